"""How bright the line is on a material, in closed form: without other surfaces and the spread of light below one."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from render.base.arrays import Float, Int
from render.base.errors import InputError
from render.laser_direct.reflected_light import reflected_at
from render.material.material import Material, Subsurface
from render.material.spectrum import BAND_CENTRES_NM, at_wavelength, per_band, reflectance_weights
from render.world.triangles import Surface

Bands = tuple[float, float, float]


def reflected_light(
    surface_at: Callable[[Bands], Surface],
    material: Material,
    wavelength_nm: float,
    triangle: Int,
    points: Float,
    camera: Float,
    laser: Float,
) -> Float:
    """(n,) triangles, (n, 3) points on them, (3,) camera and laser, all in the object's frame -> (n,) `Lit.reflected`.

    Of a material that is not known at the wavelength, for which a render is refused: as if it were at those of RGB.
    """
    try:
        surface = surface_at((wavelength_nm,) * 3)
    except InputError:
        surface = surface_at(BAND_CENTRES_NM)
    weights = np.array(reflectance_weights(wavelength_nm))
    found: Float = reflected_at(surface, triangle, points, camera, laser, weights)
    return found + from_below(material, wavelength_nm) if isinstance(material, Subsurface) else found


def from_below(material: Subsurface, wavelength_nm: float) -> float:
    """Reflectance of a wide beam that is scattered below the surface: of a half-space (van de Hulst 1980, by
    similarity), beneath a boundary that throws part of it back (Egan, Hilgeman 1979).
    """
    albedo = at_wavelength(per_band(material.scattering_albedo), wavelength_nm)
    n = material.index
    s = math.sqrt((1.0 - albedo) / (1.0 - albedo * material.anisotropy))
    open_half_space = (1.0 - s) * (1.0 - 0.139 * s) / (1.0 + 1.17 * s)
    inside = -1.440 / n**2 + 0.710 / n + 0.668 + 0.0636 * n
    enters = 1.0 - ((n - 1.0) / (n + 1.0)) ** 2
    return enters * (1.0 - inside) * open_half_space / (1.0 - inside * open_half_space)
