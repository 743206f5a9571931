"""Residuals view by view, and what the window draws of a calibration: against truth and closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.calibration.board import Board
from analysis.calibration.calibrate import Calibrated, Request, calibrate
from analysis.calibration.motion import Motion, Told
from analysis.calibration.next_pose import Advice
from analysis.calibration.observations import View
from analysis.calibration.virtual import noisy
from render.base.errors import InputError
from studio.calibration.drawings import (
    advised_pose,
    arrow_scale,
    covered,
    dark_squares,
    depth_map,
    outline,
    seen_at,
)
from studio.calibration.material import Material
from studio.calibration.view_residuals import residuals, view_rows
from tests.analysis.calibration.boards import SIZE, target, truth, views_of

BOARD = Board("checkerboard", 13, 9, 0.025)
MIDDLE = np.array([0.15, 0.1, 0.0])
"""Of the board, m from its first corner: those of the tests begin at its middle."""
VIEWS = 8
THERE = truth(3, VIEWS + 1, tilt=(15.0, 35.0))
EXACT = views_of(THERE, laser_step=64)


@pytest.fixture(scope="module")
def found() -> Calibrated:
    """Of all views but the last."""
    drawn = noisy(EXACT[:VIEWS], np.random.default_rng(3))
    return calibrate(drawn, target(), Request(SIZE, 1, 0))


class TestResiduals:
    def test_of_a_view_that_counts_they_are_those_of_the_adjustment(self, found: Calibrated) -> None:
        seen, whitened = found.adjusted.seen, found.adjusted.solution.corner_residual
        for number, view in enumerate(noisy(EXACT[:VIEWS], np.random.default_rng(3))):
            own = residuals(view, found, target())
            at = seen.view == number
            assert own.off == pytest.approx(np.linalg.solve(seen.whitening[at], whitened[at][:, :, None])[:, :, 0])
            assert own.part == "used" and own.rotation == pytest.approx(found.estimate.rotation[number])

    def test_of_a_carried_board_counted_from_its_other_end_they_are_as_small(self) -> None:
        group = np.concatenate([np.zeros(4), 1 + np.arange(4)]).astype(np.intp)
        given = np.array([0.0, 0.02, -0.03, 0.04, 0.0, 0.0, 0.0, 0.0])
        there = truth(3, VIEWS, tilt=(15.0, 35.0))
        there = replace(there, motion=Motion("stage", group, given, np.array([0.3, 0.9, 0.31]), np.eye(3)[1]))
        exact = views_of(there.moved(np.zeros(len(there.shared)), np.zeros((5, 6))), laser_step=64)
        exact[2] = replace(exact[2], target=-exact[2].target)
        told = Told("stage", {f"view {i}": ("", given[i]) for i in range(4)})
        drawn = noisy(exact, np.random.default_rng(4))
        result = calibrate(drawn, target(), Request(SIZE, 1, 0, told=told))
        for view in drawn:
            own = residuals(view, result, target())
            # 0.05 px along each coordinate
            assert own.part == "used" and 0.05 < own.rms < 0.09

    def test_of_a_view_that_does_not_its_pose_alone_is_fitted(self, found: Calibrated) -> None:
        own = residuals(EXACT[VIEWS], found, target())
        assert own.part == "left out"
        # without noise of its own: what the calibration is off, far below the 0.05 px of one corner
        assert own.rms < 0.03
        assert own.translation == pytest.approx(THERE.translation[VIEWS], abs=2e-4)
        assert np.all(own.laser_off[:, 1] == 0.0) and np.abs(own.laser_off[:, 0]).max() < 0.1

    def test_a_corner_that_was_moved_is_off_by_as_much(self, found: Calibrated) -> None:
        view = EXACT[VIEWS]
        pixel = view.pixel.copy()
        pixel[40] += [3.0, -2.0]
        own = residuals(replace(view, pixel=pixel), found, target())
        # the pose follows by its share of one corner among 117: 6 of 234 coordinates
        assert own.off[40] == pytest.approx([-3.0, 2.0], abs=0.2)

    def test_the_list_tells_what_was_said_of_each(self, found: Calibrated) -> None:
        rows = view_rows(EXACT, ["view 2"], ["view 1: 3 corners in glare dropped"], found, target())
        parts = [row.part for row, _ in rows]
        assert parts == ["used", "used", "dropped", *(5 * ["used"]), "left out"]
        assert rows[1][0].remarks == ("3 corners in glare dropped",) and rows[0][0].remarks == ()


class TestDrawings:
    def test_a_point_is_seen_where_the_camera_has_it_and_not_behind(self, found: Calibrated) -> None:
        points = np.array([[0.0, 0.0, 1.0], [0.1, -0.1, 2.0], [0.1, 0.0, -1.0]])
        pixel = seen_at(points, THERE)
        assert pixel[:2] == pytest.approx(np.array([[1223.5, 1023.5], [1223.5 + 173.913, 1023.5 - 173.913]]), abs=1e-3)
        assert np.isnan(pixel[2]).all()

    def test_dark_squares_meet_at_the_corners_and_alternate(self) -> None:
        rotation, translation = THERE.rotation[0], THERE.translation[0] - THERE.rotation[0] @ MIDDLE
        squares = dark_squares(BOARD, THERE, rotation, translation)
        assert squares.shape == (14 * 10 // 2, 4, 2)
        ends = squares.reshape(-1, 2)
        for corner in EXACT[0].pixel:  # at an inner corner two dark squares touch
            assert np.count_nonzero(np.linalg.norm(ends - corner, axis=1) < 1e-6) == 2
        edge = outline(BOARD, THERE, rotation, translation)
        assert np.all(edge[0] == edge[-1]) and edge[0] == pytest.approx(squares[0, 0])
        assert edge[24] == pytest.approx(squares[-1, 2]), "half way around, at the last square"

    def test_the_advised_pose_puts_the_middle_where_it_is_advised(self) -> None:
        rotation, centre = THERE.rotation[1], np.array([0.02, -0.01, 0.8])
        turn, shift = advised_pose(Advice(rotation, centre, 1.0, 0.5), BOARD)
        assert turn @ MIDDLE + shift == pytest.approx(centre)

    @pytest.mark.parametrize(("typical", "scale"), [(0.05, 1000.0), (0.02, 2000.0), (30.0, 2.0), (0.0, 1.0)])
    def test_arrows_have_a_round_scale(self, typical: float, scale: float) -> None:
        off = np.full((10, 2), typical / np.sqrt(2.0))
        assert arrow_scale(off, 2448) == pytest.approx(scale)

    def test_coverage_counts_corners_by_tenths(self) -> None:
        pixel = np.array([[0.0, 0.0], [SIZE[0] - 1.0, 0.0], [SIZE[0] - 1.0, SIZE[1] - 1.0], [SIZE[0] - 2.0, 2.0]])
        counts = covered([View("", pixel, np.zeros((4, 2, 2)), pixel)], SIZE)
        assert counts[0, 0] == 1 and counts[0, 9] == 2 and counts[9, 9] == 1 and counts.sum() == 4

    def test_the_map_has_the_depth_error_where_it_was_worked_out(self, found: Calibrated) -> None:
        one = found.depth[0]
        shown = depth_map(one, found.estimate)
        rows, columns = shown.sigma.shape
        across = (one.volume.pixel[:, 1] - found.estimate.intrinsics[3]) / found.estimate.intrinsics[1]
        x = (across * one.volume.depth - shown.across[0]) / (shown.across[1] - shown.across[0]) * (columns - 1)
        z = (one.volume.depth - shown.depth[0]) / (shown.depth[1] - shown.depth[0]) * (rows - 1)
        told = shown.sigma[np.rint(z).astype(int), np.rint(x).astype(int)]
        inside = np.isfinite(told)
        # half a cell of the map away it changes by less than a hundredth
        assert inside.mean() > 0.8 and told[inside] == pytest.approx(one.systematic[inside], rel=0.01)


class TestMaterial:
    def test_what_is_there_already_is_told_and_the_rest_joins(self) -> None:
        first = Material(tuple(EXACT[:3]), SIZE, 1)
        again = replace(EXACT[1], name="other name")
        both = first.joined(Material((EXACT[2], again, EXACT[4]), SIZE, 1, ("x.png: damaged",)))
        assert [view.name for view in both.views] == ["view 0", "view 1", "view 2", "view 4"]
        assert len(both.errors) == 3 and both.errors[0] == "x.png: damaged"

    def test_images_of_another_size_do_not_join(self) -> None:
        with pytest.raises(InputError, match="another size") as told:
            Material(tuple(EXACT[:3]), SIZE, 1).joined(Material((EXACT[4],), (640, 512), 1))
        assert "2448 x 2048" in str(told.value) and "640 x 512" in str(told.value)
