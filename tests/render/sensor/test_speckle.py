"""Speckle against a coherent simulation: a random wave through a circular pupil, on pixels cut into fine samples."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import erf

from render.sensor.develop import develop
from render.sensor.speckle import scintillate, speckle
from tests.render.sensor.test_develop import flat_frame, radiance_for, scene_of, sensor_of

Float = NDArray[np.float64]

PITCH, CUTS = 3.45e-6, 12
"""m; samples along a pixel's side, fine enough for the intensity's spectrum at f/1.4 and 450 nm."""


def line_of(sigma: float, half: int) -> Float:
    """Pixels -half..half of a Gaussian line on the middle pixel."""
    x = np.arange(-half, half + 1)
    edge = sigma * np.sqrt(2.0)
    return np.asarray(sigma * np.sqrt(np.pi / 2) * (erf((x + 0.5) / edge) - erf((x - 0.5) / edge)))


def centroids(rows: Float, sigma: float) -> Float:
    x = np.arange(rows.shape[1]) - rows.shape[1] // 2
    window = np.abs(x) <= np.ceil(3 * sigma)
    return np.asarray((rows * x * window).sum(axis=1) / (rows * window).sum(axis=1))


def coherent(wavelength_nm: float, f_number: float, sigma: float, rows: int) -> tuple[Float, float]:
    """Line centres (rows,) and pixel contrast of |pupil * noise|^2, from its definition."""
    rng = np.random.default_rng(11)
    half, height = int(np.ceil(4 * sigma)) + 4, 64
    width = 2 * half + 1
    centres: list[float] = []
    contrast = []
    while len(centres) < rows:
        shape = (height * CUTS, width * CUTS)
        step = PITCH / CUTS
        frequency = np.hypot(np.fft.fftfreq(shape[0], step)[:, None], np.fft.fftfreq(shape[1], step))
        inside = frequency < 1.0 / (2.0 * wavelength_nm * 1e-9 * f_number)
        wave = np.fft.ifft2((rng.normal(size=shape) + 1j * rng.normal(size=shape)) * inside)
        light = np.abs(wave) ** 2
        light /= light.mean()
        contrast.append(light.reshape(height, CUTS, width, CUTS).mean(axis=(1, 3)).std())
        x = (np.arange(width * CUTS) + 0.5) / CUTS - 0.5 - half
        pixels = (light * np.exp(-0.5 * (x / sigma) ** 2)).reshape(height, CUTS, width, CUTS).mean(axis=(1, 3))
        centres += list(centroids(pixels, sigma))
    return np.array(centres), float(np.mean(contrast))


@pytest.mark.parametrize(
    ("wavelength_nm", "f_number", "sigma"), [(450, 1.42, 0.7), (450, 1.42, 3.0), (660, 2.8, 1.5), (450, 8.0, 1.5)]
)
def test_contrast_and_line_centre_are_those_of_a_coherent_simulation(wavelength_nm, f_number, sigma):
    field = speckle(wavelength_nm, f_number, PITCH)
    simulated, contrast = coherent(wavelength_nm, f_number, sigma, 1000)
    flat = scintillate(np.ones((500, 500), np.float32), 0, 500, field, 1, 0, 0)
    assert flat.mean() == pytest.approx(1.0, abs=0.01)
    assert flat.std() == pytest.approx(field.contrast, rel=0.03)
    assert flat.std() == pytest.approx(contrast, rel=0.05)
    line = np.tile(line_of(sigma, int(np.ceil(4 * sigma)) + 4), (3000, 1)).astype(np.float32)
    centres = centroids(scintillate(line, 0, 3000, field, 1, 0, 0).astype(np.float64), sigma)
    assert centres.std() == pytest.approx(simulated.std(), rel=0.10)


def test_fine_grain_follows_the_closed_form():
    """C sqrt(A_c s / (4 sqrt(pi) p^2)) px with A_c = 4 lambda^2 N^2 / pi, for a line wide against the pixel."""
    sigma, f_number = 4.0, 1.42
    area = 4.0 * (450e-9 * f_number) ** 2 / np.pi
    expected = np.sqrt(area * sigma / (4.0 * np.sqrt(np.pi))) / PITCH
    line = np.tile(line_of(sigma, 20), (4000, 1)).astype(np.float32)
    for depolarised, factor in ((False, 1.0), (True, np.sqrt(0.5))):
        field = speckle(450, f_number, PITCH, depolarised)
        centres = centroids(scintillate(line, 0, 4000, field, 2, 0, 0).astype(np.float64), sigma)
        assert centres.std() == pytest.approx(factor * expected, rel=0.10)


def test_neighbouring_pixels_are_as_correlated_as_the_pupil_says():
    field = speckle(660, 11.0, PITCH)
    flat = scintillate(np.ones((800, 800), np.float32), 0, 800, field, 3, 0, 0).astype(np.float64) - 1.0
    middle = field.correlation.shape[0] // 2
    for dy, dx in ((0, 1), (1, 0), (1, 1), (0, 2)):
        found = np.mean(flat[: 800 - dy, : 800 - dx] * flat[dy:, dx:]) / np.mean(flat**2)
        assert found == pytest.approx(field.correlation[middle + dy, middle + dx], abs=0.03)


def test_speckle_is_gamma_distributed():
    field = speckle(450, 4.0, PITCH)
    flat = scintillate(np.ones((600, 600), np.float32), 0, 600, field, 4, 0, 0)
    # third moment of a gamma: skewness is twice its relative standard deviation
    z = (flat - flat.mean()) / flat.std()
    assert np.mean(z**3) == pytest.approx(2.0 * field.contrast, rel=0.08)


def test_pattern_belongs_to_seed_step_and_laser_and_not_to_the_rows_it_is_cut_into():
    image = np.random.default_rng(0).uniform(0, 1, (40, 60)).astype(np.float32)
    field = speckle(450, 2.8, PITCH)
    whole = scintillate(image, 0, 40, field, 5, 0, 0)
    parts = np.vstack([scintillate(image, a, a + 8, field, 5, 0, 0) for a in range(0, 40, 8)])
    np.testing.assert_array_equal(whole, parts)
    for other in ((6, 0, 0), (5, 1, 0), (5, 0, 1)):
        assert (
            np.corrcoef(
                whole.ravel() / image.ravel(), scintillate(image, 0, 40, field, *other).ravel() / image.ravel()
            )[0, 1]
            < 0.1
        )


def test_developing_with_speckle_adds_its_contrast_and_switched_off_nothing():
    scene, sensor = scene_of(0.02), sensor_of(bits=16, full_well=60000)
    frame = flat_frame(radiance_for(20000, scene, sensor))
    plain = develop(frame, scene, sensor, seed=1)
    rough = develop(frame, scene, sensor.model_copy(update={"speckle": "polarised"}), seed=1)
    contrast = speckle(450.0, scene.camera.working_f_number, scene.camera.pixel_pitch).contrast
    shot = (plain.pixels - plain.black_level).std() / (plain.pixels - plain.black_level).mean()
    signal = rough.pixels - rough.black_level
    assert signal.std() / signal.mean() == pytest.approx(np.hypot(contrast, shot), rel=0.03)
    one = develop(frame, scene, sensor.model_copy(update={"speckle": "polarised"}), seed=1, threads=1)
    np.testing.assert_array_equal(one.pixels, rough.pixels)
    smooth = develop(frame, scene, sensor.model_copy(update={"speckle": "polarised"}), seed=1, noise=False)
    assert np.ptp(smooth.pixels) == 0
