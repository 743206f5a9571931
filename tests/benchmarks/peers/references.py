"""What each scene's image should be, and which of its pixels are judged.

s1 is integrated here from the formulas alone, with nothing of the renderer: Gauss-Legendre nodes in each pixel. s3 is a
path trace of the exact ball in float64, s4 particles through it and the plate (`peers.exact_ball`). s2 and s2-shiny are
our own converged images (`peers.converge`), noise about 0.6 % in the reflections: Mitsuba's particle tracer is no
reference there. Its fixed offset of ray origins makes the reflections 0.35 % too bright, some regions by 1 %, as
its own path tracer and ours agree, and the bead's two rims plainly wrong: their rows are left out for every engine.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from peers import scenes

FOLDER = Path(__file__).with_name("references")
WRONG_ROWS = {name: ((496, 503), (519, 528)) for name in ("s2", "s2-shiny")}
ENERGY = 0.999
"""The judged pixels are the brightest that hold this share of the light."""
NODES = 12
SHEET_END = 5.5
"""Sigmas from the sheet's centre beyond which s1 is dark; 4e-8 of the light."""


@dataclass(frozen=True)
class Reference:
    image: np.ndarray
    """(h, w) float64 radiance, W/(m^2 sr)."""
    line: np.ndarray
    """(h, w) bool: all lit pixels."""
    reflection: np.ndarray | None
    """(h, w) bool: pixels lit only by way of two surfaces or more, or the caustic."""


def reference(name: str) -> Reference | None:
    """None where no image exists that one could trust."""
    if name == "s1":
        image = plane_image()
        return Reference(image, brightest(image), None)
    path = FOLDER / f"{name}.npz"
    if not path.exists():
        return None
    stored = np.load(path)
    image = stored["img"].astype(np.float64)
    direct = stored["direct"].astype(np.float64)
    judged = np.ones(image.shape, bool)
    for first, last in WRONG_ROWS.get(name, ()):
        judged[first : last + 1] = False
    indirect = np.where(direct > 0.0, 0.0, image)
    return Reference(image, brightest(image) & judged, brightest(indirect) & judged)


def brightest(image: np.ndarray, energy: float = ENERGY) -> np.ndarray:
    """(h, w) bool: the fewest pixels that hold this share of the light."""
    values = np.sort(image[image > 0.0])[::-1]
    held = np.cumsum(values)
    return np.asarray(image >= values[np.searchsorted(held, energy * held[-1])])


def plane_image() -> np.ndarray:
    """s1: albedo / pi times the irradiance of the sheet on the plane, averaged over each pixel."""
    corner, right, far = (scenes.setting("s1").parts[0].vertices[i].astype(np.float64) for i in (0, 1, 2))
    normal = np.cross(right - corner, far - corner)
    normal /= np.linalg.norm(normal)
    rotation, origin = scenes.T_WORLD_LASER[:3, :3], scenes.T_WORLD_LASER[:3, 3]
    peak = scenes.POWER / (2 * math.sin(scenes.FAN / 2))

    def radiance(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        x, y = (u - (scenes.WIDTH - 1) / 2) / scenes.FOCAL, (v - (scenes.HEIGHT - 1) / 2) / scenes.FOCAL
        rays = np.stack([x, y, np.ones_like(x)], axis=-1)
        points = rays * (corner @ normal / (rays @ normal))[..., None]
        towards = points - origin
        lx, ly, lz = np.moveaxis(towards @ rotation, -1, 0)
        across, along = lx / lz, ly / lz
        intensity = peak * np.exp(-0.5 * (across / scenes.SIGMA) ** 2) / (scenes.SIGMA * math.sqrt(2 * math.pi))
        intensity = np.where(np.abs(along) <= math.tan(scenes.FAN / 2), intensity, 0.0)
        distance = np.linalg.norm(towards, axis=-1)
        return scenes.WALL.albedo / math.pi * intensity * np.abs(towards @ normal) / distance**3

    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    u, v = np.meshgrid(np.arange(scenes.WIDTH, dtype=float), np.arange(scenes.HEIGHT, dtype=float))
    # the sheet is a few pixels wide: the pixels whose corners are near it
    near = radiance(u, v) > scenes.POWER * math.exp(-0.5 * (SHEET_END + 2.0) ** 2)
    for shift in (-2, -1, 1, 2):
        near |= np.roll(near, shift, axis=1)
    image, rows, columns = np.zeros(u.shape), *np.nonzero(near)
    for i, wi in zip(nodes, weights, strict=True):
        for j, wj in zip(nodes, weights, strict=True):
            image[rows, columns] += 0.25 * wi * wj * radiance(columns + 0.5 * i, rows + 0.5 * j)
    return image
