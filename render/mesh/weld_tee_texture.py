"""Procedural albedo of the tee joint on its developed front: rust, a ground band along the seam, and the bead.

`python -m render.mesh.weld_tee_texture FOLDER` writes the images that the sample project uses.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float
from render.base.files import atomic_write
from render.mesh.texture import linear_to_srgb
from render.mesh.weld_tee import section
from render.scene.shape import WeldTee

RUST = ((0.38, 0.23, 0.16), (0.26, 0.18, 0.14))
"""Linear reflectance of bright and dark rust."""
GROUND = (0.52, 0.51, 0.50)
BEAD = (0.34, 0.34, 0.35)
RAGGED = 0.0015
"""Standard deviation of the ground band's edge, m."""


def weld_tee_mask(shape: WeldTee, size: tuple[int, int], seed: int = 1) -> NDArray[np.float32]:
    """(h, w) float32 of `size`, row 0 at v = 1: 1 on the ground band and the bead, 0 on rust, blended over 1 mm.

    The band's outer edges wander by RAGGED about `ground_band`; both repeat along u.
    """
    design = section(shape)
    s = _developed(shape, size)
    random = np.random.default_rng([seed, 0])
    step = shape.length / size[1]
    edges = [RAGGED * _smooth(random.standard_normal((1, size[1])), (0.0, 0.01), (1.0, step)) for _ in range(2)]
    inner, outer = design.base_front, design.base_front + design.bead_length
    # Distance into the band from its edge on either plate; the bead lies within both.
    into = np.minimum(s - (inner - shape.ground_band + edges[0]), outer + shape.ground_band + edges[1] - s)
    return np.clip(into / 0.001 + 0.5, 0.0, 1.0).astype(np.float32)


def weld_tee_texture(shape: WeldTee, size: tuple[int, int], seed: int = 1) -> NDArray[np.float32]:
    """(h, w, 3) float32 linear reflectance of `size`, row 0 at v = 1; the same for the same seed; repeats along u.

    Rust is a grainy, patchy mix of two tones, the ground band is brushed along the seam, the bead is darker.
    """
    design = section(shape)
    pitch = (design.developed / size[0], shape.length / size[1])
    random = np.random.default_rng([seed, 1])

    def noise(across: float, along: float) -> Float:
        return _smooth(random.standard_normal(size), (across, along), pitch)

    patches = 1.0 / (1.0 + np.exp(-1.5 * (noise(0.006, 0.006) + 0.6 * noise(0.0015, 0.0015))))
    grain = 1.0 + 0.06 * noise(0.0004, 0.0004)
    rust = grain[..., None] * (RUST[0] + patches[..., None] * np.subtract(RUST[1], RUST[0]))
    brushed = (1.0 + 0.07 * noise(0.0003, 0.02) + 0.03 * noise(0.01, 0.01))[..., None] * GROUND
    bead = (1.0 + 0.06 * noise(0.0008, 0.0008))[..., None] * BEAD

    s = _developed(shape, size)
    within = np.minimum(s - design.base_front, design.base_front + design.bead_length - s)
    on_bead = np.clip(within / 0.0005 + 0.5, 0.0, 1.0)[..., None]
    metal = brushed + on_bead * (bead - brushed)
    albedo = rust + weld_tee_mask(shape, size, seed)[..., None] * (metal - rust)
    return np.clip(albedo, 0.02, 0.95).astype(np.float32)


def write_textures(folder: Path, shape: WeldTee, size: tuple[int, int]) -> list[Path]:
    """Write weld_tee_albedo.png (sRGB, 8 bit) and weld_tee_mask.png (linear, 8 bit). InputError: not writable."""
    from PIL import Image

    albedo = np.round(linear_to_srgb(weld_tee_texture(shape, size)) * 255).astype(np.uint8)
    mask = np.round(weld_tee_mask(shape, size) * 255).astype(np.uint8)
    paths = [Path(folder) / "weld_tee_albedo.png", Path(folder) / "weld_tee_mask.png"]
    for path, image in zip(paths, (albedo, mask), strict=True):
        with atomic_write(path) as temporary:
            Image.fromarray(image).save(temporary, optimize=True)
    return paths


def _developed(shape: WeldTee, size: tuple[int, int]) -> Float:
    """(h, 1) m from the base plate's edge along the front, at the centres of rows."""
    return (1.0 - (np.arange(size[0])[:, None] + 0.5) / size[0]) * section(shape).developed


def _smooth(white: Float, lengths: tuple[float, float], pitch: tuple[float, float]) -> Float:
    """White noise (h, w) filtered by a Gaussian of standard deviations `lengths` m, periodic, scaled to unit variance.

    pitch: m between rows and between columns; a length of 0 leaves its axis alone.
    """
    spectrum = np.fft.rfft2(white)
    down = np.fft.fftfreq(white.shape[0], pitch[0])[:, None] * lengths[0]
    right = np.fft.rfftfreq(white.shape[1], pitch[1])[None, :] * lengths[1]
    smooth = np.fft.irfft2(spectrum * np.exp(-2.0 * np.pi**2 * (down**2 + right**2)), white.shape)
    return np.asarray((smooth - smooth.mean()) / smooth.std())


if __name__ == "__main__":
    for written in write_textures(Path(sys.argv[1]), WeldTee(), (1024, 2048)):
        print(written)
