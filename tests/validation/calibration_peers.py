"""Camera and laser plane by others, from the views that ours is given: vision-calibration and mrcal."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
from scipy.spatial.transform import Rotation

from analysis.calibration.lens import normalise
from analysis.calibration.observations import View
from tests.analysis.calibration.boards import SIZE, SQUARE, target

SYSTEM_PYTHON = "/usr/bin/python3"
"""Debian's own: python3-mrcal is built for it alone."""
COLUMNS, ROWS, FOCAL = 13, 9, 3000.0
ROBUST = 0.12
"""px, 2.4 times the noise of the views: where Cauchy's loss loses a twentieth."""
Loss = Literal["its own", "squares", "robust"]
Found = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Intrinsics (4,) px, distortion (5,) in OpenCV's order, and the plane m . P = 1 (3,) 1/m."""


@cache
def has_mrcal() -> bool:
    command = [SYSTEM_PYTHON, "-c", "import mrcal"]
    return Path(SYSTEM_PYTHON).exists() and subprocess.run(command, capture_output=True).returncode == 0


def by_vision_calibration(views: Sequence[View], loss: Loss = "its own") -> Found:
    """Its joint adjustment of camera, poses and laser plane.

    loss: "its own" are all its defaults, which also hold k3 at zero and the first pose where it began; with the others
    all is free: "squares", as the noise of these views asks for, or "robust", as a line that is a reflection asks for.
    """
    import vision_calibration as peer

    data = peer.LaserlineDataset(
        [
            peer.LaserlineView(
                peer.Observation(
                    [(x, y, 0.0) for x, y in view.target.tolist()], view.pixel.tolist(), [1.0] * len(view.pixel)
                ),
                line_of(view).tolist(),
                [1.0] * len(line_of(view)),
            )
            for view in views
        ]
    )
    config = peer.LaserlineDeviceCalibrationConfig()
    if loss != "its own":
        config.solver.max_iters = 200
        best = config.optimize
        chosen = peer.robust_none() if loss == "squares" else peer.robust_cauchy(ROBUST)
        best.calib_loss, best.laser_loss, best.fix_poses = chosen, chosen, []
        best.fix_camera = peer.CameraFixMask(distortion={"k3": False})
    there = peer.run_laserline_device(data, config).estimate.params
    camera, lens, plane = there.intrinsics, there.distortion, there.plane
    normal, distance = np.array(plane.normal_xyz), plane.distance
    k = np.array([lens.k1, lens.k2, lens.p1, lens.p2, lens.k3])
    return np.array([camera.fx, camera.fy, camera.cx, camera.cy]), k, -normal / distance


def by_mrcal(views: Sequence[View]) -> Found:
    """Its camera, board and poses; the plane by total least squares through the line's points on these boards."""
    given = {
        "size": SIZE,
        "spacing": SQUARE,
        "focal": FOCAL,
        "observations": [_grid(view).tolist() for view in views],
    }
    command = [SYSTEM_PYTHON, str(Path(__file__).with_name("mrcal_process.py"))]
    done = subprocess.run(command, input=json.dumps(given), capture_output=True, text=True, check=True)
    found = {key: np.array(value) for key, value in json.loads(done.stdout).items()}
    intrinsics, k = found["intrinsics"][:4], found["intrinsics"][4:]
    points = [
        _on_board(view, pose, found["warp"], intrinsics, k) for view, pose in zip(views, found["frames"], strict=True)
    ]
    return intrinsics, k, through(np.concatenate(points))


def through(points: np.ndarray) -> np.ndarray:
    """(n, 3) m -> the plane m . P = 1 by total least squares, of what goes together.

    Points that are further off than four of what is typical are left out, again and again until none is.
    """
    kept = np.ones(len(points), dtype=bool)
    while True:
        centre = points[kept].mean(axis=0)
        normal = np.linalg.svd(points[kept] - centre, full_matrices=False)[2][2]
        away = np.abs((points - centre) @ normal)
        near = away <= 4.0 * np.median(away[kept]) / 0.6745
        if np.array_equal(near & kept, kept):
            return np.asarray(normal / (normal @ centre))
        kept &= near


def line_of(view: View) -> np.ndarray:
    """(n, 2) px, points of its only laser."""
    return np.concatenate([np.empty((0, 2)), *(stripe.pixel for stripe in view.stripes)])


def _grid(view: View) -> np.ndarray:
    """(rows, columns, 3) of a view, as mrcal takes it."""
    out = np.full((ROWS * COLUMNS, 3), -1.0)
    number = [int(np.argmin(np.linalg.norm(target() - one, axis=1))) for one in view.target]
    out[number] = np.column_stack([view.pixel, np.ones(len(number))])
    return out.reshape(ROWS, COLUMNS, 3)


def _on_board(view: View, pose: np.ndarray, warp: np.ndarray, intrinsics: np.ndarray, k: np.ndarray) -> np.ndarray:
    """(n, 3) m in the camera's frame: where the rays of the line's points meet the bent board of mrcal's pose."""
    rotation = Rotation.from_rotvec(pose[:3]).as_matrix()
    pixel = line_of(view)
    rays: Any = np.column_stack([normalise(pixel, intrinsics, k), np.ones(len(pixel))])
    height = np.zeros(len(pixel))
    for _ in range(5):
        point = rays * ((rotation[:, 2] @ pose[3:] + height) / (rays @ rotation[:, 2]))[:, None]
        share = ((point - pose[3:]) @ rotation[:, :2]) / (SQUARE * np.array([COLUMNS - 1.0, ROWS - 1.0]))
        height = (4.0 * share * (1.0 - share)) @ warp
    return np.asarray(point)
