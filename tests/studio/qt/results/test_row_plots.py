"""The charts along the line leave no point out, however far off it is."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import QPointF
from pytestqt.qtbot import QtBot

from studio.qt.results.results_histogram import ErrorHistogram
from studio.qt.results.results_rows import RowPlots
from studio.qt.results.results_steps import StepsPlot
from studio.scan.result_series import ERROR_VIEWS, ErrorView, Series

ROWS = np.arange(500.0)
BAD = {100: -334_000.0, 400: 210.0}
"""µm, by row."""


@pytest.fixture
def plots(qtbot: QtBot) -> RowPlots:
    error = np.random.default_rng(3).normal(0.0, 15.0, len(ROWS))
    for row, wrong in BAD.items():
        error[row] = wrong
    made = RowPlots()
    qtbot.addWidget(made)
    flat = np.zeros(len(ROWS))
    made.show_series("rows", None, {"likelihood": (Series(ROWS, flat, flat, flat, flat), error)}, ERROR_VIEWS[0])
    return made


def test_points_beyond_the_axis_are_crosses_at_its_ends(plots: RowPlots) -> None:
    dots, crosses = (item for plot, item in plots._drawn if plot is plots.error)
    assert len(dots.data) == len(ROWS) - len(BAD)
    x, y = crosses.getData()
    assert dict(zip(x, y, strict=True)) == {100: -plots.limit, 400: plots.limit}
    low, high = plots.error.vb.viewRange()[1]
    assert low < -plots.limit and plots.limit < high < 100.0


def test_errors_of_most_points_are_no_flat_line_beside_wrong_peaks(qtbot: QtBot, plots: RowPlots) -> None:
    """The axis went to 5000 mm for a few wrong peaks, and errors of 10 um lay on its zero."""
    error = np.random.default_rng(4).normal(0.0, 10.0, len(ROWS))
    error[::12] = 4e6
    flat = np.zeros(len(ROWS))
    plots.show_series("rows", None, {"likelihood": (Series(ROWS, flat, flat, flat, flat), error)}, ERROR_VIEWS[0])
    assert 20.0 < plots.limit < 100.0
    crosses = plots._drawn[-1][1] if plots._drawn[-1][0] is plots.error else plots._drawn[-2][1]
    assert len(crosses.getData()[0]) >= len(error[::12])


def test_large_errors_are_drawn_in_mm(qtbot: QtBot) -> None:
    """The axis had 500k beside a table in mm, and the colours of the points +500000 µm."""
    plots, histogram, steps = RowPlots(), ErrorHistogram(), StepsPlot()
    for widget in (plots, histogram, steps):
        qtbot.addWidget(widget)
    depth, position, flat = ERROR_VIEWS[0], ERROR_VIEWS[2], np.zeros(len(ROWS))
    series, error = Series(ROWS, flat, flat, flat, flat), np.full(len(ROWS), 500_000.0)

    def show(view: ErrorView, size: float) -> tuple[list[str], list[float]]:
        plots.show_series("rows", None, {"likelihood": (series, size * error)}, view)
        histogram.show_errors({"likelihood": size * error}, view)
        histogram.mark(size * error[0])
        steps.show_steps("likelihood", size * error, size * error, view)
        axes = plots.error.getAxis("left"), histogram.plot.getAxis("bottom"), steps.plot.getAxis("left")
        return [axis.labelText for axis in axes], [plots.limit, histogram.cursor.value(), steps.rmse.getData()[1][0]]

    assert show(depth, 1.0) == (["Error / mm", "Depth error / mm", "Depth error / mm"], [500.0] * 3)
    assert show(depth, 0.01) == (["Error / µm", "Depth error / µm", "Depth error / µm"], [5000.0] * 3)
    assert all(text.endswith("px") for text in show(position, 1.0)[0])


def groove() -> Series:
    return Series(ROWS, 1200.0 + np.abs(ROWS - 250.0), 850.0 - 0.08 * np.abs(ROWS - 250.0), ROWS, ROWS)


def test_a_stray_point_leaves_the_line_as_high_as_the_charts_and_is_told(plots: RowPlots) -> None:
    """One dot of noise stretched the axis to 2500 px, on which a groove was flat."""
    true, seen = groove(), groove()
    seen.position[:2], seen.depth[:2] = (2450.0, 30.0), (np.nan, 675.0)
    plots.show_series("rows", true, {"likelihood": (seen, np.zeros(len(ROWS)))}, ERROR_VIEWS[0])
    (low, high), (near, far) = (plot.vb.viewRange()[1] for plot in (plots.position, plots.depth))
    assert 1100.0 < low < 1200.0 and 1450.0 < high < 1550.0 and 820.0 < near < 830.0 and 850.0 < far < 860.0
    assert [note.text for note in plots.outside] == ["2 points outside", "1 point outside"]
    for plot in plots.plots:  # as by a double click
        plot.enableAutoRange()
        plot.vb.updateAutoRange()
    assert plots.position.vb.viewRange()[1][1] > 2450.0 and [note.text for note in plots.outside] == ["", ""]


def test_charts_are_not_zoomed_beyond_the_rows_of_the_image(plots: RowPlots) -> None:
    plots.count = len(ROWS)
    plots.show_series("rows", groove(), {}, ERROR_VIEWS[0])
    plots.error.vb.scaleBy((10.0, 1.0))
    low, high = plots.error.vb.viewRange()[0]
    assert (low, high) == (-0.5, len(ROWS) - 0.5)


def test_the_ring_of_such_a_row_is_about_its_cross(plots: RowPlots) -> None:
    plots.mark(100)
    assert plots.rings[-1].getData()[1].tolist() == [-plots.limit]


def test_large_errors_have_room_for_their_sign(plots: RowPlots) -> None:
    axis = plots.error.getAxis("left")
    assert axis.tickStrings([-200_000.0, 0.0, 200_000.0], 1.0, 200_000.0) == ["-200k", "0", "200k"]
    assert axis.tickStrings([-50.0, 0.0, 50.0], 1.0, 50.0) == ["-50", "0", "50"]


def test_beside_the_rows_of_the_image_nothing_is_pointed_at(plots: RowPlots, qtbot: QtBot) -> None:
    plots.resize(600, 500)
    plots.show()
    qtbot.waitExposed(plots)
    plots.count = len(ROWS)
    pointed: list[int | None] = []
    plots.hovered.connect(pointed.append)
    ((_, error),) = plots._shown.values()
    dot = float(error[250])
    for row in (-20.0, 250.0, 510.0):
        plots.error.setXRange(-60.0, 560.0, padding=0.0)
        plots._move(plots.error.vb.mapViewToScene(QPointF(row, dot)))
    assert pointed == [None, 250, None]


def test_a_click_on_a_dot_is_of_its_row_though_others_lie_in_the_same_pixel(plots: RowPlots, qtbot: QtBot) -> None:
    """With four rows to a pixel a click on the outlier chose a good point beside it."""
    plots.resize(200, 400)
    plots.show()
    qtbot.waitExposed(plots)
    plots.count = len(ROWS)
    qtbot.waitUntil(lambda: plots.error.vb.width() > 50)
    a_row = 1.0 / plots.error.vb.viewPixelSize()[0]
    assert a_row < 0.5
    for row, value in ((400, plots.limit), (100, -plots.limit)):
        for aside in (-3.0, 0.0, 3.0):
            place = plots.error.vb.mapViewToScene(QPointF(row, value))
            assert plots.scan_line_at(place + QPointF(aside, 0.0)) == row
    # where no dot is near it is the row beneath the mouse
    flat = np.zeros(len(ROWS))
    two = {"likelihood": (Series(ROWS, flat, flat, flat, flat), np.where(ROWS % 2.0 == 0.0, 5.0, -5.0))}
    plots.show_series("rows", None, two, ERROR_VIEWS[0])
    found = plots.scan_line_at(plots.error.vb.mapViewToScene(QPointF(250.0, 0.0)))
    assert found is not None and abs(found - 250) * a_row < 1.0
