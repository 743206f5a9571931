"""The points of a scan against a nominal part: the scanned one, or another mesh in its place. Qt-free."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.cloud import Cloud, at_first_step, merge, ply_pieces
from analysis.deviation import (
    ABOVE,
    BELOW,
    COVERAGE,
    UNDECIDED,
    WITHIN,
    Aligned,
    Alignment,
    Deviations,
    Verdicts,
    best_fit,
    coverage_of_all,
    deviations,
    far_off,
    sigma_of_deviation,
    tells_no_place,
    three_two_one,
    turn_and_shift,
    unsure_of_place,
    verdict_of,
    verdicts,
)
from analysis.distance import nearest_triangle
from analysis.measures import robust_sigma
from analysis.report.deviation_figure import DeviationMap, draw
from analysis.report.style import DPI
from render.base.arrays import Float, Int
from render.base.errors import InputError
from render.base.files import atomic_write
from render.base.finite import known
from render.base.pose import transform_points
from render.mesh.load import load_mesh
from render.scene.scene import Scene, SceneObject
from render.scene.shape import MeshFile, Unit
from render.world.world import build_world
from studio.project.step_file import is_step, read_step
from studio.scan.height_map import points_of
from studio.scan.own_files import DEVIATION_COLUMNS, check_replaceable
from studio.scan.scan_folder import open_folder

FORMAT, VERSION = "blazer-deviation", 1
MOST_POINTS = 5_000_000
CHORD = 1e-5
"""m, of a STEP file whose points have no sigma."""
TAKEN = ("x", "y", "z", "sigma_random", "sigma_systematic", "row", "laser", "step")
ALONG_NORMAL = ("sigma_surface_random", "sigma_surface_systematic")
"""Not in files of former versions, and not known of photographs."""
DEPTH = "sigma_depth_random"
PROFILE = np.int64(1 << 32)
"""Apart of the scan lines of two profiles."""
MEANING = (
    "positive is outside the nominal part, too much material, negative inside; errors of depth and surface have the "
    "other sign, positive is too far from the camera"
)
NAMES = {BELOW: "below", WITHIN: "within", ABOVE: "above", UNDECIDED: "undecided"}


@dataclass(frozen=True)
class Question:
    """What is compared with what; m."""

    part: str | None = None
    """Name of the object; None: the only one, or all of them."""
    cad: Path | None = None
    """The nominal, in the part's own coordinates; None: the part as it was scanned."""
    cad_unit: Unit | None = None
    """None: that of the part's file, else mm; a STEP file knows its own."""
    alignment: Alignment = "none"
    datums: Sequence[tuple[float, float, float]] = ()
    """Six places on the nominal in the world, for 3-2-1."""
    datum_radius: float = 2e-3
    lower: float | None = None
    upper: float | None = None

    @property
    def limits(self) -> tuple[float, float]:
        """Infinite where there is none."""
        return -math.inf if self.lower is None else self.lower, math.inf if self.upper is None else self.upper


@dataclass(frozen=True)
class Compared:
    """What came out."""

    found: Deviations
    sigma: Float
    """(m,) m, of a point along the normal: of chance and of calibration together."""
    verdicts: Verdicts | None
    """None: no tolerance was given."""
    columns: Cloud
    """laser, step and row of each point."""
    question: Question
    towards: Float
    """(3,) from the part to the camera, on the whole."""
    left_out: int
    """Points of other objects."""
    no_place: NDArray[np.bool_]
    """(m,) as of `tells_no_place`."""
    nominal_unit: Unit | None = None
    """That its file was read in; None: the part as it was scanned, or a file that tells it."""
    nominal_over_part: float = 1.0
    """Diagonals of their boxes."""
    sigma_is_bound: bool = False
    """Of some points the whole sigma is taken, as nobody knows their normal: at most that along it."""

    @property
    def beyond(self) -> NDArray[np.bool_]:
        """(m,) whether a point by itself is out of the tolerance by COVERAGE sigmas."""
        lower, upper = self.question.limits
        return np.asarray(
            (self.found.value + COVERAGE * self.sigma < lower) | (self.found.value - COVERAGE * self.sigma > upper)
        )

    @property
    def record(self) -> dict[str, Any]:
        """What is told of it, SI units."""
        value, aligned = self.found.value, self.found.aligned
        median = float(np.median(value))
        robust = robust_sigma(value)
        far = far_off(value)
        shift, turn = turn_and_shift(aligned.motion, self.found.points)
        counts, alone, without = None, None, None
        if self.verdicts is not None:
            counts = {name: int(np.count_nonzero(self.verdicts == key)) for key, name in NAMES.items()}
            alone = int(np.count_nonzero(self.beyond & (self.verdicts == UNDECIDED)))
            without = verdict_of(self.verdicts[~far])
        return {
            "format": FORMAT,
            "format_version": VERSION,
            "meaning": MEANING,
            "part": self.question.part,
            "nominal": "as scanned" if self.question.cad is None else self.question.cad.name,
            "nominal_unit": self.nominal_unit,
            "nominal_over_part": self.nominal_over_part,
            "alignment": self.question.alignment,
            "motion": aligned.motion.tolist(),
            "shift": shift.tolist(),
            "turn": turn,
            "freedoms_held": aligned.held if self.question.alignment != "none" else None,
            "points_used": aligned.used if self.question.alignment != "none" else None,
            "points": len(value),
            "points_left_out": self.left_out,
            "mean": float(value.mean()),
            "rms": float(np.sqrt((value**2).mean())),
            "standard_deviation": float(value.std()),
            "least": float(value.min()),
            "largest": float(value.max()),
            "p95": float(np.percentile(np.abs(value), 95.0)),
            "median": median,
            "robust_sigma": robust,
            "share_false": float(far.mean()),
            "rms_without_false": float(np.sqrt((value[~far] ** 2).mean())),
            "share_beyond": _share_beyond(value, self.question),
            "median_sigma": known(float(np.nanmedian(self.sigma)) if np.isfinite(self.sigma).any() else math.nan),
            "sigma_is_bound": self.sigma_is_bound,
            "lower": self.question.lower,
            "upper": self.question.upper,
            "verdicts": counts,
            "undecided_but_beyond": alone,
            "coverage": COVERAGE,
            "coverage_beyond": coverage_of_all(len(value)),
            "verdict": None if self.verdicts is None else verdict_of(self.verdicts),
            "verdict_without_far": without,
        }


def compared(folder: Path, question: Question) -> Compared:
    """The points of a results folder against the nominal.

    InputError: there are no points or too many, no such part, the nominal cannot be read, the part is not named where
    there are several, or as `best_fit` and `three_two_one`.
    """
    found = open_folder(folder)
    return compare_cloud(found.project.scene, found.root, read_cloud(points_of(folder)), question)


def compare_cloud(scene: Scene, root: Path, cloud: Cloud, question: Question) -> Compared:
    """As `compared`, of points at the pose of step 0, columns of `TAKEN`; root: the folder of the scene's meshes."""
    if question.lower is not None and question.upper is not None and not question.upper > question.lower:
        raise InputError("the tolerance is empty", found=question.upper, allowed=f"above {question.lower}")
    points = np.column_stack([cloud[name] for name in "xyz"])
    sigma, known_normal = _sigma(cloud)
    vertices, triangles, here, part = _scanned(root, scene, points, question)
    size, unit = _diagonal(vertices, triangles), None
    if question.cad is not None and part is not None:
        own = part.shape.unit if isinstance(part.shape, MeshFile) else "mm"
        unit = None if is_step(question.cad) else question.cad_unit or own
        vertices, triangles = _read(question.cad, unit, scene, part, float(np.nanmedian(sigma)))
    if len(triangles) == 0:
        raise InputError("there is no nominal surface", where=str(question.cad or root))
    over_part = _diagonal(vertices, triangles) / size if size > 0.0 else 1.0
    if not here.any():
        raise InputError(
            "no point is of the part", where=question.part or "all objects", cure="name another with --part"
        )
    points, sigma, eyes = points[here], sigma[here], _eyes(scene, cloud["step"][here])
    aligned: Aligned | None = None
    if question.alignment == "best-fit":
        aligned = best_fit(points, vertices, triangles)
    elif question.alignment == "3-2-1":
        aligned = three_two_one(points, vertices, triangles, question.datums, question.datum_radius)
    made = deviations(points, eyes, vertices, triangles, aligned)
    judged, unsure = None, _unsure(cloud, points, made.value, here)
    if question.lower is not None or question.upper is not None:
        judged = verdicts(made.points, made.value, sigma, *question.limits, unsure)
    columns = {name: cloud[name][here] for name in ("laser", "step", "row")}
    towards = (eyes - points).mean(axis=0)
    others, is_bound = int(np.count_nonzero(~here)), not bool(known_normal[here].all())
    no_place = tells_no_place(made.value, sigma, unsure)
    return Compared(made, sigma, judged, columns, question, towards, others, no_place, unit, over_part, is_bound)


def write_deviation(what: Compared, path: Path, reads: Sequence[Path] = ()) -> list[Path]:
    """The points as .csv, and beside it what they come to as .json and the map as .png.

    InputError: the name ends otherwise, a file would replace one of other origin, or cannot be written.
    """
    if path.suffix.lower() != ".csv":
        raise InputError("deviations are a table", where=str(path), allowed="a name ending in .csv")
    paths = [path, path.with_suffix(".json"), path.with_suffix(".png")]
    check_replaceable(paths, reads)
    with atomic_write(paths[1]) as temporary:
        temporary.write_text(json.dumps(what.record, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    with atomic_write(path) as temporary, open(temporary, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(DEVIATION_COLUMNS)
        nothing = [""] * len(what.sigma)
        sigma = ["" if value != value else value for value in what.sigma.tolist()]
        told = nothing if what.verdicts is None else [NAMES[key] for key in what.verdicts.tolist()]
        columns = [what.columns[name].tolist() for name in ("laser", "step", "row")]
        writer.writerows(
            zip(*what.found.points.T.tolist(), what.found.value.tolist(), sigma, told, *columns, strict=True)
        )
    with atomic_write(paths[2]) as temporary:
        draw(map_of(what)).savefig(temporary, format="png", dpi=DPI)
    return paths


def map_of(what: Compared) -> DeviationMap:
    """What is drawn of it."""
    asked = what.question
    return DeviationMap(what.found.points, what.found.value, what.towards, asked.lower, asked.upper, what.no_place)


def _scanned(
    root: Path, scene: Scene, points: Float, question: Question
) -> tuple[Float, Int, NDArray[np.bool_], SceneObject | None]:
    """Vertices and triangles of the part in the world at step 0, which points are of it, and the part itself."""
    world = build_world(scene, root)
    objects = scene.visible_objects
    names = [item.name for item in objects]
    if question.part is None and (question.cad is None or len(objects) == 1):
        every = np.ones(len(points), dtype=np.bool_)
        return world.vertices, _whole(world.triangles), every, objects[0] if objects else None
    if question.part not in names:
        raise InputError("which part is meant?", found=str(question.part), allowed=", ".join(names), cure="--part")
    index = names.index(question.part)
    of = nearest_triangle(points, world.vertices, world.triangles)
    own = world.triangles[world.object_id == index]
    return world.vertices, _whole(own), world.object_id[of] == index, objects[index]


def _sigma(cloud: Cloud) -> tuple[Float, NDArray[np.bool_]]:
    """(m,) m of a point along the normal, at most, and where it is that along it."""
    whole = sigma_of_deviation(cloud["sigma_random"], cloud["sigma_systematic"])
    if not all(name in cloud for name in ALONG_NORMAL):
        return whole, np.zeros(len(whole), dtype=np.bool_)
    along = sigma_of_deviation(*(cloud[name] for name in ALONG_NORMAL))
    here = np.isfinite(along)
    return np.where(here, along, whole), here


def _unsure(cloud: Cloud, points: Float, value: Float, here: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """As of `unsure_of_place`, of the points (m, 3) that are `here` in the cloud."""
    laser, step, row = (cloud[name][here].astype(np.int64) for name in ("laser", "step", "row"))
    scan_line = (laser * (step.max(initial=0) + 1) + step) * PROFILE + row
    unknown = np.full(len(value), np.nan)
    normal, depth = (cloud[name][here] if name in cloud else unknown for name in (ALONG_NORMAL[0], DEPTH))
    return unsure_of_place(points, value, scan_line, normal, depth)


def _diagonal(vertices: Float, triangles: Int) -> float:
    """Of the box about what has triangles, m."""
    return float(np.linalg.norm(np.ptp(vertices[np.unique(triangles)], axis=0))) if len(triangles) else 0.0


def _whole(triangles: Int) -> Int:
    return np.ascontiguousarray(triangles, dtype=np.int64)


def _read(cad: Path, unit: Unit | None, scene: Scene, part: SceneObject, sigma: float) -> tuple[Float, Int]:
    """The nominal's file where the part stands; unit: None where the file tells it."""
    matrix = scene.T_world_object(part, 0)
    if unit is None:
        parts = read_step(cad, 0.1 * sigma if math.isfinite(sigma) else CHORD)
        first = np.cumsum([0, *(len(one.vertices) for one in parts)])[:-1]
        local = part.scale * np.concatenate([one.vertices for one in parts])
        triangles = np.concatenate([one.triangles + k for one, k in zip(parts, first, strict=True)])
        return transform_points(matrix, local), _whole(triangles)
    shape = MeshFile(path=cad.name, unit=unit)
    # of another material: images of the scanned part's would be looked for beside the nominal
    mesh = load_mesh(SceneObject(name="nominal", shape=shape, scale=part.scale), cad.absolute().parent)
    return transform_points(matrix, mesh.vertices), _whole(mesh.triangles)


def _eyes(scene: Scene, step: NDArray[np.int32]) -> Float:
    """(m, 3) where the camera stood for each point, carried back with the objects to step 0."""
    steps, at = np.unique(step, return_inverse=True)
    centres = [at_first_step(scene.T_world_camera(int(k))[None, :3, 3], scene, int(k))[0] for k in steps]
    return np.asarray(centres)[at]


def read_cloud(path: Path) -> Cloud:
    """The points of a PLY that have coordinates. InputError: it lacks columns, or has none or too many points."""
    pieces, count = [], 0
    for piece in ply_pieces(path):
        missing = [name for name in TAKEN if name not in piece]
        if missing:
            raise InputError("the points lack columns", where=str(path), found=f"no {', '.join(missing)}")
        whole = np.isfinite(piece["x"] + piece["y"] + piece["z"])
        pieces.append({name: piece[name][whole] for name in (*TAKEN, *ALONG_NORMAL, DEPTH) if name in piece})
        count += int(whole.sum())
        if count > MOST_POINTS:
            raise InputError("so many points are not compared", where=str(path), allowed=f"at most {MOST_POINTS}")
    if count == 0:
        raise InputError("there are no points", where=str(path))
    return merge(pieces)


def _share_beyond(value: Float, question: Question) -> float | None:
    """Of the points out of the band of the tolerance, whatever their sigma; None: there is none."""
    if question.lower is None and question.upper is None:
        return None
    lower = -math.inf if question.lower is None else question.lower
    upper = math.inf if question.upper is None else question.upper
    return float(np.mean((value < lower) | (value > upper)))
