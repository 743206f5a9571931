"""Rigid poses `T_ab`: they map coordinates in frame b to coordinates in frame a."""

from __future__ import annotations

from functools import cached_property
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from render.base.model import Model, Position, Vector3, quantity

Array = NDArray[np.float64]
Turn = Annotated[float, Field(ge=-1e3, le=1e3)]


class Pose(Model):
    """A rigid transform as a translation (m) and a rotation vector (axis times angle, rad; OpenCV's rvec)."""

    translation: Position = quantity((0.0, 0.0, 0.0), unit="m", label="Position", help="Origin of b, in a.")
    rotation: tuple[Turn, Turn, Turn] = quantity(
        (0.0, 0.0, 0.0), unit="rad", label="Rotation vector", help="Rotation axis times angle; takes b's axes to a's."
    )

    @cached_property
    def matrix(self) -> Array:
        """(4, 4) float64 homogeneous matrix. Rotation by Rodrigues' formula."""
        matrix = np.eye(4)
        matrix[:3, :3] = rotation_matrix(np.asarray(self.rotation, dtype=np.float64))
        matrix[:3, 3] = self.translation
        return matrix

    @classmethod
    def from_matrix(cls, matrix: Array) -> Pose:
        """From a (4, 4) or (3, 4) matrix; its rotation part is taken to the nearest rotation (SVD, det +1)."""
        u, _, vt = np.linalg.svd(np.asarray(matrix, dtype=np.float64)[:3, :3])
        r = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
        t = matrix[:3, 3]
        v = rotation_vector(r)
        return cls(
            translation=(float(t[0]), float(t[1]), float(t[2])), rotation=(float(v[0]), float(v[1]), float(v[2]))
        )

    @classmethod
    def looking_at(cls, origin: Vector3, target: Vector3, down: Vector3 = (0.0, 0.0, -1.0)) -> Pose:
        """Pose of a frame at origin with z towards target and y as near to `down` as possible (an OpenCV camera)."""
        z = np.subtract(target, origin).astype(np.float64)
        z /= np.linalg.norm(z)
        x = np.cross(np.asarray(down, dtype=np.float64), z)
        if np.linalg.norm(x) < 1e-9:
            x = np.cross((0.0, 1.0, 0.0), z)
        x /= np.linalg.norm(x)
        matrix = np.eye(4)
        matrix[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
        matrix[:3, 3] = origin
        return cls.from_matrix(matrix)

    def __matmul__(self, other: Pose) -> Pose:
        """T_ab @ T_bc = T_ac."""
        return Pose.from_matrix(self.matrix @ other.matrix)

    def inverse(self) -> Pose:
        """T_ba from T_ab."""
        return Pose.from_matrix(invert(self.matrix))


def rotation_matrix(vector: Array) -> Array:
    """(3,) rotation vector, rad -> (3, 3) rotation (Rodrigues)."""
    angle = float(np.linalg.norm(vector))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = vector / angle
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * (cross @ cross)


def rotation_vector(rotation: Array) -> Array:
    """(3, 3) rotation -> (3,) rotation vector, rad, of length <= pi."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_matrix(rotation).as_rotvec(), dtype=np.float64)


def invert(matrix: Array) -> Array:
    """(..., 4, 4) rigid inverse."""
    inverse = np.zeros(np.shape(matrix))
    inverse[..., :3, :3] = np.swapaxes(matrix[..., :3, :3], -1, -2)
    inverse[..., :3, 3] = -np.einsum("...ji,...j->...i", matrix[..., :3, :3], matrix[..., :3, 3])
    inverse[..., 3, 3] = 1.0
    return inverse


def transform_points(matrix: Array, points: Array) -> Array:
    """(4, 4) applied to (..., 3) points."""
    return np.asarray(points @ matrix[:3, :3].T + matrix[:3, 3], dtype=np.float64)
