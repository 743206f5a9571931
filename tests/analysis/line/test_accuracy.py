"""Line extraction against what statistics allow: bounds, biases, honest sigmas, false alarms."""

import numpy as np
import pytest

from analysis.line.extract import extract
from analysis.line.result import Flag
from analysis.line.settings import ExtractionSettings
from tests.analysis.line.line_images import cramer_rao, electrons, expected, exposed

METHODS = ("likelihood", "gaussian", "centre_of_mass")
WIDTH = 160


def trial(amplitude, sigma, read_noise, rows, seed, method="likelihood", known_width=False):
    """Errors in px, sigma_u and the number of failures over `rows` noisy rows of uniform sub-pixel phase."""
    rng = np.random.default_rng(seed)
    centre = WIDTH / 2 + rng.uniform(-0.5, 0.5, rows)
    image = exposed(expected(WIDTH, centre, amplitude, sigma, 10.0), read_noise, rng).astype(np.float32)
    settings = ExtractionSettings(width=sigma if known_width else None)
    line = extract(image, method=method, settings=settings, noise=electrons(read_noise))
    valid = line.valid[:, 0]
    return (line.u[:, 0] - centre)[valid], line.sigma_u[valid, 0], int((~valid).sum())


def efficiency(error, amplitude, sigma, read_noise):
    return cramer_rao(amplitude, sigma, read_noise, 10.0) ** 2 / np.mean(error**2)


@pytest.mark.parametrize(
    ("amplitude", "sigma", "read_noise", "printed"),
    [
        (100, 0.6, 2, 0.0708),
        (1000, 1.5, 5, 0.0276),
        (10000, 4, 10, 0.0132),
        (300, 2, 10, 0.0805),
        (3000, 0.8, 2, 0.0112),
    ],
)
def test_the_bound_used_here_is_the_published_one(amplitude, sigma, read_noise, printed):
    assert cramer_rao(amplitude, sigma, read_noise, 10.0) == pytest.approx(printed, abs=1e-4)


@pytest.mark.parametrize("read_noise", [2, 10])
@pytest.mark.parametrize("sigma", [0.4, 0.6, 1.0, 1.5, 4.0])
@pytest.mark.parametrize("amplitude", [300, 10000])
def test_likelihood_reaches_the_bound(amplitude, sigma, read_noise):
    """Of a faint line of 0.4 px the bound, that of errors in which all is linear, holds with the width known alone."""
    rows = 3000
    error, _, failures = trial(amplitude, sigma, read_noise, rows, seed=1, known_width=amplitude * sigma < 150)
    # the mean square of n normal errors spreads by sqrt(2 / n); 0.97 less three of that
    assert efficiency(error, amplitude, sigma, read_noise) > 0.97 * (1 - 3 * np.sqrt(2 / rows))
    assert failures <= 3


# accuracy note 2.2, Gaussian least squares, integrated: A, sigma, read noise, efficiency
@pytest.mark.parametrize(
    ("amplitude", "sigma", "read_noise", "printed"),
    [(100, 1.5, 2, 0.81), (1000, 2, 5, 0.75), (10000, 3, 2, 0.67), (1000, 0.6, 10, 0.91), (10000, 1, 5, 0.67)],
)
def test_least_squares_is_as_efficient_as_published(amplitude, sigma, read_noise, printed):
    rows = 6000
    error, _, _ = trial(amplitude, sigma, read_noise, rows, seed=2, method="gaussian", known_width=True)
    spread = np.sqrt(2 / rows + 2 / 8000)  # theirs is an experiment too
    assert abs(efficiency(error, amplitude, sigma, read_noise) / printed - 1) < 3 * spread


# accuracy note 2.2, centre of mass +-3 s. There the window sits on the brightest pixel; ours is put back on its
# result, which the wide lines gain from: their third number is the efficiency of a window on the true pixel.
@pytest.mark.parametrize(
    ("amplitude", "sigma", "read_noise", "printed", "centred"),
    [(100, 1.5, 2, 0.57, 0.59), (1000, 1, 5, 0.86, 0.88), (10000, 0.6, 2, 1.01, 1.0), (10000, 4, 2, 0.75, 0.85)],
)
def test_centre_of_mass_is_at_least_as_efficient_as_published(amplitude, sigma, read_noise, printed, centred):
    rows = 6000
    error, _, _ = trial(amplitude, sigma, read_noise, rows, seed=3, method="centre_of_mass", known_width=True)
    spread = 3 * np.sqrt(2 / rows + 2 / 8000)
    assert printed * (1 - spread) < efficiency(error, amplitude, sigma, read_noise) < centred * (1 + spread)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("amplitude", "sigma", "read_noise"), [(300, 1.0, 2), (1000, 2.0, 10), (3000, 1.5, 5)])
def test_two_sigma_cover_what_they_claim(method, amplitude, sigma, read_noise):
    error, sigma_u, _ = trial(amplitude, sigma, read_noise, 4000, seed=4, method=method)
    assert 0.93 < np.mean(np.abs(error) < 2 * sigma_u) < 0.97


@pytest.mark.parametrize("method", ["gaussian", "centre_of_mass"])
def test_sigma_stays_honest_after_smoothing(method):
    rng = np.random.default_rng(5)
    centre = np.full(3000, WIDTH / 2 + 0.2)
    image = exposed(expected(WIDTH, centre, 1000, 1.5, 10.0), 5, rng).astype(np.float32)
    line = extract(image, method=method, settings=ExtractionSettings(smoothing=1.0), noise=electrons(5))
    z = (line.u - centre[:, None]) / line.sigma_u
    # smoothing over rows correlates them over about 3.5 rows: fewer independent trials
    assert np.std(z) == pytest.approx(1.0, abs=4 * np.sqrt(0.5 * 3.5 / 3000))
    assert np.median(line.width) == pytest.approx(np.hypot(1.5, 1.0), abs=0.05)


@pytest.mark.parametrize("sigma", [0.4, 0.6, 0.8, 1.0, 1.5, 2.0, 3.0, 5.0, 10.0])
def test_fits_have_no_phase_bias_and_centre_of_mass_the_published_one(sigma):
    centre = 150.0 + np.linspace(-0.5, 0.5, 101)
    image = expected(301, centre, 1e4, sigma, 10.0).astype(np.float32)
    for method in ("likelihood", "gaussian"):
        line = extract(image, method=method, noise=electrons(2.5))
        assert np.abs(line.u[:, 0] - centre).max() < 1e-4
        assert np.abs(line.width[:, 0] - sigma).max() < 1e-3 * sigma
    published = {
        0.4: 0.014,
        0.6: 0.001,
        0.8: 0.0,
        1.0: 0.005,
        1.5: 0.002,
        2.0: 0.007,
        3.0: 0.009,
        5.0: 0.010,
        10.0: 0.012,
    }
    line = extract(image, method="centre_of_mass", settings=ExtractionSettings(width=sigma), noise=electrons(2.5))
    assert np.abs(line.u[:, 0] - centre).max() == pytest.approx(published[sigma], abs=6e-4)


@pytest.mark.parametrize("exposure", [1, 2, 5, 10, 30, 100])
def test_saturated_line_is_measured_from_its_wings(exposure):
    rng = np.random.default_rng(6)
    centre = WIDTH / 2 + rng.uniform(-0.5, 0.5, 1000)
    image = exposed(expected(WIDTH, centre, 1e4 * exposure, 1.5, 10.0), 2.5, rng)
    image = np.minimum(image, 1e4).astype(np.float32)
    line = extract(image, method="likelihood", noise=electrons(2.5, saturation=1e4))
    error = (line.u - centre[:, None])[line.valid]
    assert line.valid.mean() > 0.99
    assert np.sqrt(np.mean(error**2)) < 0.01
    inside = np.mean(np.abs(error) < 2 * line.sigma_u[line.valid])
    if exposure == 1:
        assert 0.93 < inside < 0.975
        return
    assert (line.flag[line.valid] == Flag.SATURATED).all()
    assert inside > 0.93  # of all: sigma holds a glow that the wings cannot tell from none
    assert np.median(line.sigma_u[line.valid]) < 1.5 * np.sqrt(2 * np.log(exposure))  # which is within the plateau


def test_saturated_centre_of_mass_says_how_bad_it_is():
    rng = np.random.default_rng(7)
    centre = WIDTH / 2 + rng.uniform(-0.5, 0.5, 1000)
    image = np.minimum(exposed(expected(WIDTH, centre, 1e5, 1.0, 10.0), 2.5, rng), 1e4).astype(np.float32)
    line = extract(image, method="centre_of_mass", noise=electrons(2.5, saturation=1e4))
    error = line.u[:, 0] - centre
    assert np.mean(np.abs(error) < 2 * line.sigma_u[:, 0]) > 0.93
    assert np.sqrt(np.mean(error**2)) < 0.1


@pytest.mark.parametrize(("background", "read_noise"), [(10.0, 2.5), (2.0, 1.0), (100.0, 5.0)])
def test_noise_alone_is_not_a_line(background, read_noise):
    rng = np.random.default_rng(8)
    image = exposed(np.full((3000, 2448), background), read_noise, rng).astype(np.float32)
    line = extract(image, noise=electrons(read_noise))
    # at most 0.1 % of the rows: 3 expected, and 9 is three Poisson sigmas above that
    assert line.valid.sum() <= 8


def test_faint_line_is_found_nearly_as_often_as_the_matched_filter_can():
    """A = 20 at noise 4: 98 % expected at the threshold that keeps false rows below 0.1 %."""
    rng = np.random.default_rng(9)
    centre = 1200 + rng.uniform(-0.5, 0.5, 1500)
    image = exposed(expected(2448, centre, 20.0, 1.5, 10.0), 2.5, rng).astype(np.float32)
    line = extract(image, method="centre_of_mass", noise=electrons(2.5))
    assert np.mean(np.abs(line.u[:, 0] - centre) < 4) > 0.93


def test_unknown_noise_is_estimated_from_the_image():
    rng = np.random.default_rng(10)
    centre = 150 + rng.uniform(-0.5, 0.5, 1500)
    counts = exposed(expected(300, centre, 4000.0, 1.5, 10.0), 8.0, rng)
    image = np.clip(np.round(0.05 * counts + 4), 0, 255).astype(np.uint8)
    line = extract(image)
    error = line.u[:, 0] - centre
    assert line.valid.all()
    assert 0.92 < np.mean(np.abs(error) < 2 * line.sigma_u[:, 0]) < 0.98
    # amplitude in electrons comes out right too, since the gain is found from the residuals
    assert np.median(line.amplitude) == pytest.approx(4000, rel=0.15)


def test_point_sampled_profile_is_wrong_for_narrow_lines_only():
    centre = 60 + np.linspace(-0.5, 0.5, 41)
    worst = {}
    for sigma in (0.4, 1.0, 4.0):
        image = expected(121, centre, 1e4, sigma, 10.0).astype(np.float32)
        line = extract(image, settings=ExtractionSettings(profile="point", method="gaussian"), noise=electrons(2.5))
        worst[sigma] = np.abs(line.u[:, 0] - centre).max()
        # the pixel's own width is not taken out
        assert np.median(line.width) == pytest.approx(np.sqrt(sigma**2 + 1 / 12), rel=0.03)
    assert worst[0.4] > 0.005
    assert worst[1.0] < 1e-4 and worst[4.0] < 1e-4


@pytest.mark.parametrize("width", [48, 64, 100, 300])
@pytest.mark.parametrize("sigma", [1.0, 3.0])
def test_background_holds_in_narrow_images_too(width, sigma):
    rng = np.random.default_rng(11)
    centre = rng.uniform(0.3, 0.7, 500) * width
    image = exposed(expected(width, centre, 1000, sigma, 200.0), 3, rng).astype(np.float32)
    line = extract(image, noise=electrons(3))
    assert line.valid.all()
    assert 0.91 < np.mean(np.abs(line.u[:, 0] - centre) < 2 * line.sigma_u[:, 0]) < 0.99
