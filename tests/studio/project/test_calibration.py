"""A calibration's own covariance: what is allowed, how it follows the scale, and what it makes of the points."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.line.result import Line
from render.base.errors import InputError
from studio.project.calibration import Calibration
from studio.project.project import Project
from studio.scan.stages import scaled, triangulate_line, validated

SIGMAS = (0.5, 0.5, 0.2, 0.2, 1e-4, 1e-5, 1e-4, 2e-5)


def with_covariance(matrix: np.ndarray) -> Project:
    project = Project.load("plane")
    data = project.model_dump(mode="json") | {"calibration": {"covariances": [matrix.tolist()]}}
    return Project.from_data(data)


def random_covariance(seed: int = 0) -> np.ndarray:
    mix = np.random.default_rng(seed).normal(size=(8, 8)) * np.array(SIGMAS)[:, None]
    return np.asarray(mix @ mix.T / 8.0)


def line_at(project: Project, u: float) -> Line:
    full = np.full((project.scene.camera.height, 1), 1.0)
    return Line("rows", "likelihood", u * full, 0.1 * full, full, full, full, full, np.zeros(full.shape, np.uint8))


def test_without_one_the_calibration_is_exact() -> None:
    project = Project.load("plane")
    points = triangulate_line(project, line_at(project, 1000.0), 0, 0)
    assert points.covariance_systematic is None
    assert not points.sigma_systematic.any() and not points.sigma_depth_systematic.any()


def test_points_carry_the_depth_error_of_a_drawn_calibration() -> None:
    covariance = random_covariance()
    project = with_covariance(covariance)
    line = line_at(project, 1000.0)
    told = triangulate_line(project, line, 0, 0)
    camera, plane = project.scene.camera, project.scene.laser_plane(0)
    rng, rows = np.random.default_rng(1), np.array([0, 700, 2047])
    depths = []
    for fx, fy, cx, cy, *abcd in rng.multivariate_normal(np.zeros(8), covariance, 4000):
        moved = {"fx": camera.fx + fx, "fy": camera.fy + fy, "cx": camera.cx + cx, "cy": camera.cy + cy}
        q, _ = camera.model_copy(update=moved).normalise(told.pixel[rows])
        a, b, c, d = plane + np.array(abcd)
        depths.append(-d / (a * q[:, 0] + b * q[:, 1] + c))
    # a standard deviation from 4000 draws is known to 1.1 %
    np.testing.assert_allclose(np.std(depths, axis=0), told.sigma_depth_systematic[rows], rtol=0.045)
    assert (told.sigma_systematic[rows] >= told.sigma_depth_systematic[rows]).all()


def test_it_follows_the_scale_of_the_image() -> None:
    project = with_covariance(random_covariance(2))
    small = scaled(project, 0.5)
    whole = triangulate_line(project, line_at(project, 1000.5), 0, 0)
    half = triangulate_line(small, line_at(small, 500.0), 0, 0)
    np.testing.assert_allclose(half.sigma_depth_systematic[500], whole.sigma_depth_systematic[1000:1002].mean(), 1e-4)


def test_a_found_camera_follows_the_scale_too() -> None:
    data = Project.load("plane").model_dump(mode="json")
    camera = data["scene"]["rig"]["camera"]
    found = {name: camera[name] for name in ("width", "height", "fx", "fy", "cx", "cy")}
    data["calibration"] = {"camera": found | {"fx": found["fx"] + 4.0, "distortion": [-0.1, 0.0, 0.0, 0.0]}}
    small = validated(scaled(Project.from_data(data, "here"), 0.25), "at a quarter")
    camera = small.calibration.camera_of(small.scene.camera)
    assert camera.fx - small.scene.camera.fx == pytest.approx(1.0)
    assert camera.distortion[0] == -0.1 and camera.width == small.scene.camera.width


@pytest.mark.parametrize(
    ("matrix", "found"),
    [
        (np.diag([1.0] * 7 + [-1.0]), "negative variances"),
        (np.eye(8) + 0.1 * np.eye(8, k=1), "not symmetric"),
        (np.eye(8) + 2.0 * (np.eye(8, k=1) + np.eye(8, k=-1)), "negative variances"),
        (np.eye(7), "covariances"),
    ],
)
def test_what_is_no_covariance_is_refused(matrix: np.ndarray, found: str) -> None:
    with pytest.raises(InputError, match=found):
        with_covariance(matrix)


def test_every_laser_has_one_or_none_has() -> None:
    project = with_covariance(random_covariance())
    data = project.model_dump(mode="json")
    data["calibration"]["covariances"] *= 2
    with pytest.raises(InputError, match="one for each laser"):
        Project.from_data(data)


def test_a_camera_of_another_image_size_is_refused() -> None:
    """Half the size is another covariance, and a cut image has another principal point."""
    data = Project.load("plane").model_dump(mode="json")
    names = ("width", "height", "fx", "fy", "cx", "cy")
    camera = {name: data["scene"]["rig"]["camera"][name] for name in names}
    assert Project.from_data(data | {"calibration": {"camera": camera}}).calibration.camera is not None
    for change in ({"width": camera["width"] // 2, "height": camera["height"] // 2}, {"height": camera["height"] - 8}):
        with pytest.raises(InputError, match="as the scene's camera"):
            Project.from_data(data | {"calibration": {"camera": camera | change}})


def test_a_saved_project_keeps_it_bit_for_bit() -> None:
    project = with_covariance(random_covariance(3))
    assert Project.from_text(project.to_text()) == project
    assert Project.load("plane").calibration == Calibration()
