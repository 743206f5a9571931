"""What is said of the brightest pixel is of light that was rendered to be known."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np

from render.frame import Frame
from render.plan import GroupQuality
from render.sensor.develop import Image
from studio.scan.brightness import brightness

ROWS, COLUMNS = 40, 90
LASERS = ("laser", "laser 2")


def image(stray: int) -> Image:
    """A line of 3051 DN at column 30, and one pixel far from it."""
    pixels = np.full((ROWS, COLUMNS), 64, np.uint16)
    pixels[:, 30], pixels[5, 80] = 3051, stray
    return Image(pixels, 12, 1.0, 64.0, 4095.0, 2.5, None, 1e-3)


def frame(of: str) -> Frame:
    index = np.arange(ROWS, dtype=np.int32)
    curve = SimpleNamespace(axis="rows", index=index, position=np.full(ROWS, 30.2))
    quality = {name: GroupQuality("indirect", name, 0.02, 0.1, 1e6, "light paths", of=of) for name in LASERS}
    made = SimpleNamespace(curves=(curve, curve), quality_of=lambda group, laser: quality[laser])
    return cast(Frame, made)


def test_light_that_a_goal_in_depth_leaves_as_noise_is_not_the_brightest_pixel() -> None:
    """Of two mirrored lasers one had 3051 DN and the other all 4095: a path of reflected light, far from the line."""
    first, second = brightness([image(200), image(4095)], LASERS, frame("line")).splitlines()
    assert first == "laser: brightest pixel of all 3051 DN, 75% of full"
    assert second.startswith("laser 2: brightest pixel at the line 3051 DN, 75% of full, elsewhere 4095 DN, where")


def test_of_a_goal_in_the_image_every_pixel_counts() -> None:
    told = brightness([image(4095)], ["laser"], frame("image"))
    assert told == "brightest pixel of all 4095 DN, 100% of full, 0.03% of the image's pixels saturated"
