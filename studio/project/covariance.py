"""Covariances as files hold them: printed numbers, so that rounding is allowed for."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

Entry = Annotated[float, Field(ge=-1e24, le=1e24)]
ROUNDING = 1e-9
"""Of the largest variances: what asymmetry and negative variances of a printed matrix may amount to."""


def check_covariance(matrix: NDArray[np.float64], name: str) -> None:
    """(n, n). ValueError: not symmetric, or not positive semi-definite."""
    spread = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    scale = np.outer(spread, spread) + np.finfo(float).tiny
    if np.any(np.abs(matrix - matrix.T) > ROUNDING * scale):
        raise ValueError(f"{name} is not symmetric; allowed: a matrix equal to its transpose")
    related = matrix / np.where(scale > ROUNDING * np.finfo(float).tiny, scale, 1.0)
    if np.linalg.eigvalsh(np.where(np.abs(matrix) > 0.0, related, 0.0)).min() < -len(matrix) * ROUNDING:
        raise ValueError(f"{name} has negative variances; allowed: a positive semi-definite matrix")
