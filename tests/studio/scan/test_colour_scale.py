"""Limits of colours: the share that they say, zero in the middle of an error, by hand what the hand says."""

from __future__ import annotations

import numpy as np
import pytest

from studio.scan.colour_scale import SHARES, ColourScale, tick


@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("about_zero", [True, False])
def test_the_limits_hold_the_share(share: float, about_zero: bool) -> None:
    values = np.random.default_rng(2).normal(3.0, 1.0, 20_000)
    values[::7] = np.nan
    low, high = ColourScale(about_zero, share).limits(values)
    known = values[np.isfinite(values)]
    within = 100.0 * np.mean((known >= low) & (known <= high))
    if about_zero:  # rounded up to a number that is read
        assert low == -high and within >= share - 0.01
    else:
        assert within == pytest.approx(share, abs=0.02)


def test_zero_is_white_and_beyond_the_limits_is_as_at_them() -> None:
    scale = ColourScale()
    colours = scale.colours(np.array([0.0, -5.0, 5.0, 9.0, np.nan]), -5.0, 5.0)
    assert colours[0].min() > 240 and np.array_equal(colours[2], colours[3])
    assert colours[1][2] > colours[1][0] and colours[2][0] > colours[2][2]
    assert colours[4].tolist() == [140, 140, 140]
    heights = ColourScale(about_zero=False).colours(np.linspace(2.0, 3.0, 11), 2.0, 3.0).astype(float)
    lightness = heights @ [0.2126, 0.7152, 0.0722]
    assert np.all(np.diff(lightness) > 0.0), "higher is lighter, without a colour"


def test_a_hand_moves_one_end_and_of_an_error_both() -> None:
    error = ColourScale().dragged((-10.0, 10.0), True, 4.0)
    assert error.limits(np.zeros(3)) == (-4.0, 4.0)
    assert ColourScale().dragged((-10.0, 10.0), False, -25.0).limits(np.zeros(3)) == (-25.0, 25.0)
    height = ColourScale(about_zero=False)
    assert height.dragged((2.0, 4.0), True, 3.0).limits(np.zeros(3)) == (2.0, 3.0)
    assert height.dragged((2.0, 4.0), False, 3.5).limits(np.zeros(3)) == (3.5, 4.0)
    # an end never passes the other
    low, high = height.dragged((2.0, 4.0), True, 1.0).limits(np.zeros(3))
    assert low == 2.0 and high > low
    assert error.automatic(90.0).by_hand is None


def test_nothing_to_colour_has_limits_too() -> None:
    for about_zero in (True, False):
        for values in (np.zeros(0), np.full(3, np.nan), np.zeros(5)):
            low, high = ColourScale(about_zero).limits(values)
            assert high > low


def test_ticks_are_short() -> None:
    assert [tick(value) for value in (0.0, 12.34, -0.01234, 123456.0)] == ["0", "+12.3", "\u22120.0123", "+123456"]
