"""The figures of a line show the line, whatever a stray point does."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from analysis.report import line_figures
from analysis.report.frame_result import LaserResult
from analysis.report.line_figures import _band, on_line, profile_figure, three_panel_figure
from tests.analysis.report.test_report import extraction, make_frames

FAR_PX = 40.0


def with_strays(count: int) -> tuple[LaserResult, Any]:
    """The first points of a line with 0.1 px of noise are far beside it."""
    scene, frames = make_frames()
    curve = frames[0].lasers[0].curve
    noise = 0.1 * np.random.default_rng(6).standard_normal(len(curve.index))
    noise[:count] = FAR_PX
    laser = LaserResult(curve, (extraction(scene, curve, 0, "likelihood", noise),), frames[0].lasers[0].image)
    return laser, scene.T_camera_laser(0)


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures are returned as they are drawn, in place of their pictures."""
    monkeypatch.setattr(line_figures, "png_uri", lambda made: [(axes.get_xlim(), axes.texts) for axes in made.axes])


@pytest.mark.parametrize("strays", [0, 1, 3])
@pytest.mark.usefixtures("drawn")
def test_strays_take_no_room_from_the_line_and_are_counted(strays: int) -> None:
    """Four strays of 824 points left the part a speck in the corner of its profile."""
    laser, pose = with_strays(strays)
    told = [] if strays == 0 else ["1 point outside" if strays == 1 else f"{strays} points outside"]
    position: Any = three_panel_figure(laser)[0]
    (low, high), texts = position
    assert low < laser.curve.position.min() and high > laser.curve.position.max()
    assert high - low < np.ptp(laser.curve.position) + 2.0 and [one.get_text() for one in texts] == told
    profile: Any = profile_figure(laser, pose)[0]
    assert [one.get_text() for one in profile[1]] == told


def test_where_no_line_is_true_all_that_is_measured_is_shown() -> None:
    laser, _ = with_strays(2)
    (found,) = laser.extractions
    assert np.count_nonzero(~on_line(found)) == 2
    found.errors.position[:] = np.nan
    assert np.array_equal(on_line(found), found.points.valid)


def test_the_band_of_sigma_ends_where_the_points_do() -> None:
    at, half = _band(np.array([3.0, 1.0, 2.0, 40.0, 4.0, 41.0]), np.array([0.3, 0.1, 0.2, 9.0, 0.4, 9.1]))
    np.testing.assert_array_equal(at, [1.0, 2.0, 3.0, 4.0, np.nan, 40.0, 41.0])
    np.testing.assert_array_equal(half, [0.1, 0.2, 0.3, 0.4, np.nan, 9.0, 9.1])
    assert _band(np.zeros(0), np.zeros(0))[0].size == 0
