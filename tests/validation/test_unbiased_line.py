"""Noiseless scans of tilted planes, a sphere and a cylinder: the extracted line and depth have no bias."""

import math

import numpy as np
import pytest

from analysis.line.detection.noise import NoiseModel
from analysis.line.extract import extract
from analysis.triangulate import triangulate
from render.laser_direct.integrator import direct_image
from render.truth.laser_curve import laser_curve
from tests.render.laser_direct.test_integrator import SURFACES
from tests.render.scenes import paper_camera, paper_laser, scene_of, world_of

pytestmark = pytest.mark.validation

PEAK_ELECTRONS = 8000.0


@pytest.mark.parametrize("method", ["likelihood", "gaussian", "centre_of_mass"])
@pytest.mark.parametrize("name", SURFACES)
def test_no_bias_without_noise(name, method):
    # the sheet is 0.3 mm wide (half 1/e^2): a wider one is truly skewed on a tilted surface (accuracy.md section 3)
    scene = scene_of(paper_camera(), paper_laser(7e-4), objects=len(SURFACES[name]))
    world = world_of(scene, *SURFACES[name])
    parts = (world, scene.camera, scene.lasers[0], scene.T_world_camera(), scene.T_world_laser(0))
    curve = laser_curve(*parts)
    image = direct_image(*parts, target=1e-3).radiance
    electrons = (image * (PEAK_ELECTRONS / image.max())).astype(np.float32)
    line = extract(electrons, method=method, noise=NoiseModel(gain=1.0, black_level=0.0, read_noise=1.0))
    points = triangulate(
        line,
        scene.camera,
        scene.laser_plane(0),
        T_rig_camera=np.eye(4),
        T_world_camera=scene.T_world_camera(),
    )
    good = (curve.laser_angle < math.radians(60)) & (curve.camera_angle < math.radians(60))
    good &= np.abs(curve.index - 1023.5) < 900
    position, depth = np.full(scene.camera.height, np.nan), np.full(scene.camera.height, np.nan)
    position[line.valid[:, 0]] = line.u[line.valid[:, 0], 0]
    depth[points.index[points.valid]] = points.depth_z[points.valid]
    error = position[curve.index[good]] - curve.position[good]
    depth_error = depth[curve.index[good]] - curve.depth_z[good]
    print(f"{name}, {method}: {np.nanmean(error):+.2e} px, {np.nanmean(depth_error) * 1e6:+.3f} um")
    assert np.isfinite(error).mean() > 0.99
    assert abs(np.nanmean(error)) < 1e-3
    assert abs(np.nanmean(depth_error)) < 1e-6
