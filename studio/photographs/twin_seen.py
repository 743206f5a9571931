"""What a twin is fitted to: windows about the line of every photograph, and how wide its project has the sheet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from analysis.line.result import Line
from render.base.arrays import Float
from render.base.errors import InputError
from render.frame import LaserCurve
from render.sensor.blur import disc_diameter
from studio.photographs.line_profile import Stretch, stretch_of
from studio.photographs.twin_light import Numbers
from studio.preview.estimates import line_width_px
from studio.preview.inspection import facets
from studio.project.project import Project

ROWS = 64
"""Scan lines below which nothing is fitted."""
HALF, WIDER = 40, 8.0
"""px of a window to either side of the line, at least, and widths of the line."""
NEAR = 3.0
"""px between the line and the project's within which it is the project's surface."""
LAG = 8
"""Scan lines to either side between which the line's direction on the surface is taken."""
GAP, JUMP = 4, 1.0
"""Scan lines that a line may leave out, and px by which it may be beside its course, without being another."""


@dataclass(frozen=True)
class Piece:
    """The line of one photograph, (n,) scan lines."""

    stretch: Stretch
    sheet: Float
    """(n,) sigma of the project's sheet, px."""
    known: Float
    """(n,) px^2: variance of defocus by depth."""
    tilt: Float
    """(n,) by which a round blur's variance is larger across a scan line, as the line crosses it at a slant."""
    u: Float
    """(n,) position, px."""
    photograph: int = 0
    """Of the set."""

    @property
    def columns(self) -> NDArray[np.intp]:
        """(n, w) px of its windows."""
        return self.stretch.column[:, None] + np.arange(self.stretch.values.shape[1])

    def of(self, some: NDArray[np.bool_] | NDArray[np.intp]) -> Piece:
        """Some of its scan lines."""
        return Piece(
            self.stretch.of(some), self.sheet[some], self.known[some], self.tilt[some], self.u[some], self.photograph
        )


@dataclass(frozen=True)
class Seen:
    """All pieces of the photographs."""

    pieces: list[Piece]
    width: float
    """px, the line's sigma."""
    saturation: float | None
    """DN; None: nothing is saturated."""
    facing: bool
    """The surface is not the project's and was taken to face the laser."""
    half: int = HALF
    limit: float = np.inf
    """DN from which on a scan line is left out."""
    cuts: Float | None = None
    """px of the sheet at which it is cut into stretches; None: by its own scan lines."""

    @property
    def whole(self) -> Piece:
        """All pieces as one; scan lines of two photographs are no neighbours."""
        step = 10 * max(int(one.stretch.row.max()) for one in self.pieces) + 10
        stretches = [one.stretch for one in self.pieces]
        stretch = Stretch(
            np.concatenate([one.values for one in stretches]),
            np.concatenate([one.distance for one in stretches]),
            np.concatenate([one.sigma_u for one in stretches]),
            np.concatenate([one.row + k * step for k, one in enumerate(stretches)]),
            np.concatenate([one.column for one in stretches]),
        )
        return Piece(
            stretch,
            np.concatenate([one.sheet for one in self.pieces]),
            np.concatenate([one.known for one in self.pieces]),
            np.concatenate([one.tilt for one in self.pieces]),
            np.concatenate([one.u for one in self.pieces]),
        )

    @property
    def count(self) -> int:
        """Of scan lines."""
        return sum(len(one.u) for one in self.pieces)


def look(
    project: Project,
    laser: int,
    images: Sequence[Float],
    lines: Sequence[Line],
    curves: Sequence[LaserCurve],
    numbers: Numbers,
) -> Seen:
    """Images (h, w) DN linear in light, their lines and the project's own -> what is fitted.

    InputError: too few scan lines that are not saturated.
    """
    tops = [float(image.max()) for image in images]
    highest = min(max(tops), numbers.top)
    saturated = highest if sum(int((image >= highest).sum()) for image in images) >= ROWS // 2 else None
    widths = np.concatenate([line.width[line.valid] for line in lines])
    width = float(np.median(widths[np.isfinite(widths)])) if np.isfinite(widths).any() else 1.0
    half = int(np.ceil(max(HALF, WIDER * width)))
    limit = saturated if saturated is not None else numbers.top
    pieces, facing = [], False
    for k, (image, line, curve) in enumerate(zip(images, lines, curves, strict=True)):
        one = stretch_of(image, line, half, limit)
        if len(one.row) <= 2 * LAG:
            continue
        u = line.u[one.row, 0]
        inner, tilt = _inner(u, one.row, margin_of(width))
        normal = _normals(project, laser, u, one.row, curve)
        facing |= normal is None
        sheet, blur = _expected(project, laser, u, one.row, line.axis == "rows", normal)
        piece = Piece(one, sheet, blur, tilt, u, k)
        good = np.isfinite(sheet) & np.isfinite(blur) & inner
        if good.any():
            pieces.append(piece.of(good))
    seen = Seen(pieces, width, saturated, facing, half, limit)
    if seen.count < ROWS:
        raise InputError(
            "too little of the line can be compared",
            found=f"{seen.count} scan lines that are measured, not saturated and {half} px from the image's edge",
            allowed=f"{ROWS} or more",
            cure="expose less, or add photographs",
        )
    return seen


def light_above(values: Float) -> Float:
    """Windows (n, w) DN -> (n,) DN of light above what is at their ends."""
    return np.asarray((values - np.median(values[:, [0, 1, -2, -1]], axis=1)[:, None]).sum(axis=1))


def margin_of(width: float) -> int:
    """Scan lines beside an end of a line of this sigma, px, that its blur and its halo reach."""
    return max(LAG, int(np.ceil(4.0 * width)))


def joined(several: Sequence[Seen], like: Seen) -> Seen:
    """Rehearsals as one."""
    return replace(like, pieces=[piece for one in several for piece in one.pieces])


def runs(u: Float, rows: NDArray[np.intp]) -> list[NDArray[np.intp]]:
    """Numbers of the scan lines, ascending, of each stretch on which the line at u px runs on without a step."""
    gap, step = np.diff(rows), np.diff(u)
    usual = median_filter(step / gap, 2 * LAG + 1, mode="nearest") if len(step) else step
    broken = (gap > GAP) | (np.abs(step - gap * usual) > JUMP)
    return np.split(np.arange(len(rows)), np.flatnonzero(broken) + 1)


def _inner(u: Float, rows: NDArray[np.intp], margin: int) -> tuple[NDArray[np.bool_], Float]:
    """(n,) scan lines that are not so near to an end or a step that a blur brings it in, and 1 + (du/dv)^2."""
    inner, tilt = np.zeros(len(rows), np.bool_), np.ones(len(rows))
    for some in runs(u, rows):
        here = rows[some]
        inner[some] = (here >= here[0] + margin) & (here <= here[-1] - margin)
        first, last = np.searchsorted(here, here - LAG), np.searchsorted(here, here + LAG, side="right") - 1
        slope = (u[some][last] - u[some][first]) / np.maximum(here[last] - here[first], 1)
        tilt[some] = 1.0 + slope**2
    return inner, tilt


def _normals(project: Project, laser: int, u: Float, rows: NDArray[np.intp], curve: LaserCurve) -> Float | None:
    """(n, 3) normals of the project's surface along the line; None: the line is not where the project has it."""
    index, first = np.unique(curve.index, return_index=True)
    if len(index) < 2:
        return None
    off = np.interp(rows, index, curve.position[first], np.nan, np.nan) - u
    if not np.nanmedian(np.append(np.abs(off), np.nan)) <= NEAR or np.isfinite(off).mean() < 0.5:
        return None
    normal = facets(curve, project.scene.T_camera_laser(laser)[:3, 3])[first]
    nearest = np.clip(np.searchsorted(index, rows), 0, len(index) - 1)
    return np.where((np.abs(off) <= NEAR)[:, None], normal[nearest], np.nan)


def _expected(
    project: Project, laser: int, u: Float, rows: NDArray[np.intp], by_rows: bool, normal: Float | None
) -> tuple[Float, Float]:
    """(n,) sigma of the project's sheet in the image, px, and variance of defocus by depth, px^2.

    normal: (n, 3) of the surface; None: it faces the laser.
    """
    scene, camera = project.scene, project.scene.camera
    pixels = np.stack([u, rows] if by_rows else [rows, u], axis=1).astype(np.float64)
    rays, _ = camera.rays(pixels)
    plane = scene.laser_plane(laser)
    with np.errstate(divide="ignore", invalid="ignore"):
        point = rays * (-plane[3] / (rays @ plane[:3]))[:, None]
    T_camera_laser = scene.T_camera_laser(laser)
    if normal is None:
        at = np.arange(len(rows))
        along = point[np.minimum(at + LAG, len(at) - 1)] - point[np.maximum(at - LAG, 0)]
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        facing = T_camera_laser[:3, 3] - point
        normal = facing - np.einsum("ij,ij->i", facing, along)[:, None] * along
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    sheet = line_width_px(camera, scene.lasers[laser], T_camera_laser, normal, point, pixels, by_rows)
    blurred = project.sensor.defocus_by(camera.lens.model) != "nothing"
    disc = disc_diameter(camera, point[:, 2:].astype(np.float32))[:, 0] if blurred else np.zeros(len(rows))
    return sheet, disc**2 / 16.0
