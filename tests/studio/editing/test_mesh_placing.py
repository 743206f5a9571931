"""A mesh on the ground, with another axis up, or scaled to fit the view."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from render.base.arrays import Float
from render.base.pose import Pose, transform_points
from render.scene.scene import SceneObject
from render.scene.shape import MeshFile
from studio.editing.mesh_placing import (
    FILLED,
    UP_AXES,
    UpAxis,
    centred,
    fitted,
    highest_within,
    meeting,
    on_ground,
    on_its_foot,
    on_top,
    reaches_into,
    rests,
    stands,
    up_axis,
    with_axis_up,
)
from studio.editing.placement import field_of_view, target
from studio.project.project import Project
from studio.project.templates import template_folder

NANOMETRE = 1e-9
POSE = Pose(translation=(0.3, -0.1, 0.05), rotation=(0.4, -0.7, 1.1))
ITEM = SceneObject(name="part", shape=MeshFile(path="part.stl", unit="mm"), scale=2.0, T_world_object=POSE)


@pytest.fixture
def vertices() -> Float:
    """A cloud that is nowhere near its origin."""
    return np.random.default_rng(5).normal([0.02, 0.05, -0.01], [0.03, 0.01, 0.02], (200, 3))


def in_world(item: SceneObject, vertices: Float) -> Float:
    return transform_points(item.T_world_object.matrix, vertices)


def test_on_the_ground_the_lowest_vertex_is_at_zero_and_nothing_else_changes(vertices: Float) -> None:
    down = on_ground(ITEM, vertices)
    places = in_world(down, vertices)
    assert abs(places[:, 2].min()) < NANOMETRE
    assert places[:, :2] == pytest.approx(in_world(ITEM, vertices)[:, :2], abs=NANOMETRE)
    assert down.model_copy(update={"T_world_object": POSE}) == ITEM


def test_what_becomes_larger_or_smaller_stays_on_its_foot(vertices: Float) -> None:
    before = in_world(ITEM, vertices)
    for factor in (25.4, 0.001):
        places = in_world(on_its_foot(ITEM, vertices, factor), factor * vertices)
        assert places[:, 2].min() == pytest.approx(before[:, 2].min(), abs=NANOMETRE)
        middles = [0.5 * (one[:, :2].min(axis=0) + one[:, :2].max(axis=0)) for one in (before, places)]
        assert middles[0] == pytest.approx(middles[1], abs=NANOMETRE)


@pytest.mark.parametrize("axis", UP_AXES)
def test_the_axis_that_is_chosen_points_up_and_the_middle_stays(axis: UpAxis, vertices: Float) -> None:
    turned = with_axis_up(ITEM, vertices, axis)
    direction = np.zeros(3)
    direction["xyz".index(axis[1])] = -1.0 if axis[0] == "-" else 1.0
    assert turned.T_world_object.matrix[:3, :3] @ direction == pytest.approx([0.0, 0.0, 1.0], abs=1e-8)
    assert up_axis(turned) == axis and up_axis(ITEM) is None
    middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2.0
    assert in_world(turned, middle[None]) == pytest.approx(in_world(ITEM, middle[None]), abs=3 * NANOMETRE)


def test_a_fitted_part_fills_its_share_of_the_view_about_its_middle(vertices: Float) -> None:
    scene = Project.load(template_folder("step_block") / "project.json").scene
    item = fitted(ITEM, vertices, scene)
    scaled = vertices * item.scale / ITEM.scale
    # three digits of the scale are kept
    assert np.ptp(scaled, axis=0).max() == pytest.approx(FILLED * field_of_view(scene), rel=0.005)
    middle = (scaled.min(axis=0) + scaled.max(axis=0)) / 2.0
    assert in_world(item, middle[None])[0] == pytest.approx(target(scene), abs=2 * NANOMETRE)
    assert item.T_world_object.rotation == POSE.rotation


def test_what_stands_on_the_ground_still_stands_there_when_it_is_fitted(vertices: Float) -> None:
    scene = Project.load(template_folder("plane") / "project.json").scene
    down = on_ground(ITEM, vertices)
    assert stands(down, vertices) and not stands(ITEM, vertices)
    made = fitted(down, vertices, scene)
    places = in_world(made, made.scale / ITEM.scale * vertices)
    assert abs(places[:, 2].min()) < NANOMETRE
    middle = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0)) * made.scale / ITEM.scale
    assert in_world(made, middle[None])[0, :2] == pytest.approx(target(scene)[:2], abs=NANOMETRE)


def test_what_rests_on_a_tilted_plane_still_does_when_it_is_fitted_and_has_not_moved_aside(vertices: Float) -> None:
    """It sank into it, about the origin of its file."""
    scene = Project.load(template_folder("plane") / "project.json").scene
    slope = np.array([[[-9.0, -9.0, -4.0], [9.0, -9.0, 4.0], [0.0, 18.0, 1.0]]])
    for start in (ITEM, ITEM.model_copy(update={"scale": 0.01})):
        own = vertices * start.scale / ITEM.scale
        resting = on_top(start, own, [slope])
        assert rests(resting, own, [slope]) and not rests(ITEM, vertices, [slope])
        made = fitted(resting, own, scene, [slope])
        scaled = vertices * made.scale / ITEM.scale
        places, before = in_world(made, scaled), in_world(resting, own)
        assert made.scale != resting.scale and rests(made, scaled, [slope]) and not reaches_into(places, slope)
        middles = [0.5 * (one.min(axis=0) + one.max(axis=0))[:2] for one in (before, places)]
        assert middles[0] == pytest.approx(middles[1], abs=2 * NANOMETRE)


def test_on_top_of_what_is_below_it_seen_from_above(vertices: Float) -> None:
    places = in_world(ITEM, vertices)
    middle = 0.5 * (places.min(axis=0) + places.max(axis=0))
    box = np.asarray(trimesh.creation.box(extents=(0.02, 0.02, 0.03)).triangles)
    here, elsewhere = (box + np.array([x, middle[1], 0.2]) for x in (middle[0], middle[0] + 5.0))
    assert in_world(on_top(ITEM, vertices, [here]), vertices)[:, 2].min() == pytest.approx(0.215, abs=NANOMETRE)
    assert on_top(ITEM, vertices, [elsewhere]) == on_top(ITEM, vertices, []) == on_ground(ITEM, vertices)


def test_the_highest_place_of_triangles_above_a_rectangle_is_that_of_many_rays() -> None:
    """A tilted plane is lower below a part than where it ends."""
    random = np.random.default_rng(7)
    for _ in range(20):
        triangles = random.uniform(-1.0, 1.0, (6, 3, 3))
        low = random.uniform(-0.6, 0.1, 2)
        high = low + random.uniform(0.1, 0.5, 2)
        x, y = (one.ravel() for one in np.meshgrid(*np.linspace(low, high, 300).T))
        rays = np.column_stack([x, y])
        heights = [-np.inf]
        for corners in triangles:
            a, b, c = corners
            inverse = np.linalg.inv(np.column_stack([b - a, c - a])[:2])
            u, v = inverse @ (rays - a[:2]).T
            z = a[2] + u * (b - a)[2] + v * (c - a)[2]
            heights += z[(u >= 0.0) & (v >= 0.0) & (u + v <= 1.0)].tolist()
        found = highest_within(triangles, low, high)
        assert found == pytest.approx(max(heights), abs=0.03) and found >= max(heights) - 1e-9


def test_centred_over_a_place_at_its_own_height(vertices: Float) -> None:
    before, after = (in_world(item, vertices) for item in (ITEM, centred(ITEM, vertices, (0.1, -0.2, 7.0))))
    assert 0.5 * (after.min(axis=0) + after.max(axis=0))[:2] == pytest.approx((0.1, -0.2), abs=NANOMETRE)
    assert after[:, 2] == pytest.approx(before[:, 2], abs=NANOMETRE)


def test_what_was_put_on_top_of_a_slope_or_a_step_does_not_reach_into_it(vertices: Float) -> None:
    """The box around a slope, or around a part that is turned, overlaps that of what merely touches it."""
    slope = np.array([[[-1.0, -1.0, -0.4], [1.0, -1.0, 0.4], [0.0, 2.0, 0.1]]])
    step = trimesh.creation.box(extents=(2.0, 2.0, 0.2)).triangles
    beside = trimesh.creation.box(extents=(0.1, 0.1, 9.0)).apply_translation([1.0, 1.0, 0.0]).triangles
    for below in (slope, np.concatenate([step, beside])):
        own = in_world(on_top(ITEM, vertices, [below]), vertices)
        assert not reaches_into(own, below)
        assert reaches_into(own - np.array([0.0, 0.0, 1e-4]), below)
        assert not reaches_into(own - np.array([0.0, 0.0, 20.0]), below), "it is below"
        assert not reaches_into(own + np.array([30.0, 0.0, -0.1]), below), "it is beside"


def test_boxes_that_share_space_are_told_and_what_touches_is_not() -> None:
    cube = np.array([[-0.01, -0.01, -0.01], [0.01, 0.01, 0.01]])
    floor = np.array([[-1.0, -1.0, 0.0], [1.0, 1.0, 0.0]])

    def at(height: float, turn: float = 0.0) -> tuple[Float, Float]:
        return cube, Pose(translation=(0.0, 0.0, height), rotation=(turn, 0.0, 0.0)).matrix

    boxes = [(floor, np.eye(4)), at(0.01), at(0.0), at(0.029)]
    assert meeting(boxes, 1) == [2, 3]
    assert meeting(boxes, 2) == [0, 1]
    assert meeting([*boxes[:1], at(0.01, 0.3)], 1) == [0]
