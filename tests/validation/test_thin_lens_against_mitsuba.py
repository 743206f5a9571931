"""The thin lens beside Mitsuba 3, an independent renderer: laser light and ambient light, pixel by pixel."""

import math

import numpy as np
import pytest
import trimesh

from render.ambient.integrator import ambient_image
from render.camera.camera import Lens
from render.laser_direct.integrator import direct_image
from render.mesh.primitives import primitive_mesh
from render.scene.lights import Environment
from render.scene.shape import Box
from tests.render.scenes import moved, paper_camera, paper_laser, plane_mesh, scene_of, world_of
from tests.validation.laser_projector import projector

pytestmark = pytest.mark.validation
mitsuba = pytest.importorskip("mitsuba", reason="make validate installs it")

RUNS = 12
SYSTEMATIC = 4e-3
"""Of the brightest pixel: the projector's picture has texels."""


def setting():
    """A slanted wall far out of focus behind the edge of a block, so that depths mix."""
    lens = Lens(model="thin-lens", f_number=0.7, focus_distance=0.6)
    camera = paper_camera(0.06).model_copy(update={"lens": lens})
    laser = paper_laser(8e-3, fan_angle=math.radians(30))
    block = moved(primitive_mesh(Box(size_x=0.3, size_y=0.1, size_z=0.1)), (0.02, 0.05, 0.7), (0.2, 0.1, 0.3))
    meshes = [plane_mesh((0.4, -0.3, 0.8), 0.75), block]
    scene = scene_of(camera, laser, objects=2).model_copy(update={"environment": Environment(radiance=(1.0, 1.0, 1.0))})
    return scene, world_of(scene, *meshes), meshes


def theirs(camera, meshes, lights, spp, folder, depth):
    """(RUNS, h, w) of independent renders."""
    T = mitsuba.ScalarTransform4f
    white = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.5}}
    film = {"type": "hdrfilm", "width": camera.width, "height": camera.height, "component_format": "float32"}
    description = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": depth, "hide_emitters": False},
        "sensor": {
            "type": "thinlens",
            "fov": 2 * math.degrees(math.atan(camera.width / (2 * camera.fx))),
            "fov_axis": "x",
            "aperture_radius": camera.aperture_radius,
            "focus_distance": camera.lens.focus_distance,
            "to_world": T().look_at(origin=[0, 0, 0], target=[0, 0, 1], up=[0, -1, 0]),
            "film": {**film, "rfilter": {"type": "box"}, "pixel_format": "rgb"},
            "sampler": {"type": "independent", "sample_count": spp},
        },
        **lights,
    }
    for i, mesh in enumerate(meshes):
        path = folder / f"{i}.ply"
        trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False).export(path)
        bsdf = {"type": "twosided", "sides": white}
        description[f"mesh{i}"] = {"type": "ply", "filename": str(path), "bsdf": bsdf, "face_normals": True}
    scene = mitsuba.load_dict(description)
    return np.stack([np.array(mitsuba.render(scene, seed=seed))[..., 0].astype(np.float64) for seed in range(RUNS)])


def agree(ours, runs):
    """Total within 1 %, and deviations pixel by pixel as Student's t of the runs' spread says."""
    from scipy.stats import t

    mean = runs.mean(axis=0)
    assert ours.sum() == pytest.approx(mean.sum(), rel=5e-3)
    error = np.hypot(runs.std(axis=0, ddof=1) / math.sqrt(RUNS), SYSTEMATIC * ours.max() / 3)
    lit = mean > 0.02 * mean.max()
    z = ((mean - ours) / error)[lit]
    assert len(z) > 300
    # Sidak: no pixel beyond what the worst of so many may be
    assert np.abs(z).max() < t.ppf(1 - (1 - 0.999 ** (1 / len(z))) / 2, RUNS - 1)
    assert np.mean(np.abs(z) > t.ppf(0.995, RUNS - 1)) < 0.015


def test_laser_light_through_the_aperture(tmp_path):
    mitsuba.set_variant("scalar_rgb")
    scene, world, meshes = setting()
    camera, laser = scene.camera, scene.lasers[0]
    ours = direct_image(world, camera, laser, scene.T_world_camera(), scene.T_world_laser(0), target=2e-3).radiance
    runs = theirs(camera, meshes, {"laser": projector(laser)}, 256, tmp_path, 2)
    agree(ours.astype(np.float64), runs)


def test_ambient_light_through_the_aperture(tmp_path):
    mitsuba.set_variant("scalar_rgb")
    scene, world, meshes = setting()
    sky = {"type": "constant", "radiance": {"type": "rgb", "value": 1.0}}
    ours = ambient_image(world, scene, scene.camera, scene.T_world_camera(), samples=1024)
    runs = theirs(scene.camera, meshes, {"sky": sky}, 64, tmp_path, 2)
    agree(ours[..., 0].astype(np.float64), runs)
