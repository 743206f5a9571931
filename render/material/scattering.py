"""Arguments and results of every model's BSDF, as records of numbers, which cost nothing between kernels.

Local frame: z is the surface's normal. wo is the direction that a path comes from, wi the one it goes on to; both point
away from the surface.
"""

from __future__ import annotations

from typing import NamedTuple

Direction = tuple[float, float, float]
"""A unit vector in the local frame."""
Numbers = tuple[float, float, float]
"""Random numbers in [0, 1): the first selects a lobe, the others a direction in it."""


class Microsurface(NamedTuple):
    """A rough boundary."""

    alpha_x: float
    """GGX alpha along x."""
    alpha_y: float
    """GGX alpha along y."""
    eta: float
    """Refractive index below the surface over that above; not used by metals."""


class Lobes(NamedTuple):
    """The factors of a BSDF f(wo, wi) that are common to all bands."""

    specular: float
    """Microfacet lobe, 1/sr."""
    cosine: float
    """Cosine of wo with the facets' normal, for the Fresnel reflectance of each band."""
    diffuse: float
    """Lambertian lobe at a reflectance of 1, 1/sr."""


class Sample(NamedTuple):
    """A sampled direction, and what gives the weight f |cos wi| / pdf of a path that follows it."""

    wi: Direction
    """Sampled direction."""
    pdf: float
    """pdf of wi, 1/sr; -1: wi is of a delta function; 0: nothing is scattered."""
    lobes: Lobes
    """Lobes from which `eval_band` makes the weight of each band, up to `factor`."""
    factor: float
    """Factor on what `eval_band` returns."""


NOTHING = Sample((0.0, 0.0, 0.0), 0.0, Lobes(0.0, 0.0, 0.0), 0.0)
"""The sample of a surface that scatters nothing."""
