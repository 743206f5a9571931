"""Views of a 13 x 9 board by a camera of 2448 x 2048 pixels and a laser 0.2 m beside it."""

from __future__ import annotations

import math

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
