"""Our line laser as Mitsuba knows one: a projector whose picture is the sheet."""

import math

import numpy as np
import pytest

mitsuba = pytest.importorskip("mitsuba", reason="make validate installs it")

REACH = 4.5
"""The projector's picture ends this many sigmas from the sheet's centre; 7e-6 of the light lies beyond."""


def projector(laser, texels_across=256):
    """A Mitsuba projector with the laser's flux density; its texture holds irradiance on z = 1 over pi."""
    T = mitsuba.ScalarTransform4f
    sigma = math.tan(laser.sheet.full_angle / 2) / 2
    half = REACH * sigma
    # square texels: the aspect of the picture is the aspect of its field of view
    texels_along = round(texels_across * laser.tan_half_fan / half)
    x = ((np.arange(texels_across) + 0.5) / texels_across * 2 - 1) * half
    g = np.exp(-0.5 * (x / sigma) ** 2) / (sigma * math.sqrt(2 * math.pi))
    picture = np.tile(laser.power * g / (2 * laser.tan_half_fan) / math.pi, (texels_along, 1)).astype(np.float32)
    pose = laser.T_rig_laser.matrix
    origin, axis, along = pose[:3, 3], pose[:3, 2], pose[:3, 1]
    return {
        "type": "projector",
        "to_world": T().look_at(origin=list(origin), target=list(origin + axis), up=list(along)),
        "fov": 2 * math.degrees(math.atan(half)),
        "fov_axis": "x",
        "irradiance": {
            "type": "bitmap",
            "bitmap": mitsuba.Bitmap(np.repeat(picture[..., None], 3, axis=2)),
            "raw": True,
            "wrap_mode": "clamp",
        },
    }
