"""What a mosaic and a JPEG move all scan lines by: as far as such images do, and none of it where scatter tells."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ndtr

from analysis.line.detection.noise import NoiseModel
from analysis.line.extract import extract
from analysis.line.result import Flag, Line
from analysis.line.settings import ExtractionSettings
from render.sensor.processing import photograph
from render.sensor.sensor import Sensor
from studio.editing.presets import preset_named
from studio.photographs.laser_light import Channel, full_scale, laser_light
from studio.photographs.mosaic import moved_by, with_mosaic

HEIGHT, WIDTH, GAIN = 96, 128, 0.2


def taken(rng: np.random.Generator, sensor: str, colour: int, middle: float) -> np.ndarray:
    """(HEIGHT, WIDTH, 3) an upright line, as a camera hands it out."""
    how = Sensor(**preset_named("sensors", sensor, "test").values["sensor"])
    width, level, x = rng.uniform(1.2, 3.0), rng.uniform(0.2, 0.6), np.arange(WIDTH)
    line = 2.5 * width * (ndtr((x + 0.5 - middle) / width) - ndtr((x - 0.5 - middle) / width))
    place = np.empty((HEIGHT, WIDTH), np.intp)
    for k, letter in enumerate(how.pattern):
        place[k // 2 :: 2, k % 2 :: 2] = "RGB".index(letter)
    mean = how.full_well * (np.where(place == colour, 1.0, 0.3) * level * line + 0.05)
    electrons = rng.poisson(mean) + how.read_noise * rng.standard_normal(mean.shape)
    full = 2.0**how.bits - 1.0
    raw = np.clip(np.rint(electrons / how.full_well * full), 0.0, full)
    quality = how.processing.model_copy(update={"jpeg_quality": int(rng.integers(70, 96))})
    return photograph(raw, 0.0, full, how.pattern, quality)


def off_by(rng: np.random.Generator, k: int, channel: Channel, colour: int) -> tuple[np.ndarray, float] | None:
    """Mean errors (12,) px of blocks of 8 scan lines of an upright line, and what it is told to be off by; None: the
    line is not found, or clipped."""
    middle = 0.5 * WIDTH + rng.uniform(-4.0, 4.0)
    image = taken(rng, ("webcam", "phone")[k % 2], colour, middle)
    light = laser_light(image, None, channel, ("red", "green", "blue")[colour], full_scale(image, True))
    noise = NoiseModel(gain=GAIN, read_noise=5.0, saturation=light.saturation, alike=True)
    line = extract(light.image, settings=ExtractionSettings(), noise=noise, shared=False, judged=False)
    fits = line.flag[:, 0] == Flag.OK
    if fits.mean() < 0.95:
        return None
    blocks = np.nanmean(np.where(fits, line.u[:, 0] - middle, np.nan).reshape(-1, 8), axis=1)
    width, height = (float(np.median(values[fits, 0])) for values in (line.width, GAIN * line.amplitude))
    return blocks, float(moved_by(channel, width, height))


@pytest.mark.parametrize(("channel", "colour"), [("luminance", 0), ("luminance", 1), ("green", 1), ("red", 0)])
def test_upright_lines_are_off_by_as_much_as_is_told(channel: Channel, colour: int) -> None:
    rng = np.random.default_rng(12)
    found = [one for one in (off_by(rng, k, channel, colour) for k in range(160)) if one is not None]
    assert len(found) >= 80
    blocks, told = np.stack([one[0] for one in found]), np.array([one[1] for one in found])
    chance = blocks.std(axis=1, ddof=1) / np.sqrt(blocks.shape[1])
    assert np.mean(np.abs(blocks.mean(axis=1)) < 2.0 * np.hypot(told, chance)) >= 0.9  # of 95 %, less 2 standard errors
    # noise has no part in the product of an upper and a lower half
    products = blocks[:, ::2].mean(axis=1) * blocks[:, 1::2].mean(axis=1) / told**2
    error = products.std(ddof=1) / np.sqrt(len(products))
    print(f"\n{channel} {colour}: {products.mean():.2f} +- {error:.2f} of the variance told, of {len(found)} lines")
    assert products.mean() < 1.5 + 2.0 * error
    assert products.mean() > 0.1 - 2.0 * error


def straight(slope: float, count: int = 512) -> Line:
    """(count, 1) of 2 px and 100 DN."""
    rows = np.arange(count)[:, None]
    ones = np.ones((count, 1))
    flag = np.zeros((count, 1), np.uint8)
    return Line("rows", "likelihood", 50.0 + slope * rows, 0.01 * ones, 2.0 * ones, 500.0 * ones, ones, ones, flag)


def test_a_line_that_crosses_the_mosaic_has_told_by_its_scatter() -> None:
    whole = float(moved_by("red", 2.0, 100.0))
    told = {slope: float(np.median(with_mosaic(straight(slope), "red", GAIN).sigma_u)) for slope in (0.0, 0.01, 0.25)}
    assert told[0.0] == pytest.approx(np.hypot(0.01, whole)) and told[0.01] == pytest.approx(told[0.0], rel=0.01)
    assert told[0.25] < 0.5 * told[0.0]
    length = with_mosaic(straight(0.0), "red", GAIN).length_apart
    share = whole**2 / (0.01**2 + whole**2)
    assert length is not None and length == pytest.approx(1.0 + 511.0 * share, rel=1e-6) and share > 0.9
    # of a wave of 2 px, half: 100 scan lines at 0.01 px a scan line
    length = with_mosaic(straight(0.01), "red", GAIN).length_apart
    assert length is not None and length == pytest.approx(1.0 + 99.0 * share, rel=0.01)


def test_clipped_lines_are_moved_farther_and_wide_and_high_ones_less() -> None:
    for channel in ("luminance", "green", "red"):
        assert moved_by(channel, 2.0, 100.0, clipped=True) > moved_by(channel, 2.0, 100.0)
        assert moved_by(channel, 4.0, 100.0) < moved_by(channel, 2.0, 100.0) < moved_by(channel, 2.0, 20.0)
