"""Light through glass on both sides of its only rough surface, against Snell, Fresnel and merging.

The plate stands across the camera's axis; what leaves a point of the wall reaches the camera through it by a path that
Snell's law gives in closed form.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from render.camera.camera import Lens
from render.laser.laser import Divergence
from render.laser_direct.integrator import direct_image
from render.laser_indirect.bdpt_pass import BdptPass
from render.laser_indirect.guiding import no_guide
from render.laser_indirect.integrator import empty_buffer, indirect_image
from render.laser_indirect.manifold_walk import landing, passed, set_planes, walk
from render.laser_indirect.path_vertex import CAUSTIC, SPECULAR_CHAIN
from render.laser_indirect.photon_emission import uniform_fan, visible_fan_range
from render.laser_indirect.sampling import Sampling
from render.laser_indirect.specular_chains import seen_chains
from render.material.material import Conductor, Glass, Lambertian
from render.mesh.mesh import Mesh
from render.mesh.primitives import primitive_mesh
from render.mesh.vertex_normals import corner_normals
from render.run import Run
from render.scene.shape import Box, Sphere
from render.world.placed import PlacedLaser
from tests.render.laser_indirect.test_integrator import setting
from tests.render.scenes import moved, paper_camera, paper_laser, plane_mesh

GREY, GLASS, MIRROR = Lambertian(albedo=0.5), Glass(index=1.5), Conductor(roughness=0.0)
WALL, DISTANCE = plane_mesh((0, 0, 1), 0.9), 0.9
THICKNESS = 0.02
PLATE = moved(primitive_mesh(Box(size_x=0.6, size_y=0.4, size_z=THICKNESS)), (0.1, 0.0, 0.45))
WINDOW = moved(primitive_mesh(Box(size_x=0.2, size_y=0.2, size_z=0.005)), (0.0, 0.0, 0.3))


def chains_of(parts, kind):
    """The index of what the camera sees, one record of each chain whose facets all refract or not, and the surface."""
    world, camera, laser, T_world_camera, _ = parts
    surface = world.surface_at((laser.wavelength_nm,) * 3)
    index = seen_chains(world, surface, camera, T_world_camera)
    plain = [s for s in index.seen if s["count"] == len(kind) and tuple(np.sign(s["facets"][: len(kind)])) == kind]
    return index, plain, surface


def through_plate(radius):
    """Slope at the camera of the ray that Snell's law bends by the plate to `radius` on the wall, by bisection."""

    def reached(slope):
        inside = math.asin(math.sin(math.atan(slope)) / 1.5)
        return slope * (DISTANCE - THICKNESS) + THICKNESS * math.tan(inside)

    low, high = 0.0, 1.0
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if reached(middle) < radius else (low, middle)
    slope = 0.5 * (low + high)
    step = 1e-6
    return slope, (reached(slope + step) - reached(slope - step)) / (2 * step)


def fresnel(angle, inside):
    s = ((math.cos(angle) - 1.5 * math.cos(inside)) / (math.cos(angle) + 1.5 * math.cos(inside))) ** 2
    p = ((1.5 * math.cos(angle) - math.cos(inside)) / (1.5 * math.cos(angle) + math.cos(inside))) ** 2
    return (s + p) / 2


@pytest.mark.parametrize(("x", "y"), [(0.05, 0.0), (0.1, 0.12), (-0.15, -0.02)])
def test_a_walk_through_a_plate_is_the_path_of_snells_law_and_brings_what_fresnel_lets_through(x, y):
    _, parts = setting([WALL, PLATE], [GREY, GLASS])
    _, through, surface = chains_of(parts, (1, 1))
    origin, pose = (0.0, 0.0, 0.0), np.eye(4)
    places, planes, rgb = np.empty((4, 3)), np.empty((4, 5)), np.empty(3)
    radius = math.hypot(x, y)
    slope, by_slope = through_plate(radius)
    shares = []
    for chain in through:
        found = walk(surface, chain, pose, origin, (x, y, DISTANCE), (0.0, 0.0, 1.0), planes)
        # the four triangles of the plate's two faces lie on the same two planes; the walk to one far off is given up
        if not found.found:
            continue
        assert found.slopes == pytest.approx((slope * x / radius, slope * y / radius), abs=1e-9)
        # a ring of slopes dS about the axis lands on a ring dR
        assert found.spread == pytest.approx(by_slope * radius / slope, rel=1e-5)
        shares.append(passed(surface, np.full(3, 1 / 3), chain, pose, origin, found.slopes, False, places, rgb))
    angle = math.atan(slope)
    expected = (1 - fresnel(angle, math.asin(math.sin(angle) / 1.5))) ** 2
    assert [share for share in {round(share, 12) for share in shares} if share > 0] == [pytest.approx(expected)]


def test_a_walk_finds_what_no_ray_of_the_grid_has_met_and_nothing_past_the_edges():
    _, parts = setting([WALL, PLATE], [GREY, GLASS])
    index, through, surface = chains_of(parts, (1, 1))
    # from one chain's own slopes to points all over the wall, and back
    rng, planes, places, rgb = np.random.default_rng(4), np.empty((4, 5)), np.empty((4, 3)), np.empty(3)
    set_planes(surface, through[0], planes)
    met = []
    for q, r in rng.uniform(-0.3, 0.3, (40, 2)):
        ok, point = landing(planes, 2, np.eye(4), (0.0, 0.0, 0.0), q, r, (0.0, 0.0, DISTANCE), (0.0, 0.0, 1.0))
        found = walk(surface, through[0], np.eye(4), (0.0, 0.0, 0.0), point, (0.0, 0.0, 1.0), planes)
        through_facets = (surface, np.full(3, 1 / 3), through[0], np.eye(4), (0.0, 0.0, 0.0), (q, r))
        on_facets = passed(*through_facets, False, places, rgb) > 0.0
        assert ok and (found.found or not on_facets)
        assert not found.found or found.slopes == pytest.approx((q, r), abs=1e-9)
        met.append((on_facets, found.found))
    # some lie on the facets, and of those past them the farthest are given up
    assert {(True, True), (False, False)} <= set(met)
    assert index.most < 64


def pass_of(parts, **changes):
    world, camera, laser, T_world_camera, T_world_laser = parts
    low, high, reach = visible_fan_range(world, laser, T_world_laser)
    task = BdptPass.of(PlacedLaser(world, camera, laser, T_world_camera, T_world_laser), reach, 3)
    pixels = camera.width * camera.height
    active = np.arange(pixels, dtype=np.int32)
    sampling = Sampling(1 << 13, uniform_fan(low, high), np.ones(pixels, np.float32), active, no_guide(camera))
    return replace(task, **changes), sampling, camera


def chain_light(parts, passes=24, **changes):
    """Sum over the image, of each pass, of light that is specular on both sides; and the mean image."""
    task, sampling, camera = pass_of(parts, **changes)
    sums, image = [], np.zeros(camera.width * camera.height)
    for number in range(passes):
        buffer = empty_buffer(len(image))
        task.run(100 + number, sampling, buffer)
        sums.append(buffer.sums[SPECULAR_CHAIN])
        image += buffer.image / passes
    return np.array(sums), image.reshape(camera.height, camera.width)


def smooth_ball():
    mesh = moved(primitive_mesh(Sphere(radius=0.03, segments=64)), (0.01, 0.0, 0.8))
    return Mesh(mesh.vertices, mesh.triangles, normals=corner_normals(mesh.vertices, mesh.triangles, 1.0))


def leaning_wall():
    """The wall, shaded as if it leant by 40 degrees towards the laser's side."""
    a, b, c = (WALL.vertices[i] for i in WALL.triangles[0])
    side = math.copysign(1.0, np.cross(b - a, c - a)[2])
    lean = side * np.array([-math.sin(math.radians(40)), 0.0, math.cos(math.radians(40))])
    return Mesh(WALL.vertices, WALL.triangles, normals=np.broadcast_to(lean, (2, 3, 3)).astype(np.float32))


SCENES = {
    "a plate on both ways": ([WALL, PLATE], [GREY, GLASS]),
    "a plate, through a lens that blurs and distorts": ([WALL, PLATE], [GREY, GLASS]),
    "a plate before a wall with shading normals": ([leaning_wall(), PLATE], [GREY, GLASS]),
    "a smooth ball, seen through a window": ([WALL, WINDOW, smooth_ball()], [GREY, GLASS, GLASS]),
    "a mirror behind a window": (
        [
            WALL,
            WINDOW,
            moved(primitive_mesh(Box(size_x=0.1, size_y=0.1, size_z=0.01)), (0.05, 0.0, 0.7), (0.3, 0.5, 0.0)),
        ],
        [GREY, GLASS, MIRROR],
    ),
}


CAMERAS = {
    "a plate, through a lens that blurs and distorts": paper_camera(0.05, (0.2, -0.1, 0.001, 0.002, 0.0)).model_copy(
        update={"lens": Lens(model="thin-lens", f_number=1.0, focus_distance=0.6)}
    )
}
"""In place of a small pinhole camera."""
QUICK = ("a plate on both ways", "a mirror behind a window")


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name in QUICK else pytest.mark.validation) for name in SCENES]
)
def test_walks_bring_the_light_that_merging_brings_with_less_noise(name):
    _, parts = setting(*SCENES[name], camera=CAMERAS.get(name, paper_camera(0.05)))
    merged, _ = chain_light(parts, chains=None)
    walked, _ = chain_light(parts)
    error = math.sqrt((merged.var(ddof=1) + walked.var(ddof=1)) / len(merged))
    assert abs(walked.mean() - merged.mean()) < 4.0 * error
    # variances of 24 passes each: by chance they would differ as much in fewer than one of a thousand
    assert walked.var(ddof=1) < merged.var(ddof=1) / 4.0


def test_a_line_through_a_plate_on_both_ways_lies_and_shines_as_snell_and_fresnel_say():
    # wide enough for its centre to be found on pixels
    broad = paper_laser(sheet=Divergence(full_angle=0.012))
    camera = paper_camera(0.2)
    _, plain_parts = setting([WALL], [GREY], camera=camera, laser=broad)
    _, parts = setting([WALL, PLATE], [GREY, GLASS], camera=camera, laser=broad)
    image = indirect_image(*parts, target=0.01, most_paths=1 << 20).radiance.astype(np.float64)
    row = slice(camera.height // 2 - 8, camera.height // 2 + 8)
    # the sheet's middle, to the wall through the plate, in the plane of x and z
    start, d = parts[4][:3, 3], parts[4][:3, 2]
    angle = math.acos(abs(d[2]))
    inside = math.asin(math.sin(angle) / 1.5)
    lit = start[0] + d[0] / d[2] * (DISTANCE - THICKNESS - start[2]) + math.copysign(THICKNESS * math.tan(inside), d[0])
    slope, by_slope = through_plate(abs(lit))
    expected = camera.cx + camera.fx * math.copysign(slope, lit)
    columns = np.arange(camera.width)
    peak = int(image[row].sum(axis=0).argmax())
    window = slice(peak - 12, peak + 13)
    profile = image[row, window].sum(axis=0)
    assert (profile * columns[window]).sum() / profile.sum() == pytest.approx(expected, abs=0.03)
    # an image row sums E dx / (dx / du), E dx being the power to a length of the line: P h dY / dy
    bare = direct_image(*plain_parts, target=1e-3).radiance.astype(np.float64)[row].sum()
    seen = math.atan(slope)
    share = (1 - fresnel(angle, inside)) ** 2 * (1 - fresnel(seen, math.asin(math.sin(seen) / 1.5))) ** 2
    reach = DISTANCE / math.cos(angle)
    along_fan = reach / (reach - THICKNESS / math.cos(angle) + THICKNESS / (1.5 * math.cos(inside)))
    # what is reflected twice within the plate, 0.3 %, lies a few pixels beside
    assert profile.sum() / bare == pytest.approx(share * along_fan * DISTANCE / by_slope, rel=0.01)


def test_nothing_is_walked_to_where_such_light_is_not_asked_for_or_bodies_overlap():
    world, camera, laser, T_world_camera, T_world_laser = setting([WALL, PLATE], [GREY, GLASS])[1]
    placed = PlacedLaser(world, camera, laser, T_world_camera, T_world_laser)
    assert BdptPass.of(placed, 0.9, 1).chains is not None
    assert BdptPass.of(placed, 0.9, 1, CAUSTIC).chains is None
    # interpolated normals are left to merging, and so is what is seen without glass
    assert BdptPass.of(PlacedLaser(*setting([WALL, smooth_ball()], [GREY, GLASS])[1]), 0.9, 1).chains is None
    assert BdptPass.of(PlacedLaser(*setting([WALL], [GREY])[1]), 0.9, 1).chains is None


def test_walks_are_the_same_on_any_number_of_threads():
    _, parts = setting(*SCENES["a plate on both ways"], camera=paper_camera(0.05))
    one, two = (indirect_image(*parts, target=0.2, run=Run(seed=5, threads=threads)).radiance for threads in (1, 2))
    assert np.array_equal(one, two)
