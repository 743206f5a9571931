"""How bright the images of a render are: the brightest pixel, and what is saturated. Qt-free."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from render.base.arrays import Bool
from render.frame import Frame, LaserCurve
from render.sensor.develop import Image

BESIDE = 8
"""px on either side of the exact line, whose light a goal in depth renders to be known."""


def brightness(images: Sequence[Image], names: Sequence[str], frame: Frame) -> str:
    """A line for each image of a frame, one a laser: its brightest pixel, be it the line's or not, and how much of it
    is saturated. Of a goal in depth the line's is told apart where light that is not rendered to be known is brighter.
    """
    lines = []
    for i, (image, name) in enumerate(zip(images, names or [""], strict=True)):
        top, full = int(image.pixels.max()), float(np.mean(image.pixels >= image.saturation))
        saturated = f", {full:.2%} of the image's pixels saturated" if full > 0.0 else ""
        prefix, where, elsewhere = f"{name}: " if len(images) > 1 else "", "of all", ""
        reflected = frame.quality_of("indirect", name)
        if reflected is not None and reflected.of == "line" and i < len(frame.curves):
            near = _about(frame.curves[i], image.pixels.shape)
            if near.any() and (line := int(image.pixels[near].max())) < top:
                elsewhere = f", elsewhere {top} DN, where a goal in depth leaves reflections as noise"
                where, top = "at the line", line
        share = f"{top / image.saturation:.0%} of full"
        lines.append(f"{prefix}brightest pixel {where} {top} DN, {share}{elsewhere}{saturated}")
    return "\n".join(lines)


def _about(curve: LaserCurve, shape: tuple[int, ...]) -> Bool:
    """(h, w) pixels within `BESIDE` of the exact line."""
    near = np.zeros(shape, np.bool_)
    along = near if curve.axis == "rows" else near.T
    seen = np.isfinite(curve.position)
    across = np.rint(curve.position[seen]).astype(int)[:, None] + np.arange(-BESIDE, BESIDE + 1)
    along[curve.index[seen][:, None], across.clip(0, along.shape[1] - 1)] = True
    return near
