"""Light beside a line below half a pixel, which three pixels alone do not tell from the line's own width."""

import numpy as np
import pytest

from analysis.line.extract import extract
from analysis.line.result import Flag
from tests.analysis.line.line_images import electrons, expected
from tests.analysis.line.troubles import BACKGROUND, READ_NOISE, coverage

COLUMNS = 126
ODD = (Flag.BLENDED, Flag.MISFIT)


def photographed(signal, sigma, rows, seed, beside=0.0, steady=False):
    """Image (rows, w) in electrons and centres (rows,); beside: height, of the peak, of a light a pixel to the right,
    three times as wide."""
    rng = np.random.default_rng(seed)
    centre = COLUMNS / 2 + (0.003 * np.arange(rows) if steady else rng.uniform(-0.5, 0.5, rows))
    mean = BACKGROUND + expected(COLUMNS, centre, signal, sigma, 0.0)
    mean += expected(COLUMNS, centre + 1.0, beside * signal, 3.0 * sigma, 0.0)
    return (rng.poisson(mean) + rng.normal(0.0, READ_NOISE, mean.shape)).astype(np.float32), centre


@pytest.mark.parametrize("known", [True, False], ids=["noise known", "noise estimated"])
@pytest.mark.parametrize(("signal", "sigma", "beside"), [(100.0, 0.2, 0.1), (10000.0, 0.2, 0.1), (10000.0, 0.4, 0.05)])
def test_a_line_that_light_beside_it_moves_is_flagged(signal, sigma, beside, known):
    """Half to nearly all of them were not, off by 2 to 40 sigma."""
    image, _ = photographed(signal, sigma, 400, 11, beside)
    line = extract(image, noise=electrons(READ_NOISE) if known else None)
    assert np.mean(line.flag == Flag.OK) < 0.1
    assert line.valid.mean() > 0.8


def test_sigma_of_a_narrow_misfit_holds_how_far_light_beside_may_move_it():
    image, centre = photographed(10000.0, 0.3, 400, 12, 0.05)
    line = extract(image, noise=electrons(READ_NOISE))
    assert coverage(line, centre).two > 0.9
    assert line.shared_u is not None
    off = line.u[:, 0] - centre
    assert np.median(off) > 0.02
    assert np.mean(np.sign(line.shared_u[line.valid]) == np.sign(off[line.valid[:, 0]])) > 0.8


@pytest.mark.parametrize("signal", [100.0, 1000.0, 100000.0])
@pytest.mark.parametrize("sigma", [0.15, 0.3, 0.4, 0.5])
def test_a_narrow_line_alone_is_no_misfit_wherever_in_its_pixel_many_scan_lines_have_it(sigma, signal):
    image, _ = photographed(signal, sigma, 400, 13, steady=True)
    line = extract(image, noise=electrons(READ_NOISE))
    assert np.mean(np.isin(line.flag, ODD)) < 0.01


def test_a_width_that_only_neighbours_tell_is_no_reason_for_a_flag_where_light_is_enough():
    image, _ = photographed(1000.0, 0.42, 400, 14)
    assert np.mean(extract(image, noise=electrons(READ_NOISE)).flag == Flag.OK) > 0.95
