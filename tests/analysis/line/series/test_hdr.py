"""Several exposures in one image, and a sweep along time: each against what statistics and geometry allow."""

import numpy as np
import pytest

from analysis.line.detection.noise import NoiseModel
from analysis.line.extract import extract
from analysis.line.result import Flag
from analysis.line.series.hdr import fuse
from analysis.line.series.spacetime_at_rest import passage
from render.base.errors import InputError
from tests.analysis.line.line_images import electrons, expected, exposed

FULL = 10_000.0
ROWS, WIDTH = 1500, 160
TIMES = (1.0, 1 / 8, 1 / 64)


def exposures(amplitude, seed=0):
    """Centres and the images of a line whose peak makes `amplitude` (ROWS,) electrons in the longest exposure."""
    rng = np.random.default_rng(seed)
    centre = WIDTH / 2 + rng.uniform(-0.5, 0.5, ROWS)
    unit = expected(WIDTH, centre, 1.0, 1.5, 0.0) * np.asarray(amplitude)[:, None] + 10.0
    images = [np.minimum(exposed(unit * time, 2.5, rng), FULL).astype(np.float32) for time in TIMES]
    return centre, unit, images


NOISE = electrons(2.5, saturation=FULL)


def test_fused_electrons_and_their_variance_are_right():
    _, mean, images = exposures(np.full(ROWS, 4e5))
    fused = fuse(images, TIMES, NOISE)
    mean = mean * sum(TIMES)
    error = fused.electrons - mean
    # by columns, whose variance is nearly the same: an estimated one follows the count, which would lean the ratio
    for column in (20, 72, 76, 80, 84):
        middle = np.abs(mean[:, column] - np.median(mean[:, column])) < 0.2 * np.median(mean[:, column])
        inside, expected_variance = error[middle, column], fused.variance[middle, column].mean()
        assert abs(inside.mean()) < 3.5 * np.sqrt(expected_variance / middle.sum())
        assert inside.std() == pytest.approx(np.sqrt(expected_variance), rel=3.5 * np.sqrt(0.5 / middle.sum()))


def test_a_line_of_a_thousandfold_range_is_measured_all_along():
    amplitude = np.geomspace(200, 4e5, ROWS)
    centre, _, images = exposures(amplitude)
    fused = fuse(images, TIMES, NOISE)
    line = extract(fused.electrons, noise=fused.noise, variance=fused.variance)
    assert (line.flag[:, 0] == Flag.OK).all()
    error = line.u[:, 0] - centre
    assert 0.93 < np.mean(np.abs(error) < 2 * line.sigma_u[:, 0]) < 0.975
    # as good as the best single exposure at either end, which no single one is
    for image, time in zip(images, TIMES, strict=True):
        single = extract(image, method="centre_of_mass", noise=NOISE)
        bright = single.flag[:, 0] == Flag.SATURATED
        found = single.valid[:, 0] & ~bright
        assert not found.all(), time
        both = single.u[found, 0] - centre[found]
        assert np.sqrt(np.mean(error[found] ** 2)) < np.sqrt(np.mean(both**2))


def test_without_read_noise_fusion_counts_all_electrons_over_all_time():
    rng = np.random.default_rng(1)
    images = [rng.poisson(300.0 * time, (200, 200)).astype(np.float32) for time in TIMES]
    fused = fuse(images, TIMES, NoiseModel(read_noise=0.0, step=0.0, saturation=1e4))
    np.testing.assert_allclose(fused.electrons, sum(images), rtol=2e-3)


def test_pixels_saturated_in_every_exposure_stay_saturated():
    centre, _, images = exposures(np.full(ROWS, 3e6))
    fused = fuse(images, TIMES, NOISE)
    line = extract(fused.electrons, noise=fused.noise, variance=fused.variance)
    assert (line.flag == Flag.SATURATED).all()
    assert np.sqrt(np.mean((line.u[:, 0] - centre) ** 2)) < 0.01


@pytest.mark.parametrize(
    ("images", "times", "text"),
    [
        ([np.zeros((5, 5), np.uint8)], (1.0,), "two exposures"),
        ([np.zeros((5, 5), np.uint8)] * 2, (1.0, 0.0), "time"),
        ([np.zeros((5, 5), np.uint8), np.zeros((5, 6), np.uint8)], (1.0, 2.0), "shape"),
    ],
)
def test_wrong_exposures_are_named(images, times, text):
    with pytest.raises(InputError, match=text):
        fuse(images, times, NOISE)


def sweep(ratio, frames=60, speed=0.5, width=40, sigma=1.5):
    """Mean frames (t, 4, width) of a sheet that sweeps a surface whose albedo steps by `ratio` at column 19.5."""
    albedo = np.where(np.arange(width) < 19.5, 1.0, 1.0 / ratio)
    centre = 5 + speed * np.arange(frames)
    return centre, np.repeat((expected(width, centre, 5000, sigma, 0.0) * albedo + 10.0)[:, None, :], 4, axis=1)


def test_an_albedo_step_pulls_the_line_in_one_frame_and_not_along_time():
    speed = 0.5
    centre, frames = sweep(10.0, speed=speed)
    images = frames.astype(np.float32)
    single = np.array([extract(image, noise=electrons(2.5)).u[0, 0] for image in images]) - centre
    near = np.abs(centre - 19.5) < 3
    assert 1.0 < np.nanmax(np.abs(single[near])) < 2.2
    found = passage(images, electrons(2.5))
    inside = slice(12, 28)
    assert found.valid[:, inside].all()
    truth = (np.arange(40) - centre[0]) / speed
    assert np.abs((found.time[:, inside] - truth[inside]) * speed).max() < 2e-3


def test_sigma_along_time_is_honest():
    _, frames = sweep(3.0)
    rng = np.random.default_rng(2)
    images = exposed(np.repeat(frames, 40, axis=1), 2.5, rng).astype(np.float32)
    found = passage(images, electrons(2.5))
    truth = (np.arange(40) - 5) / 0.5
    z = ((found.time - truth) / found.sigma_time)[:, 12:28]
    assert np.std(z) == pytest.approx(1.0, abs=0.05)


def test_a_moving_surface_is_followed_along_its_path():
    """The albedo pattern moves with the surface; the sheet stands still: only the tilted slice sees one patch."""
    frames, width, speed = 50, 120, 0.4
    rng = np.random.default_rng(3)
    pattern = np.repeat(rng.uniform(0.2, 1.0, 60), 4)
    x = np.arange(width)
    images = []
    for t in range(frames):
        shift = speed * (t - 0.5 * (frames - 1))
        albedo = np.interp(x - shift + 60, np.arange(240), pattern)
        images.append(albedo * expected(width, np.array([60.0]), 5000, 1.5, 0.0)[0] + 10.0)
    stack = np.repeat(np.stack(images)[:, None, :], 3, axis=1).astype(np.float32)
    still = passage(stack, electrons(2.5))
    moving = passage(stack, electrons(2.5), motion=(speed, 0.0))
    inside = slice(55, 66)
    truth = 0.5 * (frames - 1) + (60.0 - x[inside]) / speed
    worst = np.abs(moving.time[1, inside] - truth).max() * speed
    assert worst < 0.1
    assert not still.valid[1, inside].all() or np.abs(still.time[1, inside] - truth).max() * speed > 5 * worst


def test_where_nothing_passes_there_is_no_time_and_three_frames_are_too_few():
    assert not passage(np.full((8, 40, 60), 5, np.uint8), NoiseModel()).valid.any()
    with pytest.raises(InputError, match="more frames"):
        passage(np.zeros((3, 5, 5), np.uint8), NoiseModel())
