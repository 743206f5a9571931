"""What a width that is not the neighbours' says of how far a misfit is moved, against light that is cut by an edge."""

import numpy as np
import pytest
from scipy.special import ndtr

from analysis.line.extract import extract
from analysis.line.methods.odd_width import FEWEST, REACH, moved_by_odd_width
from analysis.line.result import Flag
from tests.analysis.line.troubles import TROUBLES, photographed

ROWS, MIDDLE, WIDTH = 400, 200, 2.0


def told(width: float, spread: float = 0.0, flag: Flag = Flag.MISFIT, off: float = 0.0, slant: float = 0.0) -> float:
    """px, of one line of a width and flag, so many px off the course of single ones of WIDTH, which scatter evenly by
    `spread` and widen by `slant` a scan line."""
    rows = np.arange(ROWS)[:, None]
    widths = WIDTH + spread * np.where(rows % 2, 1.0, -1.0) + slant * (rows - MIDDLE)
    course = 100.0 + 0.5 * rows + off * (rows == MIDDLE)
    flags = np.full((ROWS, 1), Flag.OK, np.uint8)
    widths[MIDDLE], flags[MIDDLE] = width, flag
    return float(moved_by_odd_width(course, widths, flags)[MIDDLE, 0])


def cut(sigmas: float, dark: float) -> tuple[float, float]:
    """How far the centre of mass is moved, and the standard deviation that is left, px, where light is `dark` of it
    beyond so many sigmas: by numbers."""
    x = np.linspace(-8.0, 8.0, 160_001)
    light = np.exp(-0.5 * x**2) * np.where(x > sigmas, dark, 1.0)
    light /= light.sum()
    mean = float(light @ x)
    return WIDTH * abs(mean), WIDTH * float(np.sqrt(light @ x**2 - mean**2))


@pytest.mark.parametrize("dark", [0.0, 0.3, 0.6])
@pytest.mark.parametrize("sigmas", [0.0, 0.5, 1.0, 1.5])
def test_an_edge_moves_a_line_by_no_more_than_its_width_allows(sigmas, dark):
    """What is as likely anywhere between two bounds is at most sqrt(3) of its root of the mean square."""
    moved, width = cut(sigmas, dark)
    sigma = told(width)
    assert moved < np.sqrt(3.0) * sigma * 1.001
    if dark == 0.0:
        assert moved < sigma * 1.001  # the least of what may be
    if sigmas == 0.0:
        assert moved > sigma * 0.999  # the most


def test_of_two_lines_the_brighter_is_off_by_no_more_than_the_width_allows():
    for faint in (0.1, 0.3, 0.5):
        apart = 1.5 * WIDTH
        width = np.sqrt(WIDTH**2 + faint * (1.0 - faint) * apart**2)
        assert faint * apart < np.sqrt(3.0) * told(width) * 1.001


def test_it_is_asked_of_misfits_whose_width_differs_by_more_than_chance_among_enough_single_lines():
    assert told(1.5) > 0.5 and told(1.5, flag=Flag.OK) == 0.0 and told(WIDTH) < 1e-3
    assert told(1.8, spread=0.1) < 1e-6 and told(1.2, spread=0.1) > 0.3
    flags = np.full((ROWS, 1), Flag.NO_PEAK, np.uint8)
    flags[MIDDLE] = Flag.MISFIT
    widths, course = np.where(np.arange(ROWS) == MIDDLE, 1.5, WIDTH)[:, None], np.full((ROWS, 1), 100.0)
    for count in (FEWEST - 1, FEWEST):
        flags[MIDDLE + 1 : MIDDLE + 1 + count] = Flag.OK
        assert (moved_by_odd_width(course, widths, flags)[MIDDLE, 0] > 0.0) == (count == FEWEST)
    flags[:] = Flag.NO_PEAK
    flags[MIDDLE], flags[MIDDLE + REACH + 1 :] = Flag.MISFIT, Flag.OK
    assert moved_by_odd_width(course, widths, flags)[MIDDLE, 0] == 0.0


def test_a_sheet_that_widens_and_another_surface_are_no_edge():
    """On a ball before a plane, lines of 0.7 px beside those of 1.5 px were told to 1.3 px."""
    assert told(WIDTH, slant=0.01) < 1e-6 and told(1.5, slant=0.01) > 0.5
    assert told(1.5, off=2.0) > 0.5 and told(1.5, off=10.0) == 0.0


def test_upside_down_it_is_the_same_to_the_last_bit():
    random = np.random.default_rng(3)
    widths = random.uniform(1.0, 3.0, (ROWS, 2))
    flags = random.choice([Flag.OK, Flag.MISFIT, Flag.BLENDED, Flag.NO_PEAK], (ROWS, 2)).astype(np.uint8)
    u = 50.0 + random.uniform(-1.0, 1.0, (ROWS, 2))
    upside_down = moved_by_odd_width(u[::-1], widths[::-1], flags[::-1])
    np.testing.assert_array_equal(moved_by_odd_width(u, widths, flags)[::-1], upside_down)


def test_beside_an_edge_that_hides_a_part_sigma_holds_what_that_costs():
    """Up to 1.4 px of a line of 2 px, of which sigma told a fifth: what is left looks like a good, narrower line."""
    image, centre, noise = photographed(TROUBLES["partly occluded"], 10000.0, WIDTH, 1000, seed=77)
    line = extract(image, noise=noise)
    cut_off = (line.flag[:, 0] == Flag.MISFIT) & np.isfinite(centre)
    deviate = (line.u[cut_off, 0] - centre[cut_off]) / line.sigma_u[cut_off, 0]
    assert cut_off.sum() > 40
    # of normal deviates 95 % are below 2; of 40 that are alike beside one edge all may be as the worst
    assert np.mean(np.abs(deviate) < 2.0) > 0.95
    hidden = np.abs(ndtr((np.flatnonzero(cut_off) - 500.0) / 10.0 / WIDTH) - 0.5) < 0.35
    assert np.sqrt(np.mean(deviate[hidden] ** 2)) < 1.2
