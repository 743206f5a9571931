"""Points laid onto a nominal surface: known motions come back, freedoms that nothing tells stay, verdicts by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.stats

from analysis.deviation import (
    ABOVE,
    BELOW,
    UNDECIDED,
    WITHIN,
    best_fit,
    callouts,
    deviations,
    three_two_one,
    turn_and_shift,
    unsure_of_place,
    verdict_of,
    verdicts,
)
from render.base.errors import InputError
from render.base.pose import Pose, transform_points
from render.mesh.primitives import primitive_mesh
from render.scene.shape import Box, Plane

SIDES = np.array([0.08, 0.05, 0.03])
ABOVE_ALL = np.array([0.3, 0.2, 1.0])
MOTION = Pose(translation=(0.0011, -0.0007, 0.0004), rotation=(0.01, -0.014, 0.008)).matrix


def box() -> tuple[np.ndarray, np.ndarray]:
    made = primitive_mesh(Box(size_x=SIDES[0], size_y=SIDES[1], size_z=SIDES[2]))
    return made.vertices, made.triangles.astype(np.int64)


def on_three_faces(count: int, seed: int) -> np.ndarray:
    """Points of the three faces that a camera at (+, +, +) sees."""
    rng = np.random.default_rng(seed)
    places = rng.uniform(-0.5, 0.5, (count, 3)) * SIDES * 0.95
    face = rng.integers(0, 3, count)
    places[np.arange(count), face] = 0.5 * SIDES[face]
    return places


def test_the_best_fit_undoes_a_known_motion() -> None:
    vertices, triangles = box()
    nominal = on_three_faces(4000, 1)
    moved = transform_points(np.linalg.inv(MOTION), nominal)
    found = best_fit(moved, vertices, triangles)
    assert found.held == 6 and found.used == 4000
    assert np.abs(found.motion - MOTION).max() < 1e-9
    value = deviations(moved, np.broadcast_to(ABOVE_ALL, moved.shape), vertices, triangles, found).value
    assert np.abs(value).max() < 1e-9


def test_noise_moves_the_best_fit_by_what_its_covariance_says() -> None:
    """Sigma of the six freedoms from J^T J of the points, over 60 draws: mean squared Mahalanobis length 6."""
    vertices, triangles = box()
    nominal, sigma, rng = on_three_faces(600, 2), 2e-5, np.random.default_rng(3)
    normal = np.eye(3)[np.argmax(nominal / SIDES, axis=1)]
    jacobian = np.hstack([np.cross(nominal, normal), normal])
    lengths = []
    for _ in range(60):
        noisy = nominal + sigma * rng.standard_normal((600, 1)) * normal
        motion = best_fit(noisy, vertices, triangles).motion
        turn = 0.5 * (motion - motion.T)[[2, 0, 1], [1, 2, 0]]
        twist = np.concatenate([turn, motion[:3, 3]])
        lengths.append(float(twist @ (jacobian.T @ jacobian) @ twist) / sigma**2)
    # chi-square of 6 freedoms has a variance of 12
    assert np.mean(lengths) == pytest.approx(6.0, abs=4.0 * np.sqrt(12.0 / 60))


def test_a_dent_is_told_and_does_not_draw_the_fit() -> None:
    vertices, triangles = box()
    points = on_three_faces(6000, 4)
    dent = (points[:, 2] == 0.5 * SIDES[2]) & (np.linalg.norm(points[:, :2] - [0.01, 0.005], axis=1) < 0.006)
    points[dent, 2] -= 2e-4
    points += 1e-6 * np.random.default_rng(5).standard_normal(points.shape)
    found = best_fit(points, vertices, triangles)
    assert found.used <= len(points) - np.count_nonzero(dent)
    value = deviations(points, np.broadcast_to(ABOVE_ALL, points.shape), vertices, triangles, found).value
    assert value[dent].mean() == pytest.approx(-2e-4, abs=2e-6)
    place, depth = callouts(points, value, 3, 0.01)[0]
    assert dent[place] and depth == pytest.approx(-2e-4, abs=2e-6)


def test_what_a_plane_does_not_tell_stays() -> None:
    made = primitive_mesh(Plane(width=0.2, height=0.2))
    rng = np.random.default_rng(6)
    points = np.column_stack([rng.uniform(-0.05, 0.05, (500, 2)), np.full(500, 3e-4)])
    found = best_fit(points, made.vertices, made.triangles.astype(np.int64))
    assert found.held == 3
    shift, turn = turn_and_shift(found.motion, points)
    assert np.allclose(shift, [0.0, 0.0, -3e-4], atol=1e-9) and turn == pytest.approx(0.0, abs=1e-7)


def test_three_two_one_holds_six_spots_and_nothing_else() -> None:
    vertices, triangles = box()
    points = transform_points(np.linalg.inv(MOTION), on_three_faces(40_000, 7))
    x, y, z = 0.5 * SIDES
    spots = [(-0.02, -0.01, z), (0.02, -0.01, z), (0.0, 0.015, z), (-0.02, y, 0.0), (0.02, y, 0.0), (x, 0.0, 0.0)]
    found = three_two_one(points, vertices, triangles, spots, 0.004)
    assert np.abs(found.motion - MOTION).max() < 1e-9
    # a bend of the face between the spots is not spread over it, as a best fit would
    bent = on_three_faces(40_000, 8)
    far = (bent[:, 2] == z) & (bent[:, 0] > 0.03)
    bent[far, 2] += 1e-3
    kept = three_two_one(bent, vertices, triangles, spots, 0.004)
    assert np.abs(kept.motion - np.eye(4)).max() < 1e-9


@pytest.mark.parametrize("case", ["five", "nobody there", "free"])
def test_spots_that_hold_nothing_are_refused(case: str) -> None:
    vertices, triangles = box()
    points = on_three_faces(5000, 9)
    x, y, z = 0.5 * SIDES
    spots = [(-0.02, -0.01, z), (0.02, -0.01, z), (0.0, 0.015, z), (-0.02, y, 0.0), (0.02, y, 0.0), (x, 0.0, 0.0)]
    if case == "nobody there":
        spots[5] = (-x, 0.0, 0.0)
    if case == "free":
        spots[5] = (0.03, y, 0.0)
    with pytest.raises(InputError, match={"five": "six", "nobody there": "tertiary", "free": "free to move"}[case]):
        three_two_one(points, vertices, triangles, spots[:5] if case == "five" else spots, 0.004)


def test_each_point_is_seen_from_its_own_place() -> None:
    """A sheet has two sides: the sign is that of the camera that saw the point."""
    made = primitive_mesh(Plane(width=0.2, height=0.2))
    points = np.array([[0.01, 0.0, 1e-4], [0.01, 0.0, 1e-4]])
    eyes = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    value = deviations(points, eyes, made.vertices, made.triangles.astype(np.int64)).value
    assert np.allclose(value, [1e-4, -1e-4])


def test_a_tolerance_is_proved_by_twice_the_sigma() -> None:
    for value, wanted in ((0.0, WITHIN), (0.9, UNDECIDED), (1.1, UNDECIDED), (1.3, ABOVE), (-1.3, BELOW)):
        found = verdicts(np.zeros((1, 3)), np.array([value]), np.array([0.1]), -1.0, 1.0)
        assert found.tolist() == [wanted]
        unknown = verdicts(np.zeros((1, 3)), np.array([value]), np.array([np.nan]), -1.0, 1.0)
        assert unknown.tolist() == [UNDECIDED], "what has no sigma proves nothing"
    found = np.array([WITHIN, UNDECIDED, ABOVE, BELOW], dtype=np.int8)
    assert verdict_of(found[:1]) == "pass"
    assert verdict_of(found[:2]) == "undecided"
    assert verdict_of(found[:3]) == verdict_of(found[[0, 3]]) == "fail"


def test_noise_alone_puts_no_perfect_part_out_and_a_dent_does() -> None:
    """Of 2,500 points with two sigmas each ten were beyond a tolerance of one sigma, and a perfect part was out."""
    random = np.random.default_rng(11)
    grid = np.stack(np.meshgrid(np.arange(50.0), np.arange(50.0)), axis=-1).reshape(-1, 2)
    points, sigma, out = np.column_stack([grid, np.zeros(2500)]), np.ones(2500), {0.0: 0, 1.0: 0}
    dent = (np.abs(points[:, 0] - 25.0) <= 1.0) & (np.abs(points[:, 1] - 25.0) <= 1.0)
    for _ in range(300):
        noise = random.standard_normal(2500)
        for limit in out:  # all of the part at its very limit, and a sigma within
            out[limit] += verdict_of(verdicts(points, noise, sigma, -math.inf, limit)) == "fail"
        deep = verdicts(points, noise - 8.0 * dent, sigma, -1.0, 1.0)
        assert verdict_of(deep) == "fail" and np.all(dent[deep == BELOW])
    # a single point is found beyond two of its sigmas in 2.3 % of cases; the neighbours' median makes it rarer
    most = scipy.stats.binom.ppf(0.999, 300, scipy.stats.norm.sf(2.0))
    assert out[0.0] <= most and out[1.0] == 0


def profiles(count: int = 5, rows: int = 21, pitch: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Points on a plane, as of profiles side by side, and their scan lines."""
    profile, row = (one.ravel() for one in np.meshgrid(np.arange(count), np.arange(rows), indexing="ij"))
    return np.column_stack([pitch * row, pitch * profile, 0.0 * row]), 1000 * profile + row


def test_points_beside_an_edge_put_no_part_out_and_a_dent_does() -> None:
    """A part against itself failed by points in the air beside its edges, which scan lines of both sides make."""
    points, scan_line = profiles()
    value, sigma, depth = np.zeros(len(points)), np.full(len(points), 1e-3), np.full(len(points), 1e-3)
    edge = points[:, 0] == 10.0
    points[points[:, 0] > 10.0, 2] = -5.0
    points[edge, 2] -= 0.5
    value[edge] = -0.5
    unsure = unsure_of_place(points, value, scan_line, sigma, depth)
    assert unsure[edge].all() and not unsure[(points[:, 0] > 11.5) & (points[:, 0] < 19.5)].any()
    assert verdict_of(verdicts(points, value, sigma, -0.1, 0.1)) == "fail"
    assert verdict_of(verdicts(points, value, sigma, -0.1, 0.1, unsure)) == "undecided"
    dent = (points[:, 0] >= 4.0) & (points[:, 0] <= 6.0)
    points[dent, 2] -= 0.3
    value[dent] = -0.3
    unsure = unsure_of_place(points, value, scan_line, sigma, depth)
    found = verdicts(points, value, sigma, -0.1, 0.1, unsure)
    assert verdict_of(found) == "fail" and np.array_equal(found == BELOW, dent)


def test_a_wall_along_which_points_err_is_not_measured_by_them() -> None:
    points, scan_line = profiles()
    value, depth = np.full(len(points), 0.5), np.full(len(points), 1e-2)
    inner = (points[:, 0] > 0.5) & (points[:, 0] < 19.5)
    assert unsure_of_place(points, value, scan_line, 0.02 * depth, depth).all()
    assert not unsure_of_place(points, value, scan_line, 0.5 * depth, depth)[inner].any()
    unknown = np.full(len(points), np.nan)
    assert not unsure_of_place(points, value, scan_line, unknown, unknown)[inner].any(), "of former files"


def test_a_stray_point_puts_no_part_out_and_keeps_it_from_passing() -> None:
    grid = np.stack(np.meshgrid(np.arange(20.0), np.arange(20.0)), axis=-1).reshape(-1, 2)
    points, value = np.column_stack([grid, np.zeros(400)]), np.zeros(400)
    value[210] = 50.0
    found = verdicts(points, value, np.full(400, 0.1), -1.0, 1.0)
    assert found[210] == UNDECIDED and verdict_of(found) == "undecided"


def test_stray_points_beside_each_other_put_no_part_out_and_a_dent_of_three_points_does() -> None:
    """Three of 7,000 points, up to 360 mm over the last step of a scan of a part against itself, were its failure."""
    points, scan_line = profiles()
    height = np.random.default_rng(3).uniform(50.0, 400.0, 12)
    stray = np.column_stack([np.arange(4.0, 16.0), np.full(12, 5.0), height])
    every = np.concatenate([points, stray])
    lines = np.append(scan_line, 5004 + np.arange(12))
    value, sigma = np.append(np.zeros(len(points)), height), np.full(len(every), 1e-2)
    unsure = unsure_of_place(every, value, lines, sigma, sigma)
    assert not unsure[len(points) :].all(), "of some even their profile tells no edge"
    found = verdicts(every, value, sigma, -0.1, 0.1, unsure)
    assert verdict_of(found) == "undecided" and np.all(found[len(points) :] == UNDECIDED)
    dent = np.flatnonzero((np.abs(every[:, 0] - 10.0) <= 1.0) & (every[:, 1] == 2.0))
    every[dent, 2] = value[dent] = -0.3
    found = verdicts(every, value, sigma, -0.1, 0.1, unsure_of_place(every, value, lines, sigma, sigma))
    assert verdict_of(found) == "fail" and np.isin(np.flatnonzero(found == BELOW), dent).all()
