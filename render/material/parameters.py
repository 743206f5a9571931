"""Materials as the kernels of `render.material.bsdf` take them, at given wavelengths; the metals' indices come from a
table.
"""

from __future__ import annotations

import json
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from render.base.errors import InputError
from render.material.bsdf import (
    ANISOTROPY,
    COATED,
    CONDUCTOR,
    DIELECTRIC,
    EMITTED,
    EMITTER,
    EXTINCTION,
    LAMBERTIAN,
    ROW,
    SCATTERED,
    SUBSURFACE,
)
from render.material.fresnel import diffuse_reflectance
from render.material.material import (
    POLISHED,
    BaseMaterial,
    Coated,
    Conductor,
    Emitter,
    Glass,
    GreyTexture,
    Subsurface,
    at_wavelength,
)

Float = NDArray[np.float64]

ASSETS = Path(__file__).parents[2] / "assets"


@lru_cache(maxsize=1)
def metals() -> dict[str, dict[str, Any]]:
    """label, source, wavelength_nm, n and k of each metal."""
    return dict(json.loads((ASSETS / "metals.json").read_text(encoding="utf-8")))


def complex_index(metal: str, wavelength_nm: float, where: str = "material") -> tuple[float, float]:
    """n and k, linear between the table's wavelengths. InputError: beyond them."""
    entry = metals()[metal]
    known = entry["wavelength_nm"]
    if not known[0] <= wavelength_nm <= known[-1]:
        raise InputError(
            f"the refractive index of {entry['label'].lower()} is not known at this wavelength",
            where=f"{where}.metal",
            found=f"{wavelength_nm:g} nm",
            allowed=f"{known[0]:g} to {known[-1]:g} nm",
            cure="choose another metal, or a laser within that range",
        )
    return float(np.interp(wavelength_nm, known, entry["n"])), float(np.interp(wavelength_nm, known, entry["k"]))


@lru_cache(maxsize=1)
def substances() -> dict[str, dict[str, Any]]:
    """label, source, range_nm and Sellmeier coefficients b, c_um2 of each transparent substance."""
    return dict(json.loads((ASSETS / "substances.json").read_text(encoding="utf-8")))


def substance_index(substance: str, wavelength_nm: float, where: str = "material") -> float:
    """n by Sellmeier's equation, n^2 = 1 + sum b l^2 / (l^2 - c). InputError: beyond the range it was measured in."""
    entry = substances()[substance]
    shortest, longest = entry["range_nm"]
    if not shortest <= wavelength_nm <= longest:
        raise InputError(
            f"the refractive index of {entry['label']} is not known at this wavelength",
            where=f"{where}.substance",
            found=f"{wavelength_nm:g} nm",
            allowed=f"{shortest:g} to {longest:g} nm",
            cure="give the index as a number, or choose another substance or laser",
        )
    square_um = (wavelength_nm / 1000.0) ** 2
    terms = zip(entry["b"], entry["c_um2"], strict=True)
    return float(np.sqrt(1.0 + sum(b * square_um / (square_um - c) for b, c in terms)))


def material_row(
    material: BaseMaterial, bands_nm: tuple[float, float, float], least_alpha: float = 1.0, where: str = "material"
) -> Float:
    """(ROW,) parameters at three wavelengths; the layout is in `render.material.bsdf`.

    least_alpha: the least value of a roughness that is an image, which stands for it here. where: for messages.
    InputError: not known at a wavelength.
    """
    row = np.zeros(ROW)
    row[0] = LAMBERTIAN
    match material:
        case Conductor():
            alpha = least_alpha if isinstance(material.roughness, GreyTexture) else material.roughness
            alpha = alpha if alpha >= POLISHED else 0.0
            row[0], row[1], row[2] = CONDUCTOR, alpha, alpha
            if material.roughness_across is not None:
                # a grain keeps its direction, however near the two are
                row[1], row[2] = max(alpha, POLISHED), material.roughness_across
                row[1] *= 1.0 if row[1] != row[2] else 1.0 - 1e-9
            for band, wavelength_nm in enumerate(bands_nm):
                row[4 + band], row[7 + band] = complex_index(material.metal, wavelength_nm, where)
        case Coated():
            alpha = least_alpha if isinstance(material.roughness, GreyTexture) else material.roughness
            row[0], row[1], row[2], row[3] = COATED, alpha, alpha, material.index
            row[10] = diffuse_reflectance(1.0 / material.index)
        case Glass():
            alpha = least_alpha if isinstance(material.roughness, GreyTexture) else material.roughness
            alpha = alpha if alpha >= POLISHED else 0.0
            # one path carries three bands, so that it is bent as the middle one is
            known = material.index
            index = substance_index(material.substance, bands_nm[1], where) if known is None else known
            row[0], row[1], row[2], row[3] = DIELECTRIC, alpha, alpha, index
        case Subsurface():
            row[0], row[1], row[2], row[3] = SUBSURFACE, material.roughness, material.roughness, material.index
            row[ANISOTROPY] = material.anisotropy
            free, albedo = _rgb(material.mean_free_path), _rgb(material.scattering_albedo)
            for band, wavelength_nm in enumerate(bands_nm):
                row[EXTINCTION + band] = 1.0 / at_wavelength(free, wavelength_nm)
                row[SCATTERED + band] = at_wavelength(albedo, wavelength_nm)
        case Emitter():
            row[0], row[EMITTED : EMITTED + 3] = EMITTER, material.radiance
    return row


def _rgb(value: float | tuple[float, float, float]) -> tuple[float, float, float]:
    return value if isinstance(value, tuple) else (value, value, value)
