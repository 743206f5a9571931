"""What the BSDF of every model is given, and what it returns: records of numbers, which cost nothing between kernels.

Local frame: z is the surface's normal. wo is the direction that a path comes from, wi the one it goes on to; both point
away from the surface.
"""

from __future__ import annotations

from typing import NamedTuple

Direction = tuple[float, float, float]
"""A unit vector in the local frame."""


class Microsurface(NamedTuple):
    """A rough boundary, as a record: named tuples of numbers cost nothing between kernels."""

    alpha_x: float
    """GGX roughness along x."""
    alpha_y: float
    eta: float
    """Refractive index below over that above; not used by metals."""


class Lobes(NamedTuple):
    """What of a BSDF f(wo, wi) is alike in all bands."""

    specular: float
    """1/sr, by way of facets."""
    cosine: float
    """Of wo with the facets' normal, for the Fresnel reflectance of each band."""
    diffuse: float
    """1/sr, of a base or a surface that scatters as Lambert says, where its reflectance is 1."""


class Sample(NamedTuple):
    """A direction that was drawn, and the weight f |cos wi| / pdf of a path that follows it."""

    wi: Direction
    pdf: float
    """1/sr; -1: of a delta function, which has none; 0: nothing is scattered."""
    lobes: Lobes
    factor: float
    """On lobes: both together are the weight, as lobes alone are f."""


NOTHING = Sample((0.0, 0.0, 0.0), 0.0, Lobes(0.0, 0.0, 0.0), 0.0)
