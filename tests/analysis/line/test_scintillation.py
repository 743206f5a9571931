"""Light that scintillates: in sigma, in what neighbouring rows have in common, and told from the image alone."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.ndimage import gaussian_filter
from scipy.signal import fftconvolve

from analysis.line.detection.channel import smoothed_covariances
from analysis.line.detection.noise import NoiseModel, image_saturation
from analysis.line.estimate import estimate_noise
from analysis.line.extract import extract
from analysis.line.result import Flag
from analysis.line.settings import ExtractionSettings
from render.sensor.speckle import speckle
from tests.analysis.line.line_images import expected
from tests.analysis.line.scintillating_images import NM, PITCH, cover, known_noise, scintillating, variance_of_means
from tests.analysis.line.troubles import PLAIN, TROUBLES, Trouble, measured, photographed

ROWS = 4000
CHANCE = 3 * math.sqrt(0.95 * 0.05 / ROWS)
"""Three standard deviations of a share of 95 %."""
COARSE, FINE = (5.6, True), (1.4, True)


@pytest.mark.parametrize("method", ["likelihood", "phase", "centre_of_mass"])
@pytest.mark.parametrize(("kind", "sigma"), [(COARSE, 1.2), (FINE, 1.5), (0.05, 1.5), (0.2, 2.5)])
def test_two_sigma_hold_95_percent_where_the_light_scintillates(kind, sigma, method):
    image, centre = scintillating(kind, ROWS, sigma, seed=5)
    line = extract(image, method=method, noise=known_noise(kind))
    assert line.valid[:, 0].mean() > 0.99
    assert 0.93 - CHANCE < cover(line, centre, 2.0) < 0.97 + CHANCE
    # the likelihood would see that the profile is not that of a line; of a coarse grain the light along it tells
    if method != "likelihood" and kind != COARSE:
        blind = extract(image, method=method, noise=known_noise(0.0))
        assert np.nanmedian(blind.sigma_u) < 0.7 * np.nanmedian(line.sigma_u)


@pytest.mark.parametrize("kind", [0.0, 0.2, FINE, COARSE])
def test_variance_of_a_mean_over_ten_rows_is_foretold(kind):
    image, centre = scintillating(kind, 8000, 1.5, seed=6)
    line = extract(image, noise=known_noise(kind))
    # 15 %, and three standard deviations of a variance from 800 means
    assert variance_of_means(line, centre, 10) == pytest.approx(1.0, abs=0.15 + 3 * math.sqrt(2 / 800))


def test_rows_of_coarse_speckle_err_alike_and_those_of_a_plain_image_do_not():
    rough, plain = (
        extract(scintillating(kind, 256, 1.5, seed=7)[0], noise=known_noise(kind)) for kind in (COARSE, 0.0)
    )
    field = speckle(NM, COARSE[0], PITCH)
    middle = len(field.correlation) // 2
    # a wide line's rows are as correlated as the light of a column of pixels, or more by the diagonals
    assert np.nanmin(rough.correlation_length) > field.correlation[:, middle].sum() - 0.05
    np.testing.assert_array_equal(plain.correlation_length[plain.valid], 1.0)


def test_smoothed_noise_is_shared_by_two_root_pi_sigma_rows():
    image, centre = scintillating(0.0, 8000, 1.5, seed=8)
    line = extract(image, method="phase", settings=ExtractionSettings(smoothing=2.0), noise=known_noise(0.0))
    assert np.nanmedian(line.correlation_length) == pytest.approx(2.0 * math.sqrt(math.pi) * 2.0, rel=0.01)
    assert variance_of_means(line, centre, 100) == pytest.approx(1.0, abs=0.15 + 3 * math.sqrt(2 / 80))


def test_smoothing_covariances_is_smoothing_the_field():
    rng = np.random.default_rng(0)
    taps = speckle(NM, 11.0, PITCH, True).taps
    white = fftconvolve(rng.normal(size=(1500, 1500)), taps[::2, ::2], mode="valid")  # any correlated field
    size = 8
    part = white[:1400, :1400]
    table = np.array([[np.mean(part * white[k : 1400 + k, d : 1400 + d]) for d in range(size)] for k in range(size)])
    noise = NoiseModel(scintillation=tuple(map(tuple, table.tolist())))
    smooth = gaussian_filter(white, 1.5)[20:-20, 20:-20]
    found = smoothed_covariances(noise, 1.5)
    for d in (0, 1, 3):
        assert found[0, d] == pytest.approx(np.mean(smooth[:, :1300] * smooth[:, d : 1300 + d]), rel=0.05)


@pytest.mark.parametrize(
    ("kind", "contrast"), [(0.05, 0.05), (0.2, 0.2), (FINE, speckle(NM, FINE[0], PITCH, True).contrast)]
)
def test_an_unknown_image_tells_how_much_it_scintillates(kind, contrast):
    image, centre = scintillating(kind, ROWS, 1.5, seed=9)
    noise = estimate_noise(image, ExtractionSettings())
    # a variance from some 1500 pixels that the fit leaves free, of which shot noise is told apart
    assert noise.contrast == pytest.approx(contrast, rel=0.15)
    line = extract(image)
    assert 0.93 - CHANCE < cover(line, centre, 2.0) < 0.97 + CHANCE


def test_shot_noise_is_no_scintillation():
    for seed in range(4):
        image, centre = scintillating(0.0, ROWS, 1.5, seed=seed)
        noise = estimate_noise(image, ExtractionSettings())
        assert noise.scintillation == ()
        assert noise.gain == pytest.approx(0.1, rel=0.15)
        assert 0.93 - CHANCE < cover(extract(image), centre, 2.0) < 0.97 + CHANCE


@pytest.mark.parametrize(("kind", "flagged"), [((11.0, False), True), (COARSE, False), (0.2, False)])
def test_a_line_of_few_grains_is_flagged(kind, flagged):
    image, _ = scintillating(kind, 400, 4.0, seed=10)
    flags = extract(image, noise=known_noise(kind)).flag
    assert (np.mean(flags == Flag.SPECKLED) > 0.85) if flagged else (np.mean(flags == Flag.SPECKLED) <= 0.02)


@pytest.mark.parametrize("signal", [300.0, 3000.0])
def test_a_rough_surface_is_no_scintillation(signal):
    """Centres that jump by half a pixel from row to row counted as noise that multiplies the light: sigma 20 times."""
    line, centre = measured(PLAIN, signal, 0.6, ROWS, seed=10, known=False)
    assert 0.93 - CHANCE < cover(line, centre, 2.0) < 0.97 + CHANCE


@pytest.mark.parametrize("signal", [100.0, 10000.0])
def test_float_images_tell_their_gain_whatever_their_scale(signal):
    image, centre, _ = photographed(PLAIN, signal, 2.0, ROWS, seed=11)
    for scale in (1.0, 1e-4):
        line = extract(image * scale)
        assert 0.93 - CHANCE < cover(line, centre, 2.0) < 0.97 + CHANCE


def test_a_slope_of_the_background_is_no_noise():
    """Of what is a count and what black level a slope tells little; of how much it scatters at the line, all."""
    for signal in (1000.0, 10000.0):
        line, centre = measured(TROUBLES["slope 1 %"], signal, 2.0, ROWS, seed=12, known=False)
        assert 0.93 - CHANCE < cover(line, centre, 2.0) < 0.97 + CHANCE


def test_what_clips_an_image_below_its_full_scale_is_found():
    image, _, noise = photographed(Trouble(overexposure=3.0), 10000.0, 2.0, 512, seed=13)
    assert image_saturation(image) == noise.saturation
    assert image_saturation(image.clip(0).astype(np.uint16)) == noise.saturation
    whole, _, _ = photographed(PLAIN, 100.0, 2.0, 512, seed=13)
    for one in (whole, whole.clip(0).astype(np.uint8), expected(64, np.full(512, 32.0), 200.0, 2.0, 3.0)):
        assert image_saturation(one) is None


@pytest.mark.parametrize("table", [((0.1,), (0.1, 0.0)), ((),), ((0.1, 0.2),), ((-0.1,),)])
def test_what_is_no_covariance_is_refused(table):
    with pytest.raises(ValidationError, match="scintillation"):
        NoiseModel(scintillation=table)
