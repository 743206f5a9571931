"""Ambient light for what is measured: scan lines meet their goal without bias, the rest is as good as is told."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.ndimage import maximum_filter

from render.ambient.coarse_image import COARSE_ERROR, CoarseImage, coarse_image
from render.ambient.directions import Draws
from render.ambient.guided_image import places_of
from render.ambient.guided_interpolation import SEEN, grid_of, interpolate, smooth_grid
from render.ambient.integrator import ambient_images
from render.ambient.light_group import AmbientLight
from render.ambient.line_samples import band_of, sample_band
from render.ambient.measured_light import measured_images
from render.ambient.path_tracer import camera_paths
from render.ambient.pixel_samples import PixelSamples
from render.ambient.transport_plan import LAMPS, AmbientPlan
from render.base.pose import Pose
from render.frame import Frame
from render.importance import Importance
from render.material.material import Lambertian
from render.mesh.primitives import primitive_mesh
from render.plan import GroupQuality
from render.run import Memory, Run
from render.scene.lights import Environment
from render.scene.settings import RenderSettings
from render.scene.shape import Box
from render.truth.pixel_truth import truth_images
from render.world.placed import PlacedScene
from tests.render.ambient.test_ambient_error import SKY, box_on_a_wall
from tests.render.ambient.test_path_kernels import scene_with
from tests.render.scenes import moved, paper_camera, paper_laser

DARK = Frame(0, (), None, (), None)
SEEDS = 30
REFERENCE_SAMPLES = 256
"""Of each half."""


def band_weights(height, width, size):
    """Weights like those of a line's flanks, about a curve that crosses the box and its shadow."""
    line = 0.5 * width + 0.1 * width * np.sin(6.0 * np.arange(height) / height)
    across = np.arange(width) - line[:, None]
    weight = np.abs(across) * np.exp(-(across**2) / 18.0)
    return (size * np.where(np.abs(across) < 9.0, weight, 0.0)).astype(np.float32)


def paths_of(placed, seed=0):
    return camera_paths(placed.world, placed.scene, placed.camera.view(placed.T_world_camera), seed=seed)


@cache
def many_bands():
    """A band, (SEEDS, m, 3) its pixels as they were rendered, their (m, 2, 3) reference, and the samples of each."""
    scene, world = box_on_a_wall()
    placed = PlacedScene(world, scene)
    width, height = scene.camera.width, scene.camera.height
    even = CoarseImage(np.ones((height, width, 3), np.float32), 1.0, np.ones((99, 99), np.float32), 8, 1, 0, 0, 0.0)
    band = band_of(Importance((), band_weights(height, width, 20.0)), even)
    images, samples = [], []
    for seed in range(SEEDS):
        film = PixelSamples(band.pixels)
        sample_band(film, paths_of(placed, seed), band, 10**9, Run())
        images.append(film.means(band.pixels).mean(axis=1))
        samples.append(film.done.sum(axis=1))
    film = PixelSamples(band.pixels)
    film.add(paths_of(placed, 99), band.pixels, np.full((len(band.pixels), 2), REFERENCE_SAMPLES, np.int32), Run())
    return band, np.array(images, np.float64), film.means(band.pixels).astype(np.float64), np.array(samples)


def test_scan_lines_meet_their_goal_and_are_not_known_much_better():
    band, images, reference, samples = many_bands()
    weighted = band.weight[:, None] ** 2 * np.mean((images - reference.mean(axis=1)) ** 2, axis=0)
    moments = np.array([np.bincount(band.line, weighted[:, colour]) for colour in range(3)]).max(axis=0)
    known = np.sqrt(moments)
    assert np.mean(known <= 1.0) >= 0.95
    # where more than the first samples were needed at all
    heavy = (band.weight > 0).astype(float)
    more = np.bincount(band.line, samples.mean(axis=0) * heavy) > 6.0 * np.bincount(band.line, heavy)
    assert more.sum() > 20 and np.median(known[more]) > 0.6


def test_the_band_is_unbiased():
    band, images, reference, _ = many_bands()
    lines = np.array([np.bincount(band.line, image.mean(axis=1)) for image in images])
    halves = np.array([np.bincount(band.line, half.mean(axis=1)) for half in np.swapaxes(reference, 0, 1)])
    spread = lines.var(axis=0, ddof=1) / SEEDS + np.mean((halves[0] - halves[1]) ** 2) / 4.0
    z = (lines.mean(axis=0) - halves.mean(axis=0)) / np.sqrt(spread)
    # the squares of independent normal numbers, if each line had its own variance known to a quarter
    assert np.mean(z**2) == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / len(z)) + 0.07)
    assert abs(z.sum()) < 4.0 * np.sqrt(len(z))


def signed(weight):
    """Weights like those of a line's place: what is left of it pulls to the left."""
    lit = weight > 0.0
    middle = np.sum(np.where(lit, np.arange(weight.shape[1]), 0.0), axis=1) / lit.sum(axis=1)
    found = weight * np.sign(np.arange(weight.shape[1]) - middle[:, None])
    # no line is moved by light that is the same on both sides
    right = np.where(found > 0.0, found, 0.0).sum(axis=1) / np.where(found < 0.0, -found, 0.0).sum(axis=1)
    return np.where(found < 0.0, found * right[:, None], found).astype(np.float32)


@cache
def moved_lines(shared=True, scale=0.05, seeds=SEEDS):
    """(SEEDS, lines) how far a band's light moves lines, in allowed deviations, what that is by a reference, and what
    is told of it; and the mean number of samples."""
    scene, world = box_on_a_wall(scale)
    placed = PlacedScene(world, scene)
    width, height = scene.camera.width, scene.camera.height
    even = CoarseImage(np.ones((height, width, 3), np.float32), 1.0, np.ones((99, 99), np.float32), 8, 1, 0, 0, 0.0)
    weight = signed(band_weights(height, width, 60.0))
    band = band_of(Importance((), np.zeros_like(weight), ambient_moves=(weight,)), even)
    if not shared:
        band = replace(band, keys=band.pixels)

    def moves(pixels):
        return np.array([np.bincount(band.line, band.moves[0] * pixels[:, colour]) for colour in range(3)])

    found, told, samples = [], [], []
    for seed in range(seeds):
        film = PixelSamples(band.pixels)
        told.append(sample_band(film, paths_of(placed, seed), band, 10**9, Run()))
        found.append(moves(film.means(band.pixels).mean(axis=1)))
        samples.append(film.total)
    film = PixelSamples(band.pixels)
    film.add(paths_of(placed, 99), band.pixels, np.full((len(band.pixels), 2), 64, np.int32), Run(), Draws(band.keys))
    halves = [moves(half) for half in np.swapaxes(film.means(band.pixels).astype(np.float64), 0, 1)]
    return np.array(found), np.array(halves), np.array(told), np.mean(samples)


@pytest.mark.validation
def test_lines_are_moved_by_no_more_than_is_allowed_and_told():
    found, _, told, _ = moved_lines(seeds=2 * SEEDS)
    # in the colour that is known worst
    deviation = found.std(axis=0, ddof=1).max(axis=0)
    assert np.mean(deviation <= 1.0) >= 0.95
    # of 60 seeds a deviation is known to 9 %, the largest of three colours, and the quantile of some 150 lines
    assert np.quantile(deviation, 0.95) == pytest.approx(np.mean(np.quantile(told, 0.95, axis=1)), rel=0.3)
    assert np.sqrt(np.mean(deviation**2)) == pytest.approx(np.sqrt(np.mean(told**2)), rel=0.15)


@pytest.mark.validation
def test_lines_whose_pixels_share_random_numbers_are_where_they_should_be():
    found, halves, _, _ = moved_lines()
    of_mean = found.var(axis=0, ddof=1) / SEEDS + np.mean((halves[0] - halves[1]) ** 2, axis=-1)[:, None] / 4.0
    z = (found.mean(axis=0) - halves.mean(axis=0)) / np.sqrt(of_mean)
    # the three colours of a line are no independent numbers
    assert np.mean(z**2) == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / z.shape[1]) + 0.07)
    assert np.all(np.abs(z.sum(axis=1)) < 4.0 * np.sqrt(z.shape[1]))


def test_shared_random_numbers_spare_most_of_the_samples():
    """Where pixels are small beside shadows and edges, as in any frame that is measured."""
    shared, own = (moved_lines(shared, 0.2, 3) for shared in (True, False))
    assert shared[3] < 0.6 * own[3]
    # after the pilot's four samples a pixel
    known = np.sqrt(np.mean(shared[2] ** 2, axis=0))
    assert np.median(known) < 0.5


def test_samples_go_where_weight_and_variance_are():
    band, _, _, samples = many_bands()
    mean = samples.mean(axis=0)
    assert np.all(samples[:, band.weight == 0.0] == 4)
    heavy = band.weight > 0.5 * band.weight.max()
    assert mean[heavy].mean() > 2.0 * mean[~heavy].mean()


def test_lines_that_no_samples_would_get_there_have_no_more_than_the_others():
    """Fewer than the lines that may miss the goal, a hundred times as sensitive as the others."""
    scene, world = box_on_a_wall()
    placed, shape = PlacedScene(world, scene), (scene.camera.height, scene.camera.width)
    even = CoarseImage(np.ones((*shape, 3), np.float32), 1.0, np.ones((99, 99), np.float32), 8, 1, 0, 0, 0.0)
    far = np.arange(shape[0]) % 40 == 20
    weight = np.where(far[:, None], np.float32(100.0), np.float32(1.0)) * band_weights(*shape, 20.0)
    band = band_of(Importance((), weight), even)
    film = PixelSamples(band.pixels)
    deviations = sample_band(film, paths_of(placed), band, 10**9, Run())
    each = np.bincount(band.line, film.done.sum(axis=1), shape[0])
    assert np.mean(deviations <= 1.0) >= 0.95 and np.all(deviations[far] > 1.0)
    assert each[far].mean() <= 1.2 * each[~far].mean()


def test_the_error_told_of_the_coarse_image_is_the_true_one():
    scene, world = box_on_a_wall()
    placed = PlacedScene(world, scene)
    width, height = scene.camera.width, scene.camera.height
    every = np.arange(width * height, dtype=np.int32)
    film = PixelSamples(every)
    film.add(paths_of(placed, 99), every, np.full((len(every), 2), 128, np.int32), Run())
    truth = film.means(every).astype(np.float64)
    told, true = [], []
    for seed in range(20):
        coarse = coarse_image(paths_of(placed, seed), height, 10**9, Run(seed=seed))
        rest = np.setdiff1d(every, grid_of(width, height, coarse.block)[0])
        image, halves = coarse.radiance.reshape(-1, 3)[rest], truth[rest]
        square = np.sum((image - halves[:, 0]) * (image - halves[:, 1])) / np.sum(halves[:, 0] * halves[:, 1])
        told.append(coarse.error**2)
        true.append(square)
        assert coarse.error <= COARSE_ERROR and coarse.block > 1
    difference = np.array(told) - np.array(true)
    assert abs(difference.mean()) < 4.0 * difference.std(ddof=1) / np.sqrt(len(told))
    assert np.sqrt(np.mean(true)) < 1.1 * COARSE_ERROR


def test_light_over_a_texture_is_interpolated_as_light():
    # a plane that faces the camera, of any colours, under light that grows along it
    width, height, block = 61, 43, 8
    random = np.random.default_rng(5)
    pixels = np.arange(width * height, dtype=np.int32)
    column, row = pixels % width, pixels // width
    seen = np.zeros((len(pixels), SEEN), np.float32)
    seen[:, :3] = random.uniform(0.3, 0.6, (len(pixels), 3))
    seen[:, 5] = -1.0
    seen[:, 6], seen[:, 7] = column, row
    item = np.zeros(len(pixels), np.int32)
    radiance = (seen[:, :3] * (2.0 + 0.01 * column + 0.02 * row)[:, None]).astype(np.float32)
    grid, across = grid_of(width, height, block)
    assert len(grid) == across * 7 and {0, width - 1, width * height - 1} <= set(grid.tolist())
    light = np.empty((len(grid), 3), np.float32)
    smooth_grid(across, seen[grid], item[grid], radiance[grid], light)
    out, fit = np.empty_like(radiance), np.empty(len(pixels), np.float32)
    interpolate(places_of(pixels, width), (height, width), block, seen, item, (seen[grid], item[grid], light), out, fit)
    # the neighbours of a point of the grid, of other albedos, count in proportion to these
    assert np.sqrt(np.mean((out / radiance - 1.0) ** 2)) < 0.03
    assert fit == pytest.approx(1.0)
    # and no light passes from one object to the next
    item[column > 30] = 1
    radiance[column > 30] = 0.0
    smooth_grid(across, seen[grid], item[grid], radiance[grid], light)
    interpolate(places_of(pixels, width), (height, width), block, seen, item, (seen[grid], item[grid], light), out, fit)
    assert np.abs(out[column > 30]).max() < 0.01 * radiance.max()
    # what speaks for a place is the share of its own object's points in it, which lie at columns 24 and 32
    across_cell = (column - 24) / 8
    share = np.where(column > 30, across_cell, 1.0 - across_cell)
    assert fit == pytest.approx(np.where((column > 24) & (column < 32), share, 1.0), abs=1e-5)


def test_no_light_of_the_sky_leaks_onto_a_dark_body_nor_its_own_into_the_sky():
    box = moved(primitive_mesh(Box(size_x=0.2, size_y=0.2, size_z=0.02)), (0, 0, 0.8), (0.2, 0.3, 0.0))
    scene, world = scene_with(paper_camera(0.05), (box, Lambertian(albedo=0.002)), environment=SKY)
    placed = PlacedScene(world, scene)
    coarse = coarse_image(paths_of(placed), scene.camera.height, 10**9, Run())
    seen = truth_images(world, scene.camera, scene.T_world_camera()).object_id
    # beside its edge, whose pixels hold both
    sky, box = (maximum_filter(other, 3) == 0 for other in (seen >= 0, seen < 0))
    assert coarse.radiance[sky] == pytest.approx(np.broadcast_to(SKY.radiance, (sky.sum(), 3)), rel=1e-3)
    # a body under an even sky reflects its albedo's share of it
    expected = np.broadcast_to(0.002 * np.array(SKY.radiance), (box.sum(), 3))
    assert box.sum() > 500 and coarse.radiance[box] == pytest.approx(expected, rel=1e-2)


def test_it_takes_a_fraction_of_the_rays_of_an_image_as_good():
    scene, world = box_on_a_wall(0.25)
    placed = PlacedScene(world, scene)
    weight = band_weights(scene.camera.height, scene.camera.width, 20.0)
    start = world.rays.rays
    *_, measured = measured_images(placed, Importance((), weight), most=256)
    between = world.rays.rays
    *_, image = ambient_images(placed, target=COARSE_ERROR, most=256)
    assert measured.coarse_error <= COARSE_ERROR >= image.error and measured.error <= 1.0
    # a ray a pixel tells what is seen there
    assert between - start < 0.3 * (world.rays.rays - between)


@pytest.mark.parametrize("axis", ["rows", "columns"])
def test_threads_do_not_change_a_bit(axis):
    scene, world = box_on_a_wall()
    placed = PlacedScene(world, scene)
    importance = Importance((), band_weights(scene.camera.height, scene.camera.width, 20.0), axis)
    one, three = (list(measured_images(placed, importance, run=Run(threads=n))) for n in (1, 3))
    assert len(one) == len(three) == 2
    assert all(np.array_equal(a.radiance, b.radiance) for a, b in zip(one, three, strict=True))
    assert one[1].error == three[1].error and one[1].samples == three[1].samples


def test_where_nothing_matters_all_is_coarse_and_weights_of_another_image_are_refused():
    scene, world = box_on_a_wall()
    placed, shape = PlacedScene(world, scene), (scene.camera.height, scene.camera.width)
    first, last = measured_images(placed, Importance((), np.zeros(shape, np.float32)))
    assert last.error == 0.0 and last.coarse_error > 0.0 and last.samples == first.samples
    assert np.array_equal(first.radiance, last.radiance)
    with pytest.raises(ValueError, match="weights"):
        next(measured_images(placed, Importance((), np.zeros((3, 4), np.float32))))


def test_no_more_samples_are_spent_than_are_allowed():
    scene, world = box_on_a_wall()
    weight = band_weights(scene.camera.height, scene.camera.width, 1e4)
    *_, image = measured_images(PlacedScene(world, scene), Importance((), weight), most=4)
    assert image.samples <= 4.0 and image.error > 1.0


@pytest.mark.parametrize("most", [1, 2, 3])
def test_where_few_samples_are_allowed_no_pixel_of_the_band_gets_more(most):
    scene, world = box_on_a_wall()
    placed, weight = PlacedScene(world, scene), band_weights(scene.camera.height, scene.camera.width, 20.0)
    *_, measured = measured_images(placed, Importance((), weight), most=most, target=1e-3)
    *_, image = ambient_images(placed, target=1e-3, most=most)
    assert measured.samples <= most and np.array_equal(measured.radiance, image.radiance)


def test_a_goal_that_no_samples_reach_has_all_of_them_where_the_lines_are():
    """An even image of as many samples a pixel, known worse at the lines, is no help to whoever measures them."""
    scene, world = box_on_a_wall()
    placed, weight = PlacedScene(world, scene), band_weights(scene.camera.height, scene.camera.width, 1e4)
    *_, image = measured_images(placed, Importance((), weight), most=8, target=0.05)
    *_, even = ambient_images(placed, target=0.0, most=8)
    *_, reference = ambient_images(placed, target=0.0, most=1024, run=Run(seed=5))
    at = weight != 0.0
    error, error_even = (np.sqrt(np.mean((one.radiance - reference.radiance)[at] ** 2)) for one in (image, even))
    assert image.error > 1.0 and image.samples <= 8.0 and error < 0.75 * error_even


def test_what_the_coarse_image_knows_well_enough_is_not_sampled():
    scene, world = box_on_a_wall()
    placed, shape = PlacedScene(world, scene), (scene.camera.height, scene.camera.width)
    weight = np.full(shape, 0.01, np.float32)
    weight[:, 40:50] = -20.0
    _, image = measured_images(placed, Importance((), weight))
    _, band_alone = measured_images(placed, Importance((), np.where(weight < 0.0, -weight, np.float32(0.0))))
    assert np.array_equal(image.radiance, band_alone.radiance) and image.samples == band_alone.samples


def test_the_next_frame_has_what_the_lasers_do_not_change():
    scene, world = box_on_a_wall()
    weight = band_weights(scene.camera.height, scene.camera.width, 20.0)
    # the line is elsewhere in the second frame
    frames = [Importance((), np.roll(weight, shift, axis=1)) for shift in (0, 20)]

    def rendered(importance, run):
        start = world.rays.rays
        *_, image = measured_images(PlacedScene(world, scene), importance, run=run)
        return image, world.rays.rays - start

    apart = [rendered(one, Run()) for one in frames]
    run = Run(memory=Memory())
    together = [rendered(one, run) for one in frames]
    for (alone, _), (image, _) in zip(apart, together, strict=True):
        assert np.array_equal(image.radiance, alone.radiance) and image.error == alone.error
    # the first makes the coarse image, for which a ray a pixel tells what is seen; the second has it
    assert together[0][1] == apart[0][1]
    assert apart[1][1] - together[1][1] > weight.size


def with_rig(scene, **changes):
    return scene.model_copy(update={"rig": scene.rig.model_copy(update=changes)})


@pytest.mark.parametrize("changed", ["laser", "lamp", "camera", "world", "seed"])
def test_an_image_is_taken_over_from_the_frame_before_only_where_it_would_be_the_same(changed):
    scene, world = box_on_a_wall()
    scene = with_rig(scene, lasers=(paper_laser(),))
    plan, settings, run = AmbientPlan((LAMPS,)), RenderSettings(ambient_samples=8), Run(memory=Memory())

    def image(world, scene, run):
        start = world.rays.rays
        *_, last = AmbientLight().estimates(PlacedScene(world, scene), settings, plan, DARK, run)
        return last.value, last.quality, world.rays.rays - start

    first = image(world, scene, run)
    other, elsewhere, later = scene, world, run
    match changed:
        case "laser":
            other = with_rig(scene, lasers=(paper_laser(power=0.5, wavelength_nm=450.0),))
        case "lamp":
            other = scene.model_copy(update={"environment": Environment(radiance=(0.2, 0.3, 0.5))})
        case "camera":
            aside = scene.camera.model_copy(update={"T_rig_camera": Pose(translation=(0.01, 0.0, 0.0))})
            other = with_rig(scene, camera=aside)
        case "world":
            elsewhere = box_on_a_wall()[1]
        case "seed":
            later = replace(run, seed=1)
    again, alone = image(elsewhere, other, later), image(elsewhere, other, replace(later, memory=None))
    assert np.array_equal(again[0], alone[0]) and again[1] == alone[1] and alone[2] > 0
    assert again[2] == (0 if changed == "laser" else alone[2])
    assert np.array_equal(again[0], first[0]) == (changed in ("laser", "world"))


def test_a_frame_that_knows_what_matters_is_rendered_to_that():
    scene, world = box_on_a_wall(0.1)
    weight = band_weights(scene.camera.height, scene.camera.width, 20.0)
    aimed = replace(DARK, importance=Importance((), weight, allowed=0.07))
    plan, settings = AmbientPlan((LAMPS,)), RenderSettings(ambient_samples=64)
    placed = PlacedScene(world, scene)
    *_, last = AmbientLight().estimates(placed, settings, plan, aimed, Run())
    (quality,) = last.quality
    assert isinstance(quality, GroupQuality) and quality.reached and quality.of == "line" and quality.target == 0.07
    assert 0.0 < quality.coarse_error <= COARSE_ERROR
    assert quality.lines > 0 and 0 <= quality.unknown <= 0.05 * quality.lines
