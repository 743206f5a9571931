"""A material as kernels read it: one row of numbers with the same columns for every model.

A model packs its row at three wavelengths (`pack`). The reflectance at a point is passed beside it, since it may come
from an image; so is a roughness that comes from an image, in place of the row's.

    column       what it holds                                          of
    KIND         which model: one of the kinds below                    all
    ALPHA_X, _Y  GGX alpha along x and y of the local frame             conductor, coated, dielectric, subsurface
    INDEX        refractive index of what lies below                    coated, dielectric, subsurface
    METAL_N, _K  complex refractive index n + i k in each of 3 bands    conductor
    INTERNAL     diffuse reflectance of the coat, seen from its base    coated
    ANISOTROPY   mean cosine g of a scattering                          subsurface
    EXTINCTION   1/m, in each of 3 bands                                subsurface
    SCATTERED    single-scattering albedo in each of 3 bands            subsurface
    EMITTED      radiance, R, G, B whatever the bands, W/(m^2 sr)       emitter
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

KIND, ALPHA_X, ALPHA_Y, INDEX, METAL_N, METAL_K, INTERNAL = 0, 1, 2, 3, 4, 7, 10
ANISOTROPY, EXTINCTION, SCATTERED, EMITTED = 11, 12, 15, 18
ROW = 21
BSDF_COLUMNS = ANISOTROPY
"""The first columns, which are all that a BSDF reads: kernels copy these to set the roughness and index of a point."""

LAMBERTIAN, CONDUCTOR, DIELECTRIC, COATED, SUBSURFACE, EMITTER = 0.0, 1.0, 2.0, 3.0, 4.0, 5.0

SPECULAR_ROUGHNESS = 1e-4
"""A GGX alpha below this makes a BSDF a delta function. Models that allow it pack 0 below `maps.POLISHED`."""


def empty_row(kind: float) -> NDArray[np.float64]:
    """(ROW,) zeros with the kind set."""
    row = np.zeros(ROW)
    row[KIND] = kind
    return row
