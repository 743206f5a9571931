"""A part of what was measured, by scan lines, across the fan or as a box: its points and their errors. Qt-free."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from analysis.cloud import Cloud, at_first_step, cloud, merge, ply_pieces, write_csv
from analysis.measures import FEWEST, error_statistics, median_length
from render.base.arrays import Float
from render.base.errors import InputError
from render.scene.scene import Scene
from studio.project.input_files import input_files
from studio.project.project import ProfileSection
from studio.scan.own_files import check_not_read
from studio.scan.result_series import ErrorView, error_values, measured_series
from studio.scan.scan_results import COLUMNS
from studio.scan.stages import Measurement


@dataclass(frozen=True)
class Region:
    """Both ends are part of it."""

    along: Literal["scan lines", "fan"]
    low: float
    high: float
    """Scan lines, or m across the fan."""
    section: ProfileSection = "laser_plane"
    """Of the profile in which it is across the fan."""

    @property
    def title(self) -> str:
        if self.along == "fan":
            return f"{1e3 * self.low:.2f} to {1e3 * self.high:.2f} mm along the fan"
        return f"scan lines {math.ceil(self.low)} to {math.floor(self.high)}"

    def of(self, found: Measurement, scene: Scene) -> NDArray[np.bool_]:
        """(m,) the points within it."""
        series = measured_series(found, scene, self.section)
        place = series.index if self.along == "scan lines" else 1e-3 * series.across
        return np.asarray(found.points.valid & (place >= self.low) & (place <= self.high))

    def across(self, found: Measurement, scene: Scene, section: ProfileSection) -> tuple[float, float] | None:
        """From and to, m across the fan, for a measure of the part; None: fewer than two points are within it."""
        if self.along == "fan":
            return self.low, self.high
        place = measured_series(found, scene, section).across[self.of(found, scene)]
        if len(place) < 2 or not np.ptp(place) > 0.0:
            return None
        # half a pitch beyond the outermost points, so that noise does not decide whether they count
        margin = 0.5 * float(np.ptp(place)) / (len(place) - 1)
        return 1e-3 * (float(place.min()) - margin), 1e-3 * (float(place.max()) + margin)


@dataclass(frozen=True)
class Box:
    """Along the world's axes, on the part as it stands at step 0, as far as it lies within planes; all faces are part
    of it."""

    low: tuple[float, float, float] = (-math.inf,) * 3
    high: tuple[float, float, float] = (math.inf,) * 3
    """m."""
    sides: tuple[tuple[float, float, float, float], ...] = ()
    """a, b, c, d of each plane: a x + b y + c z + d is at least 0 within."""
    along: Literal["space"] = "space"

    @property
    def title(self) -> str:
        lengths = " x ".join(f"{1e3 * (high - low):.2f}" for low, high in zip(self.low, self.high, strict=True))
        return f"what was drawn around, {lengths} mm" if self.sides else f"a box of {lengths} mm"

    def holds(self, points: Float) -> NDArray[np.bool_]:
        """(n,) of (n, 3) points on the part at step 0."""
        inside = np.all((points >= self.low) & (points <= self.high), axis=1)
        for a, b, c, d in self.sides:
            inside[inside] = points[inside] @ (a, b, c) + d >= 0.0
        return np.asarray(inside)

    def of(self, found: Measurement, scene: Scene) -> NDArray[np.bool_]:
        """(m,) the points within it."""
        points = found.points
        return points.valid & self.holds(np.nan_to_num(at_first_step(points.world, scene, found.step), nan=np.inf))

    def of_cloud(self, points: Cloud, laser: int) -> NDArray[np.bool_]:
        """(n,) those of a scan's points that a laser has within it."""
        here = self.holds(np.stack([points[name] for name in "xyz"], axis=1))
        return np.asarray(here & (points["laser"] == laser))

    def across(self, found: Measurement, scene: Scene, section: ProfileSection) -> tuple[float, float] | None:
        """As of `Region.across`."""
        places = found.points.index[self.of(found, scene)]
        return Region("scan lines", places.min(), places.max()).across(found, scene, section) if len(places) else None


def members(region: Region | Box, found: Sequence[Measurement], scene: Scene) -> list[NDArray[np.bool_]]:
    """(m,) for each measurement, the points that a region compares.

    Of a box the scan lines that the first has in it: by their own errors points of a worse method lie outside, and
    only its best ones would count.
    """
    if isinstance(region, Region) or not found:
        return [region.of(one, scene) for one in found]
    first, *others = found
    here = region.of(first, scene)
    lines = first.points.index[here]
    return [here, *(one.points.valid & np.isin(one.points.index, lines) for one in others)]


def region_table(
    region: Region | Box, found: Sequence[Measurement], scene: Scene, view: ErrorView
) -> list[tuple[str, list[str]]]:
    """Name and, for each measurement, what is shown of the errors within the region: value and its sigma."""
    here = members(region, found, scene)
    return _rows([_figures(*pair, view) for pair in zip(here, found, strict=True)], view)


def scan_errors(region: Box | None, points: Cloud, laser: int, view: ErrorView) -> Float:
    """(n,) errors of a scan's points within a region, or of all, in the view's unit; NaN of those in the image."""
    here = (region or Box()).of_cloud(points, laser)
    if view.kind not in COLUMNS:
        return np.full(np.count_nonzero(here), np.nan)
    return np.asarray(points[COLUMNS[view.kind]][here] * view.scale)


def scan_table(region: Box, points: Cloud, laser: int, view: ErrorView, one_in: int = 1) -> list[tuple[str, list[str]]]:
    """Likewise of all steps of a scan, by the method that its points are of; these have no error in the image.

    one_in: of how many points `points` has one, which is told.
    """
    here = region.of_cloud(points, laser)
    error = scan_errors(region, points, laser, view)
    # in the order of the scan lines, those of two steps never side by side
    line = points["row"][here].astype(np.intp) + points["step"][here] * (int(points["row"].max(initial=0)) + 2)
    order = np.argsort(line, kind="stable")
    lengths = points["correlation_length"][here] if "correlation_length" in points else np.ones(len(error))
    (count, figures), *rest = _rows([_statistics(error[order], line[order], lengths[order])], view)
    return [(count if one_in == 1 else f"{count}, one in {one_in}", figures), *rest]


def _rows(columns: list[list[str]], view: ErrorView) -> list[tuple[str, list[str]]]:
    names = ("Points", *(f"{name} / {view.unit}" for name in ("Mean error", "RMSE", "Robust sigma")))
    return [(name, [column[i] for column in columns]) for i, name in enumerate(names)]


def _figures(here: NDArray[np.bool_], found: Measurement, view: ErrorView) -> list[str]:
    points = found.points
    return _statistics(error_values(found.errors, view)[here], points.index[here], points.correlation_length[here])


def _statistics(error: Float, index: NDArray[np.intp], length: Float) -> list[str]:
    known = np.isfinite(error)
    count = str(len(error)) if known.all() else f"{len(error)}, {np.count_nonzero(known)} with an error"
    if np.count_nonzero(known) < FEWEST:
        return [count, "-", "-", "-"]
    figures = error_statistics(error[known], index[known], median_length(length[known]))
    return [count, *(_with_sigma(*pair) for pair in figures)]


def _with_sigma(value: float, sigma: float) -> str:
    """ "1.23 ± 0.04": two digits of the sigma, as many places of the value."""
    places = 2 if not sigma > 0.0 else min(max(0, 1 - math.floor(math.log10(sigma))), 6)
    return f"{value:.{places}f} ± {sigma:.{places}f}"


def export_region(path: Path, region: Region | Box, found: Mapping[str, Measurement], scene: Scene, root: Path) -> int:
    """The region's points as points.csv has them; of several methods with the name of each in a column before them.

    Gives how many. InputError: none, or the file cannot be written.
    """
    parts = []
    for (method, one), here in zip(found.items(), members(region, list(found.values()), scene), strict=True):
        kept = here[one.points.valid]
        columns = cloud(one.points, one.errors, one.laser, one.step, scene)
        named = {"method": np.full(np.count_nonzero(kept), method)} if len(found) > 1 else {}
        parts.append(named | {name: column[kept] for name, column in columns.items()})
    points = merge(parts)
    count = len(points["row"])
    if not count:
        raise InputError("no point is within the region", where=region.title, cure="drag a wider one")
    check_not_read([path], input_files(scene, root).values())
    write_csv(path, points)
    return count


def export_box(path: Path, region: Box, laser: int, scanned: Path) -> int:
    """Likewise of all steps of a scan, with all columns of its file of points. InputError: as of `ply_pieces` too."""
    parts = []
    for piece in ply_pieces(scanned):
        here = region.of_cloud(piece, laser)
        parts.append({name: column[here] for name, column in piece.items()})
    points = merge(parts)
    count = len(points["row"])
    if not count:
        raise InputError("no point is within the region", where=region.title, cure="draw a wider one")
    check_not_read([path], [scanned])
    write_csv(path, points)
    return count
