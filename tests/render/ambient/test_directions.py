"""Guided directions: drawn as their pdf says, right in the mean, and lines scatter less by what is learned."""

import numpy as np
import pytest
from scipy.stats import chi2

from render.ambient.directions import CELL_ANGLE, CELLS, Draws, Guide, cell_of, cells_of, guided_direction, guided_pdf
from render.ambient.line_directions import SHARE, GuidedPixels, learned_guide
from render.ambient.path_kernels import Film
from render.ambient.path_tracer import camera_paths
from render.base.pose import Pose
from render.material.material import Coated, Conductor, Lambertian
from render.mesh.primitives import primitive_mesh
from render.run import Run
from render.scene.lights import RectangleLight
from render.scene.shape import Box
from tests.render.ambient.test_path_kernels import SKY, patch, scene_with
from tests.render.scenes import moved, paper_camera, plane_mesh


def guide_of(seed, rows=1):
    """Some cells are a thousand times as likely as others."""
    share = np.random.default_rng(seed).random((rows, CELLS)) ** 8 + 1e-3
    cumulative = np.cumsum(share, axis=1)
    return np.concatenate([np.zeros((rows, 1)), cumulative / cumulative[:, -1:]], axis=1)


def test_directions_are_drawn_as_their_pdf_says():
    cumulative, numbers = guide_of(1), np.random.default_rng(2).random((200_000, 2))
    drawn = np.array([guided_direction(cumulative, 0, *pair) for pair in numbers])
    assert np.allclose(np.linalg.norm(drawn, axis=1), 1.0)
    assert cells_of(drawn).tolist() == [cell_of(tuple(one)) for one in drawn]
    found = np.bincount(cells_of(drawn), minlength=CELLS)
    expected = np.diff(cumulative[0]) * len(drawn)
    many = expected > 10.0
    statistic = np.sum((found[many] - expected[many]) ** 2 / expected[many])
    assert statistic < chi2.ppf(0.9999, many.sum() - 1)
    pdf = guided_pdf(cumulative, 0, tuple(drawn[0]))
    assert pdf * CELL_ANGLE == pytest.approx(np.diff(cumulative[0])[cell_of(tuple(drawn[0]))])


def lamp_at(place, size, radiance):
    return RectangleLight(radiance=radiance, width=size, height=size, T_world_light=Pose(translation=place))


def corner(material):
    """A plane and a box in front of it, of one material, under a lamp and a sky."""
    lamp = RectangleLight(
        radiance=(3.0, 2.0, 1.0), width=0.4, height=0.4, T_world_light=Pose(translation=(0.0, 0.3, -0.2))
    )
    box = moved(primitive_mesh(Box(size_x=0.2, size_y=0.2, size_z=0.2)), (0.1, 0.0, 0.55))
    parts = {"lights": (lamp,), "environment": SKY}
    return scene_with(paper_camera(0.01), (plane_mesh((0.0, 0.0, 1.0), 0.7), material), (box, material), **parts)


def paths_of(scene, world, seed):
    return camera_paths(world, scene, scene.camera.view(scene.T_world_camera()), surfaces=3, seed=seed)


def light_of(paths, pixels, draws, samples):
    """(n, 3) mean over so many samples of both halves of each pixel."""
    film, first = Film(np.zeros((2 * len(pixels), 4)), np.zeros(2)), np.zeros((len(pixels), 2), np.int32)
    paths.add(pixels, first, first + samples, film, None, draws)
    assert film.counts[0] == 0
    return film.sums[:, :3].reshape(-1, 2, 3).sum(axis=1) / (2 * samples)


@pytest.mark.parametrize(
    "material",
    [Lambertian(albedo=(0.7, 0.5, 0.3)), Conductor(metal="steel", roughness=0.3), Coated(albedo=(0.5, 0.4, 0.3))],
    ids=["lambertian", "rough steel", "coated"],
)
def test_no_image_is_wrong_by_a_guide_whatever_it_has_learned(material):
    scene, world = corner(material)
    pixels = np.arange(scene.camera.width * scene.camera.height, dtype=np.int32)
    row = np.random.default_rng(5).integers(-1, 3, len(pixels)).astype(np.int32)
    guide, samples = Guide(guide_of(4, 3), row, 0.6), 16
    means = []
    for draws in (Draws(pixels), Draws(pixels, guide)):
        found = []
        for seed in range(12):
            light = light_of(paths_of(scene, world, seed + 100 * len(means)), pixels, draws, samples)
            # guided pixels, and those beside them that are not
            found.append(np.concatenate([light[row >= 0].mean(axis=0), light[row < 0].mean(axis=0)]))
        means.append(np.array(found))
    spread = np.sqrt(sum(one.var(axis=0, ddof=1) / len(one) for one in means))
    z = (means[0].mean(axis=0) - means[1].mean(axis=0)) / spread
    # Student's t of about 20 degrees of freedom, six of them
    assert np.all(np.abs(z) < 4.5), z


def test_what_is_learned_of_a_bright_patch_makes_its_lines_scatter_less():
    """A wall that a small bright patch beside it lights, by way of which all onward light comes."""
    lamp = RectangleLight(
        radiance=(80.0, 80.0, 80.0), width=0.05, height=0.05, T_world_light=Pose(translation=(0.4, 0.0, 0.3))
    )
    scene, world = scene_with(
        paper_camera(0.02),
        (plane_mesh((0.0, 0.0, 1.0), 0.7), Lambertian(albedo=(0.5, 0.5, 0.5))),
        (patch((0.4, 0.0, 0.5), 0.05), Lambertian(albedo=(0.9, 0.9, 0.9))),
        lights=(lamp,),
    )
    width, lines = scene.camera.width, 8
    rows = np.arange(lines) + scene.camera.height // 2
    pixels = (rows[:, None] * width + width // 2 + np.arange(4)).ravel().astype(np.int32)
    line = np.repeat(np.arange(lines), 4)
    keys = (10**6 + line).astype(np.int32)
    some = GuidedPixels(pixels, keys, line, np.zeros(lines, np.int32), (np.ones(len(pixels)),), 4 * np.arange(lines))
    cumulative, worth = learned_guide(paths_of(scene, world, 3), some, [100, 200], Run())
    assert cumulative.shape == (1, CELLS + 1) and worth.all()
    guide = Guide(cumulative, np.zeros(len(pixels), np.int32), SHARE)
    spread = []
    for draws in (Draws(pixels), Draws(pixels, guide)):
        found = []
        for seed in range(24):
            found.append(light_of(paths_of(scene, world, seed), pixels, draws, 32).sum())
        spread.append((np.mean(found), np.std(found, ddof=1)))
    (plain, by_chance), (guided, led) = spread
    assert abs(plain - guided) < 4.5 * np.hypot(by_chance, led) / np.sqrt(24.0)
    # variances of 24 are known to 30 %
    assert led**2 < 0.5 * by_chance**2
