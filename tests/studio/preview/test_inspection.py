"""What inspection promises, against closed forms on a plane that faces the camera, and against the scan itself."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from render.base.errors import InputError
from render.base.pose import Pose
from render.scene.lights import Environment
from render.scene.scene import SceneObject
from render.scene.shape import Plane
from studio.photographs.image_files import load_photograph
from studio.preview.inspection import Inspection, inspect, working_range
from studio.project.document import replaced
from studio.project.project import Project
from studio.project.templates import DESCRIPTIONS, template_folder
from studio.scan.options import ScanOptions
from studio.scan.scan import run_scan
from studio.scan.stages import scaled

ROOT = template_folder("plane")
LONG = ("weld_seam", "glass_ball")
"""Templates whose light takes ten seconds and more."""
BASELINE, TILT, DEPTH, FOCAL = 0.2, 0.226893, 0.8663, 3478.26


@pytest.fixture(scope="module")
def facing() -> Project:
    """The paper's rig over a plane that faces it, at the depth where the sheet crosses the camera's axis."""
    project = replaced(Project.load(ROOT / "project.json"), ("render", "goal"), None)
    plane = SceneObject(name="plane", shape=Plane(width=0.5, height=0.4))
    scene = project.scene.model_copy(update={"objects": (plane,), "lights": (), "environment": Environment()})
    return project.model_copy(update={"scene": scene})


@pytest.fixture(scope="module")
def found(facing: Project) -> Inspection:
    return inspect(facing, ROOT)


def test_baseline_and_triangulation_angle(found: Inspection) -> None:
    """On the axis the angle is atan(B / z); away from it along the line it falls: the median is 3 % below."""
    view = found.lasers[0]
    assert view.baseline == pytest.approx(BASELINE, rel=1e-9)
    assert view.triangulation_angle == pytest.approx(math.atan(BASELINE / DEPTH), rel=0.04)


def test_the_line_is_as_long_as_the_plane(found: Inspection) -> None:
    """0.4 m at magnification f / z; the first and last row centre may miss the edge by one row each."""
    view, row = found.lasers[0], DEPTH / FOCAL
    assert view.line_length == pytest.approx(0.4, abs=2 * row)
    assert view.line_length_px == pytest.approx(0.4 / row, abs=2)
    assert view.scan_lines_hit == pytest.approx(0.4 / row, abs=1)
    assert view.along_line_per_px == pytest.approx(row, rel=1e-6)
    assert view.depth_nearest == pytest.approx(DEPTH, abs=1e-9) == view.depth_farthest


def test_depth_per_pixel(found: Inspection) -> None:
    """z = -d / (n . q): dz/du = z^2 n_x / (|d| f), here z / (f tan(tilt)) on the axis."""
    assert found.lasers[0].depth_per_px == pytest.approx(DEPTH / (FOCAL * math.tan(TILT)), rel=1e-4)


def test_working_range(found: Inspection) -> None:
    """The fan's axis x = B - z tan(tilt) enters the image at x f / z = W / 2; it stays, as f tan(tilt) < W / 2."""
    near = BASELINE / (2448 / 2 / FOCAL + math.tan(TILT))
    assert found.lasers[0].working_nearest == pytest.approx(near, rel=0.003)
    assert found.lasers[0].working_farthest is None


def test_the_range_of_a_laser_that_points_back_towards_the_camera_begins_at_its_near_end(facing: Project) -> None:
    """Its axis, x = B - t cos(back) and z = z0 - t sin(back), is in the image from x = W z / 2f to x = -W z / 2f."""
    camera, back, z0 = facing.scene.camera, math.radians(5.0), 0.5
    pose = np.eye(4)
    pose[:3, 2] = -math.cos(back), 0.0, -math.sin(back)
    pose[:3, 3] = BASELINE, 0.0, z0
    nearest, farthest = working_range(camera, pose)
    half = camera.width / 2 / camera.fx
    begin, end = (
        z0 - math.sin(back) * (BASELINE - side * half * z0) / (math.cos(back) - side * half * math.sin(back))
        for side in (1, -1)
    )
    assert end < begin
    assert (nearest, farthest) == (pytest.approx(end, rel=0.003), pytest.approx(begin, rel=0.003))


def test_line_width(facing: Project, found: Inspection) -> None:
    """The sheet's sigma at the distance along its axis, widened by 1 / cos(tilt) on the plane."""
    laser = facing.scene.lasers[0]
    sheet = float(laser.sigma(DEPTH / math.cos(TILT)))
    sigma = sheet / math.cos(TILT) * FOCAL / DEPTH
    assert found.lasers[0].width_px == pytest.approx(sigma, rel=0.01)


@pytest.mark.parametrize("image_scale", [0.25, 0.1, 0.05])
def test_the_width_of_a_line_within_a_pixel_is_that_on_the_surface(
    facing: Project, found: Inspection, image_scale: float
) -> None:
    """Whether it lies within a pixel, where its image has no width, or between two, where it has half a pixel's."""
    small = inspect(scaled(facing, image_scale), ROOT)
    assert small.lasers[0].width_px == pytest.approx(image_scale * found.lasers[0].width_px, rel=0.01)  # type: ignore[operator]


def test_peak_electrons_are_those_of_the_image(facing: Project, found: Inspection, tmp_path: Path) -> None:
    """Median of the row maxima; shot noise of the maximum over a few pixels moves it by a few percent."""
    run_scan(facing, ROOT, out=tmp_path, options=ScanOptions(measure=False))
    rows = load_photograph(tmp_path / "frame_0000.png").max(axis=1)
    hit = np.sort(rows)[-found.lasers[0].scan_lines_hit :]
    electrons = np.median(hit) / facing.sensor.dn_per_electron
    assert found.lasers[0].peak_electrons == pytest.approx(electrons, rel=0.05)


def test_an_exposure_that_saturates_is_warned_of(facing: Project) -> None:
    sensor = facing.sensor.model_copy(update={"exposure_time": 10 * facing.sensor.exposure_time})
    view = inspect(facing.model_copy(update={"sensor": sensor}), ROOT)
    assert view.lasers[0].saturated == 1.0 and any("saturates" in text for text in view.warnings)


def test_a_line_that_is_not_seen_is_said(facing: Project) -> None:
    away = SceneObject(
        name="plane", shape=Plane(width=0.02, height=0.02), T_world_object=Pose(translation=(0.1, 0.0, 0.0))
    )
    scene = facing.scene.model_copy(update={"objects": (away,)})
    view = inspect(facing.model_copy(update={"scene": scene}), ROOT)
    assert view.lasers[0].scan_lines_hit == 0 and view.lasers[0].depth_per_px is None
    assert any("no part of the line" in text for text in view.warnings)


def test_nothing_in_view_is_refused(facing: Project) -> None:
    behind = SceneObject(name="plane", shape=Plane(), T_world_object=Pose(translation=(0.0, 0.0, 5.0)))
    scene = facing.scene.model_copy(update={"objects": (behind,)})
    with pytest.raises(InputError, match="nothing is visible"):
        inspect(facing.model_copy(update={"scene": scene}), ROOT)


@pytest.mark.parametrize(
    "template", [pytest.param(name, marks=pytest.mark.validation if name in LONG else []) for name in DESCRIPTIONS]
)
def test_every_template_is_exposed_well_and_can_be_told_in_json(template: str) -> None:
    folder = template_folder(template)
    view = inspect(Project.load(folder / "project.json"), folder)
    assert json.loads(json.dumps(view.as_dict(), allow_nan=False))["name"] == view.name
    laser = view.lasers[0]
    # where ground steel mirrors the laser into the camera, no exposure keeps it and the dull plates in range
    # and glass gathers light in spots
    most = 0.03 if template in ("shiny_weld_seam", "glass_ball") else 0.0
    assert laser.saturated is not None and laser.saturated <= most and laser.peak_electrons is not None
    assert 0.2 * view.full_well < laser.peak_electrons < 0.8 * view.full_well
