"""Where the camera sees edges: found whichever way the points are batched, in memory that their number cannot grow."""

import tracemalloc

import numpy as np
import pytest

from render.laser_indirect import specular_edges
from render.laser_indirect.specular_edges import find_edges
from render.mesh.mesh import Mesh
from tests.render.scenes import moved, paper_camera, paper_laser, plane_mesh, scene_of, world_of

SIZE = 4
RNG = np.random.default_rng(7)


def needles(count):
    """Triangles of which each crosses the whole view, in front of and behind each other."""
    ends = RNG.uniform(-0.2, 0.2, (3 * count, 2))
    vertices = np.column_stack((ends, RNG.uniform(0.0, 0.01, 3 * count)))
    return Mesh(vertices, np.arange(3 * count, dtype=np.int32).reshape(-1, 3), None)


def found_edges(mesh):
    scene = scene_of(paper_camera(0.1), paper_laser(), objects=2)
    world = world_of(scene, moved(mesh, (0.0, 0.0, 0.8)), moved(plane_mesh((0.0, 0.0, -1.0), 0.0), (0.0, 0.0, 0.9)))
    camera = scene.camera
    found = np.zeros((-(-camera.height // SIZE), -(-camera.width // SIZE)), np.bool_)
    _ = world.rays
    tracemalloc.start()
    find_edges(world, np.array([True, False]), camera, scene.T_world_camera(), SIZE, found)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return found, most


@pytest.mark.parametrize("batch", [100, 3001])
def test_the_edges_found_do_not_depend_on_how_many_points_are_taken_at_a_time(monkeypatch, batch):
    mesh = needles(20)
    whole, _ = found_edges(mesh)
    monkeypatch.setattr(specular_edges, "BATCH", batch)
    parts, _ = found_edges(mesh)
    assert 0 < whole.sum() < whole.size
    assert np.array_equal(parts, whole)


def test_many_long_edges_take_no_more_memory_than_a_batch(monkeypatch):
    monkeypatch.setattr(specular_edges, "BATCH", 1 << 14)
    _, few = found_edges(needles(1000))
    _, many = found_edges(needles(4000))
    # 36 bytes a triangle for what is listed of it, not the 20 kB that the points of its edges take
    assert many - few < 3000 * 1000
