"""What scan lines get to know by their neighbours, on arrays."""

import numpy as np
import pytest

from analysis.line.methods.shared_flags import with_shared_flags
from analysis.line.result import Flag

ROWS = 600


def flagged(lean, skewness=None, flag=None, sigma=0.1, width=2.0):
    peaks = np.stack([np.full(ROWS, sigma), np.full(ROWS, width)], axis=1)
    flag = np.full(ROWS, Flag.OK, np.uint8) if flag is None else flag
    return with_shared_flags(peaks, flag, lean, 0.4 * lean if skewness is None else skewness)


def noise(seed=1):
    return np.random.default_rng(seed).normal(size=ROWS)


def test_noise_flags_nothing():
    for seed in range(50):
        sigma, flag = flagged(noise(seed))
        assert (flag == Flag.OK).all()
        assert (sigma == 0.1).all()


def test_a_lean_that_no_scan_line_shows_alone_is_found_and_widens_sigma_by_that_of_a_second_line():
    # two lines, 30 % of the light 1.4 sigmas beside: third moment p (1 - p) (1 - 2 p) d^3, and they shift by p d
    p, d = 0.3 / 1.3, 1.4
    skewness = p * (1 - p) * (1 - 2 * p) * d**3
    scatter = 0.18
    lean = noise() + skewness / scatter
    assert (np.abs(lean) < 4.5).mean() > 0.99
    sigma, flag = flagged(lean, scatter * lean)
    assert (flag == Flag.MISFIT).mean() > 0.98  # the ends have half the neighbours
    shift = np.median(np.sqrt(sigma**2 - 0.1**2)) / 2.0  # of a width of 2 px
    assert shift == pytest.approx(p * d, rel=0.1)


def test_a_lean_that_moves_no_estimator_by_a_sigma_is_left_alone():
    _, flag = flagged(noise() + 2.0, 0.004 * (noise() + 2.0))  # mean and mode 0.008 px apart
    assert (flag == Flag.OK).all()


def test_a_few_scan_lines_that_lean_by_themselves_do_not_speak_for_all():
    lean = noise()
    lean[300:312] = 30.0
    skewness = 0.4 * lean
    skewness[300:312] = np.nan  # they are measured as what they are
    flag = np.full(ROWS, Flag.OK, np.uint8)
    flag[300:312] = Flag.BLENDED
    _, after = flagged(lean, skewness, flag)
    assert (after == flag).all()


def test_noise_that_neighbours_share_is_no_lean():
    rough = np.random.default_rng(3).normal(size=ROWS + 40)
    shared = np.convolve(rough, np.ones(20) / np.sqrt(20), "same")[20:-20]  # 20 scan lines err alike
    _, flag = flagged(shared, 2.0 * shared)
    assert (flag == Flag.OK).all()


def test_two_lines_are_believed_where_most_neighbours_part_as_well():
    lean, skewness = noise() + 5.0, np.full(ROWS, 0.5)
    for share, wanted in ((0.4, Flag.BLENDED), (0.95, Flag.OK)):
        parted = np.random.default_rng(4).uniform(size=ROWS) < share
        _, flag = flagged(lean, np.where(parted, np.nan, skewness))
        assert (flag[parted & (np.abs(lean) < 9.0)] == wanted).mean() > 0.99


def test_a_line_that_its_neighbours_cannot_resolve_is_not_resolved():
    flag = np.full(ROWS, Flag.UNRESOLVED, np.uint8)
    flag[::4] = Flag.OK
    _, after = flagged(np.full(ROWS, np.nan), flag=flag)
    assert (after == Flag.UNRESOLVED).all()


def test_from_either_end_it_is_the_same_to_the_bit():
    lean = noise() + 1.5
    sigma, flag = flagged(lean)
    back, again = flagged(lean[::-1].copy())
    assert (back[::-1] == sigma).all()
    assert (again[::-1] == flag).all()
