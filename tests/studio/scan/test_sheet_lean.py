"""A height that is read in a leaning plane is longer, by what is said of it."""

from __future__ import annotations

import math

import pytest

from render.base.pose import Pose
from render.laser.laser import LineLaser
from render.scene.scene import Rig, Scene
from studio.scan.sheet_lean import lean_text, sheet_lean
from tests.render.scenes import paper_camera


def looking_down(lean: float) -> Scene:
    """A camera that looks straight down, and a laser beside it turned about its fan by so many degrees."""
    camera = paper_camera()
    laser = LineLaser(
        name="laser", T_rig_laser=Pose(translation=(0.2, 0.0, 0.0), rotation=(0.0, math.radians(lean), 0.0))
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
