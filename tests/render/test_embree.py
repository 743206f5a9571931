import numpy as np
import pytest
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from render import embree
from render.embree import RayScene, commit
from render.errors import Cancelled
from render.primitives import primitive_mesh
from render.shape import Sphere
from render.threads import map_chunks


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

    monkeypatch.setattr(embree, "_rtc_commit_scene", lambda: None)
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
