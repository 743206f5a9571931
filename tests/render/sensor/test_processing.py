"""What a webcam makes of a raw image: every stage against a closed form, or against another way to the same numbers."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from pydantic import ValidationError

from render.sensor.blur import Spread, point_spread
from render.sensor.develop import develop, expected_electrons
from render.sensor.processing import (
    compressed,
    demosaiced,
    denoised,
    linear_light,
    photograph,
    sharpened,
    toned,
)
from render.sensor.sensor import Processing, Sensor, SpectralCurve
from studio.editing.presets import presets
from tests.render.sensor.test_develop import HEIGHT, WIDTH, flat_frame, radiance_for, scene_of, sensor_of

PATTERNS = ("RGGB", "BGGR", "GRBG", "GBRG")
FILTERS = tuple(
    SpectralCurve(wavelength_nm=(400, 500, 600, 700), value=values)
    for values in ((0.05, 0.1, 0.5, 0.4), (0.1, 0.6, 0.2, 0.1), (0.5, 0.3, 0.05, 0.05))
)


def mosaic_of(colour, pattern, shape=(24, 32)):
    out = np.empty(shape, np.float32)
    for place, letter in enumerate(pattern):
        out[place // 2 :: 2, place % 2 :: 2] = colour["RGB".index(letter)]
    return out


def bayer(**values) -> Sensor:
    quiet = {"colour": "bayer", "efficiency": FILTERS, "black_level": 64.0, "prnu": 0.0, "dsnu": 0.0}
    return Sensor(**(quiet | {"processing": Processing()} | values))


@pytest.mark.parametrize("pattern", PATTERNS)
@pytest.mark.parametrize("how", ["bilinear", "edge_aware"])
def test_a_flat_field_of_any_pattern_stays_flat_and_of_its_colour(pattern: str, how: str) -> None:
    colour = (0.7, 0.4, 0.1)
    found = demosaiced(mosaic_of(colour, pattern), pattern, how)
    np.testing.assert_allclose(found, np.broadcast_to(colour, found.shape), atol=1.0 / 65535)


def test_bilinear_demosaicing_keeps_a_ramp() -> None:
    ramp = np.broadcast_to(np.linspace(0.1, 0.9, 32, dtype=np.float32), (24, 32))
    found = demosaiced(ramp, "RGGB", "bilinear")[4:-4, 4:-4]
    np.testing.assert_allclose(found, np.repeat(ramp[4:-4, 4:-4, None], 3, axis=2), atol=2.0 / 65535)


def test_the_laser_reaches_every_channel_by_its_filters_at_the_wavelength() -> None:
    """Ratios of a line of the spectrum, by interpolation in the curves: 550 nm gives 0.3, 0.4 and 0.175."""
    scene, sensor = scene_of(0.02, wavelength_nm=550.0), bayer(full_well=20000, dark_current=0.0, bits=12)
    frame = flat_frame(radiance_for(5000.0, scene, sensor))
    image = develop(frame, scene, sensor, noise=False)
    means = image.pixels[4:-4, 4:-4].reshape(-1, 3).mean(axis=0)
    assert means / means[1] == pytest.approx([0.3 / 0.4, 1.0, 0.175 / 0.4], abs=1.0 / means[1])


def test_each_channel_saturates_at_its_own_light() -> None:
    """As the light grows green is full first, then red, at 4/3 of it, then blue at 16/7."""
    scene, sensor = scene_of(0.02, wavelength_nm=550.0), bayer(full_well=10000, dark_current=0.0)
    first = radiance_for(10000.0, scene, sensor.model_copy(update={"processing": None}))
    # radiance_for looks at the first pixel, which is red
    for level, full in ((0.70, ""), (0.80, "G"), (1.05, "GR"), (1.75, "GRB")):
        pixels = develop(flat_frame(level * first), scene, sensor, noise=False).pixels[8, 8]
        assert {c for c, number in zip("RGB", pixels, strict=True) if number == 255} == set(full)


def test_white_balance_is_a_gain_and_clips() -> None:
    raw = mosaic_of((1000, 2000, 500), "GBRG").astype(np.uint16)
    found = photograph(raw, 0.0, 4000.0, "GBRG", Processing(white_balance=(2.0, 1.0, 10.0)))
    assert np.all(found == np.array([128, 128, 255]))


@pytest.mark.parametrize("tone", ["linear", "gamma", "srgb"])
def test_the_tone_curve_and_its_inverse_are_one(tone: str) -> None:
    light = np.linspace(0.0, 1.0, 1001, dtype=np.float32)
    how = Processing(tone=tone, gamma=1.8)
    code = toned(light, tone, 1.8)
    assert np.all(np.diff(code) > 0) and code[0] == 0.0 and code[-1] == pytest.approx(1.0)
    np.testing.assert_allclose(linear_light(255.0 * code, how), light, atol=2e-6)


def test_srgb_is_that_of_the_standard() -> None:
    """IEC 61966-2-1: 18 % grey is coded 117.6, and 0.0031308 is where the straight part ends, at 10.3."""
    assert 255.0 * toned(np.array([0.18, 0.0031308], np.float32), "srgb", 1.0) == pytest.approx(
        [117.6, 10.31], abs=0.05
    )


def test_denoising_takes_noise_and_leaves_a_step() -> None:
    noise = np.random.default_rng(1).normal(0.0, 0.01, (128, 128)).astype(np.float32)
    step = np.where(np.arange(128) < 64, 0.2, 0.8).astype(np.float32) + noise
    found = denoised(step, 1.5, 0.05)
    assert found[:, 8:56].std() < 0.35 * noise[:, 8:56].std()
    assert np.abs(found[:, 60:68] - np.where(np.arange(60, 68) < 64, 0.2, 0.8)).max() < 0.05
    colour = denoised(np.repeat(step[..., None], 3, axis=2), 1.5, 0.05)
    np.testing.assert_allclose(colour[..., 1], found, atol=1e-4)


def test_sharpening_adds_what_the_blur_takes_from_a_wave() -> None:
    """Of a wave of period p an unsharp mask makes 1 + amount (1 - exp(-2 (pi radius / p)^2)) times as much."""
    wave = 0.5 + 0.1 * np.sin(2 * np.pi * np.arange(128) / 16.0)
    image = np.repeat(wave[None, :], 64, axis=0).astype(np.float32)
    found = sharpened(image, 0.7, 1.5)[32, 32:96] - 0.5
    wanted = 1.0 + 0.7 * (1.0 - np.exp(-2.0 * (np.pi * 1.5 / 16.0) ** 2))
    assert np.ptp(found) / np.ptp(image[32, 32:96]) == pytest.approx(wanted, rel=0.01)


@pytest.mark.parametrize("quality", [70, 95])
def test_jpeg_is_what_a_file_of_it_would_decode_to(quality: int, tmp_path) -> None:
    image = np.random.default_rng(2).integers(0, 255, (40, 56, 3), np.uint8)
    smooth = cv2.GaussianBlur(image, (0, 0), 3.0)
    path = tmp_path / "image.jpg"
    sampling = [cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_420]
    cv2.imwrite(str(path), smooth[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, quality, *sampling])
    np.testing.assert_array_equal(compressed(smooth, quality, "4:2:0"), cv2.imread(str(path))[..., ::-1])


def test_jpeg_halves_the_resolution_of_colour_alone() -> None:
    """Columns of red and green in turn, of one luma: 4:2:0 takes the colours away, 4:4:4 keeps them."""
    image = np.full((64, 64, 3), 120, np.uint8)
    image[:, ::2] = (180, 90, 120)
    image[:, 1::2] = (60, 151, 120)
    colours = {
        c: np.abs(np.diff(compressed(image, 98, c)[8:-8, 8:-8, 0].astype(int))).mean() for c in ("4:2:0", "4:4:4")
    }
    assert colours["4:4:4"] > 100 and colours["4:2:0"] < 20


def test_a_line_spreads_its_share_into_halo_and_scatter() -> None:
    image = np.zeros((401, 401), np.float32)
    image[200, 200] = 1e4
    spread = Spread(0.7, 0.04, 5.0, 0.02, 40.0)
    out = point_spread(image, spread).astype(np.float64)
    assert out.sum() == pytest.approx(1e4, rel=1e-5)
    x = np.arange(401) - 200.0
    wanted = 0.94 * 0.7**2 + 0.04 * 25.0 + 0.02 * 1600.0
    assert (out.sum(axis=0) @ x**2) / out.sum() == pytest.approx(wanted, rel=2e-3)
    far = np.hypot(x, x[:, None]) > 40.0
    assert out[far].sum() / 1e4 == pytest.approx(0.02 * np.exp(-0.5), rel=0.02)


def test_without_processing_the_image_is_raw_and_scatter_of_nothing_changes_nothing() -> None:
    scene = scene_of(0.02)
    frame = flat_frame(radiance_for(3000.0, scene, sensor_of()))
    raw = develop(frame, scene, sensor_of(), seed=3)
    assert not raw.processed and raw.grey is raw.pixels
    spot = np.zeros((HEIGHT, WIDTH), np.float32)
    spot[HEIGHT // 2, WIDTH // 2] = 1.0
    lit = replace(frame, laser_direct=(spot,))
    whole, spread = (
        expected_electrons(lit, scene, sensor_of(dark_current=0.0, scatter=share, scatter_sigma=2e-5)).sum()
        for share in (0.0, 0.3)
    )
    assert spread == pytest.approx(whole, rel=1e-5)


def test_a_mono_sensor_makes_a_grey_photograph() -> None:
    scene, sensor = scene_of(0.02), sensor_of(processing=Processing(jpeg_quality=90), dark_current=0.0)
    level = radiance_for(0.5 * sensor.full_well, scene, sensor)
    image = develop(flat_frame(level), scene, sensor, noise=False)
    assert image.processed and image.pixels.shape == (HEIGHT, WIDTH) and image.pixels.dtype == np.uint8
    assert np.abs(image.pixels.astype(int) - 128).max() <= 1
    # the gain is that of white light: electrons times it are the numbers
    assert image.gain * 0.5 * sensor.full_well == pytest.approx(127.5, rel=0.001)


def test_share_of_halo_and_scatter_is_at_most_all_light() -> None:
    with pytest.raises(ValidationError, match="more than all of the light"):
        Sensor(halo=0.7, scatter=0.4)


@pytest.mark.parametrize("name", ["Webcam", "Phone"])
def test_the_presets_photographs_are_repeatable_and_coloured(name: str) -> None:
    values = next(p for p in presets("sensors") if name in p.name).values["sensor"]
    scene, sensor = scene_of(0.02, wavelength_nm=650.0), Sensor(**values)
    frame = flat_frame(radiance_for(1000.0, scene, sensor))
    first, again = (develop(frame, scene, sensor, seed=5, threads=threads).pixels for threads in (1, 2))
    assert np.array_equal(first, again) and first.shape == (HEIGHT, WIDTH, 3)
    red, green, blue = first[20:-20, 20:-20].reshape(-1, 3).mean(axis=0)
    assert red > 1.3 * green and red > 1.3 * blue
