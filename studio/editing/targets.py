"""Which pose a selected item has, and in which frame that pose is given: what a gizmo or a typed number moves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from render.base.arrays import Float
from render.base.model import Vector3
from render.base.pose import Pose, invert
from render.scene.motion import NoMotion
from render.scene.scene import Scene
from studio.project.document import FieldPath, replaced, value_at
from studio.project.project import Project

RIG: FieldPath = ("scene", "rig")


@dataclass(frozen=True)
class Target:
    """A pose that can be moved."""

    path: FieldPath
    """Of the pose in the project."""
    name: str
    pose: Pose
    T_world_parent: Float
    """(4, 4) frame in which the pose is given."""

    @property
    def T_world_item(self) -> Float:
        """(4, 4)."""
        return np.asarray(self.T_world_parent @ self.pose.matrix)

    def moved(self, motion: Float) -> Pose:
        """The pose after a motion (4, 4) in the world that only moves: the rotation stays, bit for bit."""
        offset = self.T_world_parent[:3, :3].T @ motion[:3, 3]
        return self.pose.model_copy(update={"translation": rounded(np.add(self.pose.translation, offset))})

    def turned(self, motion: Float) -> Pose:
        """The pose after a motion (4, 4) in the world that turns about the item's own origin, which stays."""
        return self.pose.model_copy(update={"rotation": self.turned_about(motion).rotation})

    def turned_about(self, motion: Float) -> Pose:
        """The pose after a motion (4, 4) in the world that turns about any other point, too."""
        matrix = invert(self.T_world_parent) @ motion @ self.T_world_item
        found = Pose.from_matrix(matrix)
        return self.pose.model_copy(update={"rotation": found.rotation, "translation": rounded(matrix[:3, 3])})


def target(project: Project, selection: FieldPath, step: int = 0) -> Target | None:
    """The pose of what is selected at a step of the motion; None: it has none, or is not there any more."""
    scene = project.scene
    for length in range(len(selection), 1, -1):
        head = selection[:length]
        name = _pose_name(head)
        if name is not None:
            try:
                item = value_at(project, head)
                pose: Pose = getattr(item, name)
            except (KeyError, AttributeError):
                return None
            return Target((*head, name), _title(head, item), pose, _parent(scene, head, step))
    return None


def targets(project: Project, selections: Sequence[FieldPath], step: int = 0) -> tuple[Target, ...]:
    """Of all that is selected, without what another of them carries."""
    free = [path for path in selections if not any(path != other == path[: len(other)] for other in selections)]
    found = [target(project, path, step) for path in free]
    return tuple({one.path: one for one in found if one is not None}.values())


def carried(project: Project, before: Sequence[Target], motion: Float, turns: bool) -> Project:
    """Targets as they were, moved by one motion (4, 4) in the world; the last turns about its own origin.

    InputError: a pose is not allowed.
    """
    for one in before:
        still = turns and np.array_equal(motion, np.eye(4))
        own = one.turned(motion) if one is before[-1] else one.turned_about(motion)
        project = replaced(project, one.path, one.pose if still else own if turns else one.moved(motion))
    return project


def other_frame(project: Project, path: FieldPath, step: int = 0) -> tuple[str, Float] | None:
    """The pose at a path in the other of the two frames that people think in: "world" or "rig", and T_other_parent.

    None: of the rig itself and of poses that nothing in the scene has there is no other.
    """
    head = path[:-1]
    if head == RIG or not head or _pose_name(head) != path[-1]:
        return None
    T_world_parent = _parent(project.scene, head, step)
    if head[:2] == RIG:
        return "world", T_world_parent
    return "rig", np.asarray(invert(project.scene.T_world_rig(step)) @ T_world_parent)


def rounded(values: Float) -> Vector3:
    """To a nanometre: what a mouse says is no finer."""
    x, y, z = (round(float(value), 9) + 0.0 for value in values)
    return x, y, z


def _pose_name(path: FieldPath) -> str | None:
    if path == RIG:
        return "T_world_rig"
    if path == (*RIG, "camera"):
        return "T_rig_camera"
    if len(path) == 4 and path[:3] == (*RIG, "lasers"):
        return "T_rig_laser"
    if len(path) == 3 and path[1] == "objects":
        return "T_world_object"
    if len(path) == 3 and path[1] == "lights":
        return "T_world_light"
    return None


def _title(path: FieldPath, item: object) -> str:
    return getattr(item, "name", "") or str(path[-1])


def _parent(scene: Scene, path: FieldPath, step: int) -> Float:
    moves = None if isinstance(scene.motion, NoMotion) else scene.motion.moves
    if path[:2] == RIG and len(path) > 2:
        return scene.T_world_rig(step)
    if (moves == "rig" and path == RIG) or (moves == "objects" and path[1] == "objects"):
        return np.asarray(scene.motion.displacement(step))
    return np.eye(4)
