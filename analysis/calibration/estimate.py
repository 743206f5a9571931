"""What is estimated: camera, distortion, board warp, laser planes, and the board's pose in every view."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from analysis.calibration import motion as carried
from analysis.calibration.lens import NAMES
from analysis.calibration.motion import Motion
from render.base.arrays import Bool, Float

INTRINSICS = ("fx", "fy", "cx", "cy")
WARP = ("warp_x", "warp_y")


@dataclass(frozen=True)
class Estimate:
    """Parameters of the joint adjustment.

    A plane is m with m . P = 1 for its points P in the camera frame (m = -n / d): no plane through the camera's centre
    has one, and by such a plane nothing can be measured.
    """

    intrinsics: Float
    """(4,) fx, fy, cx, cy, px."""
    distortion: Float
    """(terms,) in OpenCV's order."""
    warp: Float
    """(2,) m: how far the board's middle stands out along x and along y; its ends do not."""
    planes: Float
    """(lasers, 3) 1/m."""
    rotation: Float
    """(views, 3, 3) from board to camera."""
    translation: Float
    """(views, 3) m."""
    motion: Motion | None = None
    """Where the board was carried from view to view; without, every view has a pose of its own."""

    @property
    def shared(self) -> Float:
        """(4 + terms + 2 + 3 lasers + motion,) all that is common to the views, in the order of `names`."""
        moved = np.empty(0) if self.motion is None else self.motion.parameters
        return np.concatenate([self.intrinsics, self.distortion, self.warp, self.planes.ravel(), moved])

    @property
    def names(self) -> tuple[str, ...]:
        """Of `shared`."""
        planes = tuple(f"plane_{i}_{axis}" for i in range(len(self.planes)) for axis in "xyz")
        moved = () if self.motion is None else carried.NAMES[self.motion.kind]
        return INTRINSICS + NAMES[: len(self.distortion)] + WARP + planes + moved

    @property
    def camera_count(self) -> int:
        """Parameters of the camera: they come first in `shared`."""
        return 4 + len(self.distortion)

    def plane_slice(self, laser: int) -> slice:
        """Where a laser's plane is in `shared`."""
        start = self.camera_count + 2 + 3 * laser
        return slice(start, start + 3)

    @property
    def motion_slice(self) -> slice:
        """Where the motion's parameters are in `shared`."""
        start = self.camera_count + 2 + 3 * len(self.planes)
        return slice(start, start + (0 if self.motion is None else len(self.motion.parameters)))

    @property
    def group(self) -> NDArray[np.intp]:
        """(views,) which views share a pose that is estimated."""
        return np.arange(len(self.rotation)) if self.motion is None else self.motion.group

    def of_views(self, keep: Bool) -> Estimate:
        """That of some views (views,)."""
        motion = None if self.motion is None else self.motion.of_views(keep)
        return replace(self, rotation=self.rotation[keep], translation=self.translation[keep], motion=motion)

    def with_poses(self, rotation: Float, translation: Float) -> Estimate:
        """The same shared parameters with other views, (views, 3, 3) and (views, 3), each with a pose of its own."""
        motion = None if self.motion is None else self.motion.standing(len(rotation))
        return replace(self, rotation=rotation, translation=translation, motion=motion)

    def with_motion(self, motion: Motion) -> Estimate:
        """The poses as near to those there are as the motion allows."""
        return replace(self, motion=motion)._carried(*carried.placements(motion, self.rotation, self.translation))

    def _carried(self, rotation: Float, translation: Float) -> Estimate:
        """Poses of all views from those of the placements, (groups, 3, 3) and (groups, 3)."""
        if self.motion is None:
            return replace(self, rotation=rotation, translation=translation)
        moves = self.motion.moves()
        there = np.einsum("nij,nj->ni", moves.rotation, translation[self.group]) + moves.shift
        return replace(self, rotation=moves.rotation @ rotation[self.group], translation=there)

    def with_shared(self, shared: Float) -> Estimate:
        """The same poses of the placements with other shared parameters."""
        there, motion = self._sharing(shared), self.motion
        return there if motion is None else there._carried(self.rotation[motion.first], self.translation[motion.first])

    def _sharing(self, shared: Float) -> Estimate:
        """Other shared parameters, and what the boards are carried to as it was."""
        camera, motion = self.camera_count, self.motion
        return replace(
            self,
            intrinsics=shared[:4],
            distortion=shared[4:camera],
            warp=shared[camera : camera + 2],
            planes=shared[camera + 2 : self.motion_slice.start].reshape(-1, 3),
            motion=None if motion is None else replace(motion, parameters=shared[self.motion_slice]),
        )

    def moved(self, shared: Float, poses: Float) -> Estimate:
        """A step away: shared (p,) is added; poses (groups, 6) turn each board in the camera frame and shift it."""
        first = slice(None) if self.motion is None else self.motion.first
        turned = Rotation.from_rotvec(poses[:, :3]).as_matrix() @ self.rotation[first]
        shifted = self.translation[first] + poses[:, 3:]
        return self._sharing(self.shared + shared)._carried(turned, shifted)


def free_parameters(estimate: Estimate, *, warp: bool, camera: bool = True) -> np.ndarray:
    """(p,) bool: which of `shared` are estimated, the others are held."""
    free = np.ones(len(estimate.shared), dtype=bool)
    free[: estimate.camera_count] = camera
    free[estimate.camera_count : estimate.camera_count + 2] = warp
    return free


def unit_plane(m: Float) -> Float:
    """(3,) m . P = 1 -> (4,) plane (a, b, c, d) of unit normal, d < 0."""
    return np.append(m, -1.0) / np.linalg.norm(m)


def unit_plane_jacobian(m: Float) -> Float:
    """(4, 3) derivative of `unit_plane`."""
    length = float(np.linalg.norm(m))
    normal = m / length
    return np.concatenate([(np.eye(3) - np.outer(normal, normal)) / length, normal[None] / length**2])


def plane_vector(plane: Float) -> Float:
    """(4,) plane (a, b, c, d) of any scale -> (3,) m."""
    return np.asarray(-plane[:3] / plane[3])
