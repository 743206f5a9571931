"""The part of the photographs that is looked at: a rectangle, and a mask."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from render.base.errors import InputError
from studio.photographs.image_files import load_photograph

SMALLEST = 8
"""px a side: less has no line on level ground."""


@dataclass(frozen=True)
class Region:
    """Of images of any size; empty: all of them."""

    box: tuple[int, int, int, int] | None = None
    """x, y, width, height, px."""
    open: NDArray[np.bool_] | None = None
    """(h, w) of the whole image: where the mask is not black."""
    source: str = ""
    """The mask's file."""

    @property
    def corner(self) -> tuple[int, int]:
        """(x, y) of the part's first pixel."""
        return (0, 0) if self.box is None else self.box[:2]

    def part(self, image: NDArray[Any]) -> NDArray[Any]:
        """Image (h, w, ...) -> its rectangle. InputError: the rectangle or the mask does not fit the image."""
        height, width = image.shape[:2]
        if self.open is not None and self.open.shape != (height, width):
            raise InputError(
                "the mask is of another size than the image",
                where=f"--mask {self.source}",
                found=f"{self.open.shape[1]} x {self.open.shape[0]} px",
                allowed=f"{width} x {height} px",
            )
        if self.box is None:
            return image
        x, y, w, h = self.box
        if x + w > width or y + h > height:
            raise InputError(
                "the region leaves the image",
                where="--roi",
                found=f"{x},{y},{w},{h}",
                allowed=f"x + width up to {width}, y + height up to {height}",
            )
        return image[y : y + h, x : x + w]

    def scan_lines(self, count: int, axis: str) -> int:
        """How many of an image's rows or columns are in its rectangle."""
        return count if self.box is None else self.box[3 if axis == "rows" else 2]

    @property
    def closed(self) -> NDArray[np.bool_] | None:
        """(h, w) of the part: what the mask leaves out."""
        return None if self.open is None else ~self.part(self.open)

    def told(self) -> list[tuple[str, str]]:
        """For a person."""
        found = []
        if self.box is not None:
            x, y, w, h = self.box
            found.append(("region", f"{w} x {h} px from ({x}, {y})"))
        if self.open is not None:
            found.append(("mask", f"{Path(self.source).name}, {self.open.mean():.0%} of the image"))
        return found


def region_of(roi: str | None, mask: Path | None) -> Region:
    """ "x,y,w,h" and an image file that is not black where to look. InputError names the option."""
    box = None
    if roi is not None:
        try:
            x, y, w, h = (int(part) for part in roi.split(","))
        except ValueError:
            raise InputError(
                "not a region", where="--roi", found=roi, allowed='x,y,width,height in px, such as "100,0,640,480"'
            ) from None
        if min(x, y) < 0 or min(w, h) < SMALLEST:
            allowed = f"x and y from 0 on, width and height of {SMALLEST} px or more"
            raise InputError("the region is out of range", where="--roi", found=roi, allowed=allowed)
        box = (x, y, w, h)
    if mask is None:
        return Region(box)
    pixels = load_photograph(mask)
    seen = (pixels if pixels.ndim == 2 else pixels.max(axis=2)) > 0
    if not seen.any():
        raise InputError("the mask is black everywhere", where=f"--mask {mask}", cure="paint white where to look")
    return Region(box, seen, str(mask))
