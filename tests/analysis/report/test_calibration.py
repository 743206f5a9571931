"""The report's section on the calibration: its map is what points tell, and its table stands beside the truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.report.calibration import FoundCalibration, MotionFound, depth_map, motion_rows, parameter_rows, sentence
from analysis.report.write import render_page
from tests.analysis.report.test_report import make_report, make_scene

pytestmark = pytest.mark.usefixtures("quick_reports")

DEPTHS = np.array([0.4, 0.6])


def found(scene, turned: float = 0.0, covariance: np.ndarray | None = None) -> FoundCalibration:
    plane = scene.laser_plane(0).copy()
    plane[3] *= 1.0 + turned
    return FoundCalibration(scene.camera, (plane,), (covariance,))


def test_a_plane_that_is_farther_away_makes_all_depth_greater_by_its_share() -> None:
    scene = make_scene()
    one = depth_map(found(scene, 1e-3), scene, 0, DEPTHS)
    assert one is not None
    here = np.isfinite(one.off)
    assert here.sum() > 20 and not np.isfinite(one.sigma).any()
    pinhole = scene.camera
    u, v = np.meshgrid(
        np.linspace(0, pinhole.width - 1, one.off.shape[1]), np.linspace(0, pinhole.height - 1, 64).round()
    )
    q, _ = pinhole.normalise(np.column_stack([u.ravel(), v.ravel()]))
    plane = scene.laser_plane(0)
    depth = (-plane[3] / (np.column_stack([q, np.ones(len(q))]) @ plane[:3])).reshape(u.shape)
    np.testing.assert_allclose(one.off[here], 1e-3 * depth[here], rtol=1e-6)
    assert "tells nothing" in sentence(one)
    assert depth_map(found(scene), scene, 0, np.zeros(0)) is None


def test_the_map_holds_the_sigma_that_points_have() -> None:
    scene = make_scene()
    spread = np.diag([0.0] * 7 + [1e-6]) ** 2  # of the plane's distance alone
    one = depth_map(found(scene, 0.0, spread), scene, 0, DEPTHS)
    assert one is not None
    here = np.isfinite(one.sigma)
    other = depth_map(found(scene, 1e-3), scene, 0, DEPTHS)
    assert other is not None
    both = here & np.isfinite(other.off)
    expected = np.abs(other.off[both]) / (1e-3 * abs(scene.laser_plane(0)[3])) * 1e-6
    np.testing.assert_allclose(one.sigma[both], expected, rtol=1e-3)
    assert "were told" in sentence(one)


def test_the_table_stands_beside_the_scene() -> None:
    scene = make_scene()
    rows = parameter_rows(found(scene, 1e-3, np.diag([0.1] * 4 + [1e-4] * 3 + [1e-4]) ** 2), scene, 0)
    by_name = {row[0]: row for row in rows}
    assert by_name["fx px"][1] == by_name["fx px"][3] and by_name["fx px"][4] == "+0.0"
    off = -scene.laser_plane(0)[3] * 1e-3 / 1e-4
    assert float(by_name["distance mm"][4]) == pytest.approx(off, abs=0.06)


def test_the_page_has_the_section_where_points_were_made_with_a_calibration() -> None:
    report = make_report()
    assert "The calibration</h2>" not in render_page(report)
    page = render_page(replace(report, calibration=found(report.scene, 1e-3)))
    assert "The calibration</h2>" in page and "Depth error by the calibration" in page
    assert "by the motion that the calibration found" not in page


def test_the_page_has_the_motion_that_was_found_beside_the_scene_s() -> None:
    report, axis = make_report(), np.array([0.0, 0.6, 0.8])
    point, sigma = np.array([0.1, 0.03, 0.5]), np.array([1e-4] * 3 + [1e-5] * 3)
    moved = MotionFound("turntable", np.append(axis, point + np.array([2e-5, 0.0, 0.0])), sigma, np.append(axis, point))
    rows = {row[0]: row[1:] for row in motion_rows(moved)}
    assert rows["point x mm"] == ["100.02", "0.01", "100", "+2.0"] and rows["axis y"][3] == "+0.0"
    page = render_page(replace(report, calibration=replace(found(report.scene, 1e-3), motion=moved)))
    assert "by the motion that the calibration found" in page and "100.02" in page
