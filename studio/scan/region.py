"""A range of one laser's measurement: its points, what their errors come to, and its table. Qt-free."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from analysis.cloud import cloud, write_csv
from analysis.measures import FEWEST, error_statistics, median_length
from render.base.errors import InputError
from render.scene.scene import Scene
from studio.project.input_files import input_files
from studio.scan.own_files import check_not_read
from studio.scan.result_series import ErrorView, error_values, measured_series
from studio.scan.stages import Measurement


@dataclass(frozen=True)
class Region:
    """Both ends are part of it."""

    along: Literal["scan lines", "fan"]
    low: float
    high: float
    """Scan lines, or m across the fan."""

    @property
    def title(self) -> str:
        if self.along == "fan":
            return f"{1e3 * self.low:.2f} to {1e3 * self.high:.2f} mm along the fan"
        return f"scan lines {math.ceil(self.low)} to {math.floor(self.high)}"

    def of(self, found: Measurement, scene: Scene) -> NDArray[np.bool_]:
        """(m,) the points within it."""
        series = measured_series(found, scene)
        place = series.index if self.along == "scan lines" else 1e-3 * series.across
        return np.asarray(found.points.valid & (place >= self.low) & (place <= self.high))

    def across(self, found: Measurement, scene: Scene) -> tuple[float, float] | None:
        """From and to, m across the fan, for a measure of the part; None: fewer than two points are within it."""
        if self.along == "fan":
            return self.low, self.high
        place = measured_series(found, scene).across[self.of(found, scene)]
        if len(place) < 2 or not np.ptp(place) > 0.0:
            return None
        # half a pitch beyond the outermost points, so that noise does not decide whether they count
        margin = 0.5 * float(np.ptp(place)) / (len(place) - 1)
        return 1e-3 * (float(place.min()) - margin), 1e-3 * (float(place.max()) + margin)


def region_table(
    region: Region, found: list[Measurement], scene: Scene, view: ErrorView
) -> list[tuple[str, list[str]]]:
    """Name and, for each measurement, what is shown of the errors within the region: value and its sigma."""
    columns = [_figures(region.of(one, scene), one, view) for one in found]
    names = ("Points", *(f"{name} / {view.unit}" for name in ("Mean error", "RMSE", "Robust sigma")))
    return [(name, [column[i] for column in columns]) for i, name in enumerate(names)]


def _figures(here: NDArray[np.bool_], found: Measurement, view: ErrorView) -> list[str]:
    points = found.points
    error = error_values(found.errors, view)
    known = here & np.isfinite(error)
    if np.count_nonzero(known) < FEWEST:
        return [str(np.count_nonzero(here)), "-", "-", "-"]
    figures = error_statistics(error[known], points.index[known], median_length(points.correlation_length[known]))
    return [str(np.count_nonzero(here)), *(_with_sigma(*pair) for pair in figures)]


def _with_sigma(value: float, sigma: float) -> str:
    """ "1.23 ± 0.04": two digits of the sigma, as many places of the value."""
    places = 2 if not sigma > 0.0 else min(max(0, 1 - math.floor(math.log10(sigma))), 6)
    return f"{value:.{places}f} ± {sigma:.{places}f}"


def export_region(path: Path, region: Region, found: Measurement, scene: Scene, root: Path) -> int:
    """The region's points as points.csv has them; gives how many. InputError: none, or the file cannot be written."""
    here = region.of(found, scene)
    if not here.any():
        raise InputError("no point is within the region", where=region.title, cure="drag a wider one")
    check_not_read([path], input_files(scene, root).values())
    columns = cloud(found.points, found.errors, found.laser, found.step, scene)
    kept = here[found.points.valid]
    write_csv(path, {name: column[kept] for name, column in columns.items()})
    return int(kept.sum())
