"""The pairs of a pixel's samples, and which lamp they choose: even, uniform, reproducible."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from render.ambient.light_sampling import (
    AREA,
    light_in_view,
    light_probability,
    pack_lights,
    sample_emitter_point,
    sample_light,
)
from render.base.pose import Pose
from render.material.material import Emitter
from render.mesh.primitives import primitive_mesh
from render.sampling.low_discrepancy import LENGTH, LOG_LENGTH, pair, pair_table
from render.scene.lights import PointLight, RectangleLight
from render.scene.shape import Sphere
from tests.render.ambient.test_path_kernels import scene_with
from tests.render.scenes import moved, paper_camera


@pytest.mark.parametrize("log_count", [0, 1, 4, 7, LOG_LENGTH])
def test_every_prefix_of_a_power_of_two_is_a_net(log_count):
    points = pair_table()[:, : 1 << log_count].astype(np.float64)
    for across in range(log_count + 1):
        cells = np.floor(points * (2.0**across, 2.0 ** (log_count - across))).astype(np.int64)
        numbers = (cells[..., 0] << (log_count - across)) + cells[..., 1]
        assert all(len(set(row)) == 1 << log_count for row in numbers)


def test_first_samples_of_many_pixels_are_uniform_and_independent_of_other_dimensions():
    table, n = pair_table(), 20000
    a = np.array([pair(table, 3, index, 0, 4) for index in range(n)])
    b = np.array([pair(table, 3, index, 0, 5) for index in range(n)])
    assert a.min() >= 0.0 and a.max() < 1.0
    for x, y in ((a[:, 0], a[:, 1]), (a[:, 0], b[:, 0]), (a[:, 1], b[:, 1])):
        count, *_ = np.histogram2d(x, y, bins=16, range=((0, 1), (0, 1)))
        statistic = np.sum((count - n / 256) ** 2 / (n / 256))
        assert statistic < chi2.ppf(1 - 1e-4, 255)


def test_samples_go_on_beyond_the_table():
    table = pair_table()
    points = np.array([pair(table, 1, 7, sample, 0) for sample in range(3 * LENGTH)])
    assert len(np.unique(points[:, 0])) > 2.9 * LENGTH
    assert points.mean(axis=0) == pytest.approx([0.5, 0.5], abs=2e-3)


def lights_of(*lights, objects=()):
    scene, world = scene_with(paper_camera(0.01), *objects, lights=lights)
    return pack_lights(scene, world.surface), world.surface


def test_a_lamp_is_drawn_with_its_chance_and_never_where_it_cannot_shine():
    lamps = (
        PointLight(name="near", T_world_light=Pose(translation=(0.1, 0, 0))),
        PointLight(name="far", intensity=(9.0, 9.0, 9.0), T_world_light=Pose(translation=(0, 3.0, 0))),
        PointLight(name="off", intensity=(0.0, 0.0, 0.0)),
        RectangleLight(name="before", T_world_light=Pose(translation=(0, 0, -1.0))),
        RectangleLight(name="behind", T_world_light=Pose(translation=(0, 0, 2.0))),
    )
    lights, _ = lights_of(*lamps)
    rows, point = lights.rows, (0.0, 0.0, 0.5)
    assert len(rows) == 4 and lights.rectangles == 2
    expected = np.array([light_probability(rows, k, point) for k in range(len(rows))])
    assert expected.sum() == pytest.approx(1.0) and expected[3] == 0.0 and np.all(expected[:3] > 0.0)
    n = 4000
    drawn = [sample_light(rows, point, (i + 0.5) / n) for i in range(n)]
    share = np.bincount([k for k, _ in drawn], minlength=4) / n
    assert share == pytest.approx(expected, abs=2 / n)
    assert all(value == pytest.approx(expected[k]) for k, value in drawn)


def test_a_rectangle_is_seen_from_its_front_only():
    lights, _ = lights_of(RectangleLight(width=0.2, height=0.1), PointLight())
    assert light_in_view(lights.rows, (0.09, 0.0, 1.0), (0.0, 0.0, -1.0), 2.0) == 0
    assert light_in_view(lights.rows, (0.09, 0.0, 1.0), (0.0, 0.0, -1.0), 0.5) == -1
    assert light_in_view(lights.rows, (0.09, 0.06, 1.0), (0.0, 0.0, -1.0), 2.0) == -1
    assert light_in_view(lights.rows, (0.09, 0.0, -1.0), (0.0, 0.0, 1.0), 2.0) == -1


def test_points_of_a_shining_object_are_uniform_on_it():
    ball = moved(primitive_mesh(Sphere(radius=0.3)), (1, 2, 3))
    lights, surface = lights_of(objects=((ball, Emitter()),))
    assert lights.rows[0, AREA] == pytest.approx(4 * np.pi * 0.09, rel=2e-3)
    random, n = np.random.default_rng(4), 20000
    points, normals = np.empty((n, 3)), np.empty((n, 3))
    for i in range(n):
        points[i], normals[i] = sample_emitter_point(lights, surface, 0, *random.random(2))
    out = (points - (1, 2, 3)) / 0.3
    assert np.linalg.norm(out, axis=1) == pytest.approx(1.0, abs=2e-3)
    assert np.all(np.sum(out * normals, axis=1) > 0.99)
    # of a sphere, each coordinate is flat (Archimedes)
    for axis in range(3):
        count, _ = np.histogram(out[:, axis], bins=20, range=(-1, 1))
        assert np.sum((count - n / 20) ** 2 / (n / 20)) < chi2.ppf(1 - 1e-4, 19)
