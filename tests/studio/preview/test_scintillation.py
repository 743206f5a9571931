"""What is known of speckle before anything is rendered, against closed forms and drawn patterns."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.line.detection.noise import NoiseModel
from analysis.line.extract import extract
from render.camera.camera import Camera
from render.sensor.sensor import Sensor
from render.sensor.speckle import scintillate, speckle
from studio.preview.scintillation import scintillation, speckle_px
from tests.analysis.line.line_images import expected

PITCH, NM = 3.45e-6, 450.0
NONE = np.zeros(1)


def camera(f_number: float) -> Camera:
    return Camera.from_physical(2448, 2048, PITCH, 0.012, f_number=f_number, focus_distance=0.87)


@pytest.mark.parametrize("sigma", [1.5, 3.0, 8.0])
def test_fine_grain_moves_a_wide_line_as_the_closed_form_says(sigma: float) -> None:
    # 0.096 and 0.136 px at 1.5 and 3 px; the pattern leaves out distant correlations, some percent of the area
    area = 4.0 * (NM * 1e-9 * camera(1.4).working_f_number) ** 2 / np.pi
    closed = np.sqrt(area * sigma / (4.0 * np.sqrt(np.pi))) / PITCH
    found = speckle_px(camera(1.4), NM, np.full(1, sigma), NONE, np.full(1, 1e6), NONE, 0.0)
    assert found[0] == pytest.approx(closed, rel=0.07)
    halved = speckle_px(camera(1.4), NM, np.full(1, sigma), NONE, np.full(1, 1e6), NONE, 0.0, depolarised=True)
    assert halved[0] == pytest.approx(found[0] * np.sqrt(0.5))


@pytest.mark.parametrize(
    ("f_number", "sigma", "within"),
    [
        *((1.4, 0.6, 0.06), (1.4, 0.8, 0.06), (1.4, 2.0, 0.06), (2.8, 1.2, 0.06), (5.6, 1.2, 0.06), (5.6, 3.0, 0.06)),
        *((1.4, 0.25, 0.1), (2.8, 0.3, 0.1), (2.8, 0.4, 0.1), (5.6, 0.25, 0.1), (11.0, 0.3, 0.1)),
    ],
)
def test_a_drawn_pattern_moves_the_fitted_line_as_much_as_foretold(
    f_number: float, sigma: float, within: float
) -> None:
    rows, background = 4000, 300.0
    centre = 40 + np.random.default_rng(3).uniform(-0.5, 0.5, rows)
    field = speckle(NM, camera(f_number).working_f_number, PITCH, True)
    light = expected(80, centre, 8000.0, sigma, 0.0).astype(np.float32)
    image = scintillate(light, 0, rows, field, 4, 0, 0) + np.float32(background)
    rough = Sensor(prnu=0.0, speckle="depolarised")
    table, fineness = scintillation(rough, camera(f_number), NM)
    line = extract(image, noise=NoiseModel(read_noise=2.5, step=0.0, scintillation=table, fineness=fineness))
    error = (line.u[:, 0] - centre)[line.valid[:, 0]]
    told = speckle_px(
        camera(f_number), NM, np.full(rows, sigma), centre, np.full(rows, 8e3), np.full(rows, background), 6.25, True
    )
    # first order in a contrast of up to 0.41; neighbouring rows err alike, which leaves some 3000 for the statistics
    assert np.std(error) == pytest.approx(np.sqrt(np.mean(told**2)), rel=within)


def test_covariance_is_that_of_the_pattern_and_of_uneven_pixels() -> None:
    still = Sensor(prnu=0.0, speckle="off")
    assert scintillation(still, camera(5.6), NM) == ((), 0.0)
    assert scintillation(still.model_copy(update={"prnu": 0.01}), camera(5.6), NM) == (((pytest.approx(1e-4),),), 0.0)
    rough = Sensor(prnu=0.01, speckle="polarised")
    table = np.array(scintillation(rough, camera(5.6), NM)[0])
    field = speckle(NM, camera(5.6).working_f_number, PITCH)
    flat = scintillate(np.ones((600, 600), np.float32), 0, 600, field, 2, 0, 0).astype(np.float64) - 1.0
    for k, d in ((0, 1), (1, 0), (1, 1)):
        found = np.mean(flat[: 600 - k, : 600 - d] * flat[k:, d:])
        assert table[k, d] == pytest.approx(found, abs=4 * table[0, 0] / 600)
    assert table[0, 0] == pytest.approx(np.mean(flat**2) + 1e-4, rel=0.02)


def test_beside_a_wide_line_a_narrow_one_without_any_noise_has_its_own_value() -> None:
    """Pixels without light and without noise were 0 / 0, and so was the narrow line."""
    both = speckle_px(camera(1.4), NM, np.array([0.3, 12.0]), np.zeros(2), np.full(2, 1e4), np.zeros(2), 0.0)
    alone = speckle_px(camera(1.4), NM, np.full(1, 0.3), NONE, np.full(1, 1e4), NONE, 0.0)
    assert both[0] == pytest.approx(alone[0], rel=1e-9) and np.isfinite(both).all()
