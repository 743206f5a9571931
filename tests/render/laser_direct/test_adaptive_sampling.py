"""How finely pixels are divided, against the best division found by trying them all."""

from __future__ import annotations

import heapq
import itertools
import math

import numpy as np
import pytest

from render.laser_direct.adaptive_sampling import MOST_CELLS, cells_needed, grade_neighbours, raise_neighbour_errors


def ones(n: int) -> np.ndarray:
    return np.ones(n, np.int32)


def left(error: np.ndarray, cells: np.ndarray, order: float) -> float:
    """The sum of the variances that are promised."""
    return float(np.sum(error**2 * cells.astype(float) ** -order))


@pytest.mark.parametrize("order", (3.0, 2.25))
@pytest.mark.parametrize("allowed", (4.0, 1.0, 0.1, 0.01))
def test_the_target_is_met_with_few_more_rays_than_the_best_division_needs(order, allowed):
    error = np.array([3.0, 0.1, 2.0, 1.0, 0.3, 0.02])
    cells = cells_needed(error, ones(6), allowed, 0.0, order, MOST_CELLS)
    assert left(error, cells, order) <= allowed
    best = min(
        sum(c * c for c in some)
        for some in itertools.product((1, 2, 4, 8, 16, 32), repeat=6)
        if left(error, np.array(some), order) <= allowed
    )
    assert np.sum(cells**2) <= 2.0 * best


def test_many_pixels_cost_no_more_than_when_the_worthiest_is_divided_next_each_time():
    error = np.random.default_rng(0).lognormal(sigma=1.5, size=3000)
    cells = cells_needed(error, ones(3000), 30.0, 0.0, 3.0, MOST_CELLS)
    # told apart to a sixteenth of an octave of cells
    assert 30.0 * 2.0 ** (-3 / 16) < left(error, cells, 3.0) <= 30.0
    single = ones(3000)
    # what the next level takes away for each ray that it costs more
    worth = [(-7 / 24 * v, i) for i, v in enumerate(error**2)]
    heapq.heapify(worth)
    variance = float(np.sum(error**2))
    while variance > 30.0:
        gain, i = heapq.heappop(worth)
        variance += 3.0 * gain * single[i] ** 2
        single[i] *= 2
        heapq.heappush(worth, (gain / 32.0, i))
    assert left(error, single, 3.0) == pytest.approx(variance)
    # rays go with the variance to the power -2/3
    assert np.sum(cells.astype(float) ** 2) < 2.0 ** (1 / 8) * np.sum(single.astype(float) ** 2)


def test_what_cannot_matter_stays_and_no_pixel_grows_faster_or_further_than_allowed():
    error, cells = np.array([9.0, 1e-3, 9.0, 9.0]), np.array([1, 1, 32, 16], np.int32)
    assert cells_needed(error, cells, 1e-9, 1e-2, 3.0, 4).tolist() == [4, 1, 32, 32]
    assert cells_needed(error, cells, 1e9, 1e-2, 3.0, 4).tolist() == cells.tolist()
    assert cells_needed(np.zeros(4), cells, 0.0, 0.0, 3.0, 4).tolist() == cells.tolist()


def test_neighbours_of_what_is_divided_are_divided_half_as_finely():
    width = 10
    pixels = np.array([11, 12, 13, 21, 22, 23, 25, 32], np.int32)
    cells = np.array([1, 1, 1, 1, 1, 1, 1, 8], np.int32)
    wanted = np.array([1, 1, 1, 1, 8, 1, 1, 8], np.int32)
    # the last has its eight already, so it asks nothing of others
    assert grade_neighbours(wanted, cells, pixels, width).tolist() == [4, 4, 4, 4, 8, 4, 1, 8]
    assert grade_neighbours(cells, cells, pixels, width).tolist() == cells.tolist()


def test_beside_an_edge_pixels_with_few_rays_are_in_doubt():
    pixels = np.array([11, 12, 13, 22, 35], np.int32)
    error = np.array([0.0, 0.01, 0.5, 0.0, 0.0])
    cells = np.array([2, 4, 2, 1, 2], np.int32)
    predicted = np.array([0.0, 0.64, 0.0, 0.0, 0.0])
    raise_neighbour_errors(error, predicted, 4.0, np.zeros(5), 0.35, cells, pixels, 10)
    # a pixel of one ray has been looked at with its neighbours before, and one further off is not concerned
    assert error == pytest.approx([0.16, 0.04, 0.5, 0.0, 0.0])


def test_an_edge_that_no_ray_met_may_lie_on_either_side_of_the_border():
    """Against a sweep of an edge parallel to the border over both pixels, the rays jittered in their cells."""
    random = np.random.default_rng(3)
    for cells in (2, 4, 8):
        pixels = np.array([11, 12, 31], np.int32)
        error, mean = np.zeros(3), np.array([2.0, 0.0, 1.0])
        raise_neighbour_errors(error, np.zeros(3), 4.0, mean, 0.35, np.full(3, cells, np.int32), pixels, 10)
        assert error[0] == error[1] > 0.0 and error[2] == 0.0
        # the depth of the last row of cells, where alone an edge can hide
        depth = random.random(200_000) / cells
        missed = np.all(random.random((len(depth), cells)) / cells > depth[:, None], axis=1)
        assert error[0] / 2.0 == pytest.approx(math.sqrt(np.mean(missed * depth**2)), rel=0.15)
