"""Lens blur and defocus: energy, variance and shape against the thin lens."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from render.base.errors import InputError
from render.camera.camera import Camera
from render.frame import Truth
from render.sensor.blur import Spread, defocus, disc_diameter, disc_kernel, point_spread
from render.sensor.develop import expected_electrons
from tests.render.sensor.test_develop import HEIGHT, WIDTH, flat_frame, scene_of, sensor_of


def variance(image):
    """Along the columns' axis, px^2."""
    x = np.arange(image.shape[1])
    light = image.sum(axis=0, dtype=np.float64)
    mean = light @ x / light.sum()
    return light @ (x - mean) ** 2 / light.sum()


def point(size=201):
    image = np.zeros((size, size), np.float32)
    image[size // 2, size // 2] = 1000.0
    return image


@pytest.mark.parametrize("sigma", [0.2, 0.5, 1.0, 3.0])
def test_point_spread_keeps_light_and_has_the_lenss_variance(sigma):
    out = point_spread(point(), Spread(sigma))
    assert out.sum() == pytest.approx(1000.0, rel=1e-5)
    assert variance(out) == pytest.approx(sigma**2, rel=1e-3)


def test_halo_takes_its_share_far_out():
    out = point_spread(point(), Spread(0.5, 0.1, 8.0))
    assert variance(out) == pytest.approx(0.9 * 0.25 + 0.1 * 64.0, rel=1e-3)
    far = np.abs(np.arange(201) - 100) > 4
    assert 0.02 < out[:, far].sum() / 1000.0 < 0.1


@pytest.mark.parametrize("diameter", [0.3, 1.0, 1.6, 2.5, 4.5, 12.0])
def test_disc_has_unit_sum_and_a_sixteenth_of_its_diameter_squared(diameter):
    kernel = disc_kernel(diameter)
    assert kernel.sum() == pytest.approx(1.0, rel=1e-9)
    assert variance(kernel) == pytest.approx(diameter**2 / 16, rel=2e-3)
    np.testing.assert_allclose(kernel, kernel.T, atol=1e-12)


def test_the_paper_rig_focused_at_a_metre_blurs_by_four_and_a_half_pixels():
    camera = Camera.from_physical(2448, 2048, 3.45e-6, 0.012, f_number=1.4, focus_distance=1.0)
    diameter = disc_diameter(camera, np.array([[0.87, 1.0, np.nan]], np.float32))
    assert diameter[0, 0] == pytest.approx(4.5, abs=0.05)
    assert diameter[0, 1] == pytest.approx(0.0, abs=1e-3) and diameter[0, 2] == 0.0
    # (f/N) (f / (zf - f)) |z - zf| / z
    assert diameter[0, 0] * 3.45e-6 == pytest.approx(0.012 / 1.4 * 0.012 / 0.988 * 0.13 / 0.87, rel=1e-5)


def test_every_pixel_blurs_by_its_own_depth():
    image = np.zeros((60, 200), np.float32)
    image[:, 50] = image[:, 150] = 100.0
    diameter = np.zeros(image.shape)
    diameter[:, 100:] = 6.0
    out = defocus(image, diameter)
    np.testing.assert_array_equal(out[:, :100], image[:, :100])
    assert variance(out[20:40, 100:]) == pytest.approx(36 / 16, rel=2e-3)
    np.testing.assert_array_equal(out, defocus(image, diameter, threads=1))


def test_developing_blurs_only_when_asked_and_needs_depth_for_defocus():
    scene = scene_of(0.02)
    camera = scene.camera.model_copy(update={"lens": scene.camera.lens.model_copy(update={"focus_distance": 1.0})})
    scene = scene.model_copy(update={"rig": scene.rig.model_copy(update={"camera": camera})})
    image = np.zeros((HEIGHT, WIDTH), np.float32)
    image[:, 160] = 1.0
    depth = np.full((HEIGHT, WIDTH), 0.87, np.float32)
    flat = np.zeros((HEIGHT, WIDTH, 3), np.float32)
    truth = Truth(depth, depth, flat, flat, np.zeros((HEIGHT, WIDTH), np.int32))
    frame = replace(flat_frame(0.0), laser_direct=(image,))
    sensor = sensor_of(dark_current=0.0)

    def spread(frame, **switches):
        electrons = expected_electrons(frame, scene, sensor.model_copy(update=switches))[100:140]
        return variance(electrons), electrons.sum()

    (sharp, light), (blurred, kept) = spread(frame), spread(frame, blur_sigma=1.2 * camera.pixel_pitch)
    assert sharp == 0.0
    assert blurred == pytest.approx(1.44, rel=1e-3) and kept == pytest.approx(light, rel=1e-4)
    with pytest.raises(InputError, match="depth"):
        spread(frame, defocus=True)
    wide, kept = spread(replace(frame, truth=truth), defocus=True)
    expected = disc_diameter(camera, depth)[0, 0] ** 2 / 16
    assert wide == pytest.approx(expected, rel=0.05) and kept == pytest.approx(light, rel=1e-4)
    both, _ = spread(replace(frame, truth=truth), defocus=True, blur_sigma=1.2 * camera.pixel_pitch)
    assert both == pytest.approx(wide + 1.44, rel=1e-3)
