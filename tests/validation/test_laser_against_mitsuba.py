"""A laser's light over two or more surfaces beside Mitsuba 3, an independent renderer: groups of light, and pixels.

Mitsuba's path tracer finds no light through glass on the way to a surface, its particle tracer none on the way to the
camera. What goes through glass on both is made in two steps: particles give the radiance of the wall, as it is seen
from before it, and the path tracer sees that wall shine. Its scene is a hundred times larger than ours and about the
glass: its rays start at a distance off a surface of 9e-5 (1 + |x|), x the coordinates, which shifts a caustic.
"""

import math

import numpy as np
import pytest
import trimesh
from scipy.stats import binom, t

from render.camera.camera import Camera
from render.laser_direct.integrator import direct_image
from render.laser_indirect.integrator import ALL_KINDS, indirect_image
from render.laser_indirect.path_vertex import CAUSTIC, INTERREFLECTION
from render.material.material import Conductor, Glass, Lambertian
from render.mesh.primitives import primitive_mesh
from render.run import Run
from render.scene.shape import Box, Sphere
from tests.render.ambient.test_path_kernels import patch
from tests.render.laser_indirect.test_integrator import setting
from tests.render.scenes import moved, paper_laser, plane_mesh
from tests.validation.laser_projector import projector
from tests.validation.test_ambient_against_mitsuba import bsdf

pytestmark = pytest.mark.validation
mitsuba = pytest.importorskip("mitsuba", reason="make validate installs it")

RUNS = 12
LARGER = 100.0
SYSTEMATIC = 0.01
"""Of a pixel: the projector's picture has texels, Mitsuba's Smith term is not height-correlated."""
LIT = 0.005
"""Of the brightest pixel: dimmer ones are lit by too few paths for their spread to be known."""
CAMERA = Camera(width=72, height=60, fx=103.0, fy=103.0, cx=35.5, cy=29.5)
"""The founding paper's, much coarser; Mitsuba knows square pixels only."""
BALL = 0.03, 0.02, 0.55
WALL, SIDE = 1.0, 1.2
"""m: distance and size of the wall behind the glass ball."""
TEXELS, MAP_FROM = 900, 0.82
"""Of the map of its radiance, and where it is seen from: between ball and wall."""


class Theirs:
    """Mitsuba's renders of a scene of ours."""

    def __init__(self, meshes, materials, parts, folder):
        mitsuba.set_variant("scalar_rgb")
        mitsuba.set_log_level(mitsuba.LogLevel.Warn)
        world, _, laser, _, _ = parts
        rows = world.surface_at((laser.wavelength_nm,) * 3).rows
        self.shapes = {}
        # the last mesh is the glass
        self.about = meshes[-1].vertices.mean(axis=0)
        for i, (mesh, material) in enumerate(zip(meshes, materials, strict=True)):
            path = folder / f"{i}.ply"
            trimesh.Trimesh(LARGER * (mesh.vertices - self.about), mesh.triangles, process=False).export(path)
            shading = bsdf(material, rows[i])
            self.shapes[f"mesh{i}"] = {"type": "ply", "filename": str(path), "bsdf": shading, "face_normals": True}
        pose = laser.T_rig_laser.matrix
        at = self.placed(pose[:3, 3], pose[:3, 2], pose[:3, 1])
        self.laser = {**projector(laser, texels_across=512), "to_world": at}

    def placed(self, origin, axis, up):
        """Mitsuba's pose of what is at origin and looks along axis."""
        at = LARGER * (np.asarray(origin) - self.about)
        return mitsuba.ScalarTransform4f().look_at(origin=list(at), target=list(at + axis), up=list(up))

    def render(self, integrator, edges, samples, seed, camera=CAMERA, from_z=0.0):
        """(h, w) radiance of the laser's light by paths of so many edges and fewer; -1: of any length."""
        parts = {**self.shapes, "laser": self.laser}
        return LARGER**2 * self.picture(integrator, edges, samples, seed, parts, camera, from_z)

    def wall_map(self, samples, seed):
        """(TEXELS, TEXELS) radiance of the wall, by particles."""
        focal = TEXELS * (WALL - MAP_FROM) / SIDE
        changes = {"width": TEXELS, "height": TEXELS, "fx": focal, "fy": focal}
        return self.render("ptracer", -1, samples, seed, CAMERA.model_copy(update=changes), MAP_FROM)

    def seen(self, radiance, seed):
        """(h, w) what the camera sees of a map of the wall's radiance."""
        half = LARGER * SIDE / 2
        # a picture's first row is at the largest v
        texture = mitsuba.Bitmap(np.repeat(radiance[::-1, :, None], 3, axis=2).astype(np.float32))
        wall = {
            "type": "rectangle",
            "to_world": self.placed((0, 0, WALL), (0, 0, -1), (0, -1, 0))
            @ mitsuba.ScalarTransform4f().scale([half, half, 1]),
            "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.0}},
            "emitter": {
                "type": "area",
                "radiance": {"type": "bitmap", "bitmap": texture, "raw": True, "filter_type": "nearest"},
            },
        }
        return self.picture("path", -1, 1024, seed, {**self.shapes, "mesh0": wall}, CAMERA, 0.0)

    def picture(self, integrator, edges, samples, seed, parts, camera, from_z):
        film = {"type": "hdrfilm", "width": camera.width, "height": camera.height, "component_format": "float32"}
        description = {
            "type": "scene",
            "integrator": {"type": integrator, "max_depth": edges, "rr_depth": 8},
            "sensor": {
                "type": "perspective",
                "fov": 2 * math.degrees(math.atan(camera.width / (2 * camera.fx))),
                "fov_axis": "x",
                "to_world": self.placed((0, 0, from_z), (0, 0, 1), (0, -1, 0)),
                "film": {**film, "rfilter": {"type": "box"}, "pixel_format": "rgb"},
                "sampler": {"type": "independent", "sample_count": samples},
            },
            **parts,
        }
        image = mitsuba.render(mitsuba.load_dict(description), seed=seed)
        return np.array(image)[..., 0].astype(np.float64)


def runs(render):
    """(RUNS, h, w) independent renders."""
    return np.stack([np.asarray(render(seed), np.float64) for seed in range(RUNS)])


def same_flux(name, ours, theirs):
    """The totals of (RUNS, h, w) within 1 %, and known well enough for that to mean something."""
    a, b = ours.sum(axis=(1, 2)), theirs.sum(axis=(1, 2))
    known = math.sqrt((a.var(ddof=1) + b.var(ddof=1)) / RUNS) / b.mean()
    print(f"\n{name}: flux {a.mean() / b.mean() - 1:+.2%} +- {known:.2%}")
    assert known < 0.005
    assert a.mean() == pytest.approx(b.mean(), rel=0.01)


def same_pixels(name, ours, theirs, least=100):
    """Deviations of (RUNS, h, w) pixel by pixel are as Student's t of their spread says."""
    a, b = ours.mean(axis=0), theirs.mean(axis=0)
    variance = (ours.var(axis=0, ddof=1) + theirs.var(axis=0, ddof=1)) / RUNS
    z = ((a - b) / np.sqrt(variance + (SYSTEMATIC * np.maximum(a, b)) ** 2 + 1e-300))[b > LIT * b.max()]
    # Sidak: no pixel beyond what the worst of so many may be
    worst = t.ppf(1 - (1 - 0.999 ** (1 / z.size)) / 2, RUNS - 1)
    beyond, allowed = np.sum(np.abs(z) > t.ppf(0.995, RUNS - 1)), binom.ppf(0.999, z.size, 0.01)
    print(f"{name}: {z.size} pixels, worst {np.abs(z).max():.2f} of {worst:.2f}; beyond 1 %: {beyond} of {allowed:.0f}")
    assert z.size >= least
    assert np.abs(z).max() < worst
    assert beyond <= allowed


def ours_of(parts, kinds, first, paths=1 << 18):
    """(RUNS, h, w) of indirect light."""
    # as many paths each: to stop at an error would let the runs that met little end first
    options = {"target": 0.0, "most_paths": paths, "kinds": kinds}
    return runs(lambda seed: indirect_image(*parts, **options, run=Run(seed=first + seed)).radiance)


def direct_of(parts):
    return runs(lambda seed: direct_image(*parts, target=2e-3, run=Run(seed=seed)).radiance)


def test_reflections_in_a_glossy_tee(tmp_path):
    iron = Conductor(metal="iron", roughness=0.25)
    plate = moved(primitive_mesh(Box(size_x=0.4, size_y=0.02, size_z=0.3)), (0, 0.12, 0.9), (0.4, 0.3, 0))
    upright = moved(primitive_mesh(Box(size_x=0.4, size_y=0.25, size_z=0.02)), (0, 0.0, 0.97), (0.4, 0.3, 0))
    meshes, materials = [plate, upright], [iron, iron]
    # wide, so that a path tracer meets it
    _, parts = setting(meshes, materials, CAMERA, paper_laser(0.06, fan_angle=math.radians(30)))
    mitsubas = Theirs(meshes, materials, parts, tmp_path)
    direct, indirect = direct_of(parts), ours_of(parts, INTERREFLECTION, 0)
    once = runs(lambda seed: mitsubas.render("path", 2, 128, seed))
    same_flux("direct", direct, once)
    traced = runs(lambda seed: mitsubas.render("path", -1, 1024, 100 + seed)) - once
    same_flux("indirect", indirect, traced)
    same_pixels("indirect", indirect, traced)


def test_a_refracted_caustic(tmp_path):
    # a ball beside the image, and large: what it throws on the wall is all that is seen of it
    ball = moved(primitive_mesh(Sphere(radius=0.04)), (0.142, 0.02, 0.25))
    meshes, materials = [plane_mesh((0.2, -0.1, 1), 0.9), ball], [Lambertian(albedo=0.5), Glass(index=1.5)]
    _, parts = setting(meshes, materials, CAMERA, paper_laser(0.03, fan_angle=math.radians(30)))
    mitsubas = Theirs(meshes, materials, parts, tmp_path)
    direct, caustic = direct_of(parts), ours_of(parts, CAUSTIC, 0)
    once = runs(lambda seed: mitsubas.render("ptracer", 2, 128, seed))
    all_light = runs(lambda seed: mitsubas.render("ptracer", -1, 256, 100 + seed))
    same_flux("direct", direct, once)
    same_flux("caustic", caustic, all_light - once)
    same_pixels("caustic", caustic, all_light - once)


def ball_before_a_wall(fan_angle, folder):
    """A ball that the camera sees, its wall dark, so that what the ball sends back to it does not count."""
    ball = moved(primitive_mesh(Sphere(radius=0.1)), BALL)
    meshes, materials = [patch((0, 0, WALL), SIDE), ball], [Lambertian(albedo=0.2), Glass(index=1.5)]
    _, parts = setting(meshes, materials, CAMERA, paper_laser(0.04, fan_angle=math.radians(fan_angle)))
    return parts, Theirs(meshes, materials, parts, folder)


def test_a_line_seen_past_and_through_a_glass_ball(tmp_path):
    parts, mitsubas = ball_before_a_wall(30, tmp_path)
    direct, bent = direct_of(parts), ours_of(parts, CAUSTIC, 0, 1 << 20)
    once = runs(lambda seed: mitsubas.render("path", 2, 256, seed))
    through = runs(lambda seed: mitsubas.render("path", -1, 512, 100 + seed)) - once
    # elsewhere there is the caustic, which a path tracer does not find
    glass = behind_the_ball(parts)
    assert 300 < glass.sum() < 2000
    same_flux("direct", direct, once)
    same_flux("line through glass", glass * bent, glass * through)
    same_pixels("line through glass", glass * bent, glass * through, 25)


def behind_the_ball(parts):
    """(h, w) bool: the ball covers the whole pixel, or nearly."""
    world, camera, *_ = parts
    v, u = np.mgrid[0 : camera.height, 0 : camera.width].astype(float)
    covered = np.ones(u.shape, bool)
    for du in (-0.49, 0.49):
        for dv in (-0.49, 0.49):
            rays, _ = camera.rays(np.stack([u + du, v + dv], axis=-1).reshape(-1, 2))
            hit = world.rays.from_point(np.zeros(3), rays.astype(np.float32))
            covered &= (world.object_id[hit] == 1).reshape(u.shape)
    return covered


def test_a_caustic_seen_past_and_through_the_ball_that_makes_it(tmp_path):
    # all of the fan meets the ball
    parts, mitsubas = ball_before_a_wall(8, tmp_path)
    assert direct_of(parts).sum() == 0.0
    indirect = ours_of(parts, ALL_KINDS, 0, 1 << 19)
    everything = runs(lambda seed: mitsubas.seen(mitsubas.wall_map(2, seed), 100 + seed))
    glass = behind_the_ball(parts)
    same_flux("caustic", ~glass * indirect, ~glass * everything)
    # only merging finds it
    same_flux("caustic through glass", glass * indirect, glass * everything)
    same_pixels("all light", blocks(indirect), blocks(everything), 12)


def blocks(images):
    """Sums over 6 x 6 pixels: merging blurs by a pixel, and the map of the wall has texels."""
    count, height, width = images.shape
    return images.reshape(count, height // 6, 6, width // 6, 6).sum(axis=(2, 4))
