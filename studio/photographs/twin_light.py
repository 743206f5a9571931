"""How the photographs of a project's sensor tell light: numbers linear in it, of one channel, and what they count.

A raw image is such numbers as it is. A photograph is taken back through its tone curve, 0..255 DN, in the colour that
the laser lights most; what else was done to it, the twin's rehearsal does as well (`rehearsal.py`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float
from render.sensor.processing import linear_light
from render.sensor.response import laser_response
from render.sensor.sensor import Sensor
from studio.photographs.evidence import COLOURS
from studio.photographs.laser_light import LOSSY_FULL
from studio.project.project import Project

FULL = 255.0
"""DN of a photograph's full scale."""


@dataclass(frozen=True)
class Numbers:
    """What a photograph's numbers mean, levels in DN."""

    channel: Literal["mono", "red", "green", "blue"]
    black: float
    top: float
    """From which on they are clipped."""
    gain: float
    """DN/e-, as the project has it."""
    share: float
    """White balance of the channel."""


def numbers_of(project: Project, laser: int) -> Numbers:
    """Those of the project's sensor, for one of its lasers."""
    sensor = project.sensor
    if sensor.processing is None:
        return Numbers("mono", sensor.black_level, 2.0**sensor.bits - 1.0, sensor.dn_per_electron, 1.0)
    top = FULL if sensor.processing.jpeg_quality is None else LOSSY_FULL
    top = FULL * float(linear_light(np.array(top), sensor.processing))
    if sensor.colour == "mono":
        return Numbers("mono", 0.0, top, FULL / electrons_of(sensor), 1.0)
    response = laser_response(sensor, project.scene.lasers[laser].wavelength_nm).ravel()
    balance = [sensor.processing.white_balance["RGB".index(one)] for one in sensor.pattern]
    place = int(np.argmax(response * balance))
    channel = COLOURS["RGB".index(sensor.pattern[place])]
    return Numbers(channel, 0.0, top, FULL * balance[place] / electrons_of(sensor), balance[place])


def electrons_of(sensor: Sensor) -> float:
    """Of a pixel at full scale."""
    top = min(2.0**sensor.bits - 1.0, sensor.dn_per_electron * sensor.full_well + sensor.black_level)
    return (top - sensor.black_level) / sensor.dn_per_electron


def light_of(image: NDArray[Any], sensor: Sensor, channel: str) -> Float:
    """Image (h, w) or (h, w, 3) -> (h, w) DN that are linear in light, of one channel."""
    one = image if image.ndim == 2 else image[..., COLOURS.index(channel)]
    if sensor.processing is None:
        return np.asarray(one, np.float64)
    return FULL * linear_light(one, sensor.processing)
