import numpy as np
import pytest
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from render.base.errors import Cancelled
from render.base.threads import map_chunks
from render.mesh.primitives import primitive_mesh
from render.scene.shape import Sphere
from render.world import embree
from render.world.embree import RayScene, commit


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


def test_a_mesh_handed_over_in_pieces_is_hit_in_the_same_triangles():
    mesh = primitive_mesh(Sphere(radius=0.1, segments=256))
    # in no order, so that every piece has vertices from everywhere
    triangles = np.random.default_rng(1).permutation(mesh.triangles)
    whole, pieces = RayScene(mesh.vertices, triangles), RayScene(mesh.vertices, triangles, gently=True)
    directions = np.random.default_rng(2).normal(size=(20_000, 3)).astype(np.float32)
    origins = np.zeros_like(directions)
    origins[::2] = (0.3, 0.0, 0.0)
    first, second = whole.intersect(origins, directions), pieces.intersect(origins, directions)
    assert np.mean(first[0] == second[0]) > 0.999  # a ray through an edge may name either side
    assert ((first[0] >= 0) == (second[0] >= 0)).all() and len(np.unique(second[0])) > 5_000
    np.testing.assert_allclose(first[1], second[1], rtol=1e-5)


def test_the_tree_is_built_without_the_interpreter_and_by_embreex_where_that_cannot_be(monkeypatch):
    corners, triangle = np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.int32)
    origin, towards = np.zeros((2, 3), np.float32), np.array([[1, 1, 1], [-1, -1, -1]], np.float32)
    scene = EmbreeScene(robust=True)
    mesh = TriangleMesh(scene, corners, triangle)
    assert commit(scene) and scene.is_committed
    assert scene.run(origin, towards).tolist() == [0, -1]
    del mesh

    monkeypatch.setattr(embree, "_library", lambda: None)
    assert not commit(EmbreeScene(robust=True))
    scene = ball()
    assert (scene.intersect(np.zeros((8, 3), np.float32), np.ones((8, 3), np.float32))[0] >= 0).all()


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


def many(count, seed=3):
    """Rays of which neighbours go much the same way, some of them nowhere."""
    random = np.random.default_rng(seed)
    u, v = np.meshgrid(np.linspace(-0.6, 0.6, count), np.linspace(-0.6, 0.6, count))
    directions = np.stack([u, v, np.ones_like(u)], axis=-1).reshape(-1, 3).astype(np.float32)
    directions += random.normal(scale=1e-3, size=directions.shape).astype(np.float32)
    directions[random.random(len(directions)) < 0.05] = 0.0
    return np.tile(np.float32((0.01, -0.02, -0.3)), (len(directions), 1)), directions


@pytest.mark.parametrize("coherent", (False, True))
@pytest.mark.parametrize("width", (4, 8, 16))
def test_many_rays_at_a_time_hit_what_each_hits_alone(monkeypatch, width, coherent):
    # in pieces: several meshes
    mesh = primitive_mesh(Sphere(radius=0.1, segments=256))
    scene = RayScene(mesh.vertices, np.random.default_rng(1).permutation(mesh.triangles), gently=True)
    packets = embree.packets_of(scene._scene, (width,))
    assert embree.packets_work() and packets is not None and packets.width == width
    origins, directions = many(101)
    # a limit short of the near side, between the sides, beyond
    far = np.random.default_rng(2).choice(np.float32((0.1, 0.25, 0.5)), len(directions))
    monkeypatch.setattr(scene, "_packets", None)
    alone, blocked = scene.intersect(origins, directions), scene.occluded(origins, directions, far.copy())
    monkeypatch.setattr(scene, "_packets", packets)
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


def test_without_embrees_own_functions_each_ray_is_traced_alone(monkeypatch):
    origins, directions = many(40)
    together = ball().intersect(origins, directions, coherent=True)
    monkeypatch.setattr(embree, "packets_work", lambda: False)
    scene = ball()
    assert scene._packets is None
    alone = scene.intersect(origins, directions, coherent=True)
    assert np.array_equal(alone[0], together[0]) and np.allclose(alone[1], together[1], rtol=1e-6)
    monkeypatch.undo()
    monkeypatch.setattr(embree, "_library", lambda: None)
    assert embree.packets_of(scene._scene) is None
