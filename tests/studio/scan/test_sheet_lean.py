"""A height that is read in a leaning plane is longer, by what is said of it, and in an upright section its own."""

from __future__ import annotations

import math

import numpy as np
import pytest

from analysis.gauges.gauge import Gauge
from analysis.gauges.profile import Profile, true_profile
from analysis.gauges.read import read
from render.base.arrays import Float
from render.base.pose import Pose, transform_points
from render.frame import LaserCurve
from render.laser.laser import LineLaser
from render.scene.scene import Rig, Scene
from studio.project.project import ProfileSection
from studio.scan.sheet_lean import T_section_camera, lean_text, section_of, sheet_lean
from tests.render.scenes import paper_camera

RADIUS, STEP = 0.15, 0.02
"""m, of a cylinder across the sheet, and of a step beside it."""


def looking_down(lean: float, roll: float = 0.0) -> Scene:
    """A camera that looks straight down, a laser beside it turned about its fan, and then about its axis; degrees."""
    camera = paper_camera()
    laser = LineLaser(
        name="laser",
        T_rig_laser=Pose(translation=(0.2, 0.0, 0.0), rotation=(0.0, math.radians(lean), math.radians(roll))),
    )
    down = Pose(translation=(0.0, 0.0, 1.0), rotation=(math.pi, 0.0, 0.0))
    return Scene(rig=Rig(camera=camera, lasers=(laser,), T_world_rig=down))


@pytest.mark.parametrize("lean", [0.0, 0.3, 13.0, -30.0])
def test_the_lean_is_the_lasers_turn_out_of_the_vertical(lean: float) -> None:
    scene = looking_down(lean)
    assert sheet_lean(scene, 0) == pytest.approx(math.radians(abs(lean)), abs=1e-9)
    told = lean_text(scene, 0)
    assert bool(told) == (abs(lean) > 0.5)
    if told:
        assert f"leans by {abs(lean):.1f}°" in told and f"{1 / math.cos(math.radians(lean)):.4g} times" in told


def height_across(y: Float) -> Float:
    """m, of a part that is the same all along x: ground, a cylinder that lies on it, and a step."""
    arc = np.sqrt(np.maximum(RADIUS**2 - y**2, 0.0))
    return np.where(np.abs(y) < 0.1, arc, np.where(y > 0.2, STEP, 0.0))


def line_on_part(scene: Scene) -> LaserCurve:
    """Where the sheet meets the part, by walking down it until its height is the part's."""
    T_camera_world = np.linalg.inv(scene.T_world_camera(0))
    T_world_laser = scene.T_world_camera(0) @ scene.T_camera_laser(0)
    y = np.linspace(-0.3, 0.3, 1201)
    normal, start = T_world_laser[:3, 0], T_world_laser[:3, 3]
    z = height_across(y)
    x = start[0] - (normal[1] * (y - start[1]) + normal[2] * (z - start[2])) / normal[0]
    point = transform_points(T_camera_world, np.stack([x, y, z], axis=1))
    one, index = np.ones(len(y)), np.arange(len(y))
    return LaserCurve("rows", index, one, point, point[:, 2], one, 0 * index, one, one, one, np.zeros((0, 2, 3)), one)


def measured(scene: Scene, section: ProfileSection, kind: str, *regions: tuple[float, float]) -> float:
    """m; regions: across the fan from the middle of the part."""
    curve = line_on_part(scene)
    nothing = Profile(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros((0, 2, 0)), np.zeros(0, int), np.zeros(0))
    exact = true_profile(curve, T_section_camera(scene, 0, 0, section), nothing)
    return read(Gauge(kind=kind, regions=regions), 0, exact, exact).value


@pytest.mark.parametrize("lean", [0.0, 13.0, -35.0])
def test_an_upright_section_has_the_parts_own_dimensions(lean: float) -> None:
    scene = looking_down(lean)
    sides = (-0.19, -0.12), (-0.29, -0.21)  # the fan runs against the world's y
    longer = 1.0 / math.cos(math.radians(lean))

    assert measured(scene, "upright", "step", *sides) == pytest.approx(STEP, rel=1e-9)
    assert measured(scene, "across_x", "step", *sides) == pytest.approx(STEP, rel=1e-9)
    assert measured(scene, "upright", "radius", (-0.08, 0.08)) == pytest.approx(RADIUS, rel=1e-9)
    assert measured(scene, "laser_plane", "step", *sides) == pytest.approx(STEP * longer, rel=1e-9)


@pytest.mark.parametrize(("lean", "roll"), [(0.0, 20.0), (25.0, 0.0), (40.0, -30.0)])
def test_an_upright_section_holds_the_vertical_and_no_more_turn_than_that(lean: float, roll: float) -> None:
    scene = looking_down(lean, roll)
    T = T_section_camera(scene, 0, 0, "upright")
    T_section_world = T @ np.linalg.inv(scene.T_world_camera(0))

    np.testing.assert_allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3), atol=1e-12)
    assert np.linalg.det(T[:3, :3]) == pytest.approx(1.0)
    assert T_section_world[0, 2] == pytest.approx(0.0, abs=1e-12)
    if lean == 0.0:
        np.testing.assert_allclose(T, T_section_camera(scene, 0, 0, "laser_plane"), atol=1e-12)


def test_only_the_section_across_the_part_shows_it_where_the_sheet_is_rolled_too() -> None:
    """As over the joint of the sample, which leans to the side: its level normal is not along the part."""
    scene = looking_down(25.0, 15.0)
    assert measured(scene, "across_x", "radius", (-0.08, 0.08)) == pytest.approx(RADIUS, rel=1e-9)
    assert abs(measured(scene, "upright", "radius", (-0.08, 0.08)) / RADIUS - 1.0) > 1e-3
    assert "along the world's X" in lean_text(scene, 0, 0, "across_x")
    assert "runs nearly along the world's Y" in lean_text(looking_down(25.0, 4.0), 0, 0, "across_y")


def test_a_level_sheet_is_read_in_its_own_plane() -> None:
    scene = looking_down(90.0)
    own = T_section_camera(scene, 0, 0, "laser_plane")
    np.testing.assert_allclose(T_section_camera(scene, 0, 0, "upright"), own, atol=1e-9)
    assert "nearly level" in lean_text(scene, 0, 0, "upright")


@pytest.mark.parametrize(("lean", "missing"), [(13.0, {"Y"}), (0.0, {"Y", "Z"}), (75.0, {"Y"})])
def test_a_section_in_which_the_line_is_a_stroke_is_none_that_may_be_chosen(lean: float, missing: set[str]) -> None:
    """Across Y was advised to a part that is not the same along Y, and whose profile runs along it."""
    scene = looking_down(lean)
    told = section_of(scene, 0, 0, "laser_plane").others
    across = {title[-1] for title, _ in told if "across" in title}
    assert across == {"X", "Y", "Z"} - missing
    for _, normal in told:
        assert abs(float(normal[0])) > math.cos(math.radians(80.0)), "points keep their order across the fan"
    assert "In the laser's plane" in dict(section_of(scene, 0, 0, "across_x").others)
