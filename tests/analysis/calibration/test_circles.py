"""Discs: their centroids unbiased with a covariance that errors have, and the centre where the camera sees it."""

from __future__ import annotations

import functools
from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from analysis.calibration.board import Board
from analysis.calibration.calibrate import Request, calibrate
from analysis.calibration.circles import centre_bias
from analysis.calibration.corners import noise_of
from analysis.calibration.detect import detect, on_board
from analysis.calibration.estimate import Estimate
from analysis.calibration.lens import normalise, project
from analysis.calibration.virtual import noisy
from render.base.errors import InputError
from tests.analysis.calibration.boards import SIZE, truth, views_of

BOARD = Board("circles", 7, 5, 0.04, 0.02)
FINE, WIDTH, HEIGHT = 4, 640, 512


def scene(tilt: float, side: float = 0.6, z: float = 0.6) -> Estimate:
    """The grid before a camera of 900 px with a lens that distorts, tilted by `tilt` deg."""
    turn = Rotation.from_rotvec(np.radians(tilt) * np.array([np.cos(side), np.sin(side), 0.0])).as_matrix()
    middle = np.append(0.5 * BOARD.extent[1], 0.0)
    camera = np.array([900.0, 900.0, 319.5, 255.5])
    lens, shift = np.array([-0.15, 0.05, 1e-3, -1e-3]), np.array([0.01, -0.02, z]) - turn @ middle
    return Estimate(camera, lens, np.zeros(2), np.zeros((0, 3)), turn[None], shift[None])


@functools.cache
def rays_of(camera: tuple[float, ...], lens: tuple[float, ...]) -> np.ndarray:
    """(512 FINE, 2, 640 FINE) slopes of the rays of the pixels' parts, of the camera that all scenes have."""
    u, v = np.meshgrid(*((np.arange(n * FINE) + 0.5) / FINE - 0.5 for n in (WIDTH, HEIGHT)))
    q = normalise(np.column_stack([u.ravel(), v.ravel()]), np.array(camera), np.array(lens))
    return np.ascontiguousarray(q.reshape(*u.shape, 2).transpose(0, 2, 1))


def photograph(there: Estimate, blur: float = 0.8) -> np.ndarray:
    """(512, 640) without noise, every pixel the mean of 16 parts of it."""
    u = (np.arange(WIDTH * FINE) + 0.5) / FINE - 0.5
    rays = rays_of(tuple(there.intrinsics), tuple(there.distortion))
    rotation, translation = there.rotation[0], there.translation[0]
    across, along, normal = rotation.T
    beyond = np.empty((len(rays), len(u)))
    for row, (x, y) in enumerate(rays):  # a row at a time stays in the processor's cache
        depth = (normal @ translation) / (normal[0] * x + normal[1] * y + normal[2])
        off = []
        for axis, count in ((across, BOARD.columns), (along, BOARD.rows)):
            place = (depth * (axis[0] * x + axis[1] * y + axis[2]) - axis @ translation) / BOARD.square
            off.append(place - np.clip(np.rint(place), 0, count - 1))
        beyond[row] = np.hypot(*off) - BOARD.circle / BOARD.square
    # of a part that the edge cuts the share on either side, to first order in its distance
    bright = np.clip(0.5 + beyond / np.hypot(*np.gradient(beyond)), 0.0, 1.0)
    image = cv2.GaussianBlur((50.0 + 130.0 * bright) * (1.0 + 2e-4 * u), (0, 0), blur * FINE)
    return np.asarray(image.reshape(HEIGHT, FINE, WIDTH, FINE).mean(axis=(1, 3)))


def centres(there: Estimate) -> np.ndarray:
    point = np.column_stack([BOARD.target, np.zeros(len(BOARD.target))]) @ there.rotation[0].T + there.translation[0]
    return project(point[:, :2] / point[:, 2:], there.intrinsics, there.distortion)[0]


def in_order(pixel: np.ndarray, truth_at: np.ndarray) -> np.ndarray:
    """The truth counted from the end where the detector began."""
    ends = (truth_at, truth_at[::-1])
    return min(ends, key=lambda one: np.linalg.norm(one - pixel, axis=1).max())


@pytest.mark.parametrize("tilt", [0.0, 30.0, 50.0])
def test_centres_are_found_where_the_camera_sees_them(tilt: float) -> None:
    there = scene(tilt)
    view, notes = detect(photograph(there), BOARD, "image")
    assert not notes and len(view.pixel) == 35
    bias = centre_bias(there, np.zeros(35, dtype=np.intp), BOARD.target, BOARD.circle)
    truth_at = centres(there)
    assert np.abs(view.pixel - in_order(view.pixel, truth_at + bias)).max() < 0.005
    assert np.linalg.norm(bias, axis=1).max() > (0.05 if tilt > 0.0 else 0.02)  # without tilt the lens alone


def test_the_bias_is_that_of_an_integral_over_the_disc() -> None:
    there = scene(50.0)
    x, y = (part.ravel() for part in np.meshgrid(*[np.linspace(-1.0, 1.0, 801)] * 2))
    inside = np.hypot(x, y) < 1.0
    offset = BOARD.circle * np.column_stack([x, y])[inside]
    for number in (0, 17, 34):
        flat = np.column_stack([BOARD.target[number] + offset, np.zeros(len(offset))])
        point = flat @ there.rotation[0].T + there.translation[0]
        pixel, by_q, _ = project(point[:, :2] / point[:, 2:], there.intrinsics, there.distortion)
        weight = np.linalg.det(by_q) / point[:, 2] ** 3
        expected = weight @ pixel / weight.sum() - centres(there)[number]
        found = centre_bias(there, np.zeros(1, dtype=np.intp), BOARD.target[[number]], BOARD.circle)[0]
        np.testing.assert_allclose(found, expected, atol=2e-4)


def test_centres_err_as_their_covariance_says() -> None:
    there = scene(35.0)
    exact = photograph(there)
    truth_at = centres(there) + centre_bias(there, np.zeros(35, dtype=np.intp), BOARD.target, BOARD.circle)
    rng, chi2, levels = np.random.default_rng(3), [], np.array([50.0, 180.0])
    for _ in range(12):
        noise = np.sqrt(1.0 + 0.03 * exact)
        drawn = exact + rng.normal(size=exact.shape) * noise
        told = noise_of(drawn)
        # the discs' 10,000 pixels, whose differences overlap, tell a variance by medians to 2.5 %
        assert told[0] + told[1] * levels == pytest.approx(1.0 + 0.03 * levels, rel=0.1)
        view, _ = detect(drawn, BOARD, "image")
        error = view.pixel - in_order(view.pixel, truth_at)
        chi2.append(np.einsum("ni,nij,nj->n", error, np.linalg.inv(view.covariance), error))
        assert np.sqrt(view.covariance[:, [0, 1], [0, 1]]).max() < 0.02
    # 840 degrees of freedom: chi-square over them is known to 5 %
    assert abs(np.mean(chi2) / 2.0 - 1.0) < 0.1


def test_a_calibration_by_discs_is_that_of_their_centres() -> None:
    there = truth(4, 12, terms=5)
    exact, radius = views_of(there, laser_step=64), 0.007
    moved = []
    for number, view in enumerate(exact):
        at = np.full(len(view.pixel), number)
        moved.append(replace(view, pixel=view.pixel + centre_bias(there, at, view.target, radius)))
    views = noisy(moved, np.random.default_rng(5))
    found = calibrate(views, views[0].target, Request(SIZE, 1, 5, circle=radius))
    other = calibrate(noisy(exact, np.random.default_rng(5)), views[0].target, Request(SIZE, 1, 5))
    sigma = np.sqrt(np.diag(other.adjusted.solution.covariance))
    # the same noise: what is left is the bias at an estimate beside that at the truth
    assert np.abs((found.estimate.shared - other.estimate.shared) / sigma).max() < 0.02
    plain = calibrate(views, views[0].target, Request(SIZE, 1, 5))
    assert np.abs((plain.estimate.shared - other.estimate.shared) / sigma).max() > 0.5


def test_lines_are_kept_off_the_edges_of_discs() -> None:
    there = scene(20.0)
    image = photograph(there, blur=0.5)
    view, _ = detect(image, BOARD, "image")
    rows, column = np.arange(160, 330), int(centres(there)[17, 0]) + 8
    kept = on_board(view, BOARD, np.column_stack([np.full(len(rows), float(column)), rows]), 6.0)
    dark = image[rows] < 115.0
    near, far = (dark[:, column - reach : column + reach + 1] for reach in (5, 7))
    alike = [(part == part[:, :1]).all(axis=1) for part in (near, far)]
    assert not kept[~alike[0]].any() and kept[alike[1]].all()
    assert (~alike[0]).sum() > 20 and alike[1].sum() > 60


def test_an_image_without_discs_is_told() -> None:
    with pytest.raises(InputError, match="no circle grid"):
        detect(np.full((HEIGHT, WIDTH), 100.0), BOARD, "image")
