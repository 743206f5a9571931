"""Camera paths for lines that are measured: where they go, and that pixels which share random numbers stay unbiased."""

from __future__ import annotations

import math

import numpy as np
import pytest

from render.base.arrays import Float, Float32, Int
from render.importance import Importance
from render.laser_direct.integrator import direct_image
from render.laser_indirect.bdpt_pass import BdptPass
from render.laser_indirect.guiding import active_pixels, no_guide
from render.laser_indirect.integrator import empty_buffer
from render.laser_indirect.line_goal import Projection
from render.laser_indirect.line_paths import PathDemand, alike_on_a_line
from render.laser_indirect.photon_emission import uniform_fan, visible_fan_range
from render.laser_indirect.sampling import (
    NO_KEYS,
    AlikePixels,
    DrawnPaths,
    Sampling,
    block_paths,
    draw_camera_paths,
)
from render.material.material import Lambertian
from render.mesh.mesh import Mesh
from render.mesh.primitives import primitive_mesh
from render.scene.shape import VGroove
from render.world.placed import PlacedLaser
from tests.render.scenes import moved, paper_camera, paper_laser, scene_of, world_of

HEIGHT, WIDTH = 200, 64
LINE = slice(28, 36)


def importance(peaks: float = 0.0) -> Importance:
    """Of a line down the middle of the image, and of peaks beside it."""
    weight = np.zeros((HEIGHT, WIDTH), np.float32)
    weight[:, LINE] = np.linspace(-1.0, 1.0, 8)
    away = np.full((HEIGHT, WIDTH), peaks, np.float32)
    away[:, LINE] = 0.0
    return Importance((weight,), np.abs(weight), "rows", (away,) if peaks else ())


def test_a_line_that_needs_four_times_the_paths_gets_them() -> None:
    """Whatever numbers of paths the variances were found with."""
    projection = Projection.of(importance(), 0)
    drawn = np.full(HEIGHT * WIDTH, 2.0)
    drawn.reshape(HEIGHT, WIDTH)[: HEIGHT // 2] = 4.0
    # of twice the paths twice the variance: four times the need
    variance = np.where(np.arange(HEIGHT) < HEIGHT // 2, 2.0, 1.0)
    demand = PathDemand.none(projection).learned(projection, (variance, np.zeros((0, 16), np.float32)), drawn, 1.0)
    paths = np.ones(HEIGHT * WIDTH, np.float32)
    demand.aim(paths, projection, WIDTH, 1000.0)
    image = paths.reshape(HEIGHT, WIDTH)
    # the windows of the lines on either side of the step are mixed
    assert image[40, 30] / image[160, 30] == pytest.approx(4.0)
    assert np.all(image[:, LINE] == image[:, LINE.start, None])
    assert paths.sum() == pytest.approx(1000.0)
    assert np.all(image[:, : LINE.start] == 0.0) and np.all(image[:, LINE.stop :] == 0.0)


def test_waves_teach_by_their_size() -> None:
    projection = Projection.of(importance(), 0)
    nothing, drawn = np.zeros((0, 16), np.float32), np.ones(HEIGHT * WIDTH)
    demand = PathDemand.none(projection)
    for size, variance in ((1.0, 5.0), (4.0, 1.0)):
        demand = demand.learned(projection, (np.full(HEIGHT, variance), nothing), drawn, size)
    assert demand.lines == pytest.approx(np.full(HEIGHT, (5.0 + 4.0 * 1.0) / 5.0)) and demand.size == 5.0


def test_peaks_get_paths_where_they_vary_and_some_wherever_there_is_light() -> None:
    projection = Projection.of(importance(peaks=0.5), 0)
    rises = np.zeros((len(projection.peaks), 16), np.float32)
    rises[10:20, 3] = 2.0
    drawn = np.ones(HEIGHT * WIDTH, np.float32)
    demand = PathDemand.none(projection).learned(projection, (np.zeros(HEIGHT), rises), drawn, 1.0)
    paths = np.ones(HEIGHT * WIDTH, np.float32)
    demand.aim(paths, projection, WIDTH, 1000.0)
    image = paths.reshape(HEIGHT, WIDTH)
    assert np.all(np.delete(image, LINE, axis=1) > 0.0)
    assert image[15, 5] > 20.0 * image[150, 5]


def drawn_of(expected: Float32, alike: AlikePixels, seed: int, active: Int | None = None) -> DrawnPaths:
    """Camera paths of one pass, on some pixels or on all."""
    some = np.arange(len(expected), dtype=np.int32) if active is None else active
    return draw_camera_paths(expected, some, alike, block_paths(expected, some, alike), seed)


def test_pixels_of_a_line_have_a_key_in_common_and_others_their_own() -> None:
    projection = Projection.of(importance(), 0)
    active = np.arange(0, HEIGHT * WIDTH, 3, dtype=np.int32)
    found = drawn_of(np.ones(HEIGHT * WIDTH, np.float32), alike_on_a_line(projection), 0, active)
    keys, on = found.keys, np.isin(active, projection.pixel)
    assert np.array_equal(found.pixels, active)
    assert np.array_equal(keys[on], active[on] // WIDTH)
    assert len(np.unique(keys[~on])) == np.sum(~on) and keys[~on].min() >= HEIGHT


@pytest.fixture(scope="module")
def groove() -> PlacedLaser:
    """A white V groove under a laser, as the camera sees it from the side."""
    mesh = primitive_mesh(VGroove(angle=math.radians(90), depth=0.03, width=0.2, length=0.2, thickness=0.04))
    mesh = moved(Mesh(mesh.vertices[:, [1, 0, 2]] * (1, 1, -1), mesh.triangles, mesh.uv), (0.0, 0.0, 0.85))
    scene = scene_of(paper_camera(0.25), paper_laser(), objects=1)
    item = scene.objects[0].model_copy(update={"material": Lambertian(albedo=0.8)})
    scene = scene.model_copy(update={"objects": (item,)})
    world = world_of(scene, mesh)
    return PlacedLaser(world, scene.camera, scene.lasers[0], scene.T_world_camera(), scene.T_world_laser(0))


def window_about_the_line(groove: PlacedLaser) -> tuple[Float, Projection]:
    """(pixels,) a camera path on each pixel within 6 px of the line; weights of the line's centroid there."""
    direct = direct_image(*groove, target=1e-2).radiance
    width = direct.shape[1]
    centre = np.where(direct.max(axis=1) > 0.0, direct.argmax(axis=1), -100)
    apart = np.arange(width) - centre[:, None]
    weight = np.where(np.abs(apart) <= 6, apart, 0).astype(np.float32)
    weight[(weight == 0.0) & (apart == 0)] = 1e-6
    paths = (weight != 0.0).astype(np.float32).ravel()
    return paths, Projection.of(Importance((weight,), np.abs(weight)), 0)


def test_shared_random_numbers_move_lines_less_and_leave_every_pixel_unbiased(groove: PlacedLaser) -> None:
    """The light of a V groove about the line, by passes with numbers of their own and shared ones."""
    low, high, reach = visible_fan_range(groove.world, groove.laser, groove.T_world_laser)
    task, paths = BdptPass.of(groove, reach, 0), window_about_the_line(groove)
    camera_paths, projection = paths
    active, passes = active_pixels(camera_paths), 64

    def images(keys: AlikePixels, first: int) -> Float:
        sampling = Sampling(1 << 11, uniform_fan(low, high), camera_paths, active, no_guide(groove.camera), keys)
        found = []
        for number in range(first, first + passes):
            buffer = empty_buffer(len(camera_paths))
            task.run(number, sampling, buffer)
            found.append(buffer.image)
        return np.array(found)

    own, shared = images(NO_KEYS, 0), images(alike_on_a_line(projection), passes)
    light = [np.bincount(projection.line, one.mean(axis=0)[projection.pixel]) for one in (own, shared)]
    # a part of the plate that sees no other is dark
    bright = np.flatnonzero(np.minimum(*light) > 0.02 * np.max(light))
    assert len(bright) > 40

    def sums(found: Float) -> Float:
        return np.array([np.bincount(projection.line, one[projection.pixel]) for one in found])[:, bright]

    def moves(found: Float) -> Float:
        return np.array([projection.moves(one) for one in found])[:, bright]

    # what each line's window holds, and what moves the line, is the same but for the errors of both means
    for measure in (sums, moves):
        one, other = measure(own), measure(shared)
        error = np.sqrt((one.var(axis=0, ddof=1) + other.var(axis=0, ddof=1)) / passes)
        scores = (one.mean(axis=0) - other.mean(axis=0)) / error
        # lines have light vertices in common, so that as few as ten of them may be independent
        assert abs(scores.mean()) < 3.0 / math.sqrt(10.0)
        assert scores.std() < 1.5
    # and the line is moved far less
    own_variance, shared_variance = (np.median(moves(found).var(axis=0, ddof=1)) for found in (own, shared))
    assert shared_variance < 0.2 * own_variance


@pytest.mark.parametrize(("pixels", "most"), [(400, 3.0), (4000, 0.01)], ids=["many paths a pixel", "few"])
def test_camera_paths_are_drawn_as_often_as_expected_and_in_all_to_one_path_of_their_sum(
    pixels: int, most: float
) -> None:
    """Systematic sampling: each pixel by its own expectation, the whole as near to its own as whole numbers allow."""
    rng = np.random.default_rng(8)
    expected = (rng.random(pixels) ** 4 * most).astype(np.float32)
    repeats = 4000
    drawn = np.zeros((repeats, pixels), np.int16)
    for seed in range(repeats):
        found = drawn_of(expected, NO_KEYS, seed)
        drawn[seed, found.pixels] = np.diff(found.starts)
        assert abs(drawn[seed].sum() - expected.sum()) < 1.0
    assert np.all(np.abs(drawn - expected) < 1.0)
    # as many pixels together as 400 with a few paths, so that their mean is about normal
    together = np.add.reduceat(drawn, np.arange(0, pixels, pixels // 400), axis=1).mean(axis=0)
    whole = np.add.reduceat(expected.astype(np.float64), np.arange(0, pixels, pixels // 400))
    part = whole % 1.0
    deviation = np.sqrt(np.maximum(part * (1.0 - part), 1e-9) / repeats)
    score = (together - whole) / deviation
    # 400 of one seed's numbers are not independent: each lies within what happens to one in 50,000
    assert np.all(np.abs(score) < 4.3)


def test_pixels_of_a_line_are_drawn_alike() -> None:
    expected, active = np.full(64, 0.3, np.float32), np.arange(64, dtype=np.int32)
    alike = AlikePixels(active[8:24], np.ones(16, np.int32), 8)
    for seed in range(50):
        found = drawn_of(expected, alike, seed)
        assert np.isin(np.arange(8, 24), found.pixels).sum() in (0, 16)
