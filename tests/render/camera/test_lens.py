import math

import numba
import numpy as np
import pytest

from render.base.pose import Pose
from render.camera.camera import Lens
from render.camera.distortion import tilt_matrix
from render.camera.lens import chief_ray, lens_direction, lens_point, lens_position, lens_project
from render.camera.rays import LensRays, camera_rays, lens_rays
from render.sampling.low_discrepancy import pair, pair_table
from tests.render.scenes import paper_camera

DISTORTIONS = {
    "none": (),
    "barrel": (-0.2, 0.1, 1e-3, 2e-3, 0.03),
    "tilted": (0.0,) * 12 + (math.radians(4.0), math.radians(-7.0)),
    "all": (0.1, -0.2, 1e-3, 2e-3, 0.03, 0.1, 0.01, 2e-3, 1e-3, -2e-3, 3e-3, 1e-3, 0.02, -0.03),
}
POSE = Pose(translation=(0.3, -0.2, 0.5), rotation=(0.4, -0.3, 0.8)).matrix


def thin_camera(distortion=(), f_number=1.4, focus=0.8, scale=0.1):
    lens = Lens(model="thin-lens", f_number=f_number, focus_distance=focus)
    return paper_camera(scale, distortion).model_copy(update={"lens": lens})


@numba.njit
def there_and_back(view, tilt, distorted, pixels, lens, depth, out):
    """Pixel and lens point -> ray -> point at `depth` along it -> pixel."""
    for i in range(len(pixels)):
        x, y, _ = chief_ray(view, tilt, distorted, pixels[i, 0], pixels[i, 1])
        d0, d1, d2 = lens_direction(view, x, y, lens[i, 0], lens[i, 1])
        o0, o1, o2 = lens_position(view, lens[i, 0], lens[i, 1])
        s = depth[i]
        u, v, area = lens_project(view, tilt, distorted, o0 + s * d0, o1 + s * d1, o2 + s * d2, lens[i, 0], lens[i, 1])
        out[i, 0], out[i, 1], out[i, 2] = u, v, area


@numba.njit
def images(view, tilt, distorted, points, a, b):
    out = np.empty((len(points), 3))
    for i in range(len(points)):
        u, v, area = lens_project(view, tilt, distorted, points[i, 0], points[i, 1], points[i, 2], a, b)
        out[i, 0], out[i, 1], out[i, 2] = u, v, area
    return out


def aperture_points(seed, count, radius):
    table = pair_table()
    return np.array([lens_point(radius, *pair(table, seed, 7, i, 3)) for i in range(count)])


def kernel_view(camera, pose=POSE):
    return camera.view(pose), tilt_matrix(*camera.coefficients[12:]), camera.has_distortion


@pytest.mark.parametrize("name", DISTORTIONS)
@pytest.mark.parametrize("focus", [0.8, None])
def test_a_ray_through_the_lens_comes_back_to_its_pixel(name, focus):
    camera = thin_camera(DISTORTIONS[name], focus=focus)
    view, tilt, distorted = kernel_view(camera)
    rng = np.random.default_rng(1)
    pixels = rng.uniform((-0.5, -0.5), (camera.width - 0.5, camera.height - 0.5), (4000, 2))
    lens = aperture_points(1, 4000, camera.aperture_radius)
    out = np.empty((4000, 3))
    there_and_back(view, tilt, distorted, pixels, lens, rng.uniform(0.3, 2.0, 4000), out)
    assert np.abs(out[:, :2] - pixels).max() < 1e-9
    assert (out[:, 2] > 0.0).all()


def test_the_ray_through_the_centre_is_that_of_the_pinhole():
    camera = thin_camera(DISTORTIONS["all"])
    points = np.random.default_rng(2).uniform((-0.3, -0.25, 0.7), (0.3, 0.25, 1.2), (500, 3))
    expected, valid = camera.project(points)
    world = points @ POSE[:3, :3].T + POSE[:3, 3]
    found = images(*kernel_view(camera), world, 0.0, 0.0)
    assert valid.all()
    assert np.abs(found[:, :2] - expected).max() < 1e-9


@pytest.mark.parametrize("name", DISTORTIONS)
def test_the_image_area_is_that_of_the_moved_image_of_a_small_patch(name):
    camera = thin_camera(DISTORTIONS[name])
    kernel = kernel_view(camera, np.eye(4))
    rng = np.random.default_rng(3)
    for _ in range(50):
        a, b = rng.uniform(-0.6, 0.6, 2) * camera.aperture_radius
        point = rng.uniform((-0.2, -0.2, 0.5), (0.2, 0.2, 1.5))
        # a patch that faces the lens point
        towards = np.array([a, b, 0.0]) - point
        x = np.cross(towards, rng.normal(size=3))
        x /= np.linalg.norm(x)
        y = np.cross(towards, x) / np.linalg.norm(towards)
        h = 1e-5
        found = images(*kernel, np.stack([point, point + h * x, point - h * x, point + h * y, point - h * y]), a, b)
        along, across = found[1, :2] - found[2, :2], found[3, :2] - found[4, :2]
        area = abs(along[0] * across[1] - along[1] * across[0]) / (2 * h) ** 2
        assert found[0, 2] == pytest.approx(area, rel=1e-6)


@pytest.mark.parametrize("name", DISTORTIONS)
def test_the_image_of_a_wall_covers_the_sensor_once_through_every_lens_point(name):
    # summed over a wall, area x cosine is the number of pixels it fills: the image's own, by the wall's random points
    camera = thin_camera(DISTORTIONS[name], f_number=0.7, focus=0.5)
    kernel = kernel_view(camera, np.eye(4))
    n, depth, half = 400_000, 0.9, 0.45
    points = np.column_stack([(np.random.default_rng(4).random((n, 2)) - 0.5) * 2 * half, np.full(n, depth)])
    for a, b in aperture_points(5, 4, camera.aperture_radius):
        found = images(*kernel, points, a, b)
        inside = (np.abs(found[:, 0] - camera.cx) < camera.width / 2) & (
            np.abs(found[:, 1] - camera.cy) < camera.height / 2
        )
        cosine = depth / np.linalg.norm(points - (a, b, 0.0), axis=1)
        worth = np.where(inside, found[:, 2] * cosine, 0.0) * (2 * half) ** 2
        assert not inside[np.abs(points[:, :2]).max(axis=1) > 0.98 * half].any()
        error = worth.std() / math.sqrt(n)
        assert abs(worth.mean() - camera.width * camera.height) < 4 * error


def test_all_rays_of_a_pixel_meet_on_the_plane_of_focus_and_nowhere_else():
    camera = thin_camera(DISTORTIONS["tilted"])
    view, tilt, distorted = kernel_view(camera, np.eye(4))
    plane = camera.focus_plane
    for pixel in ((3.0, 7.0), (120.0, 99.0), (240.0, 200.0)):
        x, y, _ = chief_ray(view, tilt, distorted, *pixel)
        chief = np.array([x, y, 1.0])
        met = chief * (-plane[3] / (plane[:3] @ chief))
        for a, b in aperture_points(6, 16, camera.aperture_radius):
            direction = np.array(lens_direction(view, x, y, a, b))
            assert (a, b, 0.0) + met[2] * direction == pytest.approx(met, abs=1e-12)


def test_plane_of_focus_sensor_and_lens_meet_in_one_line():
    # the sensor's plane, behind the lens, from OpenCV's rotation alone
    camera = thin_camera(DISTORTIONS["tilted"])
    tau_x, tau_y = camera.coefficients[12:]
    cx, sx, cy, sy = math.cos(tau_x), math.sin(tau_x), math.cos(tau_y), math.sin(tau_y)
    rotation = np.array([[cy, 0, -sy], [0, 1, 0], [sy, 0, cy]]) @ np.array([[1, 0, 0], [0, cx, sx], [0, -sx, cx]])
    normal, distance = rotation[2], camera.fx * camera.pixel_pitch
    focus = camera.focus_plane
    # two points of sensor's and lens's planes: n . p = -n_z v, z = 0
    foot = -normal[:2] * normal[2] * distance / (normal[:2] @ normal[:2])
    for t in (-1.0, 2.0):
        point = np.array([foot[0] - t * normal[1], foot[1] + t * normal[0], 0.0])
        assert normal @ point == pytest.approx(-normal[2] * distance)
        assert focus[:3] @ point + focus[3] == pytest.approx(0.0, abs=1e-12)
    # and a point of the plane of focus has its image on the sensor, by the lens equation along its chief ray
    f = camera.focal_length
    for x, y in ((0.1, -0.05), (-0.2, 0.15)):
        z = -focus[3] / (focus[:3] @ (x, y, 1.0))
        behind = 1.0 / (1.0 / f - 1.0 / z)
        assert normal @ (-behind * np.array([x, y, 1.0])) == pytest.approx(-normal[2] * distance)


def test_lens_points_fill_the_aperture_evenly():
    points = aperture_points(8, 4096, 2.0)
    radius, angle = np.hypot(*points.T), np.arctan2(points[:, 1], points[:, 0])
    assert radius.max() <= 2.0
    # second moment of a disc, R^2 / 4 along each axis
    assert (points**2).mean(axis=0) == pytest.approx([1.0, 1.0], rel=2e-3)
    assert points.mean(axis=0) == pytest.approx([0.0, 0.0], abs=2e-3)
    counts = np.histogram2d((radius / 2) ** 2, angle, bins=8)[0]
    # far more even than chance, which would give 8
    assert counts.std() < 4.0


def test_cells_of_a_pixel_share_the_aperture_evenly_also_by_quarters():
    camera = thin_camera(f_number=1.0)
    pixels, cells = np.array([30000], np.int32), 16
    n = cells**2
    slopes, offsets, lens = np.empty((n, 2)), np.empty((n, 2), np.float32), np.empty((n, 2))
    origins, directions = np.empty((n, 3), np.float32), np.empty((n, 3), np.float32)
    by_seed = []
    for seed in range(20):
        look = (np.zeros(3), slopes, offsets, lens, origins, directions)
        lens_rays(camera.view(POSE), pair_table(), pixels, cells, seed, look[0], LensRays(*look[1:]))
        points = (lens / camera.aperture_radius).reshape(cells, cells, 2)
        quarters = [points[i : i + 8, j : j + 8].reshape(-1, 2).mean(axis=0) for i in (0, 8) for j in (0, 8)]
        by_seed.append(np.array(quarters))
    # 64 independent points of a disc have a mean of standard deviation 1 / 2 / 8 along each axis
    assert np.std(by_seed) < 0.3 / 16
    assert not np.array_equal(by_seed[0], by_seed[1])


def test_lens_rays_without_an_aperture_are_the_pinholes():
    camera = paper_camera(0.1, DISTORTIONS["all"])
    pixels, n = np.arange(0, 2000, dtype=np.int32), 2000 * 4
    centre = np.array([0.1, 0.2, 0.3])
    slopes, offsets, directions = np.empty((n, 2)), np.empty((n, 2), np.float32), np.empty((n, 3), np.float32)
    camera_rays(camera.view(POSE), pixels, 2, 9, True, slopes, offsets, directions)
    found = [np.empty((n, 2)), np.empty((n, 2), np.float32), np.empty((n, 2))]
    origins, towards = np.empty((n, 3), np.float32), np.empty((n, 3), np.float32)
    lens_rays(camera.view(POSE), pair_table(), pixels, 2, 9, centre, LensRays(*found, origins, towards))
    assert np.array_equal(found[0], slopes) and np.array_equal(found[1], offsets)
    assert np.abs(towards - directions).max() < 1e-6 and not found[2].any()
    assert np.allclose(origins, POSE[:3, 3] - centre, atol=1e-6)
