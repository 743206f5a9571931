import math

import numpy as np
import pytest

from render.camera.camera import Lens
from render.laser.irradiance import irradiance_at
from render.laser.laser import Divergence
from render.laser.sheet_integral import about_over_aperture, mean_over, mean_over_aperture
from render.laser_direct import integrator
from render.laser_direct.integrator import direct_image
from render.laser_direct.rasterise import rasterise_sheet
from render.material.material import Conductor
from render.mesh.primitives import primitive_mesh
from render.run import Run
from render.scene.shape import Box, Sphere
from render.truth.laser_curve import laser_curve
from tests.render.camera.test_lens import DISTORTIONS, thin_camera
from tests.render.scenes import (
    centroids,
    in_laser_frame,
    moved,
    paper_camera,
    paper_laser,
    plane_mesh,
    scene_of,
    world_of,
)

SLANTED = (0.6, 0.0, 0.8)


def setting(meshes, camera, laser=None):
    scene = scene_of(camera, laser or paper_laser(), objects=len(meshes))
    world = world_of(scene, *meshes)
    return scene, (world, scene.camera, scene.lasers[0], scene.T_world_camera(), scene.T_world_laser(0))


def disc_px(camera, depth):
    """c = f^2 / N |1 / s - 1 / Z| s / (s - f), over the pixel pitch."""
    f, s = camera.focal_length, camera.lens.focus_distance
    return f**2 / camera.lens.f_number * abs(1 / s - 1 / depth) * s / (s - f) / camera.pixel_pitch


@pytest.mark.parametrize("reach", [0.01, 0.3, 2.0, 9.0, 60.0])
@pytest.mark.parametrize("half", [0.05, 0.6, 3.0])
def test_the_mean_over_a_disc_is_that_of_its_points(reach, half):
    t = np.sin(np.pi * ((np.arange(20000) + 0.5) / 20000 - 0.5))
    weight = (1 - t**2) / np.sum(1 - t**2)
    peak = 0.0
    for q in np.linspace(0.0, reach + half + 3.0, 9):
        expected = sum(w * mean_over(q + reach * x, half, 0.0) for x, w in zip(t[::20], weight[::20], strict=True)) * 20
        peak = max(peak, expected)
        assert mean_over_aperture(q, half, 0.0, reach) == pytest.approx(expected, abs=3e-4 * peak)
    # the cheap one has the same light
    total = sum(about_over_aperture(q, half, 0.0, reach) for q in np.arange(-300.0, 300.0, 0.05)) * 0.05
    assert total == pytest.approx(1.0, abs=2e-3)


@pytest.mark.parametrize("focus", [0.6, 0.87, 1.3])
def test_the_blurred_line_has_the_light_the_centre_and_the_width_that_the_disc_says(focus):
    # a line that is not much narrower than a pixel, so that its pixels tell its centre
    camera, laser = thin_camera(focus=focus, scale=0.25), paper_laser(4e-3)
    wall = [plane_mesh((0, 0, 1), 0.87)]
    _, parts = setting(wall, camera, laser)
    _, sharp = setting(wall, paper_camera(0.25), laser)
    thin, pin = (direct_image(*p, target=1e-3).radiance.astype(np.float64) for p in (parts, sharp))
    inner = slice(50, -50)
    assert thin[inner].sum() == pytest.approx(pin[inner].sum(), rel=1e-5)
    moved_by = centroids(thin)[inner] - centroids(pin)[inner]
    assert abs(np.mean(moved_by)) < 1e-4 and np.std(moved_by) < 2e-3
    # a disc of diameter c has the second moment c^2 / 16 across any line
    u = np.arange(thin.shape[1])

    def variance(image):
        light = image[inner].sum(axis=0)
        middle = (light @ u) / light.sum()
        return light @ (u - middle) ** 2 / light.sum()

    added = variance(thin) - variance(pin)
    assert added == pytest.approx(disc_px(camera, 0.87) ** 2 / 16, rel=2e-3, abs=1e-4)


def test_the_papers_camera_has_its_blur_disc_of_four_and_a_half_pixels():
    # 12 mm at f/1.4, focused at 1 m: at 0.87 m the disc is 4.5 px, and a thin sheet is a semicircle across the line
    camera = paper_camera().model_copy(update={"lens": Lens(model="thin-lens", f_number=1.4, focus_distance=1.0)})
    assert disc_px(camera, 0.87) == pytest.approx(4.4, abs=0.1)
    laser = paper_laser(sheet=Divergence(full_angle=1e-5), T_rig_laser=paper_laser().T_rig_laser)
    _, parts = setting([plane_mesh((0, 0, 1), 0.87)], camera.scaled(0.5), laser)
    image = direct_image(*parts, target=1e-3).radiance.astype(np.float64)
    curve = laser_curve(*parts)
    radius, row = disc_px(parts[1], 0.87) / 2, 500
    centre = curve.position[np.flatnonzero(curve.index == row)[0]]
    edges = np.clip((np.arange(image.shape[1] + 1) - 0.5 - centre) / radius, -1, 1)
    area = (edges * np.sqrt(1 - edges**2) + np.arcsin(edges)) / math.pi
    assert image[row] / image[row].sum() == pytest.approx(np.diff(area), abs=3e-3)


@pytest.mark.parametrize("focus", [0.7, 1.1])
def test_a_slanted_plane_out_of_focus_shifts_the_line_as_the_cosine_over_the_aperture_says(focus):
    # the disc is symmetric, but the lens points nearer to the plane's normal get more light: the patch's cosine is
    # linear, 1 + k a, and moves the centre by fx (1/s - 1/Z) k R^2 / 4
    camera, wall, laser = thin_camera(focus=focus, scale=0.5), [plane_mesh(SLANTED, 0.7)], paper_laser(2.5e-3)
    _, parts = setting(wall, camera, laser)
    _, sharp = setting(wall, paper_camera(0.5), laser)
    thin, pin = (direct_image(*p, target=2e-4).radiance for p in (parts, sharp))
    curve = laser_curve(*parts)
    depth = curve.depth_z[np.abs(curve.index - 511) < 400].mean()
    found = (centroids(thin) - centroids(pin))[112:911]
    k = -SLANTED[0] / 0.7
    expected = camera.fx * (1 / focus - 1 / depth) * k * camera.aperture_radius**2 / 4
    assert abs(expected) > 5e-4
    assert np.mean(found) == pytest.approx(expected, rel=0.04)


def test_every_pixel_is_the_mean_over_its_area_and_the_aperture():
    # a fine sum in NumPy, rays from lens points to where the chief ray meets the plane of focus; distorted and tilted
    camera = thin_camera(DISTORTIONS["all"], focus=0.7, scale=0.25)
    laser, n = paper_laser(2e-3), np.array([0.3, 0.5, 0.8]) / np.linalg.norm((0.3, 0.5, 0.8))
    _, parts = setting([plane_mesh((0.3, 0.5, 0.8), 0.7)], camera, laser)
    image = direct_image(*parts, target=3e-4).radiance
    rng, count, row = np.random.default_rng(0), 200_000, 260
    bright = np.flatnonzero(image[row] > 0.05 * image[row].max())
    focus, normal = camera.focus_plane, laser.T_rig_laser.matrix[:3, :3].T @ n
    for column in bright[:: max(1, len(bright) // 6)]:
        rays, _ = camera.rays(rng.random((count, 2)) + np.array([column - 0.5, row - 0.5]))
        met = rays * (-focus[3] / (rays @ focus[:3]))[:, None]
        radius, angle = camera.aperture_radius * np.sqrt(rng.random(count)), 2 * np.pi * rng.random(count)
        start = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(count)])
        way = met - start
        points = start + way * ((0.7 - start @ n) / (way @ n))[:, None]
        values = (
            irradiance_at(in_laser_frame(points, laser), np.tile(normal, (count, 1)), laser.packed()) * 0.5 / math.pi
        )
        error = values.std() / math.sqrt(count) + 2e-4 * image[row].max()
        assert abs(image[row, column] - values.mean()) < 4 * error


def test_the_error_estimate_is_honest_where_shadows_cut_a_blurred_line():
    comb = [
        moved(primitive_mesh(Box(size_x=0.3, size_y=0.006, size_z=0.006)), (0.0, y, 0.8), (0.1, 0.2, 0.3))
        for y in np.linspace(-0.15, 0.15, 12)
    ]
    _, parts = setting([plane_mesh((0.2, 0, 1), 0.9), *comb], thin_camera(focus=0.7, scale=0.15))
    reference = np.mean(
        [direct_image(*parts, target=1e-3, run=Run(seed=s)).radiance for s in range(3)], axis=0, dtype=float
    )
    for target in (0.1, 0.05):
        result = direct_image(*parts, target=target, run=Run(seed=9))
        lit = reference > 0
        error = math.sqrt(np.mean((result.radiance - reference)[lit] ** 2) / np.mean(reference[lit] ** 2))
        # some hundred pixels on shadows' edges make the error: its estimate has a spread of its own
        assert result.error <= target and error <= min(target, 1.15 * result.error)
        assert result.radiance.sum(dtype=float) == pytest.approx(reference.sum(), rel=5e-3)


def test_threads_do_not_change_a_bit_and_the_blur_is_all_within_reach(monkeypatch):
    camera = thin_camera(DISTORTIONS["tilted"], focus=0.6, scale=0.15)
    sphere = moved(primitive_mesh(Sphere(radius=0.1, segments=400)), (0.0, 0.0, 0.95), (0.4, 0.3, 0.2))
    _, parts = setting([sphere], camera)
    image = direct_image(*parts, run=Run(threads=1, seed=3)).radiance
    assert np.array_equal(direct_image(*parts, run=Run(threads=5, seed=3)).radiance, image)
    reach = rasterise_sheet(*parts)
    monkeypatch.setattr(integrator, "rasterise_sheet", lambda *a: np.arange(image.size, dtype=np.int32))
    everywhere = direct_image(*parts, run=Run(seed=3)).radiance
    # beyond it are a few silhouettes, whose facets are prolonged through the sheet
    beyond = np.delete(everywhere.ravel(), reach)
    assert beyond.sum() < 1e-4 * everywhere.sum() and np.count_nonzero(everywhere) > 500
    assert len(reach) < 0.05 * image.size


def test_a_closed_aperture_is_a_pinhole_on_metal_too():
    wall = [plane_mesh((0.2, 0.1, 1), 0.87)]
    images = []
    for lens in (Lens(), Lens(model="thin-lens", f_number=256.0, focus_distance=0.87)):
        scene, parts = setting(wall, paper_camera(0.1).model_copy(update={"lens": lens}))
        item = scene.objects[0].model_copy(update={"material": Conductor(roughness=0.4)})
        world = world_of(scene.model_copy(update={"objects": (item,)}), *wall)
        images.append(direct_image(world, *parts[1:], target=1e-3).radiance)
    assert images[0].max() > 0
    assert np.abs(images[1] - images[0]).max() < 2e-3 * images[0].max()
