"""A line along time: a sheet over a moving plane with stripes, each pixel integrated, against the plane itself."""

import numpy as np
import pytest

from analysis.line.extract import extract
from analysis.line.result import Flag
from analysis.line.series.spacetime_moving import Sweep, along_time
from render.base.errors import InputError
from render.camera.camera import Camera
from tests.analysis.line.line_images import electrons

ROWS, WIDTH, FRAMES, AT = 24, 160, 41, 20
DEPTH, SHEET, STEP = 0.5, 0.2e-3, 0.15e-3
"""m: distance of the plane, sigma of the sheet, travel of the surface from frame to frame."""
CAMERA = Camera(width=WIDTH, height=ROWS, fx=1700.0, fy=1700.0, cx=79.5, cy=11.5)
ANGLE = 0.35
PLANE = np.array([np.cos(ANGLE), 0.0, np.sin(ANGLE), -np.sin(ANGLE) * DEPTH])
"""Meets the plane z = DEPTH at x = 0: the true line is at cx."""
FINE = 9
"""Samples a pixel along u."""


def moves(step=(STEP, 0.0, 0.0)):
    matrices = np.tile(np.eye(4), (FRAMES, 1, 1))
    matrices[:, :3, 3] = np.outer(np.arange(FRAMES) - AT, step)
    return matrices


def sweep(ratio=1.0, amplitude=4000.0, noise=None, sheet=SHEET):
    """Frames (t) of a plane with bright and dark stripes 3 mm wide, whose brightness differs by `ratio`."""
    u = (np.arange(WIDTH * FINE) + 0.5) / FINE - 0.5
    x = DEPTH * (u - CAMERA.cx) / CAMERA.fx
    light = np.exp(-0.5 * (x * np.cos(ANGLE) / sheet) ** 2)
    frames = []
    for t in range(FRAMES):
        surface = x - STEP * (t - AT)
        phase = np.linspace(0.0, 3e-3, ROWS)[:, None]  # the stripes are oblique: every row meets the edge elsewhere
        albedo = np.where(((surface + phase) // 1.5e-3) % 2 == 0, 1.0, 1.0 / ratio)
        mean = (amplitude * albedo * light).reshape(ROWS, WIDTH, FINE).mean(axis=2) + 10.0
        frames.append(mean if noise is None else noise.poisson(mean) + noise.normal(0, 2.5, mean.shape))
    return [frame.astype(np.float32) for frame in frames]


def refined(frames, **other):
    line = extract(frames[AT], noise=electrons(2.5))
    arguments = {"moves": moves(), "plane": PLANE, "camera": CAMERA, "noise": electrons(2.5)} | other
    return line, along_time(line, Sweep(frames, AT, **arguments))


def test_edges_of_albedo_pull_the_line_of_one_frame_and_not_that_along_time():
    line, found = refined(sweep(ratio=8.0, sheet=2 * SHEET))
    assert found.valid.all(), [Flag(f).name for f in found.flag[~found.valid]]
    before, after = np.abs(line.u[:, 0] - CAMERA.cx), np.abs(found.u[:, 0] - CAMERA.cx)
    assert before.max() > 1.0
    # what is left: pixels that the edge itself goes through see both sides of it
    assert np.median(after) < 0.02 < 0.1 < np.median(before)
    assert np.sqrt(np.mean(after**2)) < 0.25 * np.sqrt(np.mean(before**2))


def test_sigma_along_time_is_honest_and_the_line_is_that_of_its_frame():
    rng = np.random.default_rng(5)
    z = []
    for _ in range(25):
        _, found = refined(sweep(noise=rng))
        good = found.valid[:, 0]
        assert good.mean() > 0.95
        z += list(((found.u - CAMERA.cx) / found.sigma_u)[good, 0])
    # 600 draws: four sigma of a standard deviation
    assert np.std(z) == pytest.approx(1.0, abs=4 / np.sqrt(2 * len(z)))
    assert abs(np.mean(z)) < 4 / np.sqrt(len(z))


def test_the_ends_of_a_sweep_say_that_the_passage_is_cut():
    frames = sweep()
    line = extract(frames[0], noise=electrons(2.5))
    cut = moves()
    cut[:, :3, 3] = np.outer(np.arange(FRAMES), (STEP, 0.0, 0.0))
    found = along_time(line, Sweep(frames, 0, cut, PLANE, CAMERA, electrons(2.5)))
    assert (~found.valid).mean() > 0.9
    assert set(found.flag[~found.valid].tolist()) <= {Flag.AT_BORDER, Flag.NO_PEAK, Flag.NOT_CONVERGED}


@pytest.mark.parametrize(
    ("step", "text"), [((0.0, STEP, 0.0), "leaves the surface under the sheet"), ((20 * STEP, 0.0, 0.0), "too fast")]
)
def test_a_motion_that_cannot_do_is_named(step, text):
    with pytest.raises(InputError, match=text):
        refined(sweep(), moves=moves(step))
