"""The angle of triangulation: at the surface, between the rays of camera and laser."""

from __future__ import annotations

import numpy as np

from render.base.arrays import Float


def triangulation_angles(points: Float, origin: Float) -> Float:
    """(n,) rad; (n, 3) points and the laser's origin (3,), m, in the camera frame."""
    to_laser = origin - points
    cosine = -np.einsum("ij,ij->i", points, to_laser)
    cosine /= np.linalg.norm(points, axis=1) * np.linalg.norm(to_laser, axis=1)
    return np.asarray(np.arccos(np.clip(cosine, -1.0, 1.0)))
