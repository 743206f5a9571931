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


@pytest.mark.parametrize(("channel", "colour"), [("luminance", 0), ("luminance", 1), ("green", 1), ("red", 0)])
def test_upright_lines_are_off_by_as_much_as_is_told(channel: Channel, colour: int) -> None:
    rng = np.random.default_rng(12)
    ratios = []
    for k in range(80):
        middle = 0.5 * WIDTH + rng.uniform(-4.0, 4.0)
        image = taken(rng, ("webcam", "phone")[k % 2], colour, middle)
        light = laser_light(image, None, channel, ("red", "green", "blue")[colour], full_scale(image, True))
        noise = NoiseModel(gain=GAIN, read_noise=5.0, saturation=light.saturation, alike=True)
        line = extract(light.image, settings=ExtractionSettings(), noise=noise, shared=False, judged=False)
        fits = line.flag[:, 0] == Flag.OK
        if fits.mean() < 0.95:
            continue
        width, height = (float(np.median(values[fits, 0])) for values in (line.width, GAIN * line.amplitude))
        ratios.append((np.median(line.u[fits, 0]) - middle) / float(moved_by(channel, width, height)))
    ratio = np.abs(ratios)
    assert len(ratio) >= 40
    assert np.mean(ratio < 2.0) >= 0.9  # of 95 %, less two standard errors
    assert np.median(ratio) > 0.1


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
    assert length is not None and float(length.min()) > 500.0


def test_clipped_lines_are_moved_farther_and_wide_and_high_ones_less() -> None:
    for channel in ("luminance", "green", "red"):
        assert moved_by(channel, 2.0, 100.0, clipped=True) > moved_by(channel, 2.0, 100.0)
        assert moved_by(channel, 4.0, 100.0) < moved_by(channel, 2.0, 100.0) < moved_by(channel, 2.0, 20.0)
