"""Photographs of a checkerboard with a laser's line on it, drawn by the camera's equations: 640 x 512 pixels, 8 bit."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from analysis.calibration.estimate import Estimate
from analysis.calibration.lens import normalise
from analysis.calibration.virtual import exact_view
from tests.analysis.calibration.boards import truth

SIZE = (640, 512)
BOARD = "checkerboard:8x6:40mm"
COLUMNS, ROWS, SQUARE = 8, 6, 0.040
FINE = 2


def scanner(views: int, seed: int = 1) -> Estimate:
    """A camera of 900 px focal length, a laser beside it, and poses of the board."""
    there = truth(seed, views, tilt=(15.0, 40.0), depth=(0.62, 0.85))
    middle = np.array([(COLUMNS - 1) / 2 * SQUARE, (ROWS - 1) / 2 * SQUARE, 0.0])
    return replace(
        there,
        intrinsics=np.array([900.0, 900.0, 319.5, 255.5]),
        distortion=np.array([-0.08, 0.05, 0.0, 0.0]),
        translation=there.translation - there.rotation @ middle,
    )


def rays(there: Estimate) -> np.ndarray:
    """(512 FINE, 640 FINE, 3) directions of the pixels' parts."""
    u, v = np.meshgrid(*((np.arange(n * FINE) + 0.5) / FINE - 0.5 for n in SIZE))
    q = normalise(np.column_stack([u.ravel(), v.ravel()]), there.intrinsics, there.distortion)
    return np.dstack([q.reshape(*u.shape, 2), np.ones(u.shape)])


def board_light(there: Estimate, number: int, directions: np.ndarray) -> np.ndarray:
    """(512, 640) what the camera gets of the board in one pose, without noise."""
    rotation, translation = there.rotation[number], there.translation[number]
    depth = (rotation[:, 2] @ translation) / (directions @ rotation[:, 2])
    x, y = (depth * (directions @ rotation[:, i]) - translation @ rotation[:, i] for i in (0, 1))
    x, y = np.floor(x / SQUARE), np.floor(y / SQUARE)
    dark = ((x + y) % 2 == 0) & (x >= -1.0) & (y >= -1.0) & (x < COLUMNS) & (y < ROWS)
    image = cv2.GaussianBlur(np.where(dark, 60.0, 130.0), (0, 0), 0.7 * FINE)
    return np.asarray(image.reshape(SIZE[1], FINE, SIZE[0], FINE).mean(axis=(1, 3)))


def with_line(there: Estimate, number: int, image: np.ndarray) -> np.ndarray:
    """The same with the laser's line on the board, 1.3 px wide (sigma)."""
    corners = np.array([[-1.0, -1.0], [COLUMNS, ROWS]]) * SQUARE
    out = image.copy()
    for stripe in exact_view("", there, number, corners, SIZE).stripes:
        rows = np.rint(stripe.pixel[:, 1]).astype(int)
        out[rows] += 100.0 * np.exp(-0.5 * ((np.arange(SIZE[0]) - stripe.pixel[:, :1]) / 1.3) ** 2)
    return out


def noisy(image: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """8 bit."""
    drawn = image + rng.normal(size=image.shape) * np.sqrt(4.0 + 0.05 * image)
    return np.asarray(np.clip(np.rint(drawn), 0, 255), dtype=np.uint8)


def write_folder(folder: Path, there: Estimate, *, pairs: bool = True) -> None:
    """pose_00_off.png and pose_00_on.png of every pose; or pose_00.png with the line alone."""
    rng, directions = np.random.default_rng(5), rays(there)
    for i in range(len(there.rotation)):
        light = board_light(there, i, directions)
        if pairs:
            cv2.imwrite(str(folder / f"pose_{i:02}_off.png"), noisy(light, rng))
        name = f"pose_{i:02}_on.png" if pairs else f"pose_{i:02}.png"
        cv2.imwrite(str(folder / name), noisy(with_line(there, i, light), rng))
