"""A render as a row of the list of renders: its title, two lines about it, and its thumbnail."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QSize

from render.output.tone_mapping import Picture, grey
from render.plan import GroupQuality
from studio.qt.core.render import Render
from studio.qt.render.kept_list import Entry
from studio.scan.kept_renders import Kept
from studio.scan.remarks import scale_name

THUMBNAIL = QSize(48, 40)
"""As high as the text beside it."""
SAMPLED = 512
"""Pixels a side that a thumbnail looks at."""


def title(render: Entry) -> str:
    """As the list shows it."""
    return render.name if isinstance(render, Kept) else render.name or f"Render {render.number}"


def named(render: Render) -> str:
    """Its title, with its image scale where that is not the scanner's."""
    return title(render) + (f" ({render.scanner_scale:.3g} x)" if render.scanner_scale != 1.0 else "")


def describe(render: Render) -> str:
    """Size, time and quality, in one line."""
    ambient, settings = render.frame.quality_of("ambient"), render.project.render
    asked = f" reached, {settings.laser_error:.2%} asked" if settings.goal is None else " reached by the depth's goal"
    parts = [*_size_and_time(render), *(one + asked for one in _laser(render))]
    if ambient is not None:
        # fewer than each pixel was to have: the others take theirs from neighbours
        few = ", as most are interpolated" * (ambient.work < settings.ambient_samples)
        parts.append(
            f"ambient {_samples(ambient)} samples a pixel reached on average, {settings.ambient_samples} asked{few}"
        )
    return ", ".join(parts)


def in_short(render: Render) -> list[str]:
    """The same in two lines that a narrow list has room for."""
    ambient = render.frame.quality_of("ambient")
    quality = [*_laser(render), *([] if ambient is None else [f"ambient {_samples(ambient)}/px"])]
    reached = f"reached: {', '.join(quality)}" if quality else ""
    return [", ".join(_size_and_time(render)), reached]


def _samples(ambient: GroupQuality) -> str:
    return f"{ambient.work:.{0 if ambient.work >= 10.0 else 1}f}"


def _laser(render: Render) -> list[str]:
    errors = [
        one.error if one.image_error is None else one.image_error
        for one in render.frame.quality
        if one.group == "direct"
    ]
    return [f"laser {max(errors):.2%}"] if errors else []


def _size_and_time(render: Render) -> list[str]:
    height, width = render.frame.shape
    small = scale_name(render.scanner_scale)
    parts = [f"{width} x {height}" + (f", {small}" if small else "")]
    if render.scan is not None:
        parts.insert(0, f"step {render.frame.step + 1} of {render.scan.count}")
    parts.append(f"{sum(render.frame.seconds.values()):.1f} s")
    if not render.final:
        parts.append("under way" if render.refining else "stopped early, Continue goes on")
    return parts


def thumbnail(render: Render) -> Picture | None:
    """A small picture of the developed image, the brightest of each block so that the line stays; None: not yet."""
    if not render.images:
        return None
    image = render.images[0]
    pixels = image.grey
    stride = max(1, max(pixels.shape) // SAMPLED)
    pixels = pixels[::stride, ::stride]
    block = max(1, min(pixels.shape[1] // THUMBNAIL.width(), pixels.shape[0] // THUMBNAIL.height()))
    rows, columns = pixels.shape[0] // block, pixels.shape[1] // block
    blocks = pixels[: rows * block, : columns * block].reshape(rows, block, columns, block)
    return grey(np.ascontiguousarray(blocks.max(axis=(1, 3))), image.black_level, image.saturation, bright=True)
