"""Colour photographs of a laser line with truth, as a phone's camera takes them: halo, white core, clutter, JPEG."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

HEIGHT, WIDTH = 300, 400


@dataclass(frozen=True)
class Scene:
    """Peak in DN before clipping of the laser's own colour; the others see `crosstalk` of it."""

    colour: int = 1
    peak: float = 160.0
    sigma: float = 2.5
    crosstalk: float = 0.15
    room: float = 0.0
    halo: float = 0.02
    slope: float = 0.1
    bend: float = 12.0

    @property
    def centre(self) -> NDArray[np.float64]:
        """(HEIGHT,) column of the line on each row."""
        rows = np.arange(HEIGHT)
        return 170.0 + self.slope * rows + self.bend * np.sin(rows / 60.0)


def photograph(scene: Scene, seed: int, laser: bool = True) -> NDArray[np.uint8]:
    """(HEIGHT, WIDTH, 3) RGB. The room: an even wall, upright furniture that is brighter than the line, a window."""
    rng = np.random.default_rng(seed)
    x = np.arange(WIDTH)
    image = np.full((HEIGHT, WIDTH, 3), 6.0)
    if scene.room:
        image += scene.room * np.array([1.0, 0.95, 0.85])
        for at, width, shade in ((40, 6, 1.2), (95, 14, -0.5), (300, 5, 1.6), (350, 25, 0.8)):
            image[:, at : at + width] += scene.room * shade * np.array([1.0, 0.97, 0.9])
        image[20:90, 310:345] = 400.0
    if laser:
        off = x - scene.centre[:, None]
        shape = np.exp(-0.5 * (off / scene.sigma) ** 2)
        shape += scene.halo * np.exp(-0.5 * (off / (8.0 * scene.sigma)) ** 2)
        weights = np.full(3, scene.crosstalk)
        weights[scene.colour] = 1.0
        image += scene.peak * shape[..., None] * weights
    noisy = image + rng.normal(size=image.shape) * np.sqrt(1.5 + 0.05 * image)
    return np.clip(np.round(noisy), 0, 255).astype(np.uint8)


def write(path: Any, image: NDArray[Any], quality: int | None = None) -> None:
    """A PNG, or a JPEG with its colour at half resolution."""
    options = []
    if quality is not None:
        options = [cv2.IMWRITE_JPEG_QUALITY, quality, cv2.IMWRITE_JPEG_SAMPLING_FACTOR, 0x221111]
    assert cv2.imwrite(str(path), image[..., ::-1] if image.ndim == 3 else image, options)
