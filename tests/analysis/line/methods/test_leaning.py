"""A second line that one scan line cannot tell, and many together can."""

import numpy as np
import pytest

from analysis.line.extract import extract
from analysis.line.methods.leaning import no_gaussian_by_neighbours, parts_alone
from analysis.line.result import Flag
from tests.analysis.line.troubles import PLAIN, TROUBLES, measured, photographed

ROWS = 400


def by_lean(lean, length):
    """Of lines that fit as usual."""
    return no_gaussian_by_neighbours(lean, np.zeros_like(lean), length)


def test_deviates_of_single_lines_do_not_lean_together_whatever_their_scale():
    """5,000 lines, of which one in 50,000 would be flagged by chance, and 65 at a time."""
    deviate = np.random.default_rng(1).normal(size=(5000, 1))
    for scale in (0.5, 1.0, 3.0):
        assert by_lean(scale * deviate, np.ones_like(deviate)).mean() < 0.02


def test_lines_that_err_alike_are_not_taken_for_lines_that_lean():
    """Sixteen scan lines with one deviate are as good as one, if their correlation length tells it."""
    deviate = np.repeat(np.random.default_rng(2).normal(size=(60, 1)), 16, axis=0)
    assert by_lean(deviate, np.ones_like(deviate)).mean() > 0.02
    assert not by_lean(deviate, np.full_like(deviate, 16.0)).any()


def test_lines_of_which_some_distances_apart_are_hardly_known_lean_no_more_than_others():
    """Pairs that err alike, eight lines apart: nothing is known of lines two to six apart."""
    deviate = np.full((8000, 1), np.nan)
    first = np.random.default_rng(4).normal(size=1000)
    deviate[::8, 0], deviate[1::8, 0] = first, first
    with np.errstate(invalid="raise"):
        assert by_lean(deviate, np.full_like(deviate, 2.0)).mean() < 0.001


def test_a_lean_of_one_standard_deviation_shows_among_neighbours_and_a_tiny_one_is_none():
    deviate = np.random.default_rng(3).normal(size=(1000, 1))
    assert by_lean(deviate + 1.5, np.ones_like(deviate)).mean() > 0.98
    assert not by_lean(np.full((100, 1), 0.01), np.ones((100, 1))).any()


def test_lines_that_only_noise_has_parted_are_found_by_their_neighbours():
    lean = np.full((100, 1), np.inf)
    flag = np.full((100, 1), Flag.OK, np.uint8)
    assert not parts_alone(flag, lean).any()
    flag[::2] = Flag.BLENDED
    assert (parts_alone(flag, lean) == (flag == Flag.OK)).all()


def test_a_line_among_others_that_do_not_fit_is_none_either_and_one_beside_them_is():
    lean = np.zeros((200, 1))
    lean[:100:3] = np.inf
    flagged = by_lean(lean, np.ones_like(lean))[:, 0]
    assert flagged[1:85][np.isfinite(lean[1:85, 0])].all()
    assert not flagged[100:].any()


@pytest.mark.parametrize("known", [True, False], ids=["noise known", "noise estimated"])
@pytest.mark.parametrize("sigma", [0.6, 2.0])
def test_a_neighbour_too_faint_for_one_scan_line_flags_all_of_them(sigma, known):
    """Of 100 e- the neighbour moved the line by 0.6 to 5 sigmas, and hardly any was flagged."""
    line, _ = measured(TROUBLES["neighbour at 1.4 sigma"], 100.0, sigma, ROWS, seed=4, known=known)
    assert np.isin(line.flag[line.valid], (Flag.BLENDED, Flag.MISFIT)).mean() > 0.98


@pytest.mark.parametrize(("sigma", "most"), [(2.0, 0.06), (8.0, 0.06)])
def test_an_edge_that_crosses_a_faint_line_slantwise_flags_it(sigma, most):
    """Of 100 e- it moved the line by up to its width, a tenth of the scan lines beyond two sigma, unflagged."""
    outside = total = 0
    for seed in range(2):
        line, centre = measured(TROUBLES["slanted edge to 30 %"], 100.0, sigma, 1000, seed=seed)
        alone = line.flag[:, 0] == Flag.OK
        outside += int((np.abs(line.u[:, 0] - centre)[alone] > 2.0 * line.sigma_u[alone, 0]).sum())
        total += int(alone.sum())
    chance = 3.0 * np.sqrt(0.05 * 0.95 / total)
    assert total > 1200 and outside / total < most + chance


def test_lines_that_fit_less_well_than_the_others_are_none():
    fit = np.random.default_rng(7).normal(size=(2000, 1))
    nothing, single = np.zeros_like(fit), np.ones_like(fit)
    assert not no_gaussian_by_neighbours(nothing, fit, single).any()
    fit[900:960] += 1.5
    flagged = no_gaussian_by_neighbours(nothing, fit, single)[:, 0]
    assert flagged[905:955].all() and not flagged[:860].any() and not flagged[1000:].any()


def test_of_single_lines_hardly_any_is_flagged():
    for sigma in (0.6, 2.0, 8.0):
        line, _ = measured(PLAIN, 1000.0, sigma, ROWS, seed=5)
        assert (line.flag != Flag.OK).mean() < 0.02


def test_a_known_width_leaves_a_faint_neighbour_to_be_seen():
    image, _, noise = photographed(TROUBLES["neighbour at 2 sigma"], 100.0, 2.0, ROWS, seed=6)
    line = extract(image, noise=noise, width=2.0)
    assert (line.flag[line.valid] != Flag.OK).mean() > 0.98
