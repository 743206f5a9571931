"""What colour a mesh file brings: one reflectance, one texture, or a colour for each triangle."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float32
from render.base.errors import InputError
from render.mesh.texture import MAX_PIXELS, linear_reflectance

Colour = tuple[float, float, float]

MAX_UV = 1e6
"""Largest UV: beyond it float32 does not resolve a position within a texture."""
PALETTE_WIDTH = 4096
"""A power of two, so that texel centres are exact in float32."""


@dataclass(frozen=True)
class Look:
    """How one part of a file looks; at most one of colour, facets and texture is set."""

    uv: Float32 | None = None
    """(t, 3, 2)."""
    colour: Colour | None = None
    facets: Float32 | None = None
    """(t, 3) linear reflectance of each triangle."""
    texture: Float32 | None = None
    """(h, w, 3) linear reflectance."""


def part_look(geometry: Any, triangles: NDArray[np.int64], *, colours: bool, linear_colours: bool, where: str) -> Look:
    """Look of one trimesh geometry; without `colours` its UV only. linear_colours: vertex colours as glTF's, not sRGB.

    A texture replaces the plain colour of an MTL material, and multiplies that of a glTF one (glTF 2.0, 3.9.2).
    """
    visual = geometry.visual
    if not colours:
        return Look(uv=part_uv(geometry, triangles))
    if visual.kind in ("face", "vertex"):
        codes = np.asarray(visual.face_colors if visual.kind == "face" else visual.vertex_colors)[:, :3]
        values = linear_reflectance(codes.astype(np.uint8), srgb=not linear_colours)
        facets = values if visual.kind == "face" else values[triangles].mean(axis=1)
        same = len(facets) > 0 and bool((facets == facets[0]).all())
        return Look(colour=as_colour(facets[0])) if same else Look(facets=facets)
    if visual.kind != "texture":
        return Look()
    uv = part_uv(geometry, triangles)
    material = visual.material
    if hasattr(material, "baseColorTexture"):
        factor = material.baseColorFactor
        colour: Any = np.ones(3) if factor is None else np.asarray(factor[:3], dtype=np.float64) / 255
        image = material.baseColorTexture
    else:
        colour = material.kwargs.get("kd")  # as written; trimesh rounds its own copy to 8 bit
        colour = None if np.shape(colour) != (3,) else np.asarray(colour, dtype=np.float64)
        image = material.image
    if image is None or uv is None:
        return Look(uv=uv, colour=None if colour is None else as_colour(np.clip(colour, 0.0, 1.0)))
    texture = _linear_image(image, where)
    if hasattr(material, "baseColorTexture"):
        texture = texture * colour.astype(np.float32)
    return Look(uv=uv, texture=texture)


def part_uv(geometry: Any, triangles: NDArray[np.int64]) -> Float32 | None:
    """(t, 3, 2) UV of one trimesh geometry, or None where it has none or they are not usable numbers."""
    uv = getattr(geometry.visual, "uv", None)
    if uv is None or np.shape(uv) != (len(geometry.vertices), 2) or not (np.abs(uv) <= MAX_UV).all():
        return None
    return np.asarray(uv, dtype=np.float32)[triangles]


def merged_look(looks: Sequence[Look], counts: Sequence[int], where: str) -> Look:
    """One look for all parts, of counts[i] triangles each; parts that differ get one colour for each triangle."""
    first = looks[0]
    uv = [look.uv for look in looks if look.uv is not None]
    all_uv = np.concatenate(uv) if len(uv) == len(looks) else None
    if all(look.colour is None and look.facets is None and look.texture is None for look in looks):
        return Look(uv=all_uv)
    if first.colour is not None and all(look.colour == first.colour for look in looks):
        return Look(uv=all_uv, colour=first.colour)
    if first.texture is not None and all(_same(look.texture, first.texture) for look in looks):
        return Look(uv=all_uv, texture=first.texture)
    if any(look.texture is not None for look in looks):
        warnings.warn(
            f"{where}: the file has several textures or materials; each triangle gets the colour at its centre",
            stacklevel=2,
        )
    return palette(np.concatenate([_facet_colours(look, count) for look, count in zip(looks, counts, strict=True)]))


def palette(facets: Float32) -> Look:
    """A texture with one texel for each triangle's colour, (t, 3), and UV that meets the texel's centre."""
    height = 1 << max(0, -(-len(facets) // PALETTE_WIDTH) - 1).bit_length()
    texture = np.zeros((height * PALETTE_WIDTH, 3), dtype=np.float32)
    texture[: len(facets)] = facets
    row, column = np.divmod(np.arange(len(facets)), PALETTE_WIDTH)
    centre = np.stack([(column + 0.5) / PALETTE_WIDTH, 1.0 - (row + 0.5) / height], axis=1).astype(np.float32)
    return Look(uv=np.repeat(centre[:, None, :], 3, axis=1), texture=texture.reshape(height, PALETTE_WIDTH, 3))


def as_colour(values: NDArray[Any]) -> Colour:
    """(3,) values as a plain tuple."""
    return float(values[0]), float(values[1]), float(values[2])


def _facet_colours(look: Look, count: int) -> Float32:
    if look.facets is not None:
        return look.facets
    if look.texture is None or look.uv is None:
        return np.full((count, 3), 0.5 if look.colour is None else look.colour, dtype=np.float32)
    height, width = look.texture.shape[:2]
    centre = look.uv.astype(np.float64).mean(axis=1) % 1.0
    column = np.minimum((centre[:, 0] * width).astype(np.int64), width - 1)
    row = np.minimum(((1.0 - centre[:, 1]) * height).astype(np.int64), height - 1)
    return np.asarray(look.texture[row, column])


def _same(a: Float32 | None, b: Float32) -> bool:
    return a is not None and a.shape == b.shape and np.array_equal(a, b)


def _linear_image(image: Any, where: str) -> Float32:
    """Linear reflectance of a Pillow image that a mesh file brought, sRGB encoded."""
    name = image.info.get("file_path", "embedded image")
    if image.width * image.height > MAX_PIXELS:
        found = f"{image.width} x {image.height} pixels"
        raise InputError("the texture is too large", where=f"{where}: {name}", found=found)
    try:
        return linear_reflectance(np.asarray(image.convert("RGB")))
    except MemoryError:
        raise
    except Exception as error:  # Pillow decodes only now, and raises many kinds on damaged data, in words of its own
        found = "an image that is cut short or damaged"
        raise InputError("the texture cannot be read", where=f"{where}: {name}", found=found) from error
