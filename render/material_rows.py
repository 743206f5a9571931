"""Materials as the kernels of `render.bsdf` take them, at given wavelengths; the metals' indices come from a table."""

from __future__ import annotations

import json
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from render.bsdf import COATED, CONDUCTOR, LAMBERTIAN, ROW
from render.errors import InputError
from render.fresnel import diffuse_reflectance
from render.material import BaseMaterial, Coated, Conductor

Float = NDArray[np.float64]

TABLE = Path(__file__).parents[1] / "assets" / "metals.json"


@lru_cache(maxsize=1)
def metals() -> dict[str, dict[str, Any]]:
    """label, source, wavelength_nm, n and k of each metal."""
    return dict(json.loads(TABLE.read_text(encoding="utf-8")))


def complex_index(metal: str, wavelength_nm: float) -> tuple[float, float]:
    """n and k, linear between the table's wavelengths. InputError: beyond them."""
    entry = metals()[metal]
    known = entry["wavelength_nm"]
    if not known[0] <= wavelength_nm <= known[-1]:
        raise InputError(
            f"the refractive index of {entry['label'].lower()} is not known at this wavelength",
            where="material.metal",
            found=f"{wavelength_nm:g} nm",
            allowed=f"{known[0]:g} to {known[-1]:g} nm",
            cure="choose another metal, or a laser within that range",
        )
    return float(np.interp(wavelength_nm, known, entry["n"])), float(np.interp(wavelength_nm, known, entry["k"]))


def material_row(material: BaseMaterial, bands_nm: tuple[float, float, float]) -> Float:
    """(ROW,) parameters at three wavelengths; the layout is in `render.bsdf`."""
    row = np.zeros(ROW)
    row[0] = LAMBERTIAN
    if isinstance(material, Conductor):
        across = material.roughness if material.roughness_across is None else material.roughness_across
        row[0], row[1], row[2] = CONDUCTOR, material.roughness, across
        for band, wavelength_nm in enumerate(bands_nm):
            row[4 + band], row[7 + band] = complex_index(material.metal, wavelength_nm)
    elif isinstance(material, Coated):
        row[0], row[1], row[2], row[3] = COATED, material.roughness, material.roughness, material.index
        row[10] = diffuse_reflectance(1.0 / material.index)
    return row
