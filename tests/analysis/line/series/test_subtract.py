"""A laser-off image taken away: what both images saturate is no laser light, what only the laser saturates is."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.line.series.subtract import subtract_off

Numbers = NDArray[np.uint8]
LAMP, CORE, LINE = np.s_[10:30, 40:70], np.s_[:, 100:103], np.s_[:, 98:105]


def photographs(channels: int) -> tuple[Numbers, Numbers]:
    """Laser on and off: a lamp that saturates both, a line whose core is saturated, a room of 40 DN."""
    off = np.full((60, 160), 40, np.uint8)
    off[LAMP] = 255
    on = off.copy()
    on[LINE] = 150
    on[CORE] = 255
    if channels == 1:
        return on, off
    colour_on, colour_off = np.stack([off, on, off], axis=2), np.stack([off, off, off], axis=2)
    colour_on[:, 101] = 255  # white, where the light is brightest
    return colour_on, colour_off


def test_a_lamp_that_saturates_both_images_is_no_laser_light() -> None:
    difference, full = subtract_off(*photographs(1))
    assert full == 255.0
    assert np.all(difference[LAMP] == 0.0)
    assert np.all(difference[:, 98:100] == 110.0)


def test_where_only_the_laser_saturates_the_difference_is_at_least_this_much() -> None:
    difference, full = subtract_off(*photographs(1))
    assert np.all(difference[CORE] == full)


def test_one_saturated_channel_makes_no_spike_in_the_others_mean() -> None:
    difference, _ = subtract_off(*photographs(3))
    assert np.all(difference[LAMP] == 0.0)
    assert np.all(difference[:, 100] == (0.0, 215.0, 0.0))  # green alone: its plain difference
    assert np.all(difference[:, 101] == 255.0)  # all three: the line's white core


def test_without_room_in_the_off_image_a_saturated_pixel_is_not_taken_for_the_full_scale() -> None:
    on, off = photographs(1)
    off[:, 100:103] = 240
    difference, _ = subtract_off(on, off)
    assert np.all(difference[CORE] == 15.0)
