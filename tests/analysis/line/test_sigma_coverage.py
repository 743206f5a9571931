"""What sigma says where the model of a Gaussian line on level ground does not hold: a small part of the whole grid.

The whole of it: `tests/validation/test_sigma_coverage.py`.
"""

import numpy as np
import pytest

from analysis.line.detection.channel import scan_lines
from analysis.line.estimate import estimate_noise
from analysis.line.extract import extract
from analysis.line.measure import measure
from analysis.line.result import Flag
from analysis.line.settings import ExtractionSettings
from tests.analysis.line.line_images import cramer_rao, electrons, expected
from tests.analysis.line.troubles import (
    BACKGROUND,
    PLAIN,
    READ_NOISE,
    SIGNALS,
    TROUBLES,
    Trouble,
    coverage,
    edges,
    measured,
    photographed,
    variance_of_means,
)

ROWS = 400
MOST = 3.3
"""Standard deviations of a share among ROWS: one test in a thousand would fail by chance."""


def within(share, low, high, rows=ROWS):
    """Whether a share can be that of a coverage between low and high."""
    return low - MOST * np.sqrt(low * (1 - low) / rows) < share < high + MOST * np.sqrt(high * (1 - high) / rows)


def holds(found):
    return within(found.one, 0.65, 0.71, found.count) and within(found.two, 0.93, 0.97, found.count)


@pytest.mark.parametrize("signal", SIGNALS)
def test_a_line_of_a_fifth_of_a_pixel_has_a_sigma_that_covers_the_phase(signal):
    line, centre = measured(PLAIN, signal, 0.2, ROWS, seed=1)
    found = coverage(line, centre)
    assert within(found.two, 0.93, 0.97, found.count)
    assert (line.flag[line.valid] == Flag.UNRESOLVED).mean() > 0.5
    assert np.median(line.sigma_u[line.valid]) < 1 / np.sqrt(12)  # more than which pixel it is in


@pytest.mark.parametrize("sigma", [0.3, 0.4, 0.6])
@pytest.mark.parametrize("signal", [300.0, 3000.0])
def test_a_known_width_is_held_and_the_narrow_line_resolved(sigma, signal):
    line, centre = measured(PLAIN, signal, sigma, ROWS, seed=2, width=sigma)
    assert (line.width[line.valid] == sigma).all()
    assert (line.flag == Flag.OK).all()
    assert holds(coverage(line, centre))


def test_a_known_width_is_held_where_the_true_one_is_another():
    line, _ = measured(PLAIN, 3000.0, 1.0, 50, seed=3, width=0.35)
    assert (line.width[line.valid] == 0.35).all()


def test_narrow_lines_without_noise_are_where_they_are():
    centre = 60 + np.linspace(-0.5, 0.5, 41)
    for sigma in (0.3, 0.35, 0.45):
        line = extract(expected(121, centre, 1e5, sigma, 10.0), noise=electrons(2.5))
        error = np.abs(line.u[:, 0] - centre)
        assert (error < 2 * line.sigma_u[:, 0]).all()
        assert error.max() < 1e-3


@pytest.mark.parametrize("name", ["slope 0.3 %", "slope 1 %", "slope 3 %"])
@pytest.mark.parametrize("sigma", [0.6, 2.0])
def test_sigma_holds_on_a_background_with_a_slope(name, sigma):
    line, centre = measured(TROUBLES[name], 3000.0, sigma, ROWS, seed=4)
    found = coverage(line, centre)
    assert holds(found)
    assert found.lost == 0.0 and found.flagged <= 0.02


@pytest.mark.parametrize(
    "method", ["gaussian", "phase", "centre_of_mass", "guo", "steger", "steger_2d", "half_energy", "blais_rioux_4"]
)
def test_every_method_takes_the_slope_off(method):
    """1 % of the peak a pixel moved the centre of mass by 0.3 px, the fit by 0.09 px."""
    image, centre, noise = photographed(Trouble(slope=0.01), 10000.0, 1.5, 200, seed=5)
    if method == "steger_2d":  # which ties the rows together
        centre = np.full_like(centre, centre.mean())
        x = np.arange(image.shape[1]) - centre[0]
        image = (expected(image.shape[1], centre, 10000.0, 1.5, 10000.0) + 100.0 * x).astype(np.float32)
    line = extract(image, method=method, noise=noise)
    valid = line.valid[:, 0]
    assert valid.mean() > 0.95  # in two dimensions not the outermost rows
    assert abs(np.mean((line.u[:, 0] - centre)[valid])) < 0.01


@pytest.mark.parametrize("sigma", [0.6, 2.0])
@pytest.mark.parametrize("signal", [100.0, 1000.0])
def test_on_level_ground_the_slope_costs_no_efficiency(sigma, signal):
    rows = 3000
    image, centre, noise = photographed(PLAIN, signal, sigma, rows, seed=6)
    error = extract(image, noise=noise).u[:, 0] - centre
    # the mean square of n normal errors spreads by sqrt(2 / n); 0.97 less three of that
    bound = cramer_rao(signal, sigma, READ_NOISE, BACKGROUND)
    assert bound**2 / np.mean(error**2) > 0.97 * (1 - 3 * np.sqrt(2 / rows))


@pytest.mark.parametrize("name", ["neighbour at 2 sigma", "neighbour at 3 sigma"])
@pytest.mark.parametrize("signal", [1000.0, 10000.0])
def test_two_lines_are_fitted_where_one_does_not_fit(name, signal):
    line, centre = measured(TROUBLES[name], signal, 2.0, ROWS, seed=7)
    found = coverage(line, centre)
    assert holds(found)
    assert found.lost <= 0.01


def test_lines_that_do_not_part_are_flagged_and_their_sigma_holds_the_distance():
    line, centre = measured(TROUBLES["neighbour at 1.4 sigma"], 1000.0, 2.0, ROWS, seed=8)
    blended = line.flag[:, 0] == Flag.BLENDED
    assert blended.mean() > 0.1
    error = np.abs(line.u[:, 0] - centre)
    assert within(np.mean(error[blended] < 2 * line.sigma_u[blended, 0]), 0.93, 1.0 - 1e-9, blended.sum())


@pytest.mark.parametrize("sigma", [2.0, 8.0])
def test_a_line_out_of_focus_is_measured_at_its_middle_and_not_as_two(sigma):
    """Of two lines that explain its flat top, the brighter one lay 1.6 px beside, at 8 px 6.6 px, without a flag."""
    line, centre = measured(TROUBLES["defocus of 2 sigma"], 10000.0, sigma, ROWS, seed=17)
    found = coverage(line, centre)
    assert found.rms < 0.02 * sigma and found.lost == 0.0
    assert (line.flag == Flag.MISFIT).all() and found.two > 0.95


def test_a_wide_faint_line_is_not_taken_for_a_bump_of_its_own_noise():
    """Of 100 e- and 8 px one in ten was fitted where its noise stood out, as a line of half a pixel on a glow, and 2
    sigma held 86 %."""
    line, centre = measured(TROUBLES["defocus of 2 sigma"], 100.0, 8.0, 1000, seed=23)
    assert holds(coverage(line, centre))


def test_noise_is_that_of_the_scan_lines_that_an_edge_leaves_whole():
    """Half of a line of 8 px is hidden on most of them; the gain came out at twice what it is."""
    image, _, _ = photographed(TROUBLES["partly occluded"], 10000.0, 8.0, 1000, seed=24)
    assert estimate_noise(image, ExtractionSettings()).gain == pytest.approx(1.0, abs=0.15)


def test_the_shape_of_a_line_out_of_focus_is_not_taken_for_noise():
    """Of a sensor that is not known sigma was 1.8 times too large, at 10,000 e- 9 times, and a sixth of it lost."""
    image, centre, _ = photographed(TROUBLES["defocus of 2 sigma"], 3000.0, 2.0, ROWS, seed=18)
    assert estimate_noise(image, ExtractionSettings()).gain == pytest.approx(1.0, abs=0.15)
    assert holds(coverage(extract(image), centre))


def test_scan_lines_that_an_edge_crosses_are_not_taken_for_noise():
    """A tenth of the scan lines made of a gain of 1 one of 1.5."""
    image, _, _ = photographed(TROUBLES["slanted edge to 30 %"], 10000.0, 8.0, 1000, seed=19)
    assert estimate_noise(image, ExtractionSettings()).gain == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("uneven", [0.0, 0.1])
def test_a_narrow_line_between_other_lights_is_flagged_with_a_sigma_that_holds(uneven):
    """Of one that is brighter by five and more, 2 sigma held 43 %, in speckle 56 %: 0.07 px off at 0.03 px."""
    rng = np.random.default_rng(20)
    centre = 60 + rng.uniform(-0.5, 0.5, ROWS)
    mean = expected(121, centre, 3000.0, 0.2, 0.0) + expected(121, centre + 3.0, 150.0, 0.4, 0.0)
    mean = (mean + expected(121, centre - 3.0, 225.0, 0.4, 0.0)) * (1 + uneven * rng.normal(size=mean.shape)) + 10.0
    image = (rng.poisson(mean.clip(0.0)) + rng.normal(0, READ_NOISE, mean.shape)).astype(np.float32)
    scintillation = ((uneven**2,),) if uneven else ()
    line = extract(image, noise=electrons(READ_NOISE, scintillation=scintillation))
    assert (line.flag == Flag.MISFIT).mean() > 0.95
    assert coverage(line, centre).two > 0.93


def test_where_a_mosaic_saw_a_narrow_line_every_position_is_flagged():
    """By its own width a tenth of them passed for lines whose place is known."""
    line, _ = measured(TROUBLES["mosaic"], 10000.0, 0.6, ROWS, seed=21, known=False)
    assert line.valid.mean() > 0.9 and not (line.flag == Flag.OK).any()


def test_the_noise_told_of_the_ground_is_that_of_the_ground():
    """Where the line scatters by more than a count, a count of the level beneath it was given as noise all the same."""
    image, _, _ = photographed(TROUBLES["mosaic"], 10000.0, 0.6, ROWS, seed=22)
    noise, ground = estimate_noise(image, ExtractionSettings()), image[:, :50]
    assert noise.black_level == pytest.approx(np.median(ground), abs=0.5)
    assert (noise.gain * noise.read_noise) ** 2 == pytest.approx(np.var(np.diff(ground, axis=1)) / 2.0, rel=0.2)


@pytest.mark.parametrize("overexposure", [3.0, 10.0, 30.0])
@pytest.mark.parametrize("sigma", [2.0, 8.0])
def test_sigma_of_a_saturated_line_holds_a_glow_beside_it(overexposure, sigma):
    """Half a percent of the peak, 3 sigmas beside: 0.03 to 0.6 px that the wings, at chi-square 1, did not tell."""
    halo = Trouble(overexposure=overexposure, halo=0.005)
    line, centre = measured(halo, 1000.0, sigma, ROWS, seed=12)
    found = coverage(line, centre)
    assert (line.flag[line.valid] == Flag.SATURATED).all()
    assert within(found.two, 0.93, 0.97, found.count)


@pytest.mark.parametrize("overexposure", [3.0, 10.0, 30.0, 300.0])
def test_sigma_of_a_saturated_line_without_a_glow_is_that_of_its_wings(overexposure):
    """Half a percent of glow, taken as given, told 0.11 px for 0.007."""
    line, centre = measured(Trouble(overexposure=overexposure), 10000.0, 2.0, ROWS, seed=15)
    found = coverage(line, centre)
    assert (line.flag[line.valid] == Flag.SATURATED).all()
    assert within(found.two, 0.93, 0.97, found.count)
    assert found.sigma < 1.3 * found.rms < 0.013


def test_a_line_of_an_eighth_of_a_pixel_at_few_places_has_a_sigma_that_holds():
    """A sheet on pixels of a quarter of the image: a width of 0.2 px or more was taken for certain, and held 0.2."""
    rng = np.random.default_rng(16)
    centre = 60 + np.repeat(rng.uniform(-0.5, 0.5, 60), 20)
    mean = expected(121, centre, 6000.0, 0.13, 10.0)
    image = (rng.poisson(mean) + rng.normal(0, READ_NOISE, mean.shape)).astype(np.float32)
    found = coverage(extract(image, noise=electrons(READ_NOISE)), centre)
    # twenty rows at one place err alike: 60 places
    assert within(found.two, 0.93, 0.99, 60)
    assert found.sigma < 0.08


def test_rows_share_the_width_that_each_hardly_tells():
    """Each row on its own left a line of 0.4 px and 300 e- at 0.78 of the bound's efficiency."""
    rows = 3000
    for sigma, least in ((0.4, 1.0), (0.45, 1.0), (0.5, 0.97)):
        image, centre, noise = photographed(PLAIN, 300.0, sigma, rows, seed=13)
        line = extract(image, noise=noise)
        error = (line.u - centre[:, None])[line.valid]
        bound = cramer_rao(300.0, sigma, READ_NOISE, BACKGROUND)  # of a width that is unknown to each
        assert bound**2 / np.mean(error**2) > least * (1 - 3 * np.sqrt(2 / rows))
        assert holds(coverage(line, centre))


def test_a_row_of_another_width_keeps_its_own():
    rng = np.random.default_rng(14)
    wide = np.arange(600) % 20 == 7
    centre = 60 + rng.uniform(-0.5, 0.5, 600)
    mean = np.where(wide[:, None], expected(121, centre, 1000.0, 0.48, 10.0), expected(121, centre, 1000.0, 0.3, 10.0))
    line = extract((rng.poisson(mean) + rng.normal(0, READ_NOISE, mean.shape)).astype(np.float32), noise=electrons(2.5))
    assert np.median(line.width[wide]) == pytest.approx(0.48, abs=0.03)
    assert np.median(line.width[~wide]) == pytest.approx(0.3, abs=0.02)
    inside = np.abs(line.u[:, 0] - centre) < 2 * line.sigma_u[:, 0]
    assert within(inside[wide].mean(), 0.93, 0.97, wide.sum()) and within(
        inside[~wide].mean(), 0.93, 0.98, (~wide).sum()
    )


def test_a_line_on_level_ground_is_hardly_ever_taken_for_anything_else():
    rows = 3000
    for signal in (100.0, 10000.0):
        line, _ = measured(PLAIN, signal, 1.5, rows, seed=9)
        # 3.4e-6 by chi-square, 6.8e-6 by either side of the asymmetry: 0.03 of 3,000
        assert np.sum(line.flag != Flag.OK) <= 1


def test_a_profile_that_is_no_line_widens_sigma_and_is_flagged():
    """Pixels uneven by 10 %, of which the noise model knows nothing: sigma was that of the counts, 0.003 px."""
    rng = np.random.default_rng(10)
    centre = 40 + rng.uniform(-0.5, 0.5, ROWS)
    mean = expected(80, centre, 3e4, 2.0, 0.0) * (1 + 0.1 * rng.normal(size=(ROWS, 80))) + 10.0
    line = extract(rng.poisson(mean).astype(np.float32), noise=electrons(0.5))
    assert (line.flag == Flag.MISFIT).mean() > 0.95
    assert np.median(line.chi2) > 10
    found = coverage(line, centre)
    assert found.two > 0.75 and found.sigma > 10 * 0.003


@pytest.mark.parametrize(("signal", "sigma"), [(1000.0, 0.6), (1000.0, 2.0), (10000.0, 2.0)])
def test_what_a_reflection_does_to_all_scan_lines_is_not_lost_in_their_mean(signal, sigma):
    """Told as if each erred for itself, means over 100 scan lines scattered by 23 times the variance told."""
    line, centre = measured(TROUBLES["reflection of 10 %"], signal, sigma, 1000, seed=77)
    assert np.mean(np.isin(line.flag, (Flag.BLENDED, Flag.MISFIT))) > 0.98
    assert variance_of_means(line, centre, 10) < 1.15
    assert variance_of_means(line, centre, 100) < 1.15


def test_lines_that_only_two_lines_explain_tell_how_many_scan_lines_err_alike():
    """Where the single line did not converge, the correlation length was no number, and so was no mean told."""
    line, _ = measured(TROUBLES["neighbour at 3 sigma"], 10000.0, 2.0, 1000, seed=77)
    assert line.valid.all() and np.isfinite(line.length_apart).all()


@pytest.mark.parametrize("name", ["slanted edge to 30 %", "partly occluded"])
def test_sigma_of_a_line_that_an_edge_cuts_holds_what_the_fit_may_have_taken_up(name):
    """Half a width and more beside the middle of 8 px: told 0.1 to 0.25 px, it was off by 0.2 to 3 px."""
    line, centre = measured(TROUBLES[name], 10000.0, 8.0, 1000, seed=77)
    edge = edges(1000)
    cut = (edge > 4.0) & (edge < 20.0)
    assert (line.flag[cut] == Flag.MISFIT).mean() > 0.9
    assert np.mean(np.abs(line.u[:, 0] - centre)[cut] < 2 * line.sigma_u[cut, 0]) > 0.93


def test_of_a_flat_line_no_scan_line_errs_as_its_neighbours_do():
    """Each to a side of its own: a mean over 100 is told to be as sure as of 100."""
    line, _ = measured(TROUBLES["defocus of 2 sigma"], 10000.0, 2.0, 1000, seed=77)
    assert np.mean(line.flag == Flag.MISFIT) > 0.9
    assert np.median(line.correlation_length) < 3.0


def test_who_asks_how_well_a_line_fits_gets_the_single_line():
    image, _, noise = photographed(TROUBLES["neighbour at 2 sigma"], 3000.0, 2.0, 50, seed=11)
    settings = ExtractionSettings()
    single = measure(scan_lines(image, settings, noise), settings, threads=1)
    assert (single.flag == Flag.OK).all()
    assert np.median(single.chi2) > 2.0
