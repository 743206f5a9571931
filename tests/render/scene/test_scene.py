import numpy as np
import pytest
from pydantic import ValidationError

from render.base.pose import Pose
from render.scene.motion import LinearStage, PoseList, Turntable
from render.scene.scene import Scene
from tests.render.scenes import paper_camera, paper_laser, plane_mesh, scene_of, world_of


def test_a_scene_survives_json_bit_for_bit():
    scene = scene_of(paper_camera(0.3, (0.1, -0.2, 1e-3, 3e-4, 1 / 3)), paper_laser(), motion=LinearStage())
    assert Scene.model_validate_json(scene.model_dump_json(), strict=True) == scene


def test_a_rig_on_a_linear_stage_carries_camera_and_laser_together():
    stage = LinearStage(moves="rig", step=(0.0, 0.002, 0.0), steps=5)
    scene = scene_of(paper_camera(), paper_laser(), motion=stage)
    assert scene.frame_count == 5
    assert scene.T_world_camera(3)[:3, 3] == pytest.approx([0, 0.006, 0])
    assert scene.T_world_laser(0, 3)[:3, 3] == pytest.approx([0.2, 0.006, 0])
    assert np.array_equal(scene.laser_plane(0), scene_of(paper_camera(), paper_laser()).laser_plane(0))


def test_moving_objects_leave_the_rig_where_it_is():
    scene = scene_of(paper_camera(), paper_laser(), motion=LinearStage(moves="objects", step=(0.01, 0, 0)))
    assert np.array_equal(scene.T_world_camera(4), scene.T_world_camera(0))
    first, fourth = (world_of(scene, plane_mesh((0, 0, 1), 0.9)).vertices for _ in range(2))
    assert np.array_equal(first, fourth)
    from render.world.world import place_meshes

    moved = place_meshes(scene, [plane_mesh((0, 0, 1), 0.9)], step=4).vertices
    assert moved - first == pytest.approx(np.broadcast_to([0.04, 0, 0], first.shape))


def test_a_turntable_keeps_its_axis_and_closes_after_a_full_turn():
    table = Turntable(centre=(0.1, 0.0, 0.9), axis=(0, 2, 0), angle_step=np.pi / 6, steps=12)
    for step in range(12):
        on_axis = table.displacement(step) @ np.array([0.1, 0.7, 0.9, 1.0])
        assert on_axis[:3] == pytest.approx([0.1, 0.7, 0.9])
    assert table.displacement(12) == pytest.approx(np.eye(4), abs=1e-12)


def test_listed_poses_are_used_one_a_frame():
    poses = (Pose(), Pose(translation=(0, 0, 0.1)))
    scene = scene_of(paper_camera(), paper_laser(), motion=PoseList(poses=poses))
    assert [scene.T_world_rig(i)[2, 3] for i in range(scene.frame_count)] == [0.0, 0.1]


@pytest.mark.parametrize(
    "parts",
    [
        {"motion": {"kind": "turntable", "axis": (0, 0, 0)}},
        {"motion": {"kind": "linear", "steps": 0}},
        {"motion": {"kind": "spiral"}},
        {"lights": ({"kind": "point", "intensity": (-1, 0, 0)},)},
        {"environment": {"radiance": (1, float("inf"), 0)}},
        {"objects": ({"name": "a", "shape": {"kind": "plane"}}, {"name": "a", "shape": {"kind": "plane"}})},
        {"objects": ({"name": "a", "shape": {"kind": "v_groove", "depth": 0.5}},)},
        {"rig": {"camera": paper_camera().model_dump(), "lasers": ({"power": -1.0},)}},
    ],
)
def test_impossible_scenes_are_refused(parts):
    whole = scene_of(paper_camera(), paper_laser()).model_dump()
    with pytest.raises(ValidationError):
        Scene.model_validate({**whole, **parts})
