"""What the camera takes of one laser: an image, or several to be fused; and how long it should expose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from render.frame import Frame
from render.sampling.random import wrapped
from render.sensor.develop import Image, develop, expected_electrons
from studio.preview.saturation import full_electrons
from studio.project.project import Project

APART = 1_000_003
"""Between the seeds of two exposures."""
BESIDE = 2
"""px from the exact line to its brightest pixel, at most."""
BRIGHTEST = 0.99
"""Quantile of the scan lines' peaks that counts as the line's: a glint is left to saturate."""


def expose(
    project: Project,
    frame: Frame,
    power: Sequence[float] | None,
    number: int = 0,
    *,
    noise: bool = True,
    threads: int | None = None,
) -> Image:
    """The project's exposure of a frame, with the `shorter` ones that the extraction asks for.

    power: W of each laser, None: the scene's. number: of the laser that fires, for its own noise. InputError: as
    `develop`.
    """
    images = []
    for k in range(project.extraction.exposures):
        time = project.sensor.exposure_time / project.extraction.exposure_ratio**k
        sensor = project.sensor.model_copy(update={"exposure_time": time})
        seed = wrapped(project.seed + number + APART * k)
        images.append(develop(frame, project.scene, sensor, seed=seed, threads=threads, laser_power=power, noise=noise))
    return replace(images[0], shorter=tuple(images[1:]))


def filling_exposure(project: Project, frame: Frame, power: Sequence[float], share: float) -> float | None:
    """Exposure time, s, by which the line fills a share of what the sensor can tell; None: no line is in the image.

    project: as the frame is developed; power: W of each laser. Of several lasers the brightest decides; light of
    lamps that falls on the line counts. InputError: as `develop`.
    """
    sensor, peaks = project.sensor, [0.0]
    for i, curve in enumerate(frame.curves):
        alone = [value if k == i else 0.0 for k, value in enumerate(power)]
        electrons = expected_electrons(frame, project.scene, sensor, laser_power=alone)
        electrons = electrons if curve.axis == "rows" else electrons.T
        seen = np.isfinite(curve.position)
        if power[i] == 0.0 or not seen.any():
            continue
        across = np.rint(curve.position[seen]).astype(int)[:, None] + np.arange(-BESIDE, BESIDE + 1)
        about = electrons[curve.index[seen][:, None], across.clip(0, electrons.shape[1] - 1)]
        peaks.append(float(np.quantile(about.max(axis=1), BRIGHTEST)))
    return (
        float(f"{sensor.exposure_time * share * full_electrons(sensor) / max(peaks):.3g}") if max(peaks) > 0.0 else None
    )
