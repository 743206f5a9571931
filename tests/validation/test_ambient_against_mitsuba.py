"""Ambient light beside Mitsuba 3, an independent renderer: a glossy tee and a glass ball, pixel by pixel."""

import math

import numpy as np
import pytest
import trimesh
from scipy.stats import t

from render.ambient.integrator import ambient_image
from render.base.pose import Pose
from render.material.material import Conductor, Glass, Lambertian
from render.mesh.primitives import primitive_mesh
from render.run import Run
from render.scene.lights import Environment, RectangleLight
from render.scene.shape import Box, Sphere
from tests.render.ambient.test_path_kernels import scene_with
from tests.render.scenes import moved, paper_camera, plane_mesh

pytestmark = pytest.mark.validation
mitsuba = pytest.importorskip("mitsuba", reason="make validate installs it")

RUNS, SAMPLES = 12, 64
BAND = 1
"""Compared: green."""
SYSTEMATIC = 0.01
"""Of a pixel: Mitsuba's Smith term is not height-correlated, and its rays start at a fixed distance off the surface."""
SKY = Environment(radiance=(0.3, 0.3, 0.3))
LAMP = RectangleLight(
    radiance=(5.0, 5.0, 5.0),
    width=0.3,
    height=0.2,
    T_world_light=Pose(translation=(-0.3, -0.3, 0.2), rotation=(-0.5, 0.4, 0)),
)


def tee():
    """A ground plate and an upright on a painted table."""
    ground, paint = Conductor(metal="iron", roughness=0.2), Lambertian(albedo=0.4)
    plate = moved(primitive_mesh(Box(size_x=0.4, size_y=0.02, size_z=0.3)), (0, 0.12, 0.9), (0.4, 0.3, 0))
    upright = moved(primitive_mesh(Box(size_x=0.4, size_y=0.25, size_z=0.02)), (0, 0.0, 0.97), (0.4, 0.3, 0))
    return [(plate, ground), (upright, ground), (plane_mesh((0, -0.5, 1), 1.2, 3.0), paint)]


def glass_ball():
    """A ball that gathers the lamp's light on a wall, and shows it upside down."""
    ball = moved(primitive_mesh(Sphere(radius=0.12)), (0, 0, 0.75))
    return [(ball, Glass(index=1.5)), (plane_mesh((0.1, -0.2, 1), 1.0, 3.0), Lambertian(albedo=0.6))]


def bsdf(material, row):
    """What Mitsuba calls it."""
    match material:
        case Glass():
            return {"type": "dielectric", "int_ior": float(row[3]), "ext_ior": 1.0}
        case Conductor():
            n, k = float(row[4 + BAND]), float(row[7 + BAND])
            metal = {"type": "roughconductor", "distribution": "ggx", "alpha": float(row[1])}
            index = {"eta": {"type": "uniform", "value": n}, "k": {"type": "uniform", "value": k}}
            return {"type": "twosided", "side": {**metal, **index}}
    return {"type": "twosided", "side": {"type": "diffuse", "reflectance": {"type": "rgb", "value": material.albedo}}}


def theirs(scene, world, parts, folder):
    """(RUNS, h, w) of independent renders."""
    T, camera = mitsuba.ScalarTransform4f, scene.camera
    film = {"type": "hdrfilm", "width": camera.width, "height": camera.height, "component_format": "float32"}
    (light,) = scene.lights
    half = np.diag([light.width / 2, light.height / 2, 1.0, 1.0])
    black = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.0}}
    description = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": -1, "rr_depth": 6},
        "sensor": {
            "type": "perspective",
            "fov": 2 * math.degrees(math.atan(camera.width / (2 * camera.fx))),
            "fov_axis": "x",
            "to_world": T().look_at(origin=[0, 0, 0], target=[0, 0, 1], up=[0, -1, 0]),
            "film": {**film, "rfilter": {"type": "box"}, "pixel_format": "rgb"},
            "sampler": {"type": "independent", "sample_count": SAMPLES},
        },
        "sky": {"type": "constant", "radiance": {"type": "rgb", "value": scene.environment.radiance[BAND]}},
        "lamp": {
            "type": "rectangle",
            "to_world": T(light.T_world_light.matrix @ half),
            "bsdf": black,
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": light.radiance[BAND]}},
        },
    }
    for i, (mesh, material) in enumerate(parts):
        path = folder / f"{i}.ply"
        trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False).export(path)
        shading = bsdf(material, world.surface.rows[i])
        description[f"mesh{i}"] = {"type": "ply", "filename": str(path), "bsdf": shading, "face_normals": True}
    loaded = mitsuba.load_dict(description)
    return np.stack([np.array(mitsuba.render(loaded, seed=seed))[..., BAND].astype(np.float64) for seed in range(RUNS)])


@pytest.mark.parametrize("parts", [tee(), glass_ball()], ids=["glossy tee", "glass ball"])
def test_pixels_and_total_agree(parts, tmp_path):
    mitsuba.set_variant("scalar_rgb")
    scene, world = scene_with(paper_camera(0.03), *parts, lights=(LAMP,), environment=SKY)
    pose = scene.T_world_camera()
    options = {"samples": SAMPLES, "surfaces": None}
    ours = np.stack(
        [ambient_image(world, scene, scene.camera, pose, **options, run=Run(seed=i))[..., BAND] for i in range(RUNS)]
    )
    other = theirs(scene, world, parts, tmp_path)
    a, b = ours.astype(np.float64).mean(axis=0), other.mean(axis=0)
    noise = ours.std(axis=0).mean() / other.std(axis=0).mean()
    print(f"\ntotal {a.sum() / b.sum() - 1:+.3%}, noise of ours over theirs with as many samples {noise:.2f}")
    assert a.sum() == pytest.approx(b.sum(), rel=0.01)
    variance = (ours.var(axis=0, ddof=1) + other.var(axis=0, ddof=1)) / RUNS
    z = (a - b) / np.sqrt(variance + (SYSTEMATIC * np.maximum(a, b)) ** 2)
    # Sidak: no pixel beyond what the worst of so many may be
    worst = t.ppf(1 - (1 - 0.999 ** (1 / z.size)) / 2, RUNS - 1)
    print(f"worst {np.abs(z).max():.2f} of {worst:.2f}; beyond 1 %: {np.mean(np.abs(z) > t.ppf(0.995, RUNS - 1)):.2%}")
    assert np.abs(z).max() < worst
    assert np.mean(np.abs(z) > t.ppf(0.995, RUNS - 1)) < 0.015
