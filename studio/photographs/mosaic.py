"""What a colour camera's mosaic adds to sigma: an error that no scatter along an upright line can show.

Red and blue are seen on every other pixel of a row, and filled in between. Tone curve, sharpening and JPEG after that
leave a profile that is wrong in the same way on all scan lines that cross the mosaic at one place. On rendered webcams
with lines of 1.5 px the position in green was off by 0.01 to 0.02 px, in all channels together by 0.07 to 0.16, in red
or blue alone by 0.1 to 0.3.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from analysis.line.result import Line
from studio.photographs.laser_light import Channel

FILLED_IN: dict[Channel, float] = {"mono": 0.1, "luminance": 0.1, "red": 0.15, "green": 0.02, "blue": 0.15}
"""px, by the channel that measures."""


def with_mosaic(line: Line, channel: Channel) -> Line:
    """The line, measured in a channel of an image whose colour is coarse, with larger sigmas.

    All scan lines err alike by that much: so the correlation length becomes as long as the line, in its share.
    """
    extra = FILLED_IN.get(channel, 0.0) ** 2
    told = np.ones_like(line.u) if line.length_apart is None else line.length_apart
    variance = line.variance_apart
    length = (variance * told + extra * max(int(line.valid.sum()), 1)) / (variance + extra)
    return replace(line, sigma_u=np.sqrt(line.sigma_u**2 + extra), length_apart=length) if extra else line
