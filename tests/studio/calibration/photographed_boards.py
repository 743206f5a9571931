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
FINE = 3


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


def photograph(there: Estimate, number: int, rng: np.random.Generator, *, line: bool) -> np.ndarray:
    """(512, 640) uint8 of one pose, with or without the laser's line."""
    side_u, side_v = (np.arange(n * FINE) / FINE - 0.5 + 0.5 / FINE for n in SIZE)
    u, v = np.meshgrid(side_u, side_v)
    q = normalise(np.column_stack([u.ravel(), v.ravel()]), there.intrinsics, there.distortion)
    rays = np.column_stack([q, np.ones(len(q))])
    rotation, translation = there.rotation[number], there.translation[number]
    depth = (rotation[:, 2] @ translation) / (rays @ rotation[:, 2])
    place = ((rays * depth[:, None] - translation) @ rotation)[:, :2] / SQUARE
    dark = (np.floor(place).astype(int).sum(axis=1) % 2 == 0) & np.all(place > -1.0, axis=1)
    dark &= (place[:, 0] < COLUMNS) & (place[:, 1] < ROWS)
    bright = np.where(dark, 60.0, 130.0).reshape(u.shape)
    image = cv2.GaussianBlur(bright, (0, 0), 0.7 * FINE).reshape(SIZE[1], FINE, SIZE[0], FINE).mean(axis=(1, 3))
    if line:
        corners = np.array([[-1.0, -1.0], [COLUMNS, ROWS]]) * SQUARE
        whole = exact_view("", there, number, corners, SIZE)
        for stripe in whole.stripes:
            for at, row in zip(stripe.pixel[:, 0], np.rint(stripe.pixel[:, 1]).astype(int), strict=True):
                image[row] += 100.0 * np.exp(-0.5 * ((np.arange(SIZE[0]) - at) / 1.3) ** 2)
    noisy = image + rng.normal(size=image.shape) * np.sqrt(0.3 + 0.01 * image)
    return np.asarray(np.clip(np.rint(noisy), 0, 255), dtype=np.uint8)


def write_folder(folder: Path, there: Estimate, *, pairs: bool = True) -> None:
    """pose_00_off.png and pose_00_on.png of every pose; or pose_00.png with the line alone."""
    rng = np.random.default_rng(5)
    for i in range(len(there.rotation)):
        if pairs:
            cv2.imwrite(str(folder / f"pose_{i:02}_off.png"), photograph(there, i, rng, line=False))
        name = f"pose_{i:02}_on.png" if pairs else f"pose_{i:02}.png"
        cv2.imwrite(str(folder / name), photograph(there, i, rng, line=True))
