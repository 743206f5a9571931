"""What no method can beat: the depth sigma that photons, read noise and speckle leave to the best possible extraction.

From the closed forms of the Design panel, for each point of a chart of speed; a render is not needed for it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from studio.preview.preview import Preview
from studio.preview.readouts import readouts
from studio.project.project import Project
from studio.scan.stages import scaled
from studio.study.study import Study, Sweep, Value, with_fields

MEASURED = ("depth_sigma", "depth_robust_sigma", "depth_rmse")
"""Measures that are at least the sigma of a depth."""
MOST = 6
"""Lines in a chart: more would hide the marks."""


@dataclass(frozen=True)
class Bound:
    """Median over the line, m. speckle: None where the sensor shows none."""

    point: tuple[Value, ...]
    photons: float
    """Cramer-Rao bound of photon and read noise."""
    speckle: float | None

    @property
    def all(self) -> float:
        """Of both together."""
        return math.hypot(self.photons, self.speckle or 0.0)


def bounds(
    study: Study, sweep: Sweep, bases: Mapping[str, Project], points: Sequence[tuple[Value, ...]]
) -> tuple[Bound, ...]:
    """At points of a sweep, those that differ; none where the chart shows no depth sigma over time, nor of many.

    Where the line is narrower than 0.4 px they are too low (`centre_bound_px`).
    """
    base = bases[sweep.base or study.base]
    if sweep.chart != "speed" or sweep.measure not in MEASURED or base.extraction.exposures != 1:
        return ()
    found: dict[float, Bound] = {}
    for point in points:
        values = dict(zip((one.field for one in sweep.vary), point, strict=True))
        project = with_fields(base, {**study.set, **sweep.set, **values}, sweep.name)
        project = project.model_copy(update={"render": base.render}).in_folder(base.folder)  # nothing here is rendered
        known = _known(scaled(project, study.image_scale).to_text(), base.folder, study.laser)
        if known is not None:
            found.setdefault(round(known[0] * 1e9, 1), Bound(point, *known))
        if len(found) > MOST:
            return ()
    return tuple(found.values())


@lru_cache(maxsize=256)
def _known(text: str, folder: Path, laser: int) -> tuple[float, float | None] | None:
    """Photons and speckle, m; None: the line is not in the image. text: of the project."""
    project = Project.from_text(text, "study").in_folder(folder)
    told = readouts(Preview().look(project, folder), laser)
    if told.photon_sigma is None:
        return None
    return told.photon_sigma, None if project.sensor.speckle == "off" else told.speckle_sigma
