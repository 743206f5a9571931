"""The laser's direct light beside an independent renderer: Mitsuba 3 (Jakob et al.), its projector as a line laser."""

import math

import numpy as np
import pytest
import trimesh

from render.laser_direct.integrator import direct_image
from tests.render.scenes import centroids, paper_camera, paper_laser, plane_mesh, scene_of, world_of
from tests.validation.laser_projector import projector

pytestmark = pytest.mark.validation
mitsuba = pytest.importorskip("mitsuba", reason="make validate installs it")


@pytest.mark.parametrize("normal", [(0.0, 0.0, 1.0), (0.5, -0.3, 0.8)])
def test_direct_radiance_of_the_laser_on_a_lambertian_plane(normal, tmp_path):
    camera = paper_camera(0.08)
    laser = paper_laser(8e-3, fan_angle=math.radians(30))
    plane = plane_mesh(normal, 0.85)
    scene = scene_of(camera, laser)
    ours = direct_image(
        world_of(scene, plane), camera, laser, scene.T_world_camera(), scene.T_world_laser(0), target=1e-4
    ).radiance.astype(np.float64)

    mitsuba.set_variant("scalar_rgb")
    T = mitsuba.ScalarTransform4f
    path = tmp_path / "plane.ply"
    trimesh.Trimesh(plane.vertices, plane.triangles, process=False).export(path)
    white = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.5}}
    film = {"type": "hdrfilm", "width": camera.width, "height": camera.height, "component_format": "float32"}
    description = {
        "type": "scene",
        "integrator": {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0},
        "sensor": {
            "type": "perspective",
            "fov": 2 * math.degrees(math.atan(camera.width / (2 * camera.fx))),
            "fov_axis": "x",
            "to_world": T().look_at(origin=[0, 0, 0], target=[0, 0, 1], up=[0, -1, 0]),
            "film": {**film, "rfilter": {"type": "box"}, "pixel_format": "rgb"},
            "sampler": {"type": "multijitter", "sample_count": 1024},
        },
        "plane": {"type": "ply", "filename": str(path), "bsdf": {"type": "twosided", "sides": white}},
        "laser": projector(laser),
    }
    theirs = np.array(mitsuba.render(mitsuba.load_dict(description), seed=1))[..., 0].astype(np.float64)

    assert theirs.sum() == pytest.approx(ours.sum(), rel=5e-3)
    rows = np.flatnonzero(ours.sum(axis=1) > 0.5 * ours.sum(axis=1).max())[1:-1]
    assert len(rows) > 60
    assert theirs[rows].sum(axis=1) == pytest.approx(ours[rows].sum(axis=1), rel=5e-3)
    assert centroids(theirs)[rows] == pytest.approx(centroids(ours)[rows], abs=0.01)
    bright = ours[rows] > 0.1 * ours.max()
    assert theirs[rows][bright] == pytest.approx(ours[rows][bright], rel=5e-3)
