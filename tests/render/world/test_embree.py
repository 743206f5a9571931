import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from itertools import count

import numpy as np
import pytest

from render.base.errors import Cancelled
from render.base.threads import map_chunks
from render.mesh.primitives import primitive_mesh
from render.scene.shape import Sphere
from render.world import embree
from render.world.embree import EmbreexTree, RayScene, Tree


def ball():
    mesh = primitive_mesh(Sphere(radius=0.1, segments=64))
    return RayScene(mesh.vertices + np.array([10.0, -20.0, 5.0]), mesh.triangles)


def test_no_ray_slips_through_a_closed_surface():
    scene = ball()
    directions = np.random.default_rng(0).normal(size=(200_000, 3)).astype(np.float32)
    hit, distance = scene.intersect(np.zeros((len(directions), 3), np.float32), directions)
    assert (hit >= 0).all()
    reach = distance * np.linalg.norm(directions, axis=1)
    assert reach.min() > 0.0995 and reach.max() < 0.1001


def test_a_plane_is_hit_where_the_closed_form_says():
    # z = 0.2 x - 0.1 y + 1, as four triangles around its middle
    corners = np.array([[x, y, 0.2 * x - 0.1 * y + 1.0] for x, y in ((0, 0), (2, 2), (-2, 2), (-2, -2), (2, -2))])
    scene = RayScene(corners, np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]], np.int32))
    directions = np.random.default_rng(5).uniform((-1, -1, 1), (1, 1, 1), (10_000, 3)).astype(np.float32)
    start = np.array([0.1, -0.2, 0.0])
    origins = np.tile((start - scene.centre).astype(np.float32), (len(directions), 1))
    triangle, distance = scene.intersect(origins, directions)
    x, y, z = directions.T.astype(np.float64)
    exact = (0.2 * start[0] - 0.1 * start[1] + 1.0) / (z - 0.2 * x + 0.1 * y)
    # vertices, origin and direction are rounded once each, over lengths below 4 m
    np.testing.assert_allclose(distance, exact, rtol=16 * 2.0**-24)
    at = start + exact[:, None] * directions
    inner = np.abs(np.abs(at[:, 0]) - np.abs(at[:, 1])) > 1e-5
    quarter = np.where(at[:, 1] > np.abs(at[:, 0]), 0, np.where(-at[:, 0] > np.abs(at[:, 1]), 1, 2))
    quarter = np.where(at[:, 0] > np.abs(at[:, 1]), 3, quarter)
    assert np.array_equal(triangle[inner], quarter[inner]) and inner.mean() > 0.99


class Watched:
    """Embree's functions, of which one is called by way of another."""

    def __init__(self, functions, name, instead):
        self.functions, self.name, self.instead = functions, name, instead

    def __getattr__(self, name):
        real = getattr(self.functions, name)
        return partial(self.instead, real) if name == self.name else real


def shifted(mesh):
    return np.concatenate([mesh.vertices, np.zeros((1, 3))]).astype(np.float32), mesh.triangles


def test_the_interpreter_is_free_while_a_tree_is_built():
    opened, turns, passed = embree.library(), count(), []
    over = threading.Event()

    def commit(real, scene):
        before = next(turns)
        real(scene)
        passed.append(next(turns) - before)

    watched = opened._replace(functions=Watched(opened.functions, "rtcCommitScene", commit))
    mesh = shifted(primitive_mesh(Sphere(radius=0.1, segments=512)))
    build = threading.Thread(target=lambda: (Tree(watched, *mesh), over.set()))
    before = sys.getswitchinterval()
    try:
        # nobody is made to let go of the interpreter; this thread does at each turn
        sys.setswitchinterval(100.0)
        build.start()
        while not over.is_set():
            next(turns)
            time.sleep(0.0)
        build.join()
    finally:
        sys.setswitchinterval(before)
    # one turn is the function's own; thousands fit into the build of a quarter of a million triangles
    assert passed[0] > 100


def test_a_tree_is_given_back_once_and_its_triangles_are_never_copied():
    opened, given = embree.library(), []
    watched = opened._replace(functions=Watched(opened.functions, "rtcReleaseScene", lambda real, s: given.append(s)))
    corners, triangles = shifted(primitive_mesh(Sphere(radius=0.1)))
    triangles = np.ascontiguousarray(triangles, np.int32)
    held = sys.getrefcount(triangles)
    tree = Tree(watched, corners, triangles)
    assert sys.getrefcount(triangles) == held + 1 and not given
    del tree
    assert len(given) == 1 and sys.getrefcount(triangles) == held
    opened.functions.rtcReleaseScene(given[0])


def test_an_error_of_embree_is_told_in_the_thread_that_made_it():
    opened = embree.library()
    assert not opened.functions.rtcNewGeometry(opened.device, 9999)
    with ThreadPoolExecutor(1) as other:
        other.submit(opened.check).result()
    with pytest.raises(RuntimeError, match="Embree: "):
        opened.check()
    opened.check()


def test_builds_and_rays_of_many_threads_give_what_one_gives():
    mesh = primitive_mesh(Sphere(radius=0.1, segments=200))
    vertices = np.concatenate([mesh.vertices, mesh.vertices + np.array([0.15, 0.0, 0.0])])
    triangles = np.concatenate([mesh.triangles, mesh.triangles + np.int32(len(mesh.vertices))])
    towards = np.random.default_rng(8).normal(size=(30_000, 3)).astype(np.float32)
    # exactly through vertices and edges, where only the order of the search decides between neighbours
    towards[::2] = vertices[triangles[np.arange(15_000), 0]] - (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    origins = np.zeros_like(towards)

    def build_and_trace(_):
        return RayScene(vertices, triangles).intersect(origins, towards)

    alone = build_and_trace(0)
    assert np.count_nonzero(alone[0] >= 0) > 15_000
    with ThreadPoolExecutor(6) as pool:
        for triangle, distance in pool.map(build_and_trace, range(12)):
            assert np.array_equal(triangle, alone[0]) and np.array_equal(distance, alone[1])


def test_a_moved_part_is_hit_where_it_stands_and_the_scene_before_stays_as_it_was():
    ball_at, table = primitive_mesh(Sphere(radius=0.1, segments=64)), np.array([[-1, -1, 0], [1, -1, 0], [0, 2, 0.0]])
    triangles = np.concatenate([ball_at.triangles, np.array([[0, 1, 2]], np.int32) + np.int32(len(ball_at.vertices))])

    def scene(x):
        return RayScene(np.concatenate([ball_at.vertices + np.array([x, 0.0, 0.2]), table]), triangles)

    def height(scene, x):
        triangle, distance = scene.intersect(
            np.float32([[x, 0.0, 1.0]]) - np.float32(scene.centre), np.float32([[0, 0, -1]])
        )
        return triangle[0] == len(triangles) - 1, 1.0 - distance[0]

    before, after = scene(0.0), scene(0.3)
    for first, there, gone in ((before, 0.0, 0.3), (after, 0.3, 0.0)):
        assert height(first, there) == (False, pytest.approx(0.3, abs=1e-6))
        assert height(first, gone) == (True, pytest.approx(0.0, abs=1e-6))


def test_occlusion_ends_at_the_target():
    scene = ball()
    origins, directions = np.zeros((2, 3), np.float32), np.array([[1, 0, 0], [1, 0, 0]], np.float32)
    assert scene.occluded(origins, directions, np.array([0.09, 0.2], np.float32)).tolist() == [False, True]


def test_rows_that_do_not_match_are_refused_instead_of_read_out_of_bounds():
    scene = ball()
    with pytest.raises(ValueError, match="do not match"):
        scene.intersect(np.zeros((5, 3), np.float32), np.zeros((4, 3), np.float32))
    with pytest.raises(ValueError, match="do not match"):
        scene.occluded(np.zeros((5, 3), np.float32), np.zeros((5, 3), np.float32), np.zeros(4, np.float32))


def test_chunks_cover_everything_once_and_report_progress():
    seen, reports = np.zeros(1000, int), []

    def work(start, stop):
        seen[start:stop] += 1

    map_chunks(work, 1000, 64, threads=3, progress=reports.append)
    assert (seen == 1).all()
    assert reports[-1] == 1.0 and reports == sorted(reports)


@pytest.mark.parametrize("threads", [1, 3])
def test_cancelling_stops_between_chunks_and_errors_come_through(threads):
    done = []
    with pytest.raises(Cancelled):
        map_chunks(lambda a, b: done.append(a), 1000, 10, threads, cancelled=lambda: len(done) >= 5)
    assert 5 <= len(done) < 20

    def fails(start, stop):
        raise KeyError(start)

    with pytest.raises(KeyError):
        map_chunks(fails, 100, 10, threads)


def many(side, seed=3):
    """Rays of which neighbours go much the same way, some of them nowhere."""
    random = np.random.default_rng(seed)
    u, v = np.meshgrid(np.linspace(-0.6, 0.6, side), np.linspace(-0.6, 0.6, side))
    directions = np.stack([u, v, np.ones_like(u)], axis=-1).reshape(-1, 3).astype(np.float32)
    directions += random.normal(scale=1e-3, size=directions.shape).astype(np.float32)
    directions[random.random(len(directions)) < 0.05] = 0.0
    return np.tile(np.float32((0.01, -0.02, -0.3)), (len(directions), 1)), directions


@pytest.mark.parametrize("coherent", (False, True))
@pytest.mark.parametrize("width", (4, 8, 16))
def test_many_rays_at_a_time_hit_what_embreex_hits_with_each_alone(monkeypatch, width, coherent):
    mesh = primitive_mesh(Sphere(radius=0.1, segments=256))
    triangles = np.random.default_rng(1).permutation(mesh.triangles)
    scene = RayScene(mesh.vertices, triangles)
    arrays = scene._tree._arrays
    origins, directions = many(101)
    # a limit short of the near side, between the sides, beyond
    far = np.random.default_rng(2).choice(np.float32((0.1, 0.25, 0.5)), len(directions))
    monkeypatch.setattr(scene, "_tree", EmbreexTree(*arrays))
    alone, blocked = scene.intersect(origins, directions), scene.occluded(origins, directions, far.copy())
    monkeypatch.setattr(scene, "_tree", Tree(embree.library(), *arrays, width))
    together = scene.intersect(origins, directions, coherent=coherent)
    assert np.count_nonzero(alone[0] >= 0) > 2000 and np.count_nonzero(alone[0] < 0) > 2000
    assert ((alone[0] >= 0) == (together[0] >= 0)).all()
    assert np.mean(alone[0] == together[0]) > 0.999  # a ray through an edge may name either side
    np.testing.assert_allclose(together[1], alone[1], rtol=1e-5)
    assert np.array_equal(scene.from_point(scene.centre + origins[0].astype(float), directions), together[0])

    assert np.array_equal(scene.occluded(origins, directions, far.copy(), coherent=coherent), blocked)
    assert 1000 < np.count_nonzero(blocked) < 2000
    hit, distance = scene.intersect(origins, directions, far.copy(), coherent=coherent)
    assert np.array_equal(hit >= 0, blocked) and np.array_equal(distance[hit < 0], far[hit < 0])


@pytest.mark.parametrize("missing", ("library", "works"))
def test_where_embree_cannot_be_opened_or_trusted_embreex_traces_each_ray_alone(monkeypatch, missing):
    origins, directions = many(40)
    together = ball().intersect(origins, directions, coherent=True)
    monkeypatch.setattr(embree, missing, lambda: None)
    scene = ball()
    assert isinstance(scene._tree, EmbreexTree)
    alone = scene.intersect(origins, directions, coherent=True)
    assert np.array_equal(alone[0], together[0]) and np.allclose(alone[1], together[1], rtol=1e-6)


def test_a_library_that_answers_otherwise_than_embreex_is_not_trusted(monkeypatch):
    assert embree.works() and isinstance(ball()._tree, Tree)
    monkeypatch.setattr(embree, "FAR", 1.2)
    opened = embree.library()
    # its rays go nowhere: no ray is valid
    silent = opened._replace(functions=Watched(opened.functions, "rtcCommitScene", lambda real, scene: None))
    monkeypatch.setattr(embree, "library", lambda: silent)
    embree.works.cache_clear()
    assert not embree.works()
    embree.works.cache_clear()
    with pytest.raises(RuntimeError, match="Invalid operation"):  # else the next tree of this thread is blamed for it
        opened.check()
