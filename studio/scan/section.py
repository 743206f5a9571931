"""A section of a scan by a plane, truth and cloud together, as a drawing (DXF) or a table (CSV). Qt-free."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from analysis.cloud import Cloud, T_first_step, ply_pieces
from analysis.section import Plane, cut, near
from render.base.arrays import Float, Int
from render.base.errors import InputError
from render.base.files import atomic_write
from render.base.pose import invert, transform_points
from render.scene.scene import Scene
from render.world.world import build_world
from studio.scan.height_map import points_of
from studio.scan.own_files import SECTION_COLUMNS, check_replaceable
from studio.scan.scan_folder import open_folder

TRUE, MEASURED = "TRUE", "MEASURED"
"""Layers of the drawing, and what a row of the table is of."""
TAKEN = ("x", "y", "z", "sigma_random", "sigma_systematic", "step", "row")

MOST_POINTS = 1_000_000
THINNEST, THICKEST = 1e-3, 1.0
"""m, of a slab that nobody has typed."""


@dataclass(frozen=True)
class Scanned:
    """What planes are put through: points, and the part that they are of."""

    scene: Scene
    pieces: list[Cloud]
    """Columns of `TAKEN`; those without a sigma have NaN."""
    vertices: Float
    triangles: Int
    box: Float
    """(2, 3) m, least and largest coordinates of all but a few of the points."""
    steps: list[int]
    """That there are points of, in order."""

    @classmethod
    def of(cls, scene: Scene, root: Path, pieces: list[Cloud]) -> Scanned:
        world = build_world(scene, root)
        points = np.concatenate([np.zeros((0, 3)), *(np.column_stack([one[name] for name in "xyz"]) for one in pieces)])
        box = np.percentile(points, (1.0, 99.0), axis=0) if len(points) else np.zeros((2, 3))
        steps = sorted({int(step) for one in pieces for step in np.unique(one.get("step", np.zeros(0)))})
        return cls(scene, pieces, world.vertices, world.triangles, box, steps)

    def apart(self, plane: Plane) -> float:
        """m along a plane's normal from one profile to the next, where they are farthest apart on it; 0: of one step.

        The sheet meets each height elsewhere, so that a thinner slab holds points of some heights only.
        """
        on_plane, normal = plane.sheet(*self.box), plane.axes[2]
        moved = [transform_points(T, on_plane) - on_plane for T in map(self._move, self.steps, self.steps[1:])]
        return max((float(np.abs(one @ normal).max()) for one in moved), default=0.0)

    def _move(self, step: int, following: int) -> Float:
        """(4, 4) of the scanner from a step to the following one, as seen from the points."""
        first, second = (T_first_step(self.scene, k) @ self.scene.T_world_rig(k) for k in (step, following))
        return np.asarray(second @ invert(first))


def slab_for(apart: float) -> float:
    """m, for profiles so far apart: no height is missing; two digits, rounded up."""
    if apart <= THINNEST:
        return THINNEST
    unit = 10.0 ** (math.floor(math.log10(apart)) - 1)
    return min(float(f"{math.ceil(apart / unit - 1e-6) * unit:.6g}"), THICKEST)


@dataclass(frozen=True)
class Section:
    """m; places are as of `Plane.local`."""

    plane: Plane
    true: list[Float]
    """Polylines (n, 2) of the part as it was scanned."""
    measured: Float
    """(k, 3) across, up, off the plane."""
    sigma: Float
    """(k,) of chance and calibration together; NaN: not known."""
    step: Float
    row: Float
    thickness: float
    """Of the slab."""
    apart: float
    """As `Scanned.apart`."""

    @property
    def remark(self) -> str:
        """What the slab leaves out; empty: nothing."""
        if self.thickness >= self.apart * (1.0 - 1e-6):
            return ""
        return f"thinner than the scan's step, {1e3 * slab_for(self.apart):g}\u00a0mm: some heights have no points"


def take_section(folder: Path, plane: Plane, thickness: float | None) -> Section:
    """Of a results folder. InputError: it is none, has no points, or the plane meets neither part nor points."""
    found = open_folder(folder)
    made = from_scanned(Scanned.of(found.project.scene, found.root, _pieces(found.folder)), plane, thickness)
    if not made.true and len(made.measured) == 0:
        cure = "put the plane through the part"
        raise InputError("the plane meets neither the part nor a point", where=str(plane.point), cure=cure)
    return made


def from_scanned(scanned: Scanned, plane: Plane, thickness: float | None) -> Section:
    """thickness: of the slab, m; None: as the scan's step needs it."""
    apart = scanned.apart(plane)
    thickness = slab_for(apart) if thickness is None else thickness
    rows: list[Float] = []
    for piece in scanned.pieces:
        here, local = near(np.column_stack([piece[name] for name in "xyz"]), plane, thickness)
        nothing = np.full(len(piece["x"]), np.nan)
        random, systematic = (piece.get(f"sigma_{name}", nothing)[here] for name in ("random", "systematic"))
        counts = [piece.get(name, nothing)[here].astype(np.float64) for name in ("step", "row")]
        rows.append(np.column_stack([local, np.hypot(random, np.nan_to_num(systematic)), *counts]))
    together = np.concatenate([np.zeros((0, 6)), *rows])
    if len(together) > MOST_POINTS:
        cure = "give a smaller thickness"
        raise InputError(
            "the section has too many points", found=len(together), allowed=f"at most {MOST_POINTS}", cure=cure
        )
    true = cut(scanned.vertices, scanned.triangles, plane)
    sigma, step, row = together[:, 3:].T
    return Section(plane, true, together[:, :3], sigma, step, row, thickness, apart)


def write_section(made: Section, path: Path, reads: Sequence[Path] = ()) -> Path:
    """.dxf (mm, layers TRUE and MEASURED) or .csv (m), by the suffix.

    InputError: the suffix is another, the file would replace one of other origin, or cannot be written.
    """
    writers = {".dxf": _write_dxf, ".csv": _write_csv}
    if path.suffix.lower() not in writers:
        raise InputError("a section is a drawing or a table", where=str(path), allowed="a name ending in .dxf or .csv")
    check_replaceable([path], reads)
    with atomic_write(path) as temporary:
        writers[path.suffix.lower()](made, temporary)
    return path


def _write_dxf(made: Section, path: Path) -> None:
    import ezdxf
    from ezdxf import units

    drawing = ezdxf.new("R2010")
    drawing.units = units.MM
    drawing.header.custom_vars.append("Made by", "Blazer Studio")
    drawing.layers.add(TRUE, color=5)
    drawing.layers.add(MEASURED, color=1)
    space = drawing.modelspace()
    for line in made.true:
        closed = len(line) > 3 and bool(np.allclose(line[0], line[-1], rtol=0.0, atol=1e-9))
        ring = line[:-1] if closed else line
        space.add_lwpolyline((1e3 * ring).tolist(), close=closed, dxfattribs={"layer": TRUE})
    for place in (1e3 * made.measured[:, :2]).tolist():
        space.add_point((*place, 0.0), dxfattribs={"layer": MEASURED})
    with open(path, "w", encoding="utf-8", newline="") as file:
        file.write("999\nBlazer Studio\n")
        drawing.write(file)


def _write_csv(made: Section, path: Path) -> None:
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(SECTION_COLUMNS)
        for number, line in enumerate(made.true):
            for place, world in zip(line.tolist(), made.plane.world(line).tolist(), strict=True):
                writer.writerow(["true", number, *map(_number, [*place, *world]), "0", "", "", ""])
        worlds = made.plane.world(made.measured).tolist()
        rest = zip(made.sigma.tolist(), made.step.tolist(), made.row.tolist(), strict=True)
        for place, world, numbers in zip(made.measured.tolist(), worlds, rest, strict=True):
            texts = map(_number, [*place[:2], *world, place[2], *numbers])
            writer.writerow(["measured", "", *texts])


def _number(value: float) -> str:
    """Without the last binary digits, which no point is known to; NaN: empty."""
    return f"{value:.9g}" if value == value else ""


def _pieces(folder: Path) -> list[Cloud]:
    return [{name: piece[name] for name in TAKEN if name in piece} for piece in ply_pieces(points_of(folder))]
