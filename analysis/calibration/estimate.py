"""What is estimated: camera, distortion, board warp, laser planes, and the board's pose in every view."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from analysis.calibration.lens import NAMES
from render.base.arrays import Float

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

    @property
    def shared(self) -> Float:
        """(4 + terms + 2 + 3 lasers,) all that is common to the views, in the order of `names`."""
        return np.concatenate([self.intrinsics, self.distortion, self.warp, self.planes.ravel()])

    @property
    def names(self) -> tuple[str, ...]:
        """Of `shared`."""
        planes = tuple(f"plane_{i}_{axis}" for i in range(len(self.planes)) for axis in "xyz")
        return INTRINSICS + NAMES[: len(self.distortion)] + WARP + planes

    @property
    def camera_count(self) -> int:
        """Parameters of the camera: they come first in `shared`."""
        return 4 + len(self.distortion)

    def plane_slice(self, laser: int) -> slice:
        """Where a laser's plane is in `shared`."""
        start = self.camera_count + 2 + 3 * laser
        return slice(start, start + 3)

    def with_shared(self, shared: Float) -> Estimate:
        """The same poses with other shared parameters."""
        camera = self.camera_count
        return replace(
            self,
            intrinsics=shared[:4],
            distortion=shared[4:camera],
            warp=shared[camera : camera + 2],
            planes=shared[camera + 2 :].reshape(-1, 3),
        )

    def moved(self, shared: Float, poses: Float) -> Estimate:
        """A step away: shared (p,) is added; poses (views, 6) turn each board in the camera frame and shift it."""
        turned = Rotation.from_rotvec(poses[:, :3]).as_matrix() @ self.rotation
        there = replace(self, rotation=turned, translation=self.translation + poses[:, 3:])
        return there.with_shared(self.shared + shared)


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
