"""What a colour camera's mosaic adds to sigma: an error that no scatter along an upright line can show.

Red and blue are seen on every other pixel of a row, and filled in between. Tone curve, sharpening and JPEG after that
leave a profile that is wrong in the same way on all scan lines that cross the mosaic at one place. Lines of 1.5 to 3 px
in red, green and blue, through the mosaics, tone curves and JPEGs of a webcam and a phone, were off on average by 0.01
to 0.03 px in luminance, but by 0.1 in a red laser's after a JPEG of quality 70; by 0.015 to 0.08 in green, 0.01 to
0.05 in the mean of the channels and 0.03 to 0.3 in red or blue alone; where they saturate, by more in those that hold
most of the green pixels as well, 0.03 to 0.05 px at three times the full well, more above.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from analysis.line.result import Flag, Line
from studio.photographs.evidence import Colour
from studio.photographs.laser_light import Channel

FILLED_IN: dict[Channel, float] = {
    "luminance": 0.03,
    "green": 0.03,
    "mono": 0.04,
    "red": 0.15,
    "blue": 0.15,
    "difference": 0.15,
}
"""px, by the channel that measures."""
COMPRESSED = 0.1
"""px at least, in the luminance of a laser that is seen on every other pixel alone, after a strong JPEG."""
CLIPPED = 0.08
"""px at least, where the mosaic is clipped before it is filled in."""


def filled_in(channel: Channel, colour: Colour) -> float:
    """px that a mosaic moves the line of a laser of some colour by, measured in a channel."""
    usual = FILLED_IN[channel]
    return max(usual, COMPRESSED) if channel == "luminance" and colour in ("red", "blue") else usual


def with_mosaic(line: Line, channel: Channel, colour: Colour) -> Line:
    """The line of a laser of some colour, measured in a channel of an image whose colour is coarse, with larger sigmas.

    All scan lines err alike by that much: so the correlation length becomes as long as the line, in its share.
    """
    usual = filled_in(channel, colour)
    extra = np.where(line.flag == Flag.SATURATED, max(usual, CLIPPED), usual) ** 2
    told = np.ones_like(line.u) if line.length_apart is None else line.length_apart
    variance = line.variance_apart
    length = (variance * told + extra * max(int(line.valid.sum()), 1)) / (variance + extra)
    return replace(line, sigma_u=np.sqrt(line.sigma_u**2 + extra), length_apart=length)
