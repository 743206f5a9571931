"""Shading frames: maps and vertex normals tilt them as geometry would, and let no light through the surface."""

from __future__ import annotations

import math
from pathlib import Path

import cv2
import numba
import numpy as np
import pytest

from render.ambient.integrator import ambient_image
from render.base.pose import Pose
from render.base.vectors import store, vector
from render.laser.laser import Divergence
from render.laser_direct.integrator import direct_image
from render.laser_indirect.integrator import indirect_image
from render.laser_indirect.pilot import indirect_pilot
from render.material import bsdf
from render.material.material import (
    BumpMap,
    Coated,
    Conductor,
    Glass,
    GreyTexture,
    Lambertian,
    NormalMap,
    Subsurface,
)
from render.mesh.load import load_mesh
from render.scene.lights import PointLight
from render.scene.scene import SceneObject
from render.scene.shape import Box, Cylinder, Plane, Sphere
from render.truth.pixel_truth import truth_images
from render.world.surface_interaction import interaction, light_side
from render.world.world import build_world, place_meshes
from tests.render.scenes import paper_camera, paper_laser, scene_of

TILT = math.radians(12)
FACING = Pose(translation=(0.0, 0.0, 0.9), rotation=(math.pi, 0.0, 0.0))


def write(path: Path, values: np.ndarray, bits: int = 16) -> str:
    codes = np.rint(np.asarray(values) * (2**bits - 1)).astype(np.uint16 if bits == 16 else np.uint8)
    cv2.imwrite(str(path), codes[..., ::-1] if codes.ndim == 3 else codes)
    return path.name


def normal_image(path: Path, normal: tuple[float, float, float]) -> str:
    middle = 2**15
    codes = np.rint(middle + np.array(normal) * (middle - 1)) / 65535
    return write(path, np.broadcast_to(codes, (4, 4, 3)))


def placed(item: SceneObject, root: Path, **parts):
    """The object alone; an open plane may be glass here, though not in a project."""
    scene = scene_of(paper_camera(0.1), paper_laser(), **parts).model_copy(update={"objects": (item,)})
    mesh = load_mesh(item.model_copy(update={"material": Lambertian()}), root)
    return scene, place_meshes(scene, [mesh], root=root)


@numba.njit
def frames(surface, t, points, normal):
    out, alphas, rgb = np.empty((len(t), 3, 3)), np.empty((len(t), 2)), np.empty(3)
    for j in range(len(t)):
        p, n = points[j], normal[j]
        interaction(surface, t[j], vector(p), vector(n), 0.5, rgb, alphas[j], out[j])
    return out, alphas


def shaded(world, count=400, inward=False):
    """Random points of the world's triangles, with their geometric normals, frames and roughness."""
    rng = np.random.default_rng(4)
    t = rng.integers(0, len(world.triangles), count).astype(np.int32)
    weights = rng.dirichlet((1, 1, 1), count)
    corners = world.vertices[world.triangles[t]]
    points = np.einsum("ij,ijk->ik", weights, corners)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True) * (-1 if inward else 1)
    return t, points, normal, *frames(world.surface, t, points, normal)


@pytest.mark.parametrize(
    "material", [Lambertian(albedo=0.8), Conductor(roughness=0.4), Coated(albedo=0.5, roughness=0.3)]
)
@pytest.mark.parametrize("kind", ["normal map", "green down", "bump map"])
def test_a_map_shades_as_a_tilted_plane_does(tmp_path, kind, material):
    # at the axis that it is tilted about, the wide sheet lights the true and the pretended tilt alike
    laser = paper_laser(sheet=Divergence(full_angle=0.2))
    slope, size = math.tan(TILT), 0.4
    if kind == "bump map":
        ramp = np.tile((np.arange(256) + 0.5) / 256, (8, 1))
        relief = BumpMap(path=write(tmp_path / "h.png", ramp), height=-slope * size)
    else:
        down = kind == "green down"
        name = normal_image(tmp_path / "n.png", (math.sin(TILT), 0.0, math.cos(TILT)))
        relief = NormalMap(path=name, green_down=down)
    flat = SceneObject(
        name="flat",
        shape=Plane(width=size, height=size),
        material=material.model_copy(update={"relief": relief}),
        T_world_object=FACING,
    )
    turned = SceneObject(
        name="tilted",
        shape=Plane(width=size, height=size),
        material=material,
        T_world_object=Pose.from_matrix(FACING.matrix @ Pose(rotation=(0.0, TILT, 0.0)).matrix),
    )
    radiance = []
    for item in (flat, turned):
        scene, world = placed(item, tmp_path)
        image = direct_image(world, scene.camera, laser, scene.T_world_camera(), scene.T_world_laser(0), target=1e-3)
        row, column = round(scene.camera.cy), round(scene.camera.cx)
        radiance.append(image.radiance[row - 5 : row + 6, column - 1 : column + 2].mean(dtype=np.float64))
    assert radiance[0] == pytest.approx(radiance[1], rel=5e-3)
    plain, world = placed(flat.model_copy(update={"material": material}), tmp_path)
    untilted = direct_image(world, plain.camera, laser, plain.T_world_camera(), plain.T_world_laser(0)).radiance
    assert untilted[row, column] != pytest.approx(radiance[0], rel=0.02)


def test_normal_maps_lean_along_u_and_v_whatever_the_mapping(tmp_path):
    # a box: its faces are mapped in different directions
    name = normal_image(tmp_path / "n.png", (0.48, 0.6, 0.64))
    for down in (False, True):
        relief = NormalMap(path=name, green_down=down)
        _, world = placed(SceneObject(name="box", shape=Box(), material=Lambertian(relief=relief)), tmp_path)
        t, _, normal, frame, _ = shaded(world)
        corners, uv = world.vertices[world.triangles[t]], world.uv[t].astype(np.float64)
        edges = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=1)
        steps = np.stack([uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]], axis=1)
        along = np.linalg.solve(steps, edges)
        along /= np.linalg.norm(along, axis=2, keepdims=True)
        found = [np.einsum("ij,ij->i", frame[:, 2], axis) for axis in (along[:, 0], along[:, 1], normal)]
        expected = (0.48, -0.6 if down else 0.6, 0.64)
        for values, value in zip(found, expected, strict=True):
            assert values == pytest.approx(value, abs=1e-4)
        # from behind, the same surface seen from behind
        assert shaded(world, inward=True)[3][:, 2] == pytest.approx(-frame[:, 2])


def test_the_middle_code_of_a_normal_map_is_flat(tmp_path):
    name = write(tmp_path / "n.png", np.broadcast_to(np.array([128, 128, 255]) / 255, (4, 4, 3)), bits=8)
    _, world = placed(SceneObject(name="p", shape=Plane(), material=Lambertian(relief=NormalMap(path=name))), tmp_path)
    _, _, normal, frame, _ = shaded(world)
    assert frame[:, 2] == pytest.approx(normal, abs=1e-7)


def test_roughness_comes_from_its_map(tmp_path):
    ramp = np.tile((np.arange(64) + 0.5) / 64, (4, 1))
    grey = GreyTexture(path=write(tmp_path / "r.png", ramp), scale=0.5)
    for material in (Conductor(roughness=grey), Glass(roughness=grey), Coated(roughness=grey)):
        _, world = placed(SceneObject(name="p", shape=Plane(), material=material), tmp_path)
        _, points, _, _, alpha = shaded(world)
        u = points[:, 0] + 0.5
        inside = np.abs(u - 0.5) < 0.47
        assert alpha[inside, 0] == pytest.approx(0.5 * u[inside], abs=1e-4)
        assert alpha[:, 1] == pytest.approx(alpha[:, 0])
        # the row says the least of it: a mirror, but never for a coat
        assert world.surface.rows[0, 1] == (0.01 if material.kind == "coated" else 0.0)
    # a grain's second roughness stays
    _, world = placed(
        SceneObject(name="p", shape=Plane(), material=Conductor(roughness=grey, roughness_across=0.3)), tmp_path
    )
    _, points, _, _, alpha = shaded(world)
    assert (alpha[:, 1] == 0.3).all() and alpha[:, 0].std() > 0.1


def test_a_map_of_one_value_is_that_value(tmp_path):
    grey = GreyTexture(path=write(tmp_path / "r.png", np.full((2, 2), 0.3)))
    images = []
    for roughness in (grey, 0.3):
        item = SceneObject(name="p", shape=Plane(), material=Conductor(roughness=roughness), T_world_object=FACING)
        scene, world = placed(item, tmp_path)
        parts = (world, scene.camera, scene.lasers[0], scene.T_world_camera(), scene.T_world_laser(0))
        images.append(direct_image(*parts).radiance)
    assert images[0].max() > 0 and images[0] == pytest.approx(images[1], rel=1e-4)


def test_smooth_normals_of_a_ball_point_from_its_centre(tmp_path):
    _, world = placed(SceneObject(name="ball", shape=Sphere(segments=32), crease_angle=0.5), tmp_path)
    _, points, normal, frame, _ = shaded(world)
    radial = points / np.linalg.norm(points, axis=1, keepdims=True)
    assert frame[:, 2] == pytest.approx(radial, abs=1e-6)
    assert np.abs(normal - radial).max() > 0.05


def test_edges_sharper_than_the_crease_angle_stay_sharp(tmp_path):
    _, world = placed(SceneObject(name="c", shape=Cylinder(segments=24), crease_angle=math.radians(30)), tmp_path)
    _, points, normal, frame, _ = shaded(world)
    cap = np.abs(normal[:, 2]) > 0.5
    assert cap.any() and frame[cap, 2] == pytest.approx(normal[cap], abs=1e-6)
    radial = points[~cap] * (1, 1, 0)
    radial /= np.linalg.norm(radial, axis=1, keepdims=True)
    # interpolation between two normals of a circle, along the chord
    assert frame[~cap, 2] == pytest.approx(radial, abs=1e-6)
    _, faceted = placed(SceneObject(name="c", shape=Cylinder(segments=24), crease_angle=math.radians(10)), tmp_path)
    _, _, normal, frame, _ = shaded(faceted)
    assert frame[:, 2] == pytest.approx(normal, abs=1e-6)


def test_a_coarse_ball_shaded_smoothly_is_as_bright_as_a_fine_one(tmp_path):
    at = Pose(translation=(0.0, 0.0, 0.9), rotation=(0.4, 0.3, 0.2))
    rows = {}
    for name, segments, crease in (("fine", 1024, 0.0), ("smooth", 48, 0.6), ("facets", 48, 0.0)):
        item = SceneObject(
            name="ball", shape=Sphere(radius=0.08, segments=segments), T_world_object=at, crease_angle=crease
        )
        scene, world = placed(item, tmp_path)
        parts = (world, scene.camera, scene.lasers[0], scene.T_world_camera(), scene.T_world_laser(0))
        rows[name] = direct_image(*parts, target=2e-3).radiance.sum(axis=1, dtype=np.float64)
    # away from the ends of the line
    used = rows["fine"] > 0.5 * rows["fine"].max()
    worst = {name: np.abs(rows[name][used] / rows["fine"][used] - 1).max() for name in ("smooth", "facets")}
    assert used.sum() > 20
    assert worst["smooth"] < 0.02 < 0.04 < worst["facets"]


BENT = np.array([0.45, 0.2, 0.0])
BENT[2] = math.sqrt(1 - BENT @ BENT)
MODELS = {
    "lambertian": (bsdf.LAMBERTIAN, 0.0, 0.0),
    "metal": (bsdf.CONDUCTOR, 0.3, 0.5),
    "frosted glass": (bsdf.DIELECTRIC, 0.4, 0.4),
    "paint": (bsdf.COATED, 0.2, 0.2),
}


def row_of(kind, ax, ay):
    row = np.zeros(bsdf.ROW)
    row[:4], row[4:7], row[7:10], row[10] = (kind, ax, ay, 1.5), 2.87, 3.25, 0.6
    return row


@numba.njit
def carried(row, axes, numbers, from_light):
    """g(i) h(o) transported by light from i to o, by paths from either end; directions cosine-distributed about z."""
    rgb, out, weight, total = np.full(3, 0.8), np.empty(3), np.empty(3), np.empty(len(numbers))
    for j in range(len(numbers)):
        radius, angle = math.sqrt(numbers[j, 3]), 2.0 * math.pi * numbers[j, 4]
        a = np.array([radius * math.cos(angle), radius * math.sin(angle), math.sqrt(1.0 - numbers[j, 3])])
        total[j] = 0.0
        o = axes @ a
        if o[2] <= 0.0:
            continue
        wi, pdf = bsdf.sample(row, vector(rgb), vector(o), vector(numbers[j]), weight)
        if pdf == 0.0:
            continue
        store(out, wi)
        b = axes.T @ out
        if light_side(out[2], b[2]) == 0.0 or b[2] < 0.0:
            continue
        value = weight[0]
        if from_light:
            value *= light_side(o[2], a[2]) / light_side(out[2], b[2])
        light, eye = (a, b) if from_light else (b, a)
        total[j] = value * math.exp(light[0] + 0.5 * light[1]) * (1.0 + eye[0]) * (1.0 + eye[1] ** 2)
    return total


@pytest.mark.parametrize("name", MODELS)
def test_paths_from_light_and_camera_carry_the_same_over_a_bent_normal(name):
    x = np.cross((0.0, 1.0, 0.0), BENT)
    x /= np.linalg.norm(x)
    axes = np.array([x, np.cross(BENT, x), BENT])
    numbers = np.random.default_rng(8).random((2, 400_000, 5))
    from_camera, from_light = (carried(row_of(*MODELS[name]), axes, numbers[k], bool(k)) for k in range(2))
    spread = math.hypot(from_camera.std(), from_light.std()) / math.sqrt(400_000)
    assert abs(from_camera.mean() - from_light.mean()) < 4 * spread
    assert spread < 0.02 * from_camera.mean()
    # without the remedy they differ by much more
    assert light_side(0.4, 0.8) == pytest.approx(0.5) and light_side(-0.1, 0.2) == 0.0


def test_no_normal_leans_below_its_facet(tmp_path):
    rough = np.random.default_rng(2).random((64, 64))
    relief = BumpMap(path=write(tmp_path / "h.png", rough), height=1.0)
    for material in (Lambertian(relief=relief), Subsurface(relief=relief)):
        _, world = placed(SceneObject(name="ball", shape=Sphere(segments=32), material=material), tmp_path)
        _, _, normal, frame, _ = shaded(world)
        cosine = np.einsum("ij,ij->i", normal, frame[:, 2])
        assert cosine.min() >= 0.05 - 1e-9 and cosine.min() < 0.1
        assert np.einsum("nij,nkj->nik", frame, frame) == pytest.approx(
            np.broadcast_to(np.eye(3), frame.shape), abs=1e-9
        )


def test_plain_materials_are_left_as_they_are(tmp_path):
    _, world = placed(SceneObject(name="ball", shape=Sphere(segments=32)), tmp_path)
    assert world.normals.shape == (0, 3, 3) and not world.detail.any()
    _, _, normal, frame, _ = shaded(world)
    assert frame[:, 2] == pytest.approx(normal)


def screen(tmp_path, relief, steep):
    """A sheet across the view; lamp, laser and a wall that they light are behind it. Steeply seen, or steeply lit."""
    sheet = SceneObject(
        name="sheet",
        shape=Plane(width=6.0, height=6.0),
        material=Lambertian(albedo=0.9, relief=relief),
        T_world_object=Pose(translation=(0.0, 0.0, 0.6), rotation=(0.0, math.radians(65) if steep else math.pi, 0.0)),
    )
    behind = Pose(translation=(0.5, 0.0, 0.8))
    beyond = Pose(translation=(0.5, 0.0, 1.5))
    if not steep:
        behind = Pose(translation=(0.5, 0.0, 0.75), rotation=(0.0, math.pi / 2, 0.0))
        beyond = Pose(translation=(0.9, 0.0, 1.1), rotation=(0.0, -math.pi / 2, 0.0))
    wall = SceneObject(name="wall", shape=Plane(), T_world_object=beyond)
    lamp = PointLight(name="lamp", intensity=(5.0, 5.0, 5.0), T_world_light=behind)
    laser = paper_laser(T_rig_laser=behind)
    scene = scene_of(paper_camera(0.02), laser, lights=(lamp,)).model_copy(update={"objects": (sheet, wall)})
    return scene, build_world(scene, tmp_path)


@pytest.mark.parametrize(("steep", "lean"), [(True, 0), (True, 1), (True, -1), (False, 1), (False, -1)])
def test_no_light_leaks_through_a_sheet_whatever_its_relief(tmp_path, steep, lean):
    name = normal_image(tmp_path / "n.png", (lean * 0.8, 0.0, 0.6))
    scene, world = screen(tmp_path, NormalMap(path=name) if lean else None, steep)
    pose, T_laser = scene.T_world_camera(), scene.T_world_laser(0)
    view = truth_images(world, scene.camera, pose)
    assert (view.object_id == 0).all()
    assert not ambient_image(world, scene, scene.camera, pose, samples=16, surfaces=None).any()
    image = indirect_image(world, scene.camera, scene.lasers[0], pose, T_laser, target=0.5, most_paths=1 << 20)
    assert not image.radiance.any()
    # there is light behind
    assert indirect_pilot(world, scene.camera, scene.lasers[0], T_laser, T_laser).interreflection[0] > 0.0
