"""The camera's paths against closed forms: furnaces, form factors, mirrors and glass; every estimator the same mean."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import render.ambient.integrator
from render.ambient.integrator import ambient_image
from render.ambient.path_state import CLAMPED, INVALID, accumulate
from render.ambient.path_tracer import camera_paths
from render.base.pose import Pose
from render.material.bsdf import evaluate
from render.material.material import Coated, Conductor, Emitter, Glass, Lambertian
from render.mesh.mesh import Mesh
from render.mesh.primitives import primitive_mesh
from render.run import Run
from render.scene.lights import Environment, PointLight, RectangleLight
from render.scene.scene import SceneObject
from render.scene.shape import Box, Plane, Sphere
from render.truth.pixel_truth import truth_images
from tests.render.scenes import moved, paper_camera, plane_mesh, scene_of, world_of

SKY = Environment(radiance=(1.0, 1.0, 1.0))


def scene_with(camera, *pairs, **parts):
    """A scene and its world of (mesh, material) pairs."""
    items = tuple(
        SceneObject(name=f"object {i}", shape=Plane(), material=material) for i, (_, material) in enumerate(pairs)
    )
    scene = scene_of(camera, **parts).model_copy(update={"objects": items})
    return scene, world_of(scene, *(mesh for mesh, _ in pairs))


def picture(scene, world, samples=16, surfaces=None, **how):
    pose = scene.T_world_camera()
    image = ambient_image(world, scene, scene.camera, pose, samples=samples, surfaces=surfaces, run=Run(**how))
    return image.astype(np.float64)


def inside_out(mesh):
    return Mesh(mesh.vertices, np.ascontiguousarray(mesh.triangles[:, ::-1]), mesh.uv, mesh.texture)


def patch(centre, size, turned=0.0):
    """A square that faces the camera (its winding's normal to -z), turned about x."""
    half = size / 2
    corners = np.array([(-half, -half, 0.0), (-half, half, 0.0), (half, half, 0.0), (half, -half, 0.0)])
    triangles = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)
    return moved(Mesh(corners, triangles), centre, (turned, 0.0, 0.0))


def directional_albedo(row, o, both_sides):
    """Integral of f |cos| over the directions, by midpoints in cosine and azimuth; the boundary's outside first."""
    n, m = 600, 240
    z = (np.arange(n) + 0.5) / n
    phi = (np.arange(m) + 0.5) / m * 2 * math.pi
    total = np.zeros(3)
    for c in np.concatenate([z, -z]) if both_sides else z:
        s = math.sqrt(1 - c * c)
        for angle in phi:
            f = evaluate(row, (1.0, 1.0, 1.0), tuple(o), (s * math.cos(angle), s * math.sin(angle), c))
            total += np.array(f) * abs(c)
    return total * 2 * math.pi / (n * m)


@pytest.mark.parametrize(
    "material",
    [
        Lambertian(albedo=1.0),
        Conductor(metal="gold", roughness=0.3),
        Coated(albedo=1.0, roughness=0.3),
        Glass(index=1.5, roughness=0.4),
        Glass(index=1.5),
    ],
    ids=["lambertian", "conductor", "coated", "rough glass", "glass"],
)
def test_a_plane_under_an_even_sky_has_its_directional_albedo(material):
    # +z of the plane's winding, which tells the outside of glass, is towards the camera
    scene, world = scene_with(paper_camera(0.005), (patch((0, 0, 1), 9.0), material), environment=SKY)
    image = picture(scene, world, samples=4096)
    row = world.surface.rows[0]
    polished = material == Glass(index=1.5)
    expected = np.ones(3) if polished else directional_albedo(row, (0.0, 0.0, 1.0), row[0] == 2.0)
    middle = image[4:6, 5:7].mean(axis=(0, 1))
    assert np.all(expected <= 1.0 + 1e-3)
    # four pixels of 4096 samples in [0, 1]: at most 0.4 % for one standard deviation, here far less
    assert middle == pytest.approx(expected, rel=6e-3)


@pytest.mark.parametrize("material", [Glass(index=1.5), Lambertian(albedo=1.0)])
def test_a_white_ball_vanishes_in_an_even_sky(material):
    ball = moved(primitive_mesh(Sphere(radius=0.1)), (0, 0, 0.8))
    scene, world = scene_with(paper_camera(0.01), (ball, material), environment=SKY)
    image = picture(scene, world, samples=64)
    # roulette makes the long paths within glass rare and heavy
    assert image.mean() == pytest.approx(1.0, abs=4 * image.std() / math.sqrt(image.size / 3) + 1e-6)
    assert image == pytest.approx(1.0, abs=0.2)


@pytest.mark.parametrize(("surfaces", "factor"), [(0, 1.0), (1, 1.5), (2, 1.75), (None, 2.0)])
def test_a_shining_room_gives_the_geometric_series(surfaces, factor):
    room = inside_out(primitive_mesh(Sphere(radius=2.0)))
    scene, world = scene_with(paper_camera(0.01), (room, Emitter(radiance=(3.0, 2.0, 1.0), albedo=0.5)))
    image = picture(scene, world, samples=256, surfaces=surfaces)
    assert image.mean(axis=(0, 1)) == pytest.approx(factor * np.array([3.0, 2.0, 1.0]), rel=3e-3)
    assert image[..., 1] * 1.5 == pytest.approx(image[..., 0], rel=1e-5)


def test_a_dark_room_with_a_lamp_keeps_the_balance_of_power():
    # flux emitted = flux absorbed: in a closed room of albedo a the mean irradiance is E = Phi / (A (1 - a))
    room = inside_out(primitive_mesh(Sphere(radius=1.0)))
    lamp = PointLight(intensity=(1.0, 1.0, 1.0))
    camera = paper_camera(0.01)
    scene, world = scene_with(camera, (room, Lambertian(albedo=0.8)), lights=(lamp,))
    image = picture(scene, world, samples=1024)
    # a lamp in the centre of a sphere lights it evenly
    expected = 0.8 / math.pi * 4 * math.pi / (4 * math.pi * (1 - 0.8))
    assert image.mean() == pytest.approx(expected, rel=0.01)


def test_a_diffuse_ball_under_a_lamp_follows_lambert():
    ball = moved(primitive_mesh(Sphere(radius=0.1)), (0, 0, 0.8))
    lamp = PointLight(intensity=(2.0, 2.0, 2.0), T_world_light=Pose(translation=(0.4, -0.3, 0.0)))
    scene, world = scene_with(paper_camera(0.05), (ball, Lambertian(albedo=0.6)), lights=(lamp,))
    truth = truth_images(world, scene.camera, scene.T_world_camera())
    towards = np.array([0.4, -0.3, 0.0]) - truth.position
    distance = np.linalg.norm(towards, axis=2)
    cosine = np.einsum("ijk,ijk->ij", truth.normal, towards) / distance
    expected = np.nan_to_num(0.6 / math.pi * 2.0 * np.maximum(cosine, 0.0) / distance**2)
    image = picture(scene, world, samples=64)[..., 0]
    assert image.sum() == pytest.approx(expected.sum(), rel=0.01)
    # away from the rim, where a pixel holds more than its centre says
    inside = np.minimum.reduce([np.roll(expected, shift, axis) for shift in (-1, 0, 1) for axis in (0, 1)])
    lit = inside > 0.4 * expected.max()
    assert image[lit] == pytest.approx(expected[lit], rel=0.05)


def disk(radius, z, n=400):
    """A disk that faces +z."""
    angle = np.arange(n) / n * 2 * math.pi
    # the polygon's area is the circle's
    radius *= math.sqrt(2 * math.pi / n / math.sin(2 * math.pi / n))
    rim = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(n, z)], axis=1)
    vertices = np.vstack([[0.0, 0.0, z], rim])
    i = np.arange(n)
    return Mesh(vertices, np.stack([np.zeros(n, np.int64), 1 + i, 1 + (i + 1) % n], axis=1).astype(np.int32))


@pytest.mark.parametrize("connected", [True, False], ids=["both ways", "scattering alone"])
@pytest.mark.parametrize("radius", [0.2, 2.0])
def test_a_shining_disk_has_its_form_factor(radius, connected):
    # from a point below its centre F = R^2 / (R^2 + h^2); behind the camera, which does not hide it
    wall, shining = plane_mesh((0, 0, 1), 0.9), disk(radius, -0.1)
    scene, world = scene_with(
        paper_camera(0.005),
        (wall, Lambertian(albedo=0.5)),
        (shining, Emitter(radiance=(4.0, 4.0, 4.0), albedo=0.0)),
    )
    paths = camera_paths(world, scene, scene.camera.view(scene.T_world_camera()))
    if not connected:
        rows = paths.lights.rows.copy()
        rows[:, 17] = 0.0
        paths = replace(paths, lights=paths.lights._replace(rows=rows))
    film = render.ambient.integrator.Film(scene.camera.width, scene.camera.height)
    image = film.add_samples(paths, np.full((film.tiles, 2), 8192), Run()).radiance
    expected = 0.5 * 4.0 * radius**2 / (radius**2 + 1.0)
    found = image[4:6, 5:7, 0].mean()
    assert found == pytest.approx(expected, rel=4e-3 if connected else 0.02)


@pytest.mark.parametrize("material", [Lambertian(albedo=0.7), Conductor(roughness=0.2), Coated(albedo=0.5)])
def test_a_rectangle_of_lamp_and_one_of_mesh_give_the_same_image(material):
    wall = plane_mesh((0.2, 0.1, 1), 0.9)
    pose = Pose(translation=(0.3, 0.1, 0.3), rotation=(0.0, 0.3, 0.0))
    lamp = RectangleLight(radiance=(5.0, 4.0, 3.0), width=0.3, height=0.2, T_world_light=pose)
    corners = np.array([(-0.15, -0.1, 0), (0.15, -0.1, 0), (0.15, 0.1, 0), (-0.15, 0.1, 0)])
    mesh = Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32))
    mesh = moved(mesh, pose.translation, pose.rotation)
    camera = paper_camera(0.02)
    one = picture(*scene_with(camera, (wall, material), lights=(lamp,)), samples=256, surfaces=1)
    shining = Emitter(radiance=(5.0, 4.0, 3.0), albedo=0.0)
    two = picture(*scene_with(camera, (wall, material), (mesh, shining)), samples=256, surfaces=1, seed=7)
    assert two.sum() == pytest.approx(one.sum(), rel=5e-3)
    blocks = [image[:40, :48].reshape(10, 4, 12, 4, 3).mean(axis=(1, 3)) for image in (one, two)]
    assert blocks[1] == pytest.approx(blocks[0], rel=0.06, abs=0.01 * blocks[0].max())


def centre_of(image):
    light = image.sum(axis=2)
    v, u = np.mgrid[0 : light.shape[0], 0 : light.shape[1]]
    return np.array([(light * u).sum(), (light * v).sum()]) / light.sum()


def test_a_mirror_shows_a_patch_where_its_mirror_image_is():
    # on x + z = 0.6; the patch beside the camera, out of its view
    wide = np.array([(0.7, -0.6, -0.1), (0.7, 0.6, -0.1), (-0.1, 0.6, 0.7), (-0.1, -0.6, 0.7)])
    mirror = Mesh(wide, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32))
    q = np.array([-0.5, 0.05, 0.58])
    corners = q + 0.02 * np.array([(0, -1, -1), (0, 1, -1), (0, 1, 1), (0, -1, 1)])
    shining = Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32))
    camera = paper_camera(0.1)
    scene, world = scene_with(
        camera,
        (mirror, Conductor(metal="silver", roughness=0.01)),
        (shining, Emitter(radiance=(1.0, 1.0, 1.0), albedo=0.0)),
    )
    image = picture(scene, world, samples=64, surfaces=1)
    behind = np.array([0.6 - q[2], q[1], 0.6 - q[0]])
    expected, _ = camera.project(behind[None])
    # nothing else is seen, and the roughness widens it evenly
    assert centre_of(image) == pytest.approx(expected[0], abs=0.1)
    # a mirror changes no radiance but by its reflectance
    at = np.rint(expected[0]).astype(int)
    assert 0.8 < image[at[1], at[0]].mean() < 1.0


def test_a_glass_plate_shifts_what_is_behind_it():
    index, thickness, angle, depth = 1.5, 0.03, math.radians(40), 0.8
    plate = moved(primitive_mesh(Box(size_x=0.6, size_y=0.6, size_z=thickness)), (0, 0, 0.4), (angle, 0, 0))
    shining = Emitter(radiance=(1.0, 1.0, 1.0), albedo=0.0)
    camera = paper_camera(0.1)
    scene, world = scene_with(camera, (plate, Glass(index=index)), (patch((0.0, 0.0, depth), 0.02), shining))
    image = picture(scene, world, samples=64, surfaces=2)

    def height_at(slope):
        """y at the patch's depth of the ray (0, slope, 1), moved along the plate's normal by the glass."""
        beta = angle + math.atan(slope)
        return slope * depth, thickness * math.sin(beta) * (
            1 - math.cos(beta) / math.sqrt(index**2 - math.sin(beta) ** 2)
        )

    shifts = []
    for sign in (1.0, -1.0):
        low, high = -0.1, 0.1
        for _ in range(60):
            slope = (low + high) / 2
            straight, moved_by = height_at(slope)
            # the ray leaves the plate parallel, moved sideways by the classic amount
            y = straight - sign * moved_by * math.sqrt(1 + slope * slope)
            low, high = (slope, high) if y < 0 else (low, slope)
        shifts.append(camera.cy + camera.fy * slope)
    found = centre_of(image)
    assert found[0] == pytest.approx(camera.cx, abs=0.05)
    assert min(abs(found[1] - shift) for shift in shifts) < 0.05
    assert abs(found[1] - camera.cy) > 2.0


def test_light_passes_through_glass_to_a_wall():
    # a plate of glass before a wall under an even sky: nothing is absorbed, so the white wall stays white
    plate = moved(primitive_mesh(Box(size_x=0.5, size_y=0.5, size_z=0.02)), (0, 0, 0.5))
    wall = plane_mesh((0, 0, 1), 0.9, size=3.0)
    scene, world = scene_with(
        paper_camera(0.01), (plate, Glass(index=1.5)), (wall, Lambertian(albedo=1.0)), environment=SKY
    )
    assert picture(scene, world, samples=512).mean() == pytest.approx(1.0, abs=0.01)


def test_threads_do_not_change_a_bit():
    ball = moved(primitive_mesh(Sphere(radius=0.1)), (0, 0, 0.8))
    scene, world = scene_with(
        paper_camera(0.05),
        (ball, Glass(roughness=0.1)),
        (plane_mesh((0.2, 0, 1), 1.0), Conductor()),
        lights=(RectangleLight(), PointLight(T_world_light=Pose(translation=(0.1, 0, 0)))),
        environment=SKY,
    )
    one, three = (picture(scene, world, samples=5, threads=n, seed=4) for n in (1, 3))
    assert np.array_equal(one, three)
    assert not np.array_equal(one, picture(scene, world, samples=5, seed=5))


def test_what_is_no_radiance_is_dropped_and_counted():
    sums, tally = np.zeros((2, 4)), np.zeros(2)
    for bad in ((math.nan, 0.0, 0.0), (0.0, math.inf, 0.0), (1.0, 1.0, -1e-9)):
        accumulate(sums, tally, 1, math.inf, bad)
    assert tally[INVALID] == 3 and not sums.any()
    accumulate(sums, tally, 1, 2.0, (4.0, 2.0, 0.0))
    assert sums[1] == pytest.approx([2.0, 1.0, 0.0, 1.0]) and tally[CLAMPED] == 1
