import math

import numpy as np
import pytest

from render.base.deadline import Deadline
from render.frame import Frame
from render.laser.laser import Divergence, LineLaser
from render.laser_direct.integrator import direct_image
from render.laser_indirect.bdpt_pass import BdptPass
from render.laser_indirect.guiding import no_guide
from render.laser_indirect.integrator import empty_buffer, indirect_image
from render.laser_indirect.light_group import IndirectLight
from render.laser_indirect.photon_emission import (
    fan_integral,
    fan_quantile,
    normal_quantile,
    uniform_fan,
    visible_fan_range,
)
from render.laser_indirect.pilot import indirect_pilot
from render.laser_indirect.sampling import Sampling
from render.light_group import chosen_plan
from render.material.material import Coated, Conductor, Glass, Lambertian, Subsurface
from render.mesh.mesh import Mesh
from render.mesh.primitives import primitive_mesh
from render.plan import TransportStep
from render.render import render_world
from render.run import Run
from render.scene.settings import RenderSettings
from render.scene.shape import Box, Sphere, VGroove
from render.world.placed import PlacedLaser, PlacedScene
from tests.render.scenes import moved, paper_camera, paper_laser, plane_mesh, scene_of, world_of


def setting(meshes, materials, camera=None, laser=None):
    scene = scene_of(camera or paper_camera(0.1), laser or paper_laser(), objects=len(meshes))
    items = tuple(
        item.model_copy(update={"material": material}) for item, material in zip(scene.objects, materials, strict=True)
    )
    scene = scene.model_copy(update={"objects": items})
    world = world_of(scene, *meshes)
    return scene, (world, scene.camera, scene.lasers[0], scene.T_world_camera(), scene.T_world_laser(0))


def turned_groove(angle=90):
    mesh = primitive_mesh(VGroove(angle=math.radians(angle), depth=0.03, width=0.2, length=0.2, thickness=0.04))
    turned = Mesh(mesh.vertices[:, [1, 0, 2]] * (1, 1, -1), mesh.triangles, mesh.uv)
    return moved(turned, (0.0, 0.0, 0.85))


@pytest.mark.parametrize("profile", ["uniform", "gaussian", "constant"])
def test_photons_leave_the_laser_as_its_fan_says(profile):
    beam = LineLaser(fan_profile=profile, fan_angle=1.2).packed()
    shares = np.linspace(0.001, 0.999, 41)
    y = np.array([fan_quantile(share, beam) for share in shares])
    assert np.array([fan_integral(v, beam) for v in y]) == pytest.approx(shares, abs=1e-9)
    # the density is the derivative
    from render.laser.irradiance import fan_density

    slope = np.array([(fan_integral(v + 1e-6, beam) - fan_integral(v - 1e-6, beam)) / 2e-6 for v in y])
    assert slope == pytest.approx([fan_density(v, beam) for v in y], rel=1e-6)


def test_the_normal_quantile_inverts_the_distribution():
    from scipy.stats import norm

    shares = np.array([1e-7, 1e-4, 0.1, 0.5, 0.73, 0.999, 1 - 1e-7])
    assert [normal_quantile(share) for share in shares] == pytest.approx(norm.ppf(shares), abs=1e-9)


def test_a_lone_convex_body_or_plane_has_no_indirect_light():
    for mesh in (plane_mesh((0, 0, 1), 0.9), moved(primitive_mesh(Sphere(radius=0.1)), (0, 0, 0.9))):
        _, parts = setting([mesh], [Lambertian(albedo=0.9)])
        shares = indirect_pilot(*parts)
        assert shares.interreflection == shares.caustic == shares.specular_chain == shares.subsurface == (0.0, 0.0)


def test_light_and_camera_paths_agree_on_the_light_in_a_groove():
    _, parts = setting([turned_groove()], [Lambertian(albedo=0.8)])
    image = indirect_image(*parts, target=0.02, most_paths=1 << 23)
    direct = direct_image(*parts, target=1e-3).radiance.astype(np.float64)
    share = image.radiance.sum(dtype=np.float64) / direct.sum()
    expected = independent_share(0.8)
    assert share == pytest.approx(expected, rel=0.03)


def independent_share(albedo, count=3_000_000):
    """Indirect over direct radiance to the camera of the groove, by plain path tracing from the camera in NumPy."""
    rng = np.random.default_rng(11)
    scene, (world, camera, laser, _, _) = setting([turned_groove()], [Lambertian(albedo=albedo)])
    from render.base.pose import invert
    from render.laser.irradiance import irradiance_at

    T_laser = invert(scene.T_world_laser(0))
    corners = world.vertices[world.triangles]
    facets = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facets /= np.linalg.norm(facets, axis=1, keepdims=True)

    # a wider sheet with the same fan, so that camera paths meet it; much narrower than the groove is long
    def lit(points, normals):
        local = points @ T_laser[:3, :3].T + T_laser[:3, 3]
        towards = scene.T_world_laser(0)[:3, 3] - points
        distance = np.linalg.norm(towards, axis=1)
        facing = np.einsum("ij,ij->i", normals, towards) > 0
        origin = (points - world.rays.centre + normals * world.rays.surface_offset).astype(np.float32)
        blocked = world.rays.occluded(
            origin, (towards / distance[:, None]).astype(np.float32), distance.astype(np.float32)
        )
        values = irradiance_at(np.ascontiguousarray(local), np.ascontiguousarray(normals @ T_laser[:3, :3].T), wide)
        return np.where(facing & ~blocked, values, 0.0)

    from render.laser.laser import Divergence

    wide = laser.model_copy(update={"sheet": Divergence(full_angle=0.03)}).packed()
    pixels = rng.uniform((-0.5, -0.5), (camera.width - 0.5, camera.height - 0.5), (count, 2))
    rays, _ = camera.rays(pixels)
    weight, origin, direction = np.ones(count), np.zeros((count, 3)), rays
    # radiance summed over pixels weighs each sample alike
    first = rest = 0.0
    alive = np.arange(count)
    for depth in range(12):
        start = (origin - world.rays.centre).astype(np.float32)
        triangle, _ = world.rays.intersect(start, direction.astype(np.float32))
        hit = triangle >= 0
        alive, origin, direction, triangle = alive[hit], origin[hit], direction[hit], triangle[hit]
        n, a = facets[triangle], corners[triangle, 0]
        t = np.einsum("ij,ij->i", n, a - origin) / np.einsum("ij,ij->i", n, direction)
        points = origin + t[:, None] * direction
        n = n * -np.sign(np.einsum("ij,ij->i", n, direction))[:, None]
        light = np.sum(weight[alive] * albedo / math.pi * lit(points, n))
        first, rest = (first + light, rest) if depth == 0 else (first, rest + light)
        weight[alive] *= albedo
        u, v = rng.random((2, len(alive)))
        z, radius, phi = np.sqrt(u), np.sqrt(1 - u), 2 * np.pi * v
        x_axis = np.cross(n, np.where(np.abs(n[:, :1]) > 0.9, (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)))
        x_axis /= np.linalg.norm(x_axis, axis=1, keepdims=True)
        y_axis = np.cross(n, x_axis)
        direction = (radius * np.cos(phi))[:, None] * x_axis + (radius * np.sin(phi))[:, None] * y_axis + z[:, None] * n
        origin = points + n * world.rays.surface_offset
    return rest / first


def test_the_error_estimate_is_that_of_the_image():
    _, parts = setting([turned_groove()], [Conductor(roughness=0.2)])
    reference = indirect_image(*parts, target=0.01, most_paths=1 << 22, run=Run(seed=5)).radiance.astype(np.float64)
    found = [indirect_image(*parts, target=0.1, run=Run(seed=seed)) for seed in (1, 2, 3)]
    errors = [math.sqrt(np.sum((image.radiance - reference) ** 2) / np.sum(reference**2)) for image in found]
    assert np.mean(errors) == pytest.approx(np.mean([image.error for image in found]), rel=0.3)
    assert max(errors) < 0.15


def test_reflections_are_the_same_for_any_number_of_threads():
    _, parts = setting([turned_groove()], [Coated(albedo=0.6)])
    one, four = (indirect_image(*parts, target=0.2, run=Run(threads=threads)).radiance for threads in (1, 4))
    assert np.array_equal(one, four) and one.max() > 0


def test_the_plan_follows_what_the_pilot_measures():
    def plan(meshes, materials, **settings):
        scene, parts = setting(meshes, materials)
        frame = Frame(0, (direct_image(*parts).radiance,), None, (), None)
        return chosen_plan(IndirectLight(), PlacedScene(parts[0], scene), RenderSettings(**settings), frame)[0]

    flat = plan([plane_mesh((0, 0, 1), 0.9)], [Conductor()])
    first = flat.steps[0]
    assert flat.kinds is None and (first.name, first.computed, first.share) == ("interreflection", False, 0.0)
    deep = plan([turned_groove()], [Conductor()])
    assert deep.kinds is not None and deep.steps[0].reason == "pilot" and deep.steps[0].share > 0.02
    # a dark groove would look the same, but there is nothing worth computing
    dark = plan([turned_groove()], [Lambertian(albedo=0.01)])
    assert dark.kinds is None and dark.steps[0].reason == "negligible"
    off = plan([turned_groove()], [Conductor()], transport="direct")
    assert off.kinds is None and off.steps == (TransportStep("indirect", "indirect", False, "switched off"),)
    requested = plan([plane_mesh((0, 0, 1), 0.9)], [Lambertian()], transport="interreflection")
    assert requested.kinds is not None and requested.steps[0].reason == "requested"


def test_a_frame_keeps_direct_and_reflected_light_apart():
    scene, parts = setting([turned_groove()], [Conductor(roughness=0.1)])
    frame = render_world(parts[0], scene)
    assert len(frame.laser_indirect) == 1
    assert frame.laser(0) == pytest.approx(frame.laser_direct[0] + frame.laser_indirect[0])
    assert frame.laser_indirect[0].sum() > 0.05 * frame.laser_direct[0].sum()


def test_metal_at_an_unknown_wavelength_is_named():
    from render.base.errors import InputError

    with pytest.raises(InputError, match="not known at this wavelength"):
        setting_parts = setting([turned_groove()], [Conductor(metal="gold")], laser=paper_laser(wavelength_nm=1550.0))
        direct_image(*setting_parts[1])


def test_light_through_a_glass_plate_loses_what_fresnel_says_and_shifts_as_snell_says():
    # a plate between the laser and the wall, not before the camera: the line on the wall is displaced and dimmed
    wall = plane_mesh((0, 0, 1), 0.9)
    plate = moved(primitive_mesh(Box(size_x=0.2, size_y=0.4, size_z=0.02)), (0.12, 0.0, 0.45))
    # wide enough for its centre to be found on pixels
    broad = paper_laser(sheet=Divergence(full_angle=0.012))
    _, specular = setting([wall], [Lambertian(albedo=0.5)], laser=broad)
    _, parts = setting([wall, plate], [Lambertian(albedo=0.5), Glass(index=1.5)], laser=broad)
    plain = direct_image(*specular, target=1e-3).radiance.astype(np.float64)
    assert direct_image(*parts, target=1e-3).radiance.sum() < 1e-3 * plain.sum()
    through = indirect_image(*parts, target=0.02, most_paths=1 << 20).radiance.astype(np.float64)
    _, columns = np.mgrid[0 : plain.shape[0], 0 : plain.shape[1]]
    middle = slice(plain.shape[0] // 2 - 10, plain.shape[0] // 2 + 10)
    # normal incidence in the middle row but for the laser's tilt in the plane of x and z
    angle = math.acos(abs(parts[4][2, 2]))
    inside = math.asin(math.sin(angle) / 1.5)
    s = ((math.cos(angle) - 1.5 * math.cos(inside)) / (math.cos(angle) + 1.5 * math.cos(inside))) ** 2
    p = ((1.5 * math.cos(angle) - math.cos(inside)) / (1.5 * math.cos(angle) + math.cos(inside))) ** 2
    reflected = (s + p) / 2
    passed = (1 - reflected) / (1 + reflected)
    shift = 0.02 * (math.tan(angle) - math.tan(inside))
    # the line alone, without what the plate throws elsewhere
    peak = int(plain[middle].sum(axis=0).argmax())
    line = (middle, slice(peak - 6, peak + 8))
    before, after = ((image[line] * columns[line]).sum() / image[line].sum() for image in (plain, through))
    assert after - before == pytest.approx(shift * parts[1].fx / 0.9, abs=0.02)
    assert through[line].sum() / plain[line].sum() == pytest.approx(passed, rel=0.01)


def test_a_line_seen_through_glass_is_found_from_the_camera_and_a_caustic_there_by_merging():
    wall = plane_mesh((0, 0, 1), 0.9)
    window = moved(primitive_mesh(Box(size_x=0.2, size_y=0.2, size_z=0.005)), (0.0, 0.0, 0.3))
    ball = moved(primitive_mesh(Sphere(radius=0.03)), (0.01, 0.0, 0.8))
    _, parts = setting([wall, window, ball], [Lambertian(albedo=0.5), Glass(index=1.5), Glass(index=1.5)])
    shares = indirect_pilot(*parts)
    assert shares.caustic[0] > 5 * shares.caustic[1] > 0
    assert shares.specular_chain[0] > 3 * shares.specular_chain[1] > 0
    # without the window there is only what the ball itself shows of its caustic
    _, without = setting([wall, ball], [Lambertian(albedo=0.5), Glass(index=1.5)])
    assert indirect_pilot(*without).specular_chain[0] < 0.5 * shares.specular_chain[0]


def test_camera_and_light_paths_weigh_each_other_without_bias():
    # the same light with hardly any camera paths, and with many
    _, parts = setting([turned_groove(70)], [Conductor(roughness=0.1)])
    few, many = (flux_of(parts, camera_paths) for camera_paths in (0, 1 << 14))
    mean, error = (np.array([part[k] for part in (few, many)]) for k in (0, 1))
    assert abs(mean[0] - mean[1]) < 4.0 * math.hypot(*error)
    assert math.hypot(*error) < 0.02 * mean[0]


def flux_of(parts, camera_paths, passes=16):
    """Mean radiance over the image and its standard error, with `camera_paths` camera paths a pass."""
    world, camera, laser, T_world_camera, T_world_laser = parts
    low, high, reach = visible_fan_range(world, laser, T_world_laser)
    task = BdptPass.of(PlacedLaser(world, camera, laser, T_world_camera, T_world_laser), reach, 3)
    pixels = camera.width * camera.height
    expected = np.full(pixels, camera_paths / pixels, np.float32)
    active = np.arange(pixels if camera_paths else 0, dtype=np.int32)
    sampling = Sampling(1 << 14, uniform_fan(low, high), expected, active, no_guide(camera))
    sums = []
    for number in range(passes):
        buffer = empty_buffer(pixels)
        task.run(number, sampling, buffer)
        sums.append(buffer.image.sum())
    return np.mean(sums), np.std(sums, ddof=1) / math.sqrt(passes)


def chandrasekhar_h(albedo, cosines):
    """H of isotropic scattering (Chandrasekhar 1960, section 41), by iteration on Gauss points."""
    x, w = np.polynomial.legendre.leggauss(64)
    x, w = (x + 1) / 2, w / 2
    h = np.ones(64)
    for _ in range(500):
        h = 1 / (math.sqrt(1 - albedo) + 0.5 * albedo * np.sum(w * x * h / (x[:, None] + x), axis=1))
    rest = [np.sum(w * x * h / (cosine + x)) for cosine in cosines]
    return [1 / (math.sqrt(1 - albedo) + 0.5 * albedo * part) for part in rest]


@pytest.mark.parametrize("albedo", [0.8, 0.9999])
def test_a_deep_medium_reflects_as_chandrasekhar_says(albedo):
    # all light that leaves is caught by a black sphere about everything
    deep = moved(primitive_mesh(Box(size_x=0.6, size_y=0.6, size_z=0.2)), (0.0, 0.0, 1.0))
    around = moved(primitive_mesh(Sphere(radius=3.0)), (0.0, 0.0, 0.5))
    wax = Subsurface(index=1.01, roughness=0.05, mean_free_path=0.001, scattering_albedo=albedo)
    _, parts = setting([deep, around], [wax, Lambertian(albedo=0.0)])
    world, camera, laser, T_world_camera, T_world_laser = parts
    # narrow, so that it all falls on the slab, and at one angle
    beam = laser.model_copy(update={"fan_angle": 0.1})
    low, high, reach = visible_fan_range(world, beam, T_world_laser)
    assert (low, high) == pytest.approx((0.0, 1.0))
    task = BdptPass.of(PlacedLaser(world, camera, beam, T_world_camera, T_world_laser), reach, 3)
    pixels, paths = camera.width * camera.height, 1 << 13
    nowhere = np.zeros(pixels, np.float32), np.zeros(0, np.int32)
    sampling = Sampling(paths, uniform_fan(low, high), *nowhere, no_guide(camera))
    found = task.trace_light_paths(7, 0, paths, sampling, empty_buffer(pixels), True)
    caught = sum(traced["throughput"][vertices["material"] == 1].sum() for _, vertices, traced in found)
    (h_laser,) = chandrasekhar_h(albedo, (abs(T_world_laser[2, 2]),))
    expected = 1.0 - math.sqrt(1.0 - albedo) * h_laser
    # the boundary, of index 1.01 at the least, sends 1 - 1 / n^2 = 2 % of the light back inside
    chance = 3.0 * math.sqrt(expected * (1.0 - expected) / paths)
    assert caught / (paths * beam.power) == pytest.approx(expected, abs=chance + 0.02 * expected)


@pytest.mark.validation
def test_an_aperture_blurs_reflected_light_and_keeps_it():
    from render.camera.camera import Lens

    camera = paper_camera(0.1)
    thin = camera.model_copy(update={"lens": Lens(model="thin-lens", f_number=1.0, focus_distance=0.5)})
    images = []
    for lensed in (camera, thin):
        _, parts = setting([turned_groove()], [Lambertian(albedo=0.8)], camera=lensed)
        images.append(
            indirect_image(*parts, target=0.012, most_paths=1 << 22, run=Run(seed=3)).radiance.astype(np.float64)
        )
    sharp, blurred = images
    assert blurred.sum() == pytest.approx(sharp.sum(), rel=5e-3)
    # along the groove the light is even; across it the disc's second moment c^2 / 16 is added
    disc = 2 * thin.aperture_radius * thin.fx * abs(1 / 0.5 - 1 / 0.86)
    spread = []
    for image in images:
        x = np.arange(image.shape[0])
        light = image.sum(axis=1)
        spread.append(light @ (x - light @ x / light.sum()) ** 2 / light.sum())
    assert spread[1] - spread[0] == pytest.approx(disc**2 / 16, rel=0.1)


@pytest.mark.parametrize("albedo", [0.5, pytest.param(0.9, marks=pytest.mark.validation)])
def test_an_integrating_sphere_is_evenly_lit_by_all_light_but_the_first(albedo):
    # the first reflection spreads evenly over a sphere; the rest is the series a^2 + a^3 + ...
    ball = primitive_mesh(Sphere(radius=1.0, segments=128))
    _, parts = setting([ball], [Lambertian(albedo=albedo)])
    radiance = indirect_image(*parts, target=0.5, most_paths=1 << 16, run=Run(seed=4)).radiance
    expected = albedo / math.pi * albedo * parts[2].power / (4.0 * math.pi) / (1.0 - albedo)
    assert radiance.mean() == pytest.approx(expected, rel=0.015)
    halves = radiance[:, : radiance.shape[1] // 2].mean(), radiance[:, radiance.shape[1] // 2 :].mean()
    assert halves == pytest.approx((expected, expected), rel=0.03)


def test_a_target_of_zero_ends_with_the_paths_that_there_may_be():
    _, parts = setting([turned_groove()], [Lambertian(albedo=0.5)])
    image = indirect_image(*parts, target=0.0, most_paths=1 << 13)
    assert image.paths >= 1 << 13 and 0.0 < image.error < np.inf


def test_an_image_of_a_hundred_pixels_is_rendered_as_any_other():
    _, placed = setting([turned_groove()], [Lambertian(albedo=0.5)], paper_camera(0.005))
    assert placed[1].width * placed[1].height < 256
    image = indirect_image(*placed, target=0.2, run=Run(seed=1))
    assert image.radiance.sum() > 0.0
    assert image.error < 0.2


class CallsLeft(Deadline):
    """Over once it has been asked so often."""

    def __init__(self, calls):
        super().__init__(1e6)
        self.calls = calls

    def share(self, parts):
        def over():
            self.calls -= 1
            return self.calls < 0

        return over


@pytest.mark.parametrize("calls", [3, 40])
def test_the_end_of_the_time_within_a_wave_leaves_the_waves_before_it(calls):
    _, parts = setting([turned_groove()], [Lambertian(albedo=0.8)])
    ended = indirect_image(*parts, target=0.0, most_paths=1 << 19, run=Run(threads=1, deadline=CallsLeft(calls)))
    whole = indirect_image(*parts, target=0.0, most_paths=ended.paths, run=Run(threads=1))
    assert 0 < ended.paths < 1 << 19 and np.array_equal(ended.radiance, whole.radiance)
