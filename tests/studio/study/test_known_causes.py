"""The cause of a breakdown, found by bisection on images in which only one thing goes wrong."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest

from analysis.error import compare
from analysis.line.extract import extract
from analysis.line.settings import Method
from analysis.study.breakdown import Search, breakdown, next_values
from analysis.study.cause import cause
from analysis.study.intervals import mean_interval
from analysis.triangulate import triangulate
from render.camera.camera import Camera
from render.frame import LaserCurve
from studio.study.measures import measures
from tests.analysis.line.line_images import electrons, expected, exposed

ROWS, WIDTH, REPEATS = 32, 128, 3
CAMERA = Camera(width=WIDTH, height=ROWS, fx=400.0, fy=400.0, cx=0.5 * (WIDTH - 1), cy=0.5 * (ROWS - 1))
DEPTH, SLOPE, FULL_WELL = 0.5, 0.02, 20_000.0
WALL = np.array([[-1.0, -1.0, DEPTH], [1.0, -1.0, DEPTH], [1.0, 1.0, DEPTH], [-1.0, 1.0, DEPTH]])
TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)


@dataclass(frozen=True)
class Look:
    """What one image shows. peak: e-; width: sigma of the line, px; baseline: m; angle: of incidence, rad."""

    peak: float
    width: float
    read_noise: float
    baseline: float = 0.2
    angle: float = 0.2
    hidden: float = 0.0
    """Of the rows, behind something."""
    ghosts: float = 0.0
    """Of the rows, with a reflection brighter than the line."""
    ambient: float = 2.0
    """e- a pixel."""
    method: Method = "likelihood"


def starved(look: Look, value: float) -> Look:
    return replace(look, peak=look.peak * value)


def saturated(look: Look, value: float) -> Look:
    """Three pixels know only the middle of a plateau; the likelihood measures it by its wings."""
    return replace(look, peak=look.peak * value, method="gauss_3")


def out_of_focus(look: Look, value: float) -> Look:
    return replace(look, peak=look.peak / value, width=look.width * value)


def thin(look: Look, value: float) -> Look:
    """The same light, by a method that takes the pixels for points; the likelihood integrates over them."""
    return replace(look, width=look.width * value, peak=0.3 * look.peak / value, method="phase")


def grazing(look: Look, value: float) -> Look:
    """The same light on more of the surface, which the camera sees from above."""
    more = math.cos(look.angle) / math.cos(value)
    return replace(look, angle=value, peak=look.peak / more, width=look.width * more)


def outshone(look: Look, value: float) -> Look:
    """A faint line, which is lost in the noise of other light before that fills the pixels."""
    return replace(look, peak=0.05 * look.peak, ambient=value)


SEARCHES = {
    "starved": (starved, 1.0, 1e-4, ("completeness", 0.9, False), True),
    "saturated": (saturated, 2.0, 100.0, ("position_rmse", 0.09, True), True),
    "too much other light": (outshone, 2.0, 1.5e4, ("completeness", 0.9, False), True),
    "wrong peak": (lambda look, value: replace(look, ghosts=value), 0.0, 0.9, ("completeness", 0.8, False), False),
    "occluded": (lambda look, value: replace(look, hidden=value), 0.0, 0.9, ("visible_rows", 0.7, False), False),
    "out of focus or too wide": (out_of_focus, 1.0, 20.0, ("position_rmse", 0.15, True), True),
    "too thin for the pixels": (thin, 1.0, 0.05, ("position_rmse", 0.1, True), True),
    "grazing": (grazing, 0.2, 1.55, ("position_rmse", 0.15, True), False),
    "degenerate": (lambda look, value: replace(look, baseline=value), 0.2, 0.002, ("depth_rmse", 2e-3, True), True),
}


def measured(look: Look, random: np.random.Generator) -> dict[str, float]:
    """Through the program's own extraction, triangulation and comparison."""
    rows = np.arange(ROWS)
    z = DEPTH + SLOPE * (rows / ROWS - 0.5)
    x = look.baseline * (1.0 - z / DEPTH)  # the laser plane crosses the axis at DEPTH
    u = CAMERA.fx * x / z + CAMERA.cx
    seen = random.permutation(ROWS) >= round(look.hidden * ROWS)
    mean = np.where(seen[:, None], expected(WIDTH, u, look.peak, look.width, 0.0), 0.0) + look.ambient
    ghost = random.permutation(ROWS) < round(look.ghosts * ROWS)
    mean += np.where(ghost[:, None], expected(WIDTH, u + 30.0, 2.0 * look.peak, look.width, 0.0), 0.0)
    image = np.minimum(exposed(mean, look.read_noise, random), FULL_WELL).astype(np.float32)
    line = extract(image, method=look.method, noise=electrons(look.read_noise, saturation=FULL_WELL), threads=1)
    point = np.stack([x, (rows - CAMERA.cy) / CAMERA.fy * z, z], axis=1)[seen]
    angle, zero = np.full(len(point), look.angle), np.zeros(len(point))
    curve = LaserCurve(
        "rows", rows[seen].astype(np.int32), u[seen], point, point[:, 2].copy(), np.linalg.norm(point, axis=1),
        np.zeros(len(point), np.int32), angle, zero, zero + 1.0, np.zeros((0, 2, 3)), zero,
    )  # fmt: skip
    plane = np.array([1.0 / look.baseline, 0.0, 1.0 / DEPTH, -1.0])
    points = triangulate(line, CAMERA, plane, T_rig_camera=np.eye(4), T_world_camera=np.eye(4))
    return measures(line, points, compare(points, line, curve, WALL, TRIANGLES, np.eye(4)), curve)


def named(kind: str, random: np.random.Generator) -> tuple[str, str]:
    change, good, bad, (measure, limit, above), logarithmic = SEARCHES[kind]
    look = Look(random.uniform(1500.0, 6000.0), random.uniform(1.2, 2.5), random.uniform(1.0, 6.0))
    search = Search(good, bad, limit * random.uniform(0.9, 1.1), above, logarithmic, 0.03)
    return searched(look, change, search, measure, random)


def searched(
    look: Look, change: Callable[[Look, float], Look], search: Search, measure: str, random: np.random.Generator
) -> tuple[str, str]:
    """How the search ends, and the cause that is named."""
    rows: dict[float, list[dict[str, float]]] = {}
    known: dict[float, np.ndarray] = {}
    while values := next_values(search, known):
        for value in values:
            rows[value] = [measured(change(look, value), random) for _ in range(REPEATS)]
            known[value] = np.array([row[measure] for row in rows[value]])
    found = breakdown(search, known)
    if found.ending != "found":
        return found.ending, ""
    good_row, bad_row = (
        {name: mean_interval(np.array([row[name] for row in rows[value]])).mean for name in rows[value][0]}
        for value in (search.good, found.first_bad)
    )
    return found.ending, cause(good_row, bad_row)


@pytest.mark.parametrize("kind", SEARCHES)
def test_what_goes_wrong_alone_is_named(kind: str) -> None:
    assert named(kind, np.random.default_rng(3)) == ("found", kind)
