"""Pictures for a screen."""

from __future__ import annotations

import numpy as np
import pytest

from render.output.tone_mapping import colour, colour_table, grey, mapped, pyramid, white_level


def red(picture):
    return (picture >> 16) & 255


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_grey_runs_from_black_to_white_and_clips(dtype):
    image = np.array([[0, 10, 60, 110, 200]], dtype=dtype)
    assert red(grey(image, 10, 110)).tolist() == [[0, 0, 128, 255, 255]]
    assert np.all(grey(image, 10, 110) >> 24 == 255)


def test_bright_lifts_a_quarter_to_a_half():
    assert red(grey(np.array([[0.25]], np.float32), 0, 1, bright=True))[0, 0] == 128


def test_nan_is_black_in_grey_and_empty_in_a_colour_map():
    image = np.array([[np.nan, 1.0]], np.float32)
    assert red(grey(image, 0, 1)).tolist() == [[0, 255]]
    table = colour_table("viridis")
    assert mapped(image, 0, 1, table, 0xFF123456).tolist() == [[0xFF123456, int(table[-1])]]


def test_colour_keeps_its_channels_apart():
    image = np.array([[[1.0, 0.5, 0.0]]], np.float32)
    assert colour(image, 1.0)[0, 0] == 0xFFFF8000


def test_a_pyramid_halves_and_keeps_the_mean():
    random = np.random.default_rng(1)
    image = random.integers(0, 256, (1031, 1200)).astype(np.uint8)
    levels = pyramid(grey(image, 0, 255))
    assert [level.shape for level in levels] == [(1031, 1200), (516, 600), (258, 300)]
    # the mean of 1.2 million flat bytes has a standard deviation of 0.07; rounding twice adds less than one
    assert red(levels[-1]).mean() == pytest.approx(image.mean(), abs=0.5)


def test_the_white_level_ignores_what_is_dark():
    image = np.zeros((400, 400), np.float32)
    image[:, 200:204] = 2.0
    assert white_level(image) == 2.0 and white_level(np.zeros((8, 8), np.float32)) == 1.0
