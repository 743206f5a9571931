"""Errors against truth: matching, measures of known samples, and the signed distance to open and closed meshes."""

from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from analysis import distance
from analysis.cloud import cloud
from analysis.distance import point_triangle_distance, signed_distance
from analysis.error import compare, match
from analysis.line.result import Flag, Line
from analysis.measures import error_statistics, measure
from analysis.triangulate import triangulate
from render.base.errors import InputError
from render.camera.camera import Camera
from render.frame import LaserCurve

THETA, BASELINE, DEPTH = math.radians(13), 0.2, 0.85
CAMERA = Camera(width=2448, height=2048, fx=3478.26, fy=3478.26, cx=1223.5, cy=1023.5)
PLANE = np.array([math.cos(THETA), 0.0, math.sin(THETA), -BASELINE * math.cos(THETA)])
WALL = np.array([[-1.0, -1.0, DEPTH], [1.0, -1.0, DEPTH], [1.0, 1.0, DEPTH], [-1.0, 1.0, DEPTH]])
WALL_TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)


def wall_curve(rows: np.ndarray) -> LaserCurve:
    """The exact line on a wall at z = DEPTH that faces the camera."""
    n = len(rows)
    x = BASELINE - DEPTH * math.tan(THETA)
    point = np.stack([np.full(n, x), (rows - CAMERA.cy) / CAMERA.fy * DEPTH, np.full(n, DEPTH)], axis=1)
    u = CAMERA.fx * x / DEPTH + CAMERA.cx
    zero = np.zeros(n)
    return LaserCurve(
        "rows", rows.astype(np.int32), np.full(n, u), point, point[:, 2].copy(), np.linalg.norm(point, axis=1),
        np.zeros(n, np.int32), zero, zero, zero + 30.0, np.zeros((0, 2, 3)), zero,
    )  # fmt: skip


def line_of(u: np.ndarray, sigma: float) -> Line:
    """(n, k) positions, NaN for none -> a line."""
    full = np.ones_like(u)
    flag = np.where(np.isfinite(u), Flag.OK, Flag.NO_PEAK).astype(np.uint8)
    return Line("rows", "ml", u, full * sigma, full, full, full, full, flag)


def errors_of(line: Line, curve: LaserCurve, vertices=WALL, triangles=WALL_TRIANGLES):
    points = triangulate(line, CAMERA, PLANE, T_rig_camera=np.eye(4), T_world_camera=np.eye(4))
    return points, compare(points, line, curve, vertices, triangles, np.eye(4))


def test_an_exact_line_has_no_error():
    curve = wall_curve(np.arange(100, 1900))
    u = np.full((2048, 1), np.nan)
    u[100:1900, 0] = curve.position
    _, errors = errors_of(line_of(u, 0.05), curve)
    assert errors.truth_rows == errors.measured_rows == errors.valid_rows == errors.u.count == 1800
    assert errors.completeness == 1.0
    assert errors.false_rows == 0
    assert errors.u.rmse == 0.0
    assert errors.depth_z.rmse < 1e-14
    assert errors.surface.rmse < 1e-14


def test_noise_and_bias_come_out_as_they_went_in():
    random = np.random.default_rng(3)
    curve = wall_curve(np.arange(2048))
    u = curve.position[:, None] + 0.02 + 0.1 * random.standard_normal((2048, 1))
    points, errors = errors_of(line_of(u, 0.1), curve)
    dz_du = DEPTH**2 / (BASELINE * CAMERA.fx)
    standard_error = 0.1 / math.sqrt(2048)
    assert abs(errors.u.bias - 0.02) < 4 * standard_error
    assert errors.u.sigma == pytest.approx(0.1, rel=4 / math.sqrt(2 * 2048))
    assert errors.u.robust_sigma == pytest.approx(0.1, rel=4 * 1.17 / math.sqrt(2048))
    assert errors.depth_z.sigma == pytest.approx(errors.u.sigma * dz_du, rel=1e-3)
    assert errors.depth_z.bias == pytest.approx(-errors.u.bias * dz_du, rel=2e-2)  # farther right is nearer
    # the wall faces the camera: the error off it is the depth error, of the same sign
    assert np.allclose(errors.off_surface, errors.depth, atol=1e-12)
    assert np.allclose(errors.sigma_off_surface, points.sigma_depth, rtol=1e-9)
    assert abs(errors.u.autocorrelation) < 4 / math.sqrt(2048)
    assert errors.u.rmse**2 == pytest.approx(errors.u.bias**2 + errors.u.sigma**2)


def test_what_the_sheet_adds_goes_with_the_point_that_its_crossing_is_matched_to():
    curve = wall_curve(np.arange(100, 1900))
    curve = dataclasses.replace(curve, sheet_bias=np.linspace(-0.1, 0.1, 1800))
    u = np.full((2048, 1), np.nan)
    u[200:2000, 0] = curve.position[0]
    points, errors = errors_of(line_of(u, 0.05), curve)
    for row, expected in ((200, curve.sheet_bias[100]), (1899, 0.1), (150, np.nan), (1950, np.nan)):
        np.testing.assert_equal(errors.sheet_bias[points.index == row], expected)
    table = cloud(points, errors, 0, 0)
    np.testing.assert_equal(table["sheet_bias"], errors.sheet_bias[points.valid])


def test_what_the_calibration_moves_off_a_slanted_surface_is_the_spread_of_its_draws():
    slanted = WALL @ Rotation.from_euler("xy", [0.2, -0.6]).as_matrix().T + np.array([0.0, 0.0, 0.2])
    u = np.full((2048, 1), np.nan)
    u[200:1800:40, 0] = 900.0
    curve, random = wall_curve(np.arange(100, 1900)), np.random.default_rng(9)
    line = line_of(u, 0.05)
    points = triangulate(line, CAMERA, PLANE, T_rig_camera=np.eye(4), T_world_camera=np.eye(4))
    by_calibration, by_motion = (2e-5 * random.standard_normal((len(points.flag), 3, k)) for k in (5, 2))
    points = dataclasses.replace(points, calibration=by_calibration, motion=by_motion)
    told = compare(points, line, curve, slanted, WALL_TRIANGLES, np.eye(4)).systematic_off_surface
    moves, draws = np.concatenate([by_calibration, by_motion], axis=2), []
    for draw in random.standard_normal((400, 7)):
        draws.append(signed_distance(points.world + moves @ draw, slanted, WALL_TRIANGLES, np.zeros(3))[0])
    np.testing.assert_allclose(np.std(draws, axis=0), told, rtol=5.0 / math.sqrt(2 * 400))
    assert np.all(told < points.sigma_systematic), "what moves along the surface counts for nothing"


def test_false_rows_next_to_an_end_are_counted_apart_from_stray_ones():
    """The one 230 scan lines away, 650 px beside the line, was told to be at its end."""
    curve = wall_curve(np.arange(500, 900))
    at, u = curve.position[0], np.full((2048, 2), np.nan)
    u[497:903, 0] = at  # three scan lines beyond each end
    u[270, 0] = at + 650.0
    u[495, 0] = at + 650.0  # next to the end's scan line, not to the end
    u[901, 1] = at + 300.0  # and beside one that is
    _, errors = errors_of(line_of(u, 0.05), curve)
    assert (errors.false_rows, errors.false_rows_at_ends) == (8, 5)


def test_a_peak_whose_ray_gives_no_depth_is_no_point_and_counted_by_itself():
    """Among the false rows, which have points, the counts of a report would not add up."""
    curve, u = wall_curve(np.arange(100, 200)), np.full((2048, 1), np.nan)
    u[100:200, 0] = curve.position
    u[1783, 0] = 100.0  # beyond the plane's vanishing line
    u[300, 0] = curve.position[0]
    points, errors = errors_of(line_of(u, 0.05), curve)
    assert not points.valid[-1] and np.isnan(points.depth_z[-1])
    assert (errors.false_rows, errors.depthless_rows, errors.valid_rows) == (1, 1, 101)
    assert errors.measured_rows + errors.false_rows == errors.valid_rows


def test_coverage_tells_an_honest_sigma_from_a_boastful_one():
    random = np.random.default_rng(5)
    curve = wall_curve(np.arange(2048))
    noise = 0.1 * random.standard_normal((2048, 1))
    honest = errors_of(line_of(curve.position[:, None] + noise, 0.1), curve)[1]
    boastful = errors_of(line_of(curve.position[:, None] + noise, 0.05), curve)[1]
    tolerance = 4 * math.sqrt(0.954 * 0.046 / 2048)
    for measures in (honest.u, honest.depth_z, honest.surface):
        assert abs(measures.coverage - 0.9545) < tolerance
    assert abs(boastful.u.coverage - 0.6827) < 4 * math.sqrt(0.68 * 0.32 / 2048)


def test_rows_that_are_missing_false_or_wrong_are_counted_apart():
    curve = wall_curve(np.arange(100, 200))
    u = np.full((2048, 1), np.nan)
    u[110:200, 0] = curve.position[0] + 0.01 * np.random.default_rng(0).standard_normal(90)  # ten rows missing
    u[120:125, 0] += 30.0  # five wrong peaks
    u[500:507, 0] = 900.0  # seven rows where nothing is to be seen
    _, errors = errors_of(line_of(u, 0.01), curve)
    assert (errors.truth_rows, errors.valid_rows, errors.measured_rows, errors.false_rows) == (100, 97, 85, 7)
    assert errors.completeness == 0.85
    assert errors.u.count == 90
    assert errors.u.outlier_rate == pytest.approx(5 / 90)
    assert errors.outlier.sum() == 5
    assert errors.surface.count == 97
    assert errors.u.robust_sigma < 0.02 < errors.u.sigma


def test_stray_peaks_do_not_count_as_measured_however_many_they_are():
    """Where most peaks are wrong the robust sigma is hundreds of pixels; the line's own width is not."""
    curve, random = wall_curve(np.arange(100, 1900)), np.random.default_rng(5)
    u = np.full((2048, 1), np.nan)
    u[100:1900, 0] = random.uniform(0, 2448, 1800)
    right = slice(100, 300)
    u[right, 0] = curve.position[:200] + random.normal(0, 0.1, 200)
    _, errors = errors_of(line_of(u, 0.05), curve)
    assert errors.valid_rows > 1400
    # each stray peak is within 2 px of the line by a chance of 4 in 2448
    assert 200 <= errors.measured_rows <= 200 + 12
    left_out = 1.0 - errors.measured_rows / errors.u.count
    assert errors.u.outlier_rate == pytest.approx(left_out), "what completeness leaves out is told as outliers"
    assert errors.depth_z.outlier_rate == pytest.approx(left_out, abs=2 / 1800)


def test_a_laser_without_light_draws_no_line_to_be_found():
    curve = wall_curve(np.arange(100, 1900))
    dark = dataclasses.replace(curve, irradiance=np.zeros(1800))
    u = np.full((2048, 1), np.nan)
    u[100:1900, 0] = curve.position
    _, errors = errors_of(line_of(u, 0.05), dark)
    assert (errors.truth_rows, errors.measured_rows, errors.false_rows) == (0, 0, 1800)
    assert math.isnan(errors.completeness) and errors.u.count == 0


def test_a_line_along_the_other_axis_is_refused_in_words():
    curve = dataclasses.replace(wall_curve(np.arange(100, 1900)), axis="columns")
    with pytest.raises(InputError, match=r"extraction\.axis.*found rows.*columns"):
        errors_of(line_of(np.full((2048, 1), np.nan), 0.05), curve)


@pytest.mark.parametrize("stage", ["points", "errors"])
def test_a_point_that_is_no_number_is_named_with_its_stage(stage: str):
    curve = wall_curve(np.arange(100, 1900))
    u = np.full((2048, 1), np.nan)
    u[100:1900, 0] = curve.position
    line, vertices = line_of(u, 0.05), WALL.copy()
    if stage == "points":
        line.u[500, 0] = np.nan
    else:
        curve.depth_z[500] = np.inf
    with pytest.raises(InputError, match=f"stage '{stage}'"):
        errors_of(line, curve, vertices)


def test_each_crossing_is_matched_once_and_to_the_nearest():
    true_index = np.array([3, 5, 5, 5, 9], dtype=np.int32)
    true_position = np.array([10.0, 100.0, 200.0, 300.0, 50.0])
    index = np.array([5, 5, 5, 5, 3, 4, 9])
    position = np.array([201.0, 199.5, 90.0, np.nan, 10.5, 10.0, 1000.0])
    # 199.5 takes 200, which leaves 300 to 201: nearer to it than 100, which 90 takes
    assert match(index, position, true_index, true_position).tolist() == [3, 2, 1, -1, 0, -1, 4]


def test_matching_equals_trying_every_pair_in_order_of_distance():
    random = np.random.default_rng(11)
    for _ in range(20):
        true_index = np.sort(random.integers(0, 6, 12)).astype(np.int32)
        true_position, index, position = random.random(12), random.integers(0, 6, 10), random.random(10)
        wanted, taken = [-1] * 10, set()
        pairs = [(abs(position[p] - true_position[c]), p, c) for p, c in itertools.product(range(10), range(12))]
        for _, p, c in sorted(pairs):
            if index[p] == true_index[c] and wanted[p] < 0 and c not in taken:
                wanted[p] = c
                taken.add(c)
        assert match(index, position, true_index, true_position).tolist() == wanted


def test_nothing_measured_gives_nan_and_no_warning():
    curve = wall_curve(np.arange(100, 200))
    with np.errstate(all="raise"):
        points, errors = errors_of(line_of(np.full((2048, 3), np.nan), 0.1), curve)
    assert len(points.flag) == errors.u.count == errors.valid_rows == 0
    assert errors.completeness == 0.0
    assert math.isnan(errors.depth_z.rmse)


def test_nothing_visible_gives_only_false_rows():
    u = np.full((2048, 1), np.nan)
    u[10:20, 0] = 1200.0
    _, errors = errors_of(line_of(u, 0.1), wall_curve(np.arange(0)), np.zeros((0, 3)), np.zeros((0, 3), np.int32))
    assert errors.false_rows == errors.valid_rows == 10
    assert math.isnan(errors.completeness)
    assert errors.surface.count == errors.u.count == 0


def test_two_neighbours_at_an_edge_do_not_correlate_the_rest():
    error = np.random.default_rng(4).standard_normal(1000)
    error[500:502] = 35.0
    index, nobody = np.arange(1000), np.zeros(1000, dtype=int)
    found = measure(error, np.ones(1000), np.inf, index, nobody)
    assert abs(found.autocorrelation) < 4 / math.sqrt(1000)


def test_the_sigma_of_a_mean_knows_of_neighbours_that_err_together():
    """Of all that is in its spread: with the correlation of the rest alone it was told a quarter too small."""
    random, index, told, means = np.random.default_rng(6), np.arange(200), [], []
    for _ in range(500):
        error = random.standard_normal(200)
        error[100:102] += 100.0 * random.standard_normal()
        (mean, sigma), *_ = error_statistics(error, index, 1.0)
        told.append(sigma)
        means.append(mean)
    assert np.sqrt(np.mean(np.square(told))) > 0.9 * np.std(means)


def test_smoothed_errors_show_in_the_autocorrelation():
    random = np.random.default_rng(8)
    smooth = np.convolve(random.standard_normal(4100), np.ones(5) / 5, mode="valid")
    rows = np.arange(len(smooth))
    found = measure(smooth, np.full(len(smooth), np.nan), 100.0, rows, np.zeros_like(rows))
    assert found.autocorrelation == pytest.approx(0.8, abs=0.04)  # 4 of 5 samples shared
    assert math.isnan(found.coverage)


def box(size: float) -> tuple[np.ndarray, np.ndarray]:
    corners = np.array(list(itertools.product((-size, size), repeat=3)))
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return corners, np.array([t for q in quads for t in ((q[0], q[1], q[2]), (q[0], q[2], q[3]))], dtype=np.int32)


@pytest.fixture(params=["few points", "many points"])
def either_tree(request, monkeypatch):
    """Distances by the tree that few points are measured with, and by that for many."""
    monkeypatch.setattr(distance, "FEW", 50_000 if request.param == "few points" else 0)
    distance._forget(None)


@pytest.mark.usefixtures("either_tree")
@pytest.mark.parametrize("reversed_winding", [False, True])
def test_distance_to_a_box_is_right_and_signed_at_faces_edges_and_corners(reversed_winding):
    vertices, triangles = box(0.5)
    if reversed_winding:
        triangles = triangles[:, ::-1].copy()
    vertices = vertices + 100.0  # far from the origin, where float32 is 8 um coarse
    camera = np.array([103.0, 102.0, 104.0])
    random = np.random.default_rng(2)
    p = random.uniform(-0.6, 0.6, (4000, 3))
    p[:, 0] = np.abs(p[:, 0])  # the sides that the camera sees
    outside = np.maximum(np.abs(p) - 0.5, 0.0)
    wanted = np.linalg.norm(outside, axis=1) + np.minimum(np.max(np.abs(p) - 0.5, axis=1), 0.0)
    seen = (p[:, 1] > -0.49) & (p[:, 2] > -0.49)
    found, nearest = signed_distance(p + 100.0, vertices, triangles, camera)
    wrong = np.abs(found[seen] - wanted[seen])
    # exact but where two faces are as near to float32, which may then take the other: by at most its resolution
    assert np.max(wrong) < np.finfo(np.float32).eps
    assert np.percentile(wrong, 99) < 1e-13
    assert (nearest >= 0).all()


@pytest.mark.usefixtures("either_tree")
def test_the_tree_of_a_mesh_is_built_once_and_goes_with_it():
    vertices, triangles = box(0.5)
    points, camera = np.array([[0.0, 0.0, 0.6]]), np.array([0.0, 0.0, 3.0])
    assert signed_distance(points, vertices, triangles, camera)[0] == pytest.approx(0.1)
    built = last_tree()
    signed_distance(points, vertices, triangles, camera)
    assert built is not None and last_tree() is built
    # another mesh, also of the same size, is another tree
    assert signed_distance(points, vertices - [0.0, 0.0, 0.2], triangles, camera)[0] == pytest.approx(0.3)
    assert last_tree() is None  # what was measured just now is gone already


def last_tree():
    return distance._Locator.last or distance._Raycasting.last


def test_a_line_of_sight_through_an_edge_slips_between_no_two_facets():
    random = np.random.default_rng(5)
    turn = np.linalg.qr(random.standard_normal((3, 3)))[0]
    vertices, camera = WALL @ turn.T, np.array([0.3, -0.2, -0.4]) @ turn.T
    share = random.uniform(0.01, 0.99, (2000, 1))
    on_edge = (1 - share) * vertices[0] + share * vertices[2]  # the diagonal that both facets share
    points = camera + 1.1 * (on_edge - camera)
    found, _ = signed_distance(points, vertices, WALL_TRIANGLES, camera)
    assert np.all(found < 0.0)


@pytest.mark.usefixtures("either_tree")
def test_distance_off_a_tilted_sheet_keeps_its_sign_within_a_nanometre():
    # an open mesh, a metre away, and points a nanometre off it
    random = np.random.default_rng(6)
    rotation = np.linalg.qr(random.standard_normal((3, 3)))[0]
    vertices = WALL @ rotation.T + [0.3, -0.2, 0.1]
    camera = np.array([0.3, -0.2, 0.1])
    local = np.stack([random.uniform(-0.3, 0.3, 500), random.uniform(-0.3, 0.3, 500), np.full(500, DEPTH)], axis=1)
    off = random.uniform(-1e-9, 1e-9, 500)
    towards_camera = -rotation[:, 2]
    points = local @ rotation.T + camera + off[:, None] * towards_camera
    found, _ = signed_distance(points, vertices, WALL_TRIANGLES, camera)
    assert np.max(np.abs(found - off)) < 1e-14


def test_distance_to_a_triangle_is_that_of_a_fine_search():
    random = np.random.default_rng(9)
    corners, points = random.standard_normal((30, 3, 3)), 2 * random.standard_normal((30, 3))
    corners[0, 2] = corners[0, 1]  # degenerate to an edge
    corners[1, 1] = corners[1, 2] = corners[1, 0]  # and to a point
    steps = np.linspace(0, 1, 801)
    a, b = (grid.ravel() for grid in np.meshgrid(steps, steps))
    weights = np.stack([a, b, 1 - a - b], axis=1)[a + b <= 1.0 + 1e-12]
    found = point_triangle_distance(points, corners)
    for k in range(30):
        searched = np.min(np.linalg.norm(weights @ corners[k] - points[k], axis=1))
        assert searched - 1e-4 < found[k] <= searched + 1e-12
    assert found[1] == pytest.approx(np.linalg.norm(points[1] - corners[1, 0]))


@pytest.mark.usefixtures("either_tree")
def test_points_on_a_sphere_of_facets_lie_off_it_by_at_most_the_sagitta():
    n, radius = 128, 0.05
    theta, phi = np.meshgrid(np.linspace(0, np.pi, n // 2 + 1), np.linspace(0, 2 * np.pi, n + 1), indexing="ij")
    unit = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)
    vertices = radius * unit.reshape(-1, 3)
    i = (np.arange(n // 2)[:, None] * (n + 1) + np.arange(n)).ravel()
    triangles = np.concatenate([np.stack([i, i + n + 1, i + n + 2], 1), np.stack([i, i + n + 2, i + 1], 1)]).astype(
        np.int32
    )
    random = np.random.default_rng(4)
    direction = random.standard_normal((2000, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    direction[:, 2] = -np.abs(direction[:, 2]) - 0.3
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    found, _ = signed_distance(radius * direction, vertices, triangles, np.array([0.0, 0.0, -1.0]))
    sagitta = 2 * radius * (1 - math.cos(math.pi / n))
    assert found.min() > -1e-12
    assert found.max() < sagitta
