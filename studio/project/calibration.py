"""How well camera and laser planes are known: an error of theirs is common to all points, and no mean removes it."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator

from analysis.triangulate import CALIBRATION
from render.base.model import Model, quantity

Entry = Annotated[float, Field(ge=-1e9, le=1e9)]
Row = Annotated[tuple[Entry, ...], Field(min_length=len(CALIBRATION), max_length=len(CALIBRATION))]
Covariance = Annotated[tuple[Row, ...], Field(min_length=len(CALIBRATION), max_length=len(CALIBRATION))]

ROUNDING = 1e-9
"""Of the largest variances: what asymmetry and negative variances of a printed matrix may amount to."""


class Calibration(Model):
    """What a calibration says of its own errors; as it is, camera and lasers are taken as exact."""

    covariances: tuple[Covariance, ...] = quantity(
        (),
        label="Covariances",
        help="One 8 x 8 matrix for each laser, of fx, fy, cx, cy (px) and its plane a, b, c (unit normal), d (m), in "
        "the camera's frame; none: exact.",
        max_length=64,
    )

    @field_validator("covariances")
    @classmethod
    def _are_covariances(cls, matrices: tuple[Covariance, ...]) -> tuple[Covariance, ...]:
        for i, rows in enumerate(matrices):
            matrix = np.array(rows)
            spread = np.sqrt(np.maximum(np.diag(matrix), 0.0))
            scale = np.outer(spread, spread) + np.finfo(float).tiny
            if np.any(np.abs(matrix - matrix.T) > ROUNDING * scale):
                raise ValueError(f"covariance {i} is not symmetric; allowed: a matrix equal to its transpose")
            related = matrix / np.where(scale > ROUNDING * np.finfo(float).tiny, scale, 1.0)
            if np.linalg.eigvalsh(np.where(np.abs(matrix) > 0.0, related, 0.0)).min() < -len(CALIBRATION) * ROUNDING:
                raise ValueError(f"covariance {i} has negative variances; allowed: a positive semi-definite matrix")
        return matrices

    def covariance(self, laser: int) -> NDArray[np.float64] | None:
        """(8, 8) of `analysis.triangulate.CALIBRATION` for a laser, None where it is taken as exact."""
        return np.array(self.covariances[laser]) if self.covariances else None

    def scaled(self, image_scale: float) -> Calibration:
        """That of images with `image_scale` times the pixels a side."""
        by = np.array([image_scale] * 4 + [1.0] * 4)
        matrices = [np.array(rows) * np.outer(by, by) for rows in self.covariances]
        return Calibration(covariances=tuple(tuple(tuple(row) for row in matrix.tolist()) for matrix in matrices))
