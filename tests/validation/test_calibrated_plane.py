"""A plane scanned with estimated calibrations: its depth is off by as much as each of them predicts.

python -m tests.validation.test_calibrated_plane 20    # a table, of as many calibrations
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy import stats

import studio as blazer
from analysis.calibration.board import Board
from analysis.calibration.calibrate import Request, calibrate
from analysis.line.result import Line
from analysis.triangulate import Points
from studio.calibration.calibration_file import file_data
from studio.calibration.material import virtual
from studio.calibration.solving import of_project
from studio.project.project import Project
from studio.scan.stages import scaled, triangulate_line

pytestmark = pytest.mark.validation

CALIBRATIONS, VIEWS, SCALE, LINE_SIGMA = 40, 12, 0.25, 0.05
BOARD = Board("checkerboard", 13, 9, 0.025)


@cache
def calibrated(seed: int) -> Project:
    """With a calibration by virtual boards of a seed, by way of its file's data."""
    project = Project.load("plane")
    material, _ = virtual(project, BOARD, count=VIEWS, seed=seed)
    found = calibrate(material.views, BOARD.target, Request(material.size, material.lasers, 5))
    data = json.loads(json.dumps(file_data(found, material.size, "checkerboard:13x9:25mm")))
    return project.model_copy(update={"calibration": of_project(data)})


def mean_off(points: Points, depth: np.ndarray) -> float:
    """Mean error of depth in standard deviations of that mean; depth (m,) m, true."""
    here = points.valid & np.isfinite(depth)
    assert points.calibration is not None
    # errors of the calibration are common to all points, those of the line are each point's own
    shared = np.linalg.norm(points.calibration[here, 2].mean(axis=0))
    own = np.sqrt(np.sum(points.sigma_depth[here] ** 2)) / np.count_nonzero(here)
    return float((points.depth_z[here] - depth[here]).mean() / np.hypot(shared, own))


def exact_plane(project: Project) -> tuple[Line, np.ndarray]:
    """A plane 0.85 m ahead, tilted by 0.3 rad, where every row's line is known but for noise; and its depth, m."""
    camera, plane = project.scene.camera, project.scene.laser_plane(0)
    rows = np.arange(camera.height, dtype=np.float64)
    wall = np.array([np.sin(0.3), 0.0, np.cos(0.3)])
    way = np.cross(plane[:3], wall)
    start = np.linalg.solve(np.array([plane[:3], wall, way]), [-plane[3], 0.85 * wall[2], 0.0])
    along = np.linspace(-0.6, 0.6, 20_001)[:, None] * way / np.linalg.norm(way) + start
    pixel = np.column_stack([camera.fx * along[:, 0] / along[:, 2], camera.fy * along[:, 1] / along[:, 2]])
    pixel += [camera.cx, camera.cy]
    order = np.argsort(pixel[:, 1])
    u, depth = (np.interp(rows, pixel[order, 1], values[order]) for values in (pixel[:, 0], along[:, 2]))
    full = np.full((len(rows), 1), 1.0)
    line = Line(
        "rows", "likelihood", u[:, None], LINE_SIGMA * full, full, full, full, full, np.zeros(full.shape, np.uint8)
    )
    return line, depth


def of_exact_geometry(count: int) -> list[float]:
    line, depth = exact_plane(Project.load("plane"))
    found = []
    for seed in range(count):
        noise = LINE_SIGMA * np.random.default_rng(1000 + seed).normal(size=line.u.shape)
        points = triangulate_line(calibrated(seed), replace(line, u=line.u + noise), 0, 0)
        found.append(mean_off(points, depth))
    return found


def of_a_render(count: int) -> list[float]:
    """One image of the plane, measured with each calibration."""
    project = Project.load("plane")
    frame = blazer.render(project, image_scale=SCALE)
    line = blazer.extract(blazer.develop(frame))
    exact = triangulate_line(scaled(project, SCALE), line, 0, 0)
    truth = blazer.compare(blazer.triangulate(line), frame)
    depth = exact.depth_z - truth.depth
    projects = (scaled(calibrated(seed), SCALE) for seed in range(count))
    return [mean_off(triangulate_line(one, line, 0, 0), depth) for one in projects]


@pytest.mark.parametrize("way", [of_exact_geometry, of_a_render])
def test_a_plane_is_within_two_sigma_of_its_own_prediction(way) -> None:
    off = np.array(way(CALIBRATIONS))
    # as many of 40 as a binomial of 95 % has with a probability of 99.9 %
    assert np.count_nonzero(np.abs(off) > 2.0) <= stats.binom.ppf(0.999, CALIBRATIONS, 0.0455)
    # and not by sigmas that are too large: a chi-square, within 99.9 %
    low, high = stats.chi2.ppf([0.0005, 0.9995], CALIBRATIONS)
    assert low < np.sum(off**2) < high


if __name__ == "__main__":
    for each in (of_exact_geometry, of_a_render):
        off = np.array(each(int(sys.argv[1])))
        within = int(np.count_nonzero(np.abs(off) < 2.0))
        print(f"{each.__name__:18} mean of the plane: rms {np.sqrt(np.mean(off**2)):.2f} sigma, {within} of {len(off)}")
