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
"""m from height zero, within which a part's lowest vertex stands on the ground."""


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


def on_top(item: SceneObject, vertices: Float, boxes: Sequence[tuple[Float, Float]]) -> SceneObject:
    """Its lowest vertex as high as the highest of what is below or above its own box. vertices: as of `with_axis_up`.

    boxes: of other objects, as of `meeting`. Where there is none, on the ground.
    """
    own = transform_points(item.T_world_object.matrix, vertices)
    low, high = own.min(axis=0)[:2], own.max(axis=0)[:2]
    around = [_around(box, to_world) for box, to_world in boxes]
    tops = [top[2] for bottom, top in around if np.all((low < top[:2]) & (bottom[:2] < high))]
    return _at_height(item, vertices, max(tops, default=0.0))


def centred(item: SceneObject, vertices: Float, place: Sequence[float]) -> SceneObject:
    """The middle of its box over a place, which it keeps its height at. vertices: as of `with_axis_up`."""
    own = transform_points(item.T_world_object.matrix, vertices)
    off = np.asarray(place[:2]) - 0.5 * (own.min(axis=0) + own.max(axis=0))[:2]
    return _moved(item, item.T_world_object.matrix[:3, 3] + np.array([*off, 0.0]))


def _at_height(item: SceneObject, vertices: Float, height: float) -> SceneObject:
    matrix = item.T_world_object.matrix
    return _moved(item, np.array([*matrix[:2, 3], height - float((vertices @ matrix[2, :3]).min())]))


def stands(item: SceneObject, vertices: Float) -> bool:
    """On the ground. vertices: as of `with_axis_up`."""
    matrix = item.T_world_object.matrix
    return abs(float((vertices @ matrix[2, :3]).min() + matrix[2, 3])) < STANDS


def fitted(item: SceneObject, vertices: Float, scene: Scene) -> SceneObject:
    """Scaled to FILLED of the camera's view, its middle in the middle of it; what stands on the ground stays there.

    vertices: as of `with_axis_up`.
    """
    matrix = item.T_world_object.matrix
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    scale = float(f"{item.scale * FILLED * field_of_view(scene) / float((high - low).max()):.3g}")
    middle = matrix[:3, :3] @ (low + high) / 2.0 * (scale / item.scale)
    made = _moved(item.model_copy(update={"scale": scale}), target(scene) - middle)
    return on_ground(made, vertices * (scale / item.scale)) if stands(item, vertices) else made


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
    slack = 1e-6
    return [
        k
        for k, (other_low, other_high) in enumerate(around)
        if k != index and np.all((low < other_high - slack) & (other_low < high - slack))
    ]


def _around(box: Float, to_world: Float) -> tuple[Float, Float]:
    corners = transform_points(to_world, np.array(np.meshgrid(*box.T, indexing="ij")).reshape(3, -1).T)
    return corners.min(axis=0), corners.max(axis=0)


def _moved(item: SceneObject, place: Float, rotation: tuple[float, float, float] | None = None) -> SceneObject:
    rotation = item.T_world_object.rotation if rotation is None else rotation
    return item.model_copy(update={"T_world_object": Pose(translation=vector(place), rotation=rotation)})
