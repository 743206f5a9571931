"""What passes bring: added up, guarded against what is no number, and clamped only where that is asked for."""

from __future__ import annotations

import math

import numpy as np
import pytest

from render.camera.camera import Camera
from render.importance import Importance
from render.laser_indirect.accumulator import WAVE_WEIGHT_EXPONENT, Accumulator
from render.laser_indirect.connection_buffer import empty_connections, splat_unoccluded
from render.laser_indirect.guiding import BINS, NO_PIXELS, no_guide
from render.laser_indirect.integrator import empty_buffer
from render.laser_indirect.photon_emission import uniform_fan

CAMERA = Camera(width=4, height=2, fx=4.0, fy=4.0, cx=1.5, cy=0.5)


def nothing(pixels=8, size=100, most=8):
    arrays = np.zeros((0, BINS)), np.zeros(pixels), np.zeros(pixels, np.float32)
    return Accumulator(
        0,
        uniform_fan(0.0, 1.0),
        size,
        4 if size > 100 else 1 << 20,
        0.0,
        NO_PIXELS,
        np.zeros(pixels, np.float32),
        no_guide(CAMERA),
        *arrays,
    )


def passes(*images):
    buffers = []
    for image in images:
        buffer = empty_buffer(len(image))
        buffer.image[:], buffer.touched[:] = image, True
        buffers.append(buffer)
    return buffers


def test_what_is_no_number_is_left_out_and_counted():
    connections, buffer = empty_connections(6), empty_buffer(8)
    connections.contribution[:] = (1.0, math.nan, math.inf, -1.0, 2.0, 4.0)
    connections.pixel[:], connections.kind[:], connections.fan_bin[:] = np.arange(6), 0, 0
    splat_unoccluded(connections, np.array([False] * 5 + [True]), 6, 0.5, buffer)
    assert buffer.image.tolist() == [0.5, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
    assert buffer.invalid[0] == 3.0 and np.isfinite(buffer.fan_moments).all() and np.isfinite(buffer.sums).all()
    so_far = nothing()
    so_far.add([buffer, empty_buffer(8)], np.zeros((2, 0, BINS)))
    assert so_far.invalid == 3.0 and np.isfinite(so_far.radiance((2, 4))).all()


def test_the_error_is_that_of_the_mean_of_the_passes():
    rng = np.random.default_rng(4)
    # as passes hold them
    images = rng.gamma(3.0, 1.0, (16, 8)).astype(np.float32).astype(np.float64)
    so_far = nothing()
    so_far.add(passes(*images), np.zeros((16, 0, BINS)))
    mean, variance = images.mean(axis=0), images.var(axis=0, ddof=1) / 16
    assert so_far.radiance((2, 4)).ravel() == pytest.approx(mean, rel=1e-6)
    assert so_far.error == pytest.approx(math.sqrt(variance.sum() / (np.sum(mean**2) - variance.sum())), rel=1e-9)


def test_later_waves_weigh_more_and_the_error_is_the_scatter_of_what_they_add_up_to():
    rng = np.random.default_rng(8)
    renders, errors = [], []
    for _ in range(300):
        so_far = nothing()
        for _ in range(4):
            # the larger a pass, the less noisy
            images = 5.0 + rng.standard_normal((4, 8)) / math.sqrt(so_far.growth)
            so_far.add(passes(*images), np.zeros((4, 0, BINS)))
        assert (so_far.passes, so_far.growth, so_far.paths) == (32, 8, 4 * 8 * 100 << 2)
        renders.append(so_far.radiance((2, 4)).ravel())
        errors.append(so_far.error * 5.0)
    scatter = np.std(renders, axis=0, ddof=1)
    sizes = np.array([1.0, 1.0, 2.0, 4.0])
    weights = sizes**WAVE_WEIGHT_EXPONENT
    expected = math.sqrt(np.sum(weights**2 / sizes) / 4) / weights.sum()
    # the standard error of 2400 values' scatter is 1.4 %
    assert np.sqrt(np.mean(scatter**2)) == pytest.approx(expected, rel=0.06)
    assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(expected, rel=0.06)


def test_waves_grow_up_to_a_limit():
    so_far, sizes = nothing(size=1 << 13, most=4), []
    for _ in range(6):
        sizes.append(so_far.growth)
        so_far.add(passes(np.ones(8), np.ones(8)), np.zeros((2, 0, BINS)))
    assert sizes == [1, 1, 2, 4, 4, 4]


def test_a_last_wave_is_no_larger_than_the_measured_line_should_take():
    rng, weight, sizes, beyond = np.random.default_rng(3), np.zeros((2, 4), np.float32), [], [math.inf]
    # all waves together need a size of about 100 for an error of 1
    weight[:, 1], weight[:, 2] = -13.0, 13.0
    so_far = nothing()
    so_far.aim_at(Importance((weight,), np.abs(weight)), 0)
    while beyond[-1] > 1.0:
        sizes.append(so_far.growth)
        images = 20.0 + rng.standard_normal((8, 8)) / math.sqrt(sizes[-1])
        so_far.add(passes(*images), np.zeros((8, 0, BINS)))
        assert np.array_equal(Accumulator.of_arrays(so_far.arrays()).growth, so_far.growth)
        beyond.append(so_far.line_error)
    for wave, size in enumerate(sizes[1:], 1):
        enough = math.ceil(sum(sizes[:wave]) * max(beyond[wave] ** 2 - 1.0, 0.125))
        assert size == min(2 ** (wave - 1), enough)
    assert sizes[-1] < 2 ** (len(sizes) - 2) and sum(sizes) < 128 + 64


def test_the_clamp_takes_what_it_says_and_nothing_is_clamped_unasked():
    images = np.ones((2, 8))
    images[1, 3] = 100.0
    free, cut = nothing(), nothing()
    free.add(passes(*images), np.zeros((2, 0, BINS)))
    cut.add(passes(*images), np.zeros((2, 0, BINS)), clamp=10.0)
    assert free.clamped == free.clamped_radiance == 0.0
    assert cut.clamped == 1.0 and cut.clamped_radiance == 90.0
    assert free.total.sum() - cut.total.sum() == 90.0


def test_arrays_hold_all_of_it():
    so_far = nothing()
    so_far.add(passes(np.arange(8.0), np.ones(8)), np.zeros((2, 0, BINS)), clamp=5.0)
    again = Accumulator.of_arrays(so_far.arrays())
    for name, array in so_far.arrays().items():
        assert np.array_equal(again.arrays()[name], array)
    assert (again.passes, again.error, again.clamped, again.clamped_radiance) == (
        2,
        so_far.error,
        2.0,
        so_far.clamped_radiance,
    )
    assert (again.waves, again.paths, again.variance_sum, again.camera_share) == (
        1,
        800,
        so_far.variance_sum,
        so_far.camera_share,
    )
