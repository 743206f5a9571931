"""Points of a scan are put together by the motion that was found, and carry its errors."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from analysis.cloud import at_first_step
from analysis.line.result import Line
from render.base.errors import InputError
from render.base.pose import transform_points
from render.scene.scene import Scene
from studio.calibration.in_silico import truth_of
from studio.calibration.motion_file import motion_values
from studio.project.found_motion import FoundMotion, measured_pose, motion_error, true_motion
from studio.project.project import Project
from studio.scan.stages import triangulate_line

MOTIONS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "stage": (
        {"kind": "linear", "moves": "objects", "step": [0.002, 0.001, 0.0], "steps": 60},
        {"step": [0.00205, 0.00098, 0.00003]},
    ),
    "stage of the rig": (
        {"kind": "linear", "moves": "rig", "step": [0.0, 0.002, 0.0], "steps": 60},
        {"step": [0.00001, 0.0021, 0.0]},
    ),
    "turntable": (
        {"kind": "turntable", "centre": [0.02, 0.01, 0.0], "axis": [0.0, 0.1, 1.0], "angle_step": 0.02, "steps": 60},
        {"centre": [0.021, 0.012, 0.0], "axis": [0.01, 0.08, 1.0]},
    ),
    "turntable of the rig": (
        {"kind": "turntable", "moves": "rig", "axis": [0.0, 1.0, 0.0], "angle_step": 0.02, "steps": 60},
        {"centre": [0.001, 0.0, -0.002], "axis": [0.02, 1.0, 0.01]},
    ),
    "objects by a robot": (
        {
            "kind": "poses",
            "moves": "objects",
            "poses": [
                {"translation": [0.0, 0.005 * i, 0.01], "rotation": [0.1 * (i % 3), 0.12 * (i % 2), 0.05 * i]}
                for i in range(8)
            ],
        },
        {},
    ),
    "the rig by a robot": (
        {
            "kind": "poses",
            "moves": "rig",
            "poses": [
                {"translation": [0.0, 0.005 * i, 0.01], "rotation": [0.01 * (i % 3), 0.02 * (i % 2), 0.005 * i]}
                for i in range(8)
            ],
        },
        {},
    ),
}
STEP = 5


def project_of(motion: dict[str, Any], calibration: dict[str, Any] | None = None) -> Project:
    data = json.loads(Project.load("plane").to_text())
    data["scene"]["motion"] = motion
    return Project.from_data(data | ({} if calibration is None else {"calibration": calibration}))


def found_in(project: Project, covariance: np.ndarray | None = None) -> dict[str, Any]:
    """What a calibration without errors would write of the project's own motion."""
    there = truth_of(project)
    motion = true_motion(project.scene, (0, STEP))
    values = motion_values(type(there)(*(getattr(there, name) for name in FIELDS), motion))
    assert values is not None
    return values | ({} if covariance is None else {"covariance": covariance.tolist()})


FIELDS = ("intrinsics", "distortion", "warp", "planes", "rotation", "translation")


def loaded(project: Project, motion: dict[str, Any]) -> tuple[Scene, FoundMotion]:
    scene = project_of(project.scene.motion.model_dump(mode="json"), {"motion": motion})
    assert scene.calibration.motion is not None
    return scene.scene, scene.calibration.motion


@pytest.mark.parametrize("name", MOTIONS)
def test_the_motion_that_a_scene_has_changes_nothing(name: str) -> None:
    """Two ways to the same poses: displacements in the world, and the board's motion before the camera."""
    project = project_of(MOTIONS[name][0])
    scene, found = loaded(project, found_in(project))
    for step in (0, 1, STEP):
        np.testing.assert_allclose(measured_pose(scene, found, step), scene.T_world_camera(step), atol=1e-12)
        assert np.array_equal(measured_pose(scene, None, step), scene.T_world_camera(step))


@pytest.mark.parametrize("name", MOTIONS)
def test_points_fit_together_by_the_axis_that_there_is(name: str) -> None:
    """Not by the one that the project supposes: the part is where it is seen from every step."""
    nominal, change = MOTIONS[name]
    real = project_of(nominal | change)
    if not change:  # of a robot another hand-eye pose is real
        data = json.loads(real.to_text())
        rig = data["scene"]["rig"]
        moved = rig["camera"]["T_rig_camera"] if nominal["moves"] == "rig" else rig["T_world_rig"]
        moved["translation"][0] += 0.002
        moved["rotation"][1] += 0.003
        real = Project.from_data(data)
    supposed = project_of(nominal)
    values = found_in(real)
    if values["kind"] == "stage":  # it was told the way that the project supposes
        told, way = (np.linalg.norm(one["step"]) for one in (nominal, nominal | change))
        values["step"] = (np.array(values["step"]) * way / told).tolist()
    scene, found = loaded(supposed, values)
    part = transform_points(real.scene.T_world_camera(0), np.array([[0.0, 0.0, 0.85], [0.03, -0.02, 0.87]]))
    objects = nominal["moves"] == "objects" if "moves" in nominal else True
    motion = real.scene.motion
    carried = motion.displacement(STEP) @ np.linalg.inv(motion.displacement(0)) if objects else np.eye(4)
    seen = transform_points(np.linalg.inv(real.scene.T_world_camera(STEP)) @ carried, part)
    # relative to the camera of step 0, by which a scan's world is held
    expected = transform_points(np.linalg.inv(real.scene.T_world_camera(0)), part)
    by_found, by_supposed = (
        at_first_step(transform_points(measured_pose(scene, one, STEP), seen), scene, STEP) for one in (found, None)
    )
    to_camera = np.linalg.inv(scene.T_world_camera(0))
    np.testing.assert_allclose(transform_points(to_camera, by_found), expected, atol=1e-9)
    assert np.abs(transform_points(to_camera, by_supposed) - expected).max() > 2e-5


@pytest.mark.parametrize("name", MOTIONS)
def test_points_carry_the_errors_of_drawn_motions(name: str) -> None:
    project = project_of(MOTIONS[name][0])
    motion = true_motion(project.scene, (0, STEP))
    assert motion is not None
    count, rng = len(motion.parameters), np.random.default_rng(3)
    mix = 1e-4 * rng.normal(size=(count, count))
    covariance = mix @ mix.T
    turned = motion.axis_and_point_derivative() if motion.kind == "turntable" else np.eye(count)
    scene, found = loaded(project, found_in(project, turned @ covariance @ turned.T))
    points = np.array([[0.0, 0.0, 0.85], [0.05, -0.06, 0.95]])
    told = motion_error(scene, found, STEP, points)
    assert told is not None and motion_error(scene, None, STEP, points) is None
    moved = []
    for drawn in rng.multivariate_normal(motion.parameters, covariance, 4000):
        moves = motion.with_parameters(drawn).moves()
        moved.append((points - moves.shift[1]) @ moves.rotation[1])
    # a variance from 4000 draws is known to 2.2 %
    spread = np.var(moved, axis=0).sum(axis=1)
    np.testing.assert_allclose((told**2).sum(axis=(1, 2)), spread, rtol=0.09)
    at_start = motion_error(scene, found, 0, points)
    assert at_start is not None and np.abs(at_start).max() < 1e-12


def test_a_scan_s_points_have_the_place_and_the_sigma_of_the_found_motion() -> None:
    given = MOTIONS["stage"][0]
    plain = project_of(given)
    way = np.array(found_in(plain)["step"])
    wrong = way + np.array([0.0, 0.002, 0.0])
    project = project_of(given, {"motion": {"kind": "stage", "step": wrong.tolist(), "covariance": np.eye(3).tolist()}})
    full = np.full((project.scene.camera.height, 1), 1.0)
    line = Line("rows", "likelihood", 1000.0 * full, 0.1 * full, full, full, full, full, np.zeros(full.shape, np.uint8))
    for step, travel in ((0, 0.0), (STEP, STEP * np.hypot(0.002, 0.001))):
        before, after = (triangulate_line(one, line, 0, step) for one in (plain, project))
        away = np.linalg.norm(after.world - before.world, axis=1)
        np.testing.assert_allclose(away, 0.002 * travel, atol=1e-12)
        np.testing.assert_array_equal(after.camera, before.camera)
        # a way of sigma 1 m a metre along each axis
        np.testing.assert_allclose(after.sigma_systematic, np.sqrt(3.0) * travel, atol=1e-12)
        assert not after.sigma_depth_systematic.any()


@pytest.mark.parametrize(
    ("motion", "message"),
    [
        ({"kind": "turntable", "axis": [0.0, 1.0, 0.0], "point": [0.0, 0.0, 0.8]}, "of kind turntable"),
        ({"kind": "stage", "step": [0.0, 1.0]}, "step"),
        ({"kind": "stage", "step": [0.0, 1.0, 0.0], "covariance": [[1.0]]}, "3 rows of 3"),
        ({"kind": "stage", "step": [0.0, 1.0, 0.0], "covariance": np.diag([1.0, 1.0, -1.0]).tolist()}, "negative"),
        ({"kind": "turntable", "axis": [0.0, 2.0, 0.0], "point": [0.0, 0.0, 0.8]}, "length of 2"),
    ],
)
def test_a_motion_that_is_none_of_the_project_s_is_refused(motion: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        project_of(MOTIONS["stage"][0], {"motion": motion})


def test_a_hand_that_holds_the_other_is_refused() -> None:
    given = MOTIONS["the rig by a robot"][0]
    hand = {"kind": "hand_eye", "rotation": [0.0, 0.0, 0.0], "translation": [0.0, 0.0, 0.0]}
    assert project_of(given, {"motion": hand | {"holds": "camera"}}).calibration.motion is not None
    with pytest.raises(InputError, match="holds the board"):
        project_of(given, {"motion": hand | {"holds": "board"}})


def test_a_scene_that_stands_still_takes_any_motion() -> None:
    turned = Rotation.from_rotvec([0.0, 0.1, 0.0]).as_matrix()[:, 1].tolist()
    axis = {"kind": "turntable", "axis": turned, "point": [0.0, 0.0, 0.8]}
    project = project_of({"kind": "none"}, {"motion": axis})
    scene = project.scene
    assert np.array_equal(measured_pose(scene, project.calibration.motion, 0), scene.T_world_camera(0))
    assert Project.from_text(project.to_text()) == project
