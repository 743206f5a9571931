"""A triangle mesh in its object's frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Mesh:
    """Triangles in metres, in the object's own frame (before `T_world_object`, after unit and scale).

    vertices (v, 3) float64; triangles (t, 3) int32; uv (t, 3, 2) float32 per triangle corner, origin at the lower left;
    texture (h, w, 3) float32 linear reflectance, row 0 at the top, or None; colour: RGB reflectance that the file
    brings, or None.
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]
    uv: NDArray[np.float32] | None = None
    texture: NDArray[np.float32] | None = None
    colour: tuple[float, float, float] | None = None
    normals: NDArray[np.float32] | None = None
    """(t, 3, 3) unit normals of the corners for shading, or None: shade the facets."""
    smooth_normals: bool = False
    """The file carries vertex normals that differ from its facets."""
