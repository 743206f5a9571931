"""Water in a glass, drawn as two bodies that overlap: position and radiance as Snell and Fresnel say, slab by slab.

The tank: air, a wall of glass, water that reaches 15 mm into the 20 mm of the wall, and a dark plate in the water.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from render.ambient.integrator import ambient_image
from render.base.pose import Pose, invert, transform_points
from render.camera.camera import Camera
from render.laser.irradiance import irradiance_at
from render.laser.laser import Divergence, LineLaser
from render.laser_indirect.integrator import indirect_image
from render.material.material import Emitter, Glass, Lambertian, Subsurface
from render.mesh.mesh import Mesh
from render.mesh.primitives import primitive_mesh
from render.scene.lights import Environment
from render.scene.shape import Box, Sphere
from tests.render.scenes import moved, paper_camera, paper_laser, plane_mesh, scene_of, world_of

GLASS, WATER, DEPTH, ALBEDO = 1.52, 1.333, 0.55, 0.02
LAYERS = ((0.30, 1.0), (0.02, GLASS), (0.23, WATER))
"""Thickness, m, and index of what lies between the plane of the camera and the plate."""
CAMERA = Camera(width=200, height=40, fx=400.0, fy=400.0, cx=20.5, cy=19.5)
SHEET = Divergence(full_angle=0.012)


def placed(scene, materials, *meshes):
    items = tuple(i.model_copy(update={"material": m}) for i, m in zip(scene.objects, materials, strict=True))
    scene = scene.model_copy(update={"objects": items})
    return scene, world_of(scene, *meshes)


def tank(laser, T_rig_camera=None, plate=None):
    """Scene and world; the plate reflects so little that what comes back to it may be left out."""
    wall = moved(primitive_mesh(Box(size_x=0.8, size_y=0.8, size_z=0.02)), (0.0, 0.0, 0.31))
    water = moved(primitive_mesh(Box(size_x=0.7, size_y=0.7, size_z=0.30)), (0.0, 0.0, 0.455))
    camera = CAMERA.model_copy(update={"T_rig_camera": T_rig_camera or Pose()})
    scene = scene_of(camera, laser, objects=3)
    materials = [Glass(index=GLASS, priority=1), Glass(index=WATER), plate or Lambertian(albedo=ALBEDO)]
    return placed(scene, materials, wall, water, plane_mesh((0, 0, 1), DEPTH, 0.3))


def seen_through_layers(u, v):
    """(n,) pixels of a camera outside -> their points on the plate (n, 3), and sines of their angle in air."""
    x, y = (u - CAMERA.cx) / CAMERA.fx, (v - CAMERA.cy) / CAMERA.fy
    tangent = np.hypot(x, y)
    sine = tangent / np.hypot(1.0, tangent)
    r = sum(d * (sine / n) / np.sqrt(1.0 - (sine / n) ** 2) for d, n in LAYERS)
    return np.stack([r * x / tangent, r * y / tangent, np.full_like(x, DEPTH)], axis=-1), sine


def fresnel(sine, before, after):
    """Share of unpolarised light that a smooth boundary lets through, sine in air."""
    a, b = np.sqrt(1.0 - (sine / before) ** 2), np.sqrt(1.0 - (sine / after) ** 2)
    s, p = (before * a - after * b) / (before * a + after * b), (after * a - before * b) / (after * a + before * b)
    return 1.0 - 0.5 * (s**2 + p**2)


def predicted_image(scene, cuts=6):
    """Radiance (h, w) of the line on the plate, of a laser in the water seen from outside, pixels cut into cuts^2."""
    offsets = (np.arange(cuts) + 0.5) / cuts - 0.5
    u, v = ((np.arange(size)[:, None] + offsets).ravel() for size in (CAMERA.width, CAMERA.height))
    u, v = np.meshgrid(u, v)
    points, sine = seen_through_layers(u, v)
    T_laser_world = invert(scene.T_world_laser(0))
    there = np.ascontiguousarray(transform_points(T_laser_world, points.reshape(-1, 3)))
    normals = np.ascontiguousarray(np.broadcast_to(T_laser_world[:3, :3] @ [0.0, 0.0, -1.0], there.shape))
    light = irradiance_at(there, normals, scene.lasers[0].packed()).reshape(u.shape)
    radiance = ALBEDO / math.pi * light * fresnel(sine, 1.0, GLASS) * fresnel(sine, GLASS, WATER) / WATER**2
    return radiance.reshape(CAMERA.height, cuts, CAMERA.width, cuts).mean(axis=(1, 3))


def line_positions(image, half=8):
    """(h,) centres of mass about the brightest pixel of each row."""
    at = image.argmax(axis=1)[:, None] + np.arange(-half, half + 1)
    light = np.take_along_axis(image.astype(np.float64), at, axis=1)
    return (light * at).sum(axis=1) / light.sum(axis=1)


def indirect(scene, world, **options):
    return indirect_image(
        world, scene.camera, scene.lasers[0], scene.T_world_camera(), scene.T_world_laser(0), **options
    )


def test_a_line_in_water_seen_through_its_glass_stands_where_snell_says_and_is_as_bright_as_fresnel_says():
    scene, world = tank(LineLaser(sheet=SHEET, T_rig_laser=Pose(translation=(0.16, 0.0, 0.40), rotation=(0, -0.5, 0))))
    image = indirect(scene, world, target=0.015, most_paths=1 << 20)
    expected = predicted_image(scene)
    rows = slice(4, -4)
    off = (line_positions(image.radiance) - line_positions(expected))[rows]
    # by one path after another each row is known to a hundredth of a pixel, their mean better
    assert abs(off.mean()) < 0.005
    assert off.std() < 0.02
    assert image.radiance[rows].sum() == pytest.approx(expected[rows].sum(), rel=0.01)


def refracted_sheet(scene):
    """(n, 3) where rays of the middle of the sheet meet the plate, bent at both faces of the wall."""
    matrix = scene.T_world_laser(0)
    slope = np.linspace(-0.15, 0.15, 401)
    ray = np.stack([0.0 * slope, slope, np.ones_like(slope)], axis=1) @ matrix[:3, :3].T
    ray /= np.linalg.norm(ray, axis=1, keepdims=True)
    point = np.tile(matrix[:3, 3], (len(slope), 1))
    for depth, index in LAYERS:
        across = ray[:, :2] / index
        inside = np.column_stack([across, np.sqrt(1.0 - np.sum(across**2, axis=1))])
        point += inside * (depth / inside[:, 2:])
    return point


BESIDE = Pose(translation=(0.2, 0.0, 0.0), rotation=(0.0, -0.35, 0.0))
THIN = Divergence(full_angle=0.003)


def test_a_camera_in_the_water_sees_a_laser_outside_where_snell_says():
    """By paths from the laser this time."""
    scene, world = tank(LineLaser(sheet=THIN, T_rig_laser=BESIDE), Pose(translation=(0.0, 0.0, 0.36)))
    image = indirect(scene, world, target=0.01, most_paths=1 << 20)
    point = refracted_sheet(scene)
    u, v = (CAMERA.fx * point[:, i] / (DEPTH - 0.36) + c for i, c in ((0, CAMERA.cx), (1, CAMERA.cy)))
    rows = np.arange(4, CAMERA.height - 4)
    off = line_positions(image.radiance)[rows] - np.interp(rows, v, u)
    assert abs(off.mean()) < 0.01


def test_laser_and_camera_outside_see_the_line_where_snell_says_by_merging():
    scene, world = tank(LineLaser(sheet=THIN, T_rig_laser=BESIDE))
    image = indirect(scene, world, target=0.03, most_paths=1 << 20)
    point = refracted_sheet(scene)
    u, rows = np.linspace(21.0, 180.0, 20_000), np.arange(4, CAMERA.height - 4)
    expected = []
    for row in rows:
        seen, _ = seen_through_layers(u, np.full_like(u, float(row)))
        expected.append(np.interp(0.0, seen[:, 0] - np.interp(seen[:, 1], point[:, 1], point[:, 0]), u))
    off = line_positions(image.radiance)[rows] - expected
    # rows scatter by 0.017 px
    assert abs(off.mean()) < 0.01


def test_an_edge_that_shines_in_the_water_is_seen_where_snell_says_by_ambient_light():
    scene, world = tank(paper_laser(), plate=Emitter(radiance=(1.0, 1.0, 1.0), albedo=0.0))
    # turned to the camera, and its left edge at x = 0.06 m
    shifted = moved(plane_mesh((0, 0, -1), -DEPTH, 0.3), (0.36, 0.0, 0.0))
    scene, world = placed(scene, [item.material for item in scene.objects], *meshes_of(world, 2), shifted)
    image = ambient_image(world, scene, scene.camera, scene.T_world_camera(), samples=256, surfaces=None)
    u = np.linspace(1.0, 150.0, 100_000)
    row = 20
    points, sine = seen_through_layers(u, np.full_like(u, float(row)))
    edge = np.interp(0.06, points[:, 0], u)
    through = np.interp(np.arange(CAMERA.width), u, fresnel(sine, 1.0, GLASS) * fresnel(sine, GLASS, WATER))
    lit = image[row - 3 : row + 3, :120, 1].mean(axis=0) / through[:120]
    assert 119.5 - lit.sum() == pytest.approx(edge, abs=0.05)


def meshes_of(world, count):
    return [Mesh(world.vertices, world.triangles[world.object_id == item]) for item in range(count)]


@pytest.mark.parametrize(
    "hidden", [pytest.param(Glass(index=1.2), marks=pytest.mark.validation), Subsurface(mean_free_path=0.001)]
)
def test_what_is_hidden_within_a_body_changes_nothing(hidden):
    """Connections and shadow rays cross the hidden boundary too: rough glass, whose inner faces see each other."""
    block = moved(primitive_mesh(Box(size_x=0.2, size_y=0.2, size_z=0.1)), (0.05, 0.0, 0.8))
    ball = moved(primitive_mesh(Sphere(radius=0.04, segments=24)), (0.05, 0.0, 0.8))
    wall = plane_mesh((0, 0, 1), 0.95)
    rough = Glass(index=1.5, roughness=0.2, priority=1)
    scene = scene_of(paper_camera(0.05), paper_laser(), objects=2, environment=Environment(radiance=(1, 1, 1)))
    images = []
    for extra in ((), ((hidden, ball),)):
        objects = scene.model_copy(
            update={"objects": scene_of(scene.camera, paper_laser(), objects=2 + len(extra)).objects}
        )
        materials = [Lambertian(albedo=0.5), rough, *(material for material, _ in extra)]
        made, world = placed(objects, materials, wall, block, *(mesh for _, mesh in extra))
        assert world.nesting.ranked == ((2, 1) if extra else ())
        light = indirect(made, world, target=0.02, most_paths=1 << 17).radiance
        ambient = ambient_image(world, made, made.camera, made.T_world_camera(), samples=16, surfaces=None)
        images.append((light, ambient))
    for alone, with_hidden in zip(*images, strict=True):
        assert with_hidden.sum() == pytest.approx(alone.sum(), rel=0.02)


@pytest.mark.validation
def test_light_that_wanders_in_wax_goes_on_through_a_boundary_that_is_hidden_there():
    block = moved(primitive_mesh(Box(size_x=0.1, size_y=0.1, size_z=0.05)), (0.0, 0.0, 0.8))
    core = moved(primitive_mesh(Box(size_x=0.09, size_y=0.09, size_z=0.045)), (0.0, 0.0, 0.7995))
    wax = Subsurface(mean_free_path=0.004, scattering_albedo=0.99, priority=1)
    found = []
    for priority in (None, 0, 2):
        count = 1 if priority is None else 2
        scene = scene_of(paper_camera(0.05), paper_laser(), objects=count, environment=Environment(radiance=(1, 1, 1)))
        materials = [wax] if priority is None else [wax, Glass(index=1.5, priority=priority)]
        scene, world = placed(scene, materials, block, *(() if priority is None else (core,)))
        image = indirect(scene, world, target=0.02, most_paths=1 << 18)
        ambient = ambient_image(world, scene, scene.camera, scene.T_world_camera(), samples=16, surfaces=None)
        found.append((image.radiance.sum(), ambient.sum()))
    alone, within, displacing = found
    assert within == pytest.approx(alone, rel=0.02)
    # light that would have come back from the wax goes on through a clear core that is there
    assert displacing[0] < 0.6 * alone[0]


def test_nested_clear_bodies_under_an_even_sky_are_not_seen():
    """A white furnace: whatever the order of refraction, radiance over the index squared stays as it is."""
    ball = moved(primitive_mesh(Sphere(radius=0.1, segments=64)), (0.0, 0.0, 0.8))
    core = moved(primitive_mesh(Box(size_x=0.15, size_y=0.05, size_z=0.05)), (0.05, 0.0, 0.8))
    scene = scene_of(paper_camera(0.05), paper_laser(), objects=2, environment=Environment(radiance=(1, 1, 1)))
    scene, world = placed(scene, [Glass(index=1.5, priority=1), Glass(index=1.33)], ball, core)
    assert world.nesting.ranked == (1, 0)
    options = {"samples": 64, "surfaces": None}
    outside = ambient_image(world, scene, scene.camera, scene.T_world_camera(), **options)
    # light that is caught by total reflection is found by few paths of much weight
    seen = outside[np.abs(outside - 1.0).max(axis=2) > 1e-6]
    assert seen.mean() == pytest.approx(1.0, abs=0.01)
    # within the ball the same sky shines with the square of the index
    inside = scene.T_world_camera().copy()
    inside[:3, 3] = (0.0, 0.04, 0.8)
    seen = ambient_image(world, scene, scene.camera, inside, **options)
    assert seen.mean() == pytest.approx(1.5**2, rel=0.01)
