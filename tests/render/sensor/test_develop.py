"""The sensor does what EMVA 1288 says: photon transfer, dark noise, saturation, colour; on any thread count."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from render.base.errors import InputError
from render.camera.camera import Camera, Lens
from render.frame import Frame
from render.laser.laser import LineLaser
from render.scene.lights import RGB
from render.scene.scene import Rig, Scene
from render.sensor.develop import develop, expected_electrons
from render.sensor.response import BANDS_NM, band_response, joules_per_radiance
from render.sensor.sensor import BandPass, Sensor, SpectralCurve

Float32 = NDArray[np.float32]

FLAT = SpectralCurve(wavelength_nm=(300, 1100), value=(0.6, 0.6))
WIDTH, HEIGHT = 320, 240


def scene_of(*powers: float, wavelength_nm: float = 450.0, **camera: Any) -> Scene:
    lasers = tuple(
        LineLaser(name=f"laser {i}", power=power, wavelength_nm=wavelength_nm) for i, power in enumerate(powers)
    )
    centred = {"fx": 3478.26, "fy": 3478.26, "cx": (WIDTH - 1) / 2, "cy": (HEIGHT - 1) / 2}
    values = centred | {"lens": Lens(vignetting=False)} | camera
    return Scene(rig=Rig(camera=Camera(width=WIDTH, height=HEIGHT, **values), lasers=lasers))


def sensor_of(**values: Any) -> Sensor:
    return Sensor(**({"efficiency": (FLAT,), "black_level": 40.0, "prnu": 0.0, "dsnu": 0.0} | values))


def flat_frame(*radiance: float, ambient: RGB | None = None, step: int = 0) -> Frame:
    images = tuple(np.full((HEIGHT, WIDTH), value, dtype=np.float32) for value in radiance)
    sky = None if ambient is None else np.full((HEIGHT, WIDTH, 3), ambient, dtype=np.float32)
    return Frame(step=step, laser_direct=images, ambient=sky, curves=(), truth=None)


def radiance_for(electrons: float, scene: Scene, sensor: Sensor) -> float:
    """The radiance of laser 0 that makes so many electrons, by the definition of expected_electrons."""
    one = expected_electrons(flat_frame(1.0), scene, sensor.model_copy(update={"dark_current": 0.0}))[0, 0]
    return electrons / float(one)


def test_the_paper_rig_collects_the_electrons_of_the_radiometry_anchor() -> None:
    power, fan, z, w, rho = 0.02, math.radians(45), 0.866, 0.3e-3, 0.5
    peak = power / (2 * z * math.tan(fan / 2)) / (math.sqrt(2 * math.pi) * w / 2)  # on a screen across the beam, W/m^2
    assert peak == pytest.approx(74.0, rel=0.01)
    radiance = rho * peak * math.cos(math.radians(13)) / math.pi  # the screen faces the camera, the laser is at 13 deg
    scene, sensor = scene_of(power), sensor_of(exposure_time=1.0, dark_current=0.0)
    electrons = expected_electrons(flat_frame(radiance), scene, sensor)
    assert float(electrons[0, 0]) == pytest.approx(6.7e7, rel=0.01)


def test_focusing_close_costs_light_by_the_square_of_the_working_f_number() -> None:
    far, near = scene_of(0.02), scene_of(0.02, lens=Lens(vignetting=False, focus_distance=0.1))
    m = near.camera.fx * near.camera.pixel_pitch / 0.1
    ratio = joules_per_radiance(far.camera, sensor_of()) / joules_per_radiance(near.camera, sensor_of())
    assert ratio == pytest.approx((1 + m) ** 2, rel=1e-12)


def test_a_scaled_image_collects_the_same_light_in_all() -> None:
    camera = scene_of(0.02, fy=3000.0).camera
    whole, half = (joules_per_radiance(c, sensor_of()) for c in (camera, camera.scaled(0.5)))
    assert half == pytest.approx(4 * whole, rel=1e-12)


@pytest.mark.parametrize("distortion", [(), (-0.2, 0.1, 1e-3, -1e-3)])
def test_vignetting_is_cos4_of_the_ray_of_each_pixel(distortion: tuple[float, ...]) -> None:
    camera: dict[str, Any] = {"fx": 300.0, "fy": 310.0, "distortion": distortion}
    dark = expected_electrons(flat_frame(1.0), scene_of(1.0, lens=Lens(), **camera), sensor_of(dark_current=0.0))
    full = expected_electrons(flat_frame(1.0), scene_of(1.0, **camera), sensor_of(dark_current=0.0))
    columns, rows = np.meshgrid(np.arange(WIDTH, dtype=float), np.arange(HEIGHT, dtype=float))
    rays, valid = scene_of(1.0, **camera).camera.rays(np.stack([columns, rows], axis=-1))
    assert valid.all()
    np.testing.assert_allclose(dark / full, rays[..., 2] ** 4, rtol=1e-6)


@pytest.mark.parametrize("bits", [8, 10, 12, 16])
def test_photon_transfer_slope_is_the_gain(bits: int) -> None:
    scene = scene_of(1.0)
    sensor = sensor_of(bits=bits, black_level=2.0 ** (bits - 5))
    one = radiance_for(1.0, scene, sensor)
    means, variances = [], []
    for level in np.linspace(200.0, 9500.0, 32):
        shots = [develop(flat_frame(one * level, step=step), scene, sensor, seed=3) for step in (0, 1)]
        a, b = (shot.pixels.astype(np.float64) for shot in shots)
        means.append((a.mean() + b.mean()) / 2)
        variances.append((a - b).var() / 2)  # EMVA 1288, section 6: the difference of two frames
    assert max(means) + 5 * math.sqrt(max(variances)) < 2**bits - 1
    weights = 1.0 / np.asarray(variances)  # the variance of a variance is 2 var^2 / n
    slope = np.polyfit(means, variances, 1, w=weights)[0]
    assert slope == pytest.approx(sensor.dn_per_electron, rel=0.01)


@pytest.mark.parametrize("bits", [10, 12, 16])
def test_dark_variance_is_read_noise_dark_current_and_quantisation(bits: int) -> None:
    sensor = sensor_of(bits=bits, read_noise=20.0, dark_current=1e5, exposure_time=1e-3, black_level=2.0 ** (bits - 4))
    image = develop(flat_frame(0.0), scene_of(1.0), sensor, seed=4)
    electrons = (image.pixels - image.black_level) / image.gain
    expected = 20.0**2 + 100.0 + 1 / (12 * image.gain**2)
    limit = stats.norm.isf(1e-4)
    assert abs(electrons.var() - expected) < limit * expected * math.sqrt(2 / electrons.size)
    assert abs(electrons.mean() - 100.0) < limit * math.sqrt(expected / electrons.size)


@pytest.mark.parametrize("bits", [8, 12, 16])
def test_a_blinded_sensor_reads_its_saturation_everywhere(bits: int) -> None:
    scene, full = scene_of(1.0), 2**bits - 1
    for gain, top in ((None, full), (0.5 * (full - 20) / 10_500, round(0.5 * (full - 20)) + 20)):
        sensor = sensor_of(bits=bits, black_level=20.0, gain=gain)
        image = develop(flat_frame(radiance_for(1e6, scene, sensor)), scene, sensor)
        assert image.saturation == pytest.approx(top, abs=1)
        assert np.all(image.pixels == image.saturation)
        assert image.pixels.dtype == (np.uint8 if bits == 8 else np.uint16)


def test_without_noise_the_image_is_the_quantised_mean() -> None:
    scene, sensor = scene_of(1.0), sensor_of(prnu=0.1, dsnu=30.0, dark_current=0.0)
    frame = flat_frame(radiance_for(1234.5, scene, sensor))
    image = develop(frame, scene, sensor, noise=False)
    assert np.all(image.pixels == round(1234.5 * sensor.dn_per_electron + 40.0))
    assert np.all(develop(flat_frame(0.0), scene, sensor, noise=False).pixels == 40)


def test_prnu_and_dsnu_are_the_sensors_own_and_have_their_spread() -> None:
    scene = scene_of(1.0)
    sensor = sensor_of(bits=16, prnu=0.02, dsnu=8.0, read_noise=0.0, dark_current=0.0, black_level=1000.0)
    dark = develop(flat_frame(0.0), scene, sensor, seed=1)
    offsets = (dark.pixels - dark.black_level) / dark.gain
    assert offsets.std() == pytest.approx(8.0, rel=4 / math.sqrt(2 * offsets.size))
    assert np.array_equal(develop(flat_frame(0.0, step=5), scene, sensor, seed=2).pixels, dark.pixels)

    bright = flat_frame(radiance_for(5000.0, scene, sensor))
    shots = [develop(bright, scene, sensor, seed=seed).pixels / dark.gain for seed in range(2)]
    covariance = np.cov(shots[0].ravel(), shots[1].ravel())[0, 1]  # what two shots share is the fixed pattern
    pattern = math.sqrt(100.0**2 + 8.0**2)
    assert math.sqrt(covariance) == pytest.approx(pattern, rel=4 * (5000 + 100**2) / 100**2 / math.sqrt(shots[0].size))


def test_two_steps_and_two_seeds_have_their_own_noise() -> None:
    scene, sensor = scene_of(1.0), sensor_of()
    bright = radiance_for(1000.0, scene, sensor)
    shots = [
        develop(flat_frame(bright, step=step), scene, sensor, seed=seed).pixels.ravel()
        for step, seed in ((0, 0), (1, 0), (0, 1))
    ]
    correlation = np.corrcoef(shots) - np.eye(3)
    assert np.abs(correlation).max() < 4.5 / math.sqrt(shots[0].size)


def test_power_rescales_each_laser_by_itself() -> None:
    scene, sensor = scene_of(0.02, 0.01), sensor_of(dark_current=0.0)
    frame = flat_frame(3.0, 2.0)
    first, second = (
        expected_electrons(flat_frame(*pair), scene, sensor).astype(np.float64) for pair in ((3.0, 0.0), (0.0, 2.0))
    )
    rescaled = expected_electrons(frame, scene, sensor, laser_power=(0.05, 0.0025))
    np.testing.assert_allclose(rescaled, 2.5 * first + 0.25 * second, rtol=1e-6)
    assert np.all(expected_electrons(frame, scene, sensor, laser_power=(0.0, 0.0)) == 0.0)


def test_each_bayer_pixel_answers_with_its_own_curve() -> None:
    values = ((0, 0.1), (0.2, 0.4), (0.8, 0.6))
    curves = tuple(SpectralCurve(wavelength_nm=(400, 500), value=value) for value in values)
    scene = scene_of(1.0, wavelength_nm=450.0)
    mono = expected_electrons(flat_frame(1.0), scene, sensor_of(dark_current=0.0)) / 0.6
    expected = {"R": 0.05, "G": 0.3, "B": 0.7}
    for pattern in ("RGGB", "BGGR", "GRBG", "GBRG"):
        sensor = sensor_of(colour="bayer", pattern=pattern, efficiency=curves, dark_current=0.0)
        mosaic = expected_electrons(flat_frame(1.0), scene, sensor) / mono
        for place, colour in enumerate(pattern):
            part = mosaic[place // 2 :: 2, place % 2 :: 2]
            np.testing.assert_allclose(part, expected[colour], rtol=1e-6)
        assert develop(flat_frame(1.0), scene, sensor).pattern == pattern


def test_ambient_bands_are_integrated_over_wavelength() -> None:
    curve = SpectralCurve(wavelength_nm=(420, 480, 530, 690), value=(0.1, 0.7, 0.6, 0.2))
    sensor = sensor_of(efficiency=(curve,), band_pass=BandPass(centre_nm=500, width_nm=130, transmission=0.8))
    wavelength = np.linspace(380, 720, 3_400_001)
    efficiency = np.interp(wavelength, curve.wavelength_nm, curve.value, left=0, right=0)
    passed = np.where(np.abs(wavelength - 500) <= 65, 0.8, 0.0)
    per_joule = efficiency * passed * wavelength * 1e-9 / (6.62607015e-34 * 299792458.0)
    for i, (low, high) in enumerate(BANDS_NM):
        inside = (wavelength >= low) & (wavelength < high)
        brute = per_joule[inside].mean() if per_joule[inside].any() else 0.0
        assert band_response(sensor)[0, 0, i] == pytest.approx(brute, rel=1e-5)


def test_ambient_light_adds_to_the_laser() -> None:
    scene, sensor = scene_of(1.0), sensor_of(dark_current=0.0)
    both = expected_electrons(flat_frame(2.0, ambient=(1.0, 2.0, 3.0)), scene, sensor)
    apart = [expected_electrons(f, scene, sensor) for f in (flat_frame(2.0), flat_frame(0.0, ambient=(1.0, 2.0, 3.0)))]
    np.testing.assert_allclose(both, apart[0] + apart[1], rtol=1e-6)
    assert apart[1].min() > 0


def test_a_band_pass_filter_blocks_a_laser_outside_it() -> None:
    scene = scene_of(1.0, wavelength_nm=450.0)
    frame, dark = flat_frame(1.0), {"dark_current": 0.0}
    plain = expected_electrons(frame, scene, sensor_of(**dark))
    covering = BandPass(centre_nm=455, width_nm=20, transmission=0.7)
    inside = expected_electrons(frame, scene, sensor_of(band_pass=covering, **dark))
    outside = expected_electrons(frame, scene, sensor_of(band_pass=BandPass(centre_nm=470, width_nm=20), **dark))
    np.testing.assert_allclose(inside / plain, 0.7, rtol=1e-6)
    assert not outside.any()


def test_the_image_is_the_same_for_any_number_of_threads() -> None:
    rng = np.random.default_rng(5)
    laser = (rng.random((HEIGHT, WIDTH)) * 40).astype(np.float32)
    sky = rng.random((HEIGHT, WIDTH, 3)).astype(np.float32)
    frame = Frame(step=2, laser_direct=(laser,), ambient=sky, curves=(), truth=None)
    scene, sensor = scene_of(1.0, lens=Lens()), sensor_of(prnu=0.01, dsnu=1.0)
    images = [develop(frame, scene, sensor, seed=9, threads=threads).pixels for threads in (1, 2, 5)]
    assert np.array_equal(images[0], images[1]) and np.array_equal(images[0], images[2])
    assert len(np.unique(images[0])) > 100


@pytest.mark.parametrize("seed", [-1, 2**63, 2**80 + 1])
def test_any_integer_is_a_seed(seed: int) -> None:
    assert develop(flat_frame(0.0), scene_of(1.0), sensor_of(), seed=seed).pixels.std() > 0


def test_a_radiance_that_is_no_number_reads_as_dark() -> None:
    frame = flat_frame(0.0)
    frame.laser_direct[0][:] = np.nan
    scene, sensor = scene_of(1.0), sensor_of()
    assert np.array_equal(develop(frame, scene, sensor).pixels, develop(flat_frame(0.0), scene, sensor).pixels)


@pytest.mark.parametrize(
    ("powers", "named"),
    [((0.1,), "1 powers"), ((0.1, -1.0), "laser 1"), ((0.1, math.nan), "laser 1"), ((0.1, 0.1, 0.1), "3 powers")],
)
def test_a_power_that_cannot_be_is_refused(powers: tuple[float, ...], named: str) -> None:
    with pytest.raises(InputError, match=named):
        develop(flat_frame(1.0, 1.0), scene_of(0.02, 0.02), sensor_of(), laser_power=powers)


def test_a_laser_rendered_dark_cannot_be_turned_up() -> None:
    with pytest.raises(InputError, match="0 W"):
        develop(flat_frame(0.0), scene_of(0.0), sensor_of(), laser_power=(0.1,))


def test_a_frame_of_another_scene_is_refused() -> None:
    with pytest.raises(InputError, match="not of this scene"):
        develop(flat_frame(1.0), scene_of(0.02, 0.02), sensor_of())
    smaller = Frame(0, (np.zeros((8, 8), np.float32),), None, (), None, "")
    with pytest.raises(InputError, match="8 x 8 px"):
        develop(smaller, scene_of(0.02), sensor_of())
