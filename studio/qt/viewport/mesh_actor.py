"""How a body looks in the 3D view: its facets in the colour or texture of its material; glass is seen through."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyvista as pv
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

from render.material.bsdf import CONDUCTOR, DIELECTRIC, EMITTED, EMITTER
from render.world.triangles import Surface

GLASS_OPACITY = 0.35


def mesh_actor(surface: Surface) -> vtkActor:
    """Triangles with their colour or texture. Flat facets: smooth shading would hide what the light really meets."""
    textured = surface.texture_shape[0, 1] > 0
    vertices = surface.vertices[surface.triangles.ravel()] if textured else surface.vertices
    triangles = np.arange(len(vertices)).reshape(-1, 3) if textured else surface.triangles
    cells = np.empty((len(triangles), 4), dtype=np.int64)
    cells[:, 0], cells[:, 1:] = 3, triangles
    data = pv.PolyData(vertices.astype(np.float32), faces=cells.ravel())
    mapper = vtkPolyDataMapper()
    mapper.ScalarVisibilityOff()
    actor = vtkActor()
    actor.SetMapper(mapper)
    look = actor.GetProperty()
    look.SetInterpolationToFlat()
    look.SetAmbient(0.18)
    look.SetDiffuse(0.85)
    if textured:
        start, height, width = surface.texture_shape[0]
        texels = surface.textures[3 * start : 3 * (start + height * width)]
        image = encoded(texels.reshape(height, width, 3))
        data.active_texture_coordinates = surface.uv.reshape(-1, 2)
        texture = pv.Texture((255.0 * image).astype(np.uint8))
        texture.SetRepeat(True)
        actor.SetTexture(texture)
    else:
        look.SetColor(*(float(c) for c in encoded(surface.albedo[0] * _mirrored(surface))))
    if surface.rows[0, 0] == DIELECTRIC:
        look.SetOpacity(GLASS_OPACITY)
    elif surface.rows[0, 0] == EMITTER:
        shine = surface.rows[0, EMITTED : EMITTED + 3]
        look.SetColor(*(float(c) for c in encoded(shine / max(float(shine.max()), 1e-30))))
        look.SetAmbient(1.0)
        look.SetDiffuse(0.0)
    mapper.SetInputData(data)
    return actor


def _mirrored(surface: Surface) -> Any:
    """(3,) what a metal reflects straight back, by its index n + i k; 1 for the rest."""
    row = surface.rows[0]
    if row[0] != CONDUCTOR:
        return 1.0
    n, k = row[4:7], row[7:10]
    return ((n - 1.0) ** 2 + k**2) / ((n + 1.0) ** 2 + k**2)


def encoded(linear: Any) -> Any:
    """Reflectance as the screen shows it (a power of 1 / 2.2)."""
    return np.clip(linear, 0.0, 1.0) ** (1.0 / 2.2)
