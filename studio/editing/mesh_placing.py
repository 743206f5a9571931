"""A mesh where it belongs: its up axis, on the ground or on another part, over an axis, as large as the camera sees."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np

from render.base.arrays import Float
from render.base.pose import Pose, transform_points
from render.scene.scene import Scene, SceneObject
from studio.editing.placement import field_of_view, target, vector
from studio.editing.placing import least_turn

UpAxis = Literal["+x", "-x", "+y", "-y", "+z", "-z"]
UP_AXES: tuple[UpAxis, ...] = get_args(UpAxis)
FILLED = 0.8
"""Of the camera's view, by a part that was fitted to it."""
STANDS = 1e-6
"""m, within which a part's lowest vertex stands on the ground, or touches another part."""


def up_axis(item: SceneObject) -> UpAxis | None:
    """The axis of the file that points up in the world; None: none does."""
    up = item.T_world_object.matrix[2, :3]
    found = int(np.argmax(np.abs(up)))
    return None if abs(up[found]) < 1.0 - 1e-6 else UP_AXES[2 * found + int(up[found] < 0.0)]


def with_axis_up(item: SceneObject, vertices: Float, axis: UpAxis) -> SceneObject:
    """Turned from how the file has it, by the least angle that makes an axis of it point up, about its middle.

    vertices: (n, 3) m, in the object's frame, its scale included.
    """
    before, direction = item.T_world_object.matrix, np.zeros(3)
    direction["xyz".index(axis[1])] = 1.0 if axis[0] == "+" else -1.0
    turned = np.eye(4)
    turned[:3, :3] = least_turn(direction, np.array([0.0, 0.0, 1.0]))
    middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2.0
    turned[:3, 3] = before[:3, :3] @ middle + before[:3, 3] - turned[:3, :3] @ middle
    pose = Pose.from_matrix(turned)
    return _moved(item, turned[:3, 3], vector(np.array(pose.rotation)))


def on_ground(item: SceneObject, vertices: Float) -> SceneObject:
    """Its lowest vertex at height zero. vertices: as of `with_axis_up`."""
    return _at_height(item, vertices, 0.0)


def on_top(item: SceneObject, vertices: Float, others: Sequence[Float]) -> SceneObject:
    """Its lowest vertex as high as the highest place of others that is below or above its own box.

    vertices: as of `with_axis_up`; others: (t, 3, 3) m corners of triangles in the world. Where there is none, on the
    ground.
    """
    own = transform_points(item.T_world_object.matrix, vertices)
    low, high = own.min(axis=0)[:2], own.max(axis=0)[:2]
    return _at_height(item, vertices, max((highest_within(one, low, high) for one in others), default=-np.inf))


def highest_within(triangles: Float, low: Float, high: Float) -> float:
    """Largest z of triangles (t, 3, 3) above a rectangle (2,), (2,) of the ground, m; -inf: there is none.

    Of a triangle that is cut by the rectangle it is at a corner of the one or the other, or where their sides meet.
    """
    there = np.all((triangles[..., :2].min(axis=1) < high) & (triangles[..., :2].max(axis=1) > low), axis=1)
    found, corners = [-np.inf], triangles[there]
    within = np.all((corners[..., :2] >= low) & (corners[..., :2] <= high), axis=2)
    found += corners[..., 2][within].tolist()
    start, side = corners, np.roll(corners, -1, axis=1) - corners
    for axis, other in ((0, 1), (1, 0)):
        for limit in (low[axis], high[axis]):
            with np.errstate(divide="ignore", invalid="ignore"):
                share = (limit - start[..., axis]) / side[..., axis]
                across = start[..., other] + share * side[..., other]
                height = start[..., 2] + share * side[..., 2]
            meets = (share >= 0.0) & (share <= 1.0) & (across >= low[other]) & (across <= high[other])
            found += height[meets].tolist()
    normal = np.cross(side[:, 0], side[:, 1])
    for corner in ((low[0], low[1]), (low[0], high[1]), (high[0], low[1]), (high[0], high[1])):
        off = np.array(corner) - start[..., :2]
        turn = side[..., 0] * off[..., 1] - side[..., 1] * off[..., 0]
        inside = (np.all(turn >= 0.0, axis=1) | np.all(turn <= 0.0, axis=1)) & (np.abs(normal[:, 2]) > 0.0)
        found += (
            start[inside, 0, 2] - np.sum(normal[inside, :2] * off[inside, 0], axis=1) / normal[inside, 2]
        ).tolist()
    return max(found)


def centred(item: SceneObject, vertices: Float, place: Sequence[float]) -> SceneObject:
    """The middle of its box over a place, which it keeps its height at. vertices: as of `with_axis_up`."""
    own = transform_points(item.T_world_object.matrix, vertices)
    off = np.asarray(place[:2]) - 0.5 * (own.min(axis=0) + own.max(axis=0))[:2]
    return _moved(item, item.T_world_object.matrix[:3, 3] + np.array([*off, 0.0]))


def _at_height(item: SceneObject, vertices: Float, height: float) -> SceneObject:
    """-inf: on the ground."""
    matrix, height = item.T_world_object.matrix, height if np.isfinite(height) else 0.0
    return _moved(item, np.array([*matrix[:2, 3], height - float((vertices @ matrix[2, :3]).min())]))


def stands(item: SceneObject, vertices: Float) -> bool:
    """On the ground. vertices: as of `with_axis_up`."""
    matrix = item.T_world_object.matrix
    return abs(float((vertices @ matrix[2, :3]).min() + matrix[2, 3])) < STANDS


def rests(item: SceneObject, vertices: Float, others: Sequence[Float]) -> bool:
    """As `on_top` would put it on one of the others; both as of that."""
    own = transform_points(item.T_world_object.matrix, vertices)
    low, high = own.min(axis=0), own.max(axis=0)
    return any(abs(highest_within(one, low[:2], high[:2]) - low[2]) < STANDS for one in others)


def fitted(item: SceneObject, vertices: Float, scene: Scene, others: Sequence[Float] = ()) -> SceneObject:
    """Scaled to FILLED of the camera's view, its middle in the middle of it; what stands on the ground stays there,
    and what rests on others stays on them, about the middle of its foot.

    vertices: as of `with_axis_up`; others: as of `on_top`.
    """
    matrix = item.T_world_object.matrix
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    scale = float(f"{item.scale * FILLED * field_of_view(scene) / float((high - low).max()):.3g}")
    factor = scale / item.scale
    scaled = item.model_copy(update={"scale": scale})
    if not stands(item, vertices) and rests(item, vertices, others):
        # a wider part may reach a higher place of what leans below it
        return on_top(on_its_foot(scaled, vertices, factor), vertices * factor, others)
    made = _moved(scaled, target(scene) - matrix[:3, :3] @ (low + high) / 2.0 * factor)
    return on_ground(made, vertices * factor) if stands(item, vertices) else made


def on_its_foot(item: SceneObject, vertices: Float, factor: float) -> SceneObject:
    """Of an item that has become `factor` times as large, the lowest and the middle of what it was stay in their place.

    vertices: as of `with_axis_up`, as they were.
    """
    matrix = item.T_world_object.matrix
    around = vertices @ matrix[:3, :3].T
    low, high = around.min(axis=0), around.max(axis=0)
    foot = np.array([*(0.5 * (low + high))[:2], low[2]])
    return _moved(item, matrix[:3, 3] + (1.0 - factor) * foot)


def meeting(boxes: Sequence[tuple[Float, Float]], index: int) -> list[int]:
    """Which boxes share space with one of them. boxes: (2, 3) m lowest and highest corner, and (4, 4) to the world.

    Each turned box counts as the one along the world's axes around it; what only touches does not count.
    """
    around = [_around(box, to_world) for box, to_world in boxes]
    low, high = around[index]
    return [
        k
        for k, (other_low, other_high) in enumerate(around)
        if k != index and np.all((low < other_high - STANDS) & (other_low < high - STANDS))
    ]


def reaches_into(own: Float, other: Float) -> bool:
    """Whether the box around vertices (n, 3) reaches into what triangles (t, 3, 3) m have above or below it.

    What is put on top of another is not: of a sloping or stepped one the box around all is higher than its place there.
    """
    low, high = own.min(axis=0), own.max(axis=0)
    top = highest_within(other, low[:2], high[:2])
    foot = -highest_within(other * np.array([1.0, 1.0, -1.0]), low[:2], high[:2])
    return bool(low[2] < top - STANDS and foot < high[2] - STANDS)


def _around(box: Float, to_world: Float) -> tuple[Float, Float]:
    corners = transform_points(to_world, np.array(np.meshgrid(*box.T, indexing="ij")).reshape(3, -1).T)
    return corners.min(axis=0), corners.max(axis=0)


def _moved(item: SceneObject, place: Float, rotation: tuple[float, float, float] | None = None) -> SceneObject:
    rotation = item.T_world_object.rotation if rotation is None else rotation
    return item.model_copy(update={"T_world_object": Pose(translation=vector(place), rotation=rotation)})
