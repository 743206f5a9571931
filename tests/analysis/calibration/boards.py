"""Views of a 13 x 9 board by a camera of 2448 x 2048 pixels and a laser 0.2 m beside it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from analysis.calibration.estimate import Estimate
from analysis.calibration.observations import View
from analysis.calibration.virtual import exact_view

SIZE = (2448, 2048)
SQUARE = 0.025
LENS = (-0.09, 0.12, 4e-4, -3e-4, -0.05, 0.01, -0.02, 0.01, 2e-4, -1e-4, 1e-4, 2e-4, 0.01, -0.006)
PLANES = ((math.cos(0.227), 0.0, math.sin(0.227), -0.195), (-0.97, 0.05, 0.24, -0.19), (0.9, 0.3, 0.3, -0.2))


def target() -> np.ndarray:
    """(117, 2) m, middle of the board at the origin."""
    y, x = np.mgrid[0:9, 0:13]
    return (np.stack([x.ravel(), y.ravel()], axis=1) - [6, 4]) * SQUARE


def truth(
    seed: int,
    views: int,
    *,
    terms: int = 0,
    lasers: int = 1,
    tilt: tuple[float, float] = (5.0, 35.0),
    depth: tuple[float, float] = (0.7, 1.0),
    warp: tuple[float, float] = (0.0, 0.0),
) -> Estimate:
    """A camera, its lasers, and random poses of the board: tilt in deg, depth in m."""
    rng = np.random.default_rng(seed)
    rotation, translation = [], []
    for _ in range(views):
        direction, angle = rng.uniform(0.0, 2.0 * math.pi), math.radians(rng.uniform(*tilt))
        turned = Rotation.from_rotvec([angle * math.cos(direction), angle * math.sin(direction), 0.0])
        rotation.append((turned * Rotation.from_rotvec([0.0, 0.0, rng.uniform(-0.2, 0.2)])).as_matrix())
        z = rng.uniform(*depth)
        translation.append([rng.uniform(-0.09, 0.09) * z, rng.uniform(-0.09, 0.09) * z, z])
    planes = np.array([[-a / d, -b / d, -c / d] for a, b, c, d in PLANES[:lasers]]).reshape(-1, 3)
    camera = np.array([3478.26, 3478.26, 1223.5, 1023.5])
    return Estimate(camera, np.array(LENS[:terms]), np.array(warp), planes, np.array(rotation), np.array(translation))


def views_of(estimate: Estimate, laser_step: int = 16, **given: float) -> list[View]:
    """Exact views of all poses."""
    count = len(estimate.rotation)
    return [exact_view(f"view {i}", estimate, i, target(), SIZE, laser_step=laser_step, **given) for i in range(count)]


def coinciding(there: Estimate) -> Estimate:
    """All boards at one place, so that the line is always the same."""
    return replace(
        there,
        rotation=np.repeat(there.rotation[:1], 20, axis=0),
        translation=np.repeat([[0.0, 0.0, 0.86]], 20, axis=0),
    )


def pencil(there: Estimate) -> Estimate:
    """Boards that turn about one line of the laser plane, vertical at 0.86 m."""
    m = there.planes[0]
    x = (1.0 - m[2] * 0.86) / m[0]
    turns = [
        np.array([[np.cos(a), 0, np.sin(a)], [0, 1.0, 0], [-np.sin(a), 0, np.cos(a)]])
        for a in np.linspace(-0.6, 0.6, 20)
    ]
    return replace(there, rotation=np.array(turns), translation=np.repeat([[x, 0.0, 0.86]], 20, axis=0))


def one_axis(there: Estimate) -> Estimate:
    return replace(there, rotation=pencil(there).rotation)


def parallel(there: Estimate) -> Estimate:
    return replace(there, rotation=np.repeat(pencil(there).rotation[:1], 20, axis=0))


def central(there: Estimate) -> Estimate:
    return replace(there, translation=np.array([0.0, 0.0, 4.0]) + 0.5 * there.translation)


def aside(there: Estimate) -> Estimate:
    return replace(there, translation=there.translation + np.array([-0.25, 0.0, 0.25]))


DEGENERATE: tuple[tuple[dict[str, Any], str], ...] = (
    ({"tilt": (0.0, 3.0)}, "all boards face the camera"),
    ({"change": parallel}, "all boards are parallel"),
    ({"change": one_axis}, "tilted about one axis only"),
    ({"depth": (0.85, 0.86)}, "at one distance"),
    ({"change": central, "lasers": 0}, "corners cover"),
    ({"change": aside}, "hardly meet"),
    ({"change": coinciding}, "coincide"),
    ({"change": pencil}, "turn about the line"),
)
"""What `degenerate` is given, and what is said of that set."""


def degenerate(seed: int, change: Callable[[Estimate], Estimate] = lambda there: there, **given: Any) -> Estimate:
    """20 poses that cannot do."""
    return change(truth(seed, 20, **given))
