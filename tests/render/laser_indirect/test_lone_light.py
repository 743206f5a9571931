"""What one path alone made a peak of is spread; what many passes found, and the line itself, stay as they are."""

from __future__ import annotations

import numpy as np
import pytest

from render.importance import Importance
from render.laser_indirect.accumulator import Accumulator
from render.laser_indirect.connection_buffer import PassBuffer
from render.laser_indirect.guiding import BINS
from render.laser_indirect.integrator import empty_buffer, with_lone_spread
from render.laser_indirect.lone_light import SPREAD_SIGMA, spread_lone
from tests.render.laser_indirect.test_accumulator import nothing

SHAPE = HEIGHT, WIDTH = 150, 200
LINE = slice(96, 104)
RISE = 0.1
"""Weight of light beside the line: from 10 W/(m^2 sr) on it is a peak."""
PASSES, WAVES = 8, 2
SPOT = (70, 30)
GLOW = 1e-3


def accumulator() -> Accumulator:
    found = nothing(HEIGHT * WIDTH)
    weight = np.zeros(SHAPE, np.float32)
    weight[:, LINE] = np.linspace(-1.0, 1.0, 8)
    found.aim_at(Importance((weight,), np.abs(weight), "rows", (np.full(SHAPE, RISE, np.float32),)), 0)
    return found


def wave(spot: tuple[int, int], heights: list[float]) -> list[PassBuffer]:
    """Passes of a faint glow, each with its own light in one pixel."""
    buffers = [empty_buffer(HEIGHT * WIDTH) for _ in range(PASSES)]
    for buffer, height in zip(buffers, heights, strict=True):
        buffer.image[:], buffer.touched[:] = GLOW, True
        buffer.image.reshape(SHAPE)[spot] += height
    return buffers


def radiance_of(spot: tuple[int, int], heights: list[list[float]]) -> tuple[np.ndarray, float | None, np.ndarray]:
    """With single passes spread, the share that was, and as the passes have it."""
    found = accumulator()
    for one in heights:
        found.add(wave(spot, one), np.zeros((PASSES, 0, BINS)))
    return *with_lone_spread(found, SHAPE), found.radiance(SHAPE)


def test_a_peak_of_one_path_is_spread_and_its_light_stays() -> None:
    """Of 10,135 points of a cylinder 11 were wrong by 52 mm, for a bright pixel that no other render had."""
    heights = [[0.0] * PASSES for _ in range(WAVES)]
    heights[1][3] = 500.0
    found, share, plain = radiance_of(SPOT, heights)
    assert plain[SPOT] == pytest.approx(500.0 / (PASSES * WAVES) + GLOW)
    assert found[SPOT] < 2e-3 * plain[SPOT] and found.min() > 0.9 * GLOW
    assert found.sum(dtype=float) == pytest.approx(plain.sum(dtype=float), rel=1e-5)
    assert share == pytest.approx((plain[SPOT] - GLOW) / plain.sum(dtype=float), rel=1e-3)
    there = np.argwhere(found - GLOW > 0.02 * (found - GLOW).max())
    assert np.abs(there - SPOT).max() < 4.0 * SPREAD_SIGMA


@pytest.mark.parametrize(
    ("spot", "heights"),
    [
        (SPOT, [[40.0] * PASSES] * WAVES),
        (SPOT, [[0.0, 600.0, 0.0, 0.0, 0.0, 0.0, 0.0, 500.0], [0.0] * PASSES]),
        (SPOT, [[20.0, *[0.0] * (PASSES - 1)], [0.0] * PASSES]),
        ((70, 99), [[500.0, *[0.0] * (PASSES - 1)], [0.0] * PASSES]),
    ],
    ids=["a glint in all passes", "a spot in two passes", "too faint for a peak", "on the line"],
)
def test_all_other_light_is_bit_for_bit_as_it_was(spot: tuple[int, int], heights: list[list[float]]) -> None:
    found, share, plain = radiance_of(spot, heights)
    assert np.array_equal(found, plain) and share == 0.0


def test_without_a_goal_nothing_is_spread() -> None:
    found = accumulator()
    found.aim_at(None, 0)
    found.add(wave(SPOT, [500.0, *[0.0] * (PASSES - 1)]), np.zeros((PASSES, 0, BINS)))
    radiance, share = with_lone_spread(found, SHAPE)
    assert share is None and np.array_equal(radiance, found.radiance(SHAPE))


def test_the_brightest_pass_goes_through_a_checkpoint() -> None:
    found = accumulator()
    found.add(wave(SPOT, [500.0, *[0.0] * (PASSES - 1)]), np.zeros((PASSES, 0, BINS)))
    again = Accumulator.of_arrays(found.arrays())
    assert np.array_equal(with_lone_spread(again, SHAPE)[0], with_lone_spread(found, SHAPE)[0])


def listed(image: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    places = np.flatnonzero(image).astype(np.int32)
    return places, image.ravel()[places]


@pytest.mark.parametrize("place", [(0, 0), (HEIGHT - 1, WIDTH - 1), (75, 100)])
def test_what_is_spread_keeps_its_sum_also_at_the_edge(place: tuple[int, int]) -> None:
    light = np.zeros(SHAPE, np.float32)
    light[place] = 7.0
    found = light.copy()
    assert spread_lone(found, *listed(light)) == 1.0
    assert found.sum(dtype=float) == pytest.approx(7.0, rel=1e-5) and found.min() >= 0.0
    assert found.max() < 7.0 / SPREAD_SIGMA**2


def test_what_is_spread_has_no_seam() -> None:
    """It is drawn in bands of rows; a Gaussian of 16 px changes by 4 % of its height from row to row."""
    light = np.zeros(SHAPE, np.float32)
    light[60, 100] = 7.0
    found = light.copy()
    spread_lone(found, *listed(light))
    steps = np.abs(np.diff(found, axis=0))
    assert steps.max() < 0.04 * found.max()
    assert np.unravel_index(found.argmax(), SHAPE)[0] in range(56, 64)
