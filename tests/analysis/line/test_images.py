"""Line extraction on every kind of image: types, axes, colours, several peaks, borders, and images that are wrong."""

from typing import get_args

import numpy as np
import pytest
from pydantic import ValidationError

from analysis.line.detection.channel import Lines
from analysis.line.detection.noise import NoiseModel, image_saturation
from analysis.line.estimate import estimate_noise
from analysis.line.extract import extract
from analysis.line.result import Flag
from analysis.line.settings import ExtractionSettings, Method
from render.base.errors import InputError
from tests.analysis.line.line_images import electrons, expected, exposed

METHODS = ("likelihood", "gaussian", "centre_of_mass", "phase", "guo", "steger")
EVERY = [name for name in get_args(Method) if name != "auto"]
ROWS, WIDTH = 80, 200


def slanted(rng=None, amplitude=2000.0, read_noise=3.0):
    """Centres (ROWS,) and electrons (ROWS, WIDTH) of a slanted line, noisy when `rng` is given."""
    centre = 60 + 0.83 * np.arange(ROWS)
    mean = expected(WIDTH, centre, amplitude, 1.3, 15.0)
    return centre, mean if rng is None else exposed(mean, read_noise, rng)


@pytest.mark.parametrize(
    ("dtype", "gain", "bound"), [("uint8", 0.1, 0.05), ("uint16", 20.0, 0.025), ("float64", 1.0, 0.025)]
)
def test_every_pixel_type_gives_the_same_line(dtype, gain, bound):
    centre, counts = slanted(np.random.default_rng(0))
    step = 0.0 if dtype == "float64" else 1.0
    numbers = counts * gain + 8 if step == 0 else np.round(counts * gain + 8)
    noise = NoiseModel(gain=gain, black_level=8, read_noise=3, step=step)
    for method in METHODS:
        line = extract(numbers.astype(dtype), method=method, noise=noise)
        assert line.valid.all()
        assert np.sqrt(np.mean((line.u[:, 0] - centre) ** 2)) < bound
        assert np.median(line.amplitude) == pytest.approx(2000, rel=0.1)
        assert np.median(line.background) == pytest.approx(15, abs=3)


@pytest.mark.parametrize("method", EVERY)
def test_columns_are_rows_of_the_transposed_image(method):
    _, counts = slanted(np.random.default_rng(1))
    image = counts.astype(np.float32)
    rows = extract(image, method=method, noise=electrons(3))
    columns = extract(np.ascontiguousarray(image.T), method=method, axis="columns", noise=electrons(3))
    np.testing.assert_array_equal(rows.u, columns.u)
    pixels, index, _ = columns.pixels()
    assert np.array_equal(pixels[:, 0], index) and np.array_equal(pixels[:, 1], rows.u[index, 0])
    np.testing.assert_array_equal(rows.v[:, 0], np.arange(ROWS))


@pytest.mark.parametrize("saturation", [None, 60000.0])
@pytest.mark.parametrize("dtype", ["uint16", "float32", "float64"])
@pytest.mark.parametrize("channel", ["mono", "red"])
def test_kernels_find_columns_in_the_same_order_of_memory_as_rows(dtype, channel, saturation):
    """Or all of them would be compiled anew for the first image that is read along columns."""
    shape = (ROWS, WIDTH) if channel == "mono" else (ROWS, WIDTH, 3)
    columns = np.full(shape, 100, dtype).swapaxes(0, 1)
    lines = Lines(columns, channel, None, NoiseModel(gain=1.0, read_noise=3.0, saturation=saturation))
    assert all(part.flags.c_contiguous for part in lines.read(0, WIDTH))


def test_result_is_the_same_for_any_number_of_threads():
    rng = np.random.default_rng(2)
    image = exposed(expected(WIDTH, rng.uniform(40, 160, 500), 300, 1.5, 10), 3, rng).astype(np.float32)
    one, four = (extract(image, peaks=3, noise=electrons(3), threads=t) for t in (1, 4))
    for name in ("u", "sigma_u", "width", "amplitude", "background", "chi2", "flag"):
        np.testing.assert_array_equal(getattr(one, name), getattr(four, name))


@pytest.mark.parametrize("laser", ["red", "green", "blue"])
def test_colour_difference_removes_white_light_and_keeps_the_laser(laser):
    rng = np.random.default_rng(3)
    centre, _ = slanted()
    white = 3000 + 2000 * np.sin(np.arange(WIDTH) / 7.0)[None, :] * np.ones((ROWS, 1))
    image = np.stack([white, white, white], axis=2)
    image[..., ["red", "green", "blue"].index(laser)] += expected(WIDTH, centre, 4000, 1.3, 0.0)
    image = exposed(image, 3, rng).astype(np.float32)
    chosen = extract(image, settings=ExtractionSettings(channel=laser), noise=electrons(3))
    guessed = extract(image, noise=electrons(3))
    np.testing.assert_array_equal(chosen.u, guessed.u)
    error = chosen.u[:, 0] - centre
    assert chosen.valid.all()
    z = error / chosen.sigma_u[:, 0]
    assert np.std(z) == pytest.approx(1.0, abs=4 * np.sqrt(0.5 / ROWS))  # white light is gone, its shot noise is not
    assert np.abs(chosen.background).mean() < 100


def test_grey_picture_stored_as_colour_is_read_as_mono():
    _, counts = slanted(np.random.default_rng(4))
    grey = np.clip(np.round(counts * 0.1), 0, 255).astype(np.uint8)
    noise = NoiseModel(gain=0.1, read_noise=3)
    np.testing.assert_allclose(extract(np.stack([grey] * 3, 2), noise=noise).u, extract(grey, noise=noise).u, atol=1e-5)


@pytest.mark.parametrize(("laser", "pattern"), [("green", "RGGB"), ("red", "RGGB"), ("blue", "GBRG")])
@pytest.mark.parametrize("axis", ["rows", "columns"])
def test_bayer_uses_the_pixels_of_the_lasers_colour(laser, pattern, axis):
    rng = np.random.default_rng(5)
    centre = 100 + rng.uniform(-1, 1, ROWS)
    counts = expected(WIDTH, centre, 3000, 1.5, 10)
    if axis == "columns":
        counts = counts.T.copy()
    rows, columns = np.indices(counts.shape)
    colour = np.array(list(pattern))[2 * (rows % 2) + columns % 2]
    image = exposed(np.where(colour == laser[0].upper(), counts, 10.0), 3, rng).astype(np.float32)
    settings = ExtractionSettings(pattern=pattern, axis=axis)
    line = extract(image, settings=settings, noise=electrons(3))
    has_colour = (colour == laser[0].upper()).any(axis=1 if axis == "rows" else 0)
    assert np.array_equal(line.valid[:, 0], has_colour)
    assert (line.flag[~has_colour] == Flag.NO_PIXELS).all()
    z = (line.u[:, 0] - centre)[has_colour] / line.sigma_u[has_colour, 0]
    assert np.std(z) == pytest.approx(1.0, abs=4 * np.sqrt(0.5 / has_colour.sum()))


@pytest.mark.parametrize("method", METHODS)
def test_two_lines_are_both_found_strongest_first(method):
    rng = np.random.default_rng(6)
    strong, weak = 80 + rng.uniform(-0.5, 0.5, 400), 92 + rng.uniform(-0.5, 0.5, 400)  # 8 sigma apart
    mean = expected(WIDTH, strong, 2000, 1.5, 10) + expected(WIDTH, weak, 600, 1.5, 0)
    line = extract(exposed(mean, 3, rng).astype(np.float32), method=method, peaks=3, noise=electrons(3))
    assert line.valid[:, :2].all()
    assert (line.flag[:, 2] == Flag.NO_PEAK).mean() > 0.99
    # the neighbour's tail costs a little bias: still well inside a tenth of a pixel
    assert np.sqrt(np.mean((line.u[:, 0] - strong) ** 2)) < 0.03
    assert np.sqrt(np.mean((line.u[:, 1] - weak) ** 2)) < 0.07
    assert (line.amplitude[:, 0] > line.amplitude[:, 1]).all()


def test_textured_background_does_not_fill_the_rows_with_peaks():
    rng = np.random.default_rng(7)
    texture = 400 * (1 + 0.3 * rng.standard_normal((200, 600)))
    line = extract(exposed(np.maximum(texture, 0), 3, rng).astype(np.float32), noise=electrons(3))
    assert line.valid.mean() < 0.05
    mean = np.maximum(texture, 0) + expected(600, np.full(200, 300.3), 4000, 1.5, 0)
    line = extract(exposed(mean, 3, rng).astype(np.float32), noise=electrons(3))
    assert np.mean(np.abs(line.u[:, 0] - 300.3) < 0.5) > 0.99


def test_ambient_slope_does_not_hide_the_line():
    centre = 60 + 0.83 * np.arange(ROWS)
    slope = 3.0 * np.arange(WIDTH)[None, :]
    rng = np.random.default_rng(8)
    image = exposed(expected(WIDTH, centre, 500.0, 1.3, 15.0) + slope, 3, rng).astype(np.float32)
    line = extract(image, noise=electrons(3))
    assert line.valid.mean() > 0.97
    assert abs(np.nanmean(line.u[:, 0] - centre)) < 0.05


def test_missing_pixels_are_left_out():
    centre, counts = slanted(np.random.default_rng(9))
    image = counts.astype(np.float32)
    image[np.arange(ROWS), np.round(centre).astype(int) + 1] = np.nan
    image[10, :] = np.nan
    line = extract(image, noise=electrons(3))
    assert line.flag[10, 0] == Flag.NO_PIXELS
    keep = np.arange(ROWS) != 10
    z = (line.u[keep, 0] - centre[keep]) / line.sigma_u[keep, 0]
    assert np.std(z) == pytest.approx(1.0, abs=4 * np.sqrt(0.5 / ROWS))


@pytest.mark.parametrize("method", EVERY)
def test_line_cut_by_the_border_is_flagged_or_right(method):
    centre = np.linspace(-3, 14, 171)
    image = exposed(expected(WIDTH, centre, 2000, 1.3, 10), 3, np.random.default_rng(10)).astype(np.float32)
    line = extract(image, method=method, noise=electrons(3))
    valid = line.valid[:, 0]
    assert not valid[centre < -0.5].any()
    assert np.isin(line.flag[centre < -0.5], (Flag.AT_BORDER, Flag.NOT_CONVERGED)).mean() > 0.9
    assert valid[(centre > 9) & (centre < 12)].all()
    # a method without a sigma is locked to the pixels: by half of one, and noise, for the row maximum
    bound = np.where(np.isnan(line.sigma_u[valid, 0]), 0.8, 5 * line.sigma_u[valid, 0] + 0.02)
    assert (np.abs(line.u[valid, 0] - centre[valid]) < bound).all()
    assert np.isnan(line.u[~valid]).all()


def test_wide_glow_is_refused_with_its_reason():
    image = expected(1000, np.full(20, 500.0), 5000, 60.0, 10).astype(np.float32)
    assert (extract(image, noise=electrons(3)).flag == Flag.TOO_WIDE).all()


@pytest.mark.parametrize("value", [0, 255])
@pytest.mark.parametrize("method", EVERY)
def test_black_and_saturated_images_have_no_line(value, method):
    image = np.full((20, 100), value, np.uint8)
    for noise in (None, NoiseModel(gain=0.1, read_noise=3, saturation=255)):
        line = extract(image, method=method, noise=noise)
        assert (line.flag == Flag.NO_PEAK).all() and np.isnan(line.u).all()


@pytest.mark.parametrize(
    "image",
    [
        np.zeros((0, 100), np.uint8),
        np.zeros((100, 0), np.uint8),
        np.zeros(100, np.uint8),
        np.zeros((10, 10, 4), np.uint8),
        np.zeros((10, 10, 3, 3), np.uint8),
        np.zeros((10, 10), bool),
        np.zeros((10, 10), complex),
        np.zeros((10, 10), np.int64),
        np.array([["a", "b"]]),
        np.full((10, 10), np.nan, np.float32),
        np.full((10, 10), np.inf),
        "picture.png",
        None,
    ],
)
def test_bad_images_are_named(image):
    with pytest.raises(InputError, match="image"):
        extract(image)


@pytest.mark.parametrize("shape", [(1, 1), (3, 1), (1, 5), (2, 3), (5, 8)])
def test_tiny_images_are_answered(shape):
    for method in EVERY:
        assert extract(np.zeros(shape, np.uint8), method=method).flag.shape == (shape[0], 1)
        image = np.zeros(shape, np.uint8)
        image[:, shape[1] // 2] = 200
        extract(image, method=method)


def test_missing_channel_and_bad_settings_are_named():
    mono = np.zeros((20, 30), np.uint8)
    with pytest.raises(InputError, match="channel"):
        extract(mono, settings=ExtractionSettings(channel="green"))
    with pytest.raises(InputError, match="pattern"):
        extract(np.zeros((20, 30, 3), np.uint8), settings=ExtractionSettings(pattern="RGGB"))
    with pytest.raises(InputError, match=r"extraction\.peaks"):
        extract(mono, peaks=0)
    with pytest.raises(InputError, match=r"extraction\.method"):
        extract(mono, method="magic")
    with pytest.raises(ValidationError, match="Bayer"):
        ExtractionSettings(channel="mono", pattern="RGGB")


def test_likelihood_does_without_smoothing():
    image = slanted(np.random.default_rng(11))[1].astype(np.float32)
    smooth = extract(image, settings=ExtractionSettings(smoothing=3.0), noise=electrons(3))
    np.testing.assert_array_equal(smooth.u, extract(image, noise=electrons(3)).u)


def test_numbers_that_are_whole_are_known_for_it_whatever_is_missing_among_them() -> None:
    rng = np.random.default_rng(3)
    line = 60.0 * np.exp(-0.5 * ((np.arange(96) - 48.0) / 2.0) ** 2)
    image = rng.poisson(20.0 + line, (64, 96)).astype(np.float32)
    image[5, 7], image[9] = np.nan, np.nan
    assert estimate_noise(image, ExtractionSettings()).step == 1.0
    image[0, 0] += 0.25
    assert estimate_noise(image, ExtractionSettings()).step == 0.0


def test_what_clips_an_image_is_told_by_the_next_lower_number_that_there_is() -> None:
    """Whole numbers and others alike, and where numbers below the highest are left out."""
    steep, gentle = np.full(1000, 50), np.full(1000, 50)
    steep[:200], steep[200:240] = 180, 170
    gentle[:200], gentle[200:300] = 180, 179
    for kind in (np.uint8, np.uint16, np.float32):
        assert image_saturation(steep.astype(kind)) == 180.0
        assert image_saturation(gentle.astype(kind)) is None
