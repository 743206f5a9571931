import math

import numpy as np
import pytest

from render.laser.irradiance import irradiance_at
from render.laser.laser import Divergence, LineLaser, Waist
from tests.render.scenes import paper_camera, paper_laser, scene_of

SHEETS = [Divergence(full_angle=1.15e-3), Divergence(full_angle=0.05), Waist(radius=1e-4, focus_distance=0.8)]


def power_through_ellipsoid(laser: LineLaser) -> float:
    """Integral of the irradiance over the half z > 0 of an ellipsoid around the laser, by the midpoint rule."""
    axes = np.array([0.5, 0.9, 0.7])
    q, y = np.meshgrid(np.linspace(-7, 7, 101), laser.tan_half_fan * ((np.arange(400) + 0.5) / 200 - 1))

    def surface(q, y):
        # the point with x = q sigma(z), y = Y z on the ellipsoid, by fixed-point iteration on z
        z = np.full(np.shape(q), 0.3)
        for _ in range(30):
            x = q * laser.sigma(z)
            z = np.sqrt((1 - (x / axes[0]) ** 2) / ((y / axes[1]) ** 2 + 1 / axes[2] ** 2))
        return np.stack([q * laser.sigma(z), y * z, z], axis=-1)

    points = surface(q, y)
    step = 1e-6
    area = np.cross(
        (surface(q + step, y) - surface(q - step, y)) / (2 * step),
        (surface(q, y + step) - surface(q, y - step)) / (2 * step),
    )
    size = np.linalg.norm(area, axis=-1)
    normals = area / size[..., None]
    flux = irradiance_at(points.reshape(-1, 3), np.ascontiguousarray(normals.reshape(-1, 3)), laser.packed())
    cell = (q[0, 1] - q[0, 0]) * (y[1, 0] - y[0, 0])
    return float(np.sum(flux.reshape(size.shape) * size) * cell)


@pytest.mark.parametrize("sheet", SHEETS, ids=["thin", "wide", "waist"])
@pytest.mark.parametrize("profile", ["uniform", "gaussian", "constant"])
@pytest.mark.parametrize("fan", [10, 60, 120])
def test_a_closed_surface_receives_the_laser_power(fan, profile, sheet):
    laser = LineLaser(power=0.02, fan_angle=math.radians(fan), fan_profile=profile, sheet=sheet)
    assert power_through_ellipsoid(laser) == pytest.approx(0.02, rel=1e-3)


def test_a_powell_lens_is_flat_on_a_flat_target_and_a_constant_fan_is_not():
    y = np.tan(np.radians([0.0, 22.4]))
    points, normals = np.stack([0 * y, y, 1 + 0 * y], axis=1), np.tile([0.0, 0.0, 1.0], (2, 1))
    flat = irradiance_at(points, normals, LineLaser(fan_profile="uniform").packed())
    assert flat[1] == pytest.approx(flat[0])
    constant = irradiance_at(points, normals, LineLaser(fan_profile="constant").packed())
    assert constant[1] / constant[0] == pytest.approx(math.cos(math.radians(22.4)) ** 3)


def test_the_plane_of_the_paper_is_found_with_d_not_positive():
    plane = scene_of(paper_camera(), paper_laser()).laser_plane(0)
    angle = math.radians(13)
    assert plane == pytest.approx([math.cos(angle), 0.0, math.sin(angle), -0.2 * math.cos(angle)], abs=1e-15)
    assert np.linalg.norm(plane[:3]) == pytest.approx(1.0)


def test_a_waist_spreads_as_measured_in_the_reference():
    # accuracy.md section 7: 450 nm, M^2 1.5, w0 = 100 um -> 297 um at 130 mm from the focus
    laser = LineLaser(sheet=Waist(radius=1e-4, focus_distance=0.8, m_squared=1.5))
    assert 2 * laser.sigma(0.8 + 0.13) == pytest.approx(297e-6, abs=1e-6)
    assert 2 * laser.sigma(0.8) == pytest.approx(1e-4)


def test_sigma_is_a_quarter_of_the_full_width_at_one_over_e_squared():
    laser = LineLaser(sheet=Divergence(full_angle=2e-3))
    edge = math.tan(1e-3)
    e = irradiance_at(np.array([[0.0, 0.0, 1.0], [edge, 0.0, 1.0]]), np.tile([0.0, 0.0, 1.0], (2, 1)), laser.packed())
    assert e[1] / e[0] == pytest.approx(math.exp(-2), rel=1e-5)
