"""The height map in the window: the picture, the cell under the mouse and the profile are those of the map itself."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from PySide6.QtCore import QPointF
from pytestqt.qtbot import QtBot

from analysis.height_map import along, height_map, within
from analysis.report.units import count
from render.scene.motion import LinearStage
from studio.project.document import Document, replaced
from studio.qt.core.jobs import JobRunner
from studio.qt.core.render import Render
from studio.qt.core.scan_steps import scan_steps
from studio.qt.core.session import Session
from studio.qt.results.height_map_tab import NOTHING, HeightMapTab, line_sentence
from studio.scan.height_map import file_range, read_points, steep_record, steep_sentence
from studio.scan.options import ScanOptions
from studio.scan.scan import run_scan
from studio.scan.scan_folder import open_folder
from tests.studio.qt.small_session import small_project as one_frame
from tests.studio.qt.small_session import small_render
from tests.studio.scan_of_steps import SCALE, small_project


@pytest.fixture(scope="module")
def scanned(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Three steps across the line."""
    folder = tmp_path_factory.mktemp("across")
    file = folder / "project" / "steps.json"
    stage = LinearStage(step=(0.004, 0.0, 0.0), steps=3)
    project = replaced(small_project(), ("scene", "motion"), stage).save(file)
    run_scan(project, file.parent, out=folder / "scan", options=ScanOptions(image_scale=SCALE, report=False))
    return file, folder / "scan"


@pytest.fixture
def session(scanned: tuple[Path, Path], qtbot: QtBot) -> Iterator[Session]:
    found = open_folder(scanned[1])
    made = Session(Document(found.project, scanned[0]))
    steps = scan_steps(made)
    steps.show(found)
    qtbot.waitUntil(lambda: made.shown is not None)
    yield made
    steps.close()


@pytest.fixture
def tab(session: Session, qtbot: QtBot) -> Iterator[HeightMapTab]:
    runner = JobRunner()
    made = HeightMapTab(session, runner)
    qtbot.addWidget(made)
    made.resize(420, 700)
    made.show()
    qtbot.waitUntil(lambda: made.made is not None)
    yield made
    runner.close()


def test_it_is_the_map_of_the_scans_points(tab: HeightMapTab, scanned: tuple[Path, Path], qtbot: QtBot) -> None:
    made = tab.made
    assert made is not None
    # with the errors, of which the limits are
    points = read_points(scanned[1] / "points.ply")
    limits = file_range(points)
    assert limits is not None
    expected = within(height_map(points), limits)
    np.testing.assert_array_equal(made.heights, expected.heights)
    rows, columns = made.heights.shape
    assert tab.view.item.size == (columns, rows) and f"{columns} x {rows} cells" in tab.told.text()
    assert f"{made.sigma_cells / made.sigma_points:.2f} of a point's" in tab.told.text()
    low, high = tab.bar.limits
    # the colours go as far as the file does: a legend beyond that told of heights which there are not
    kept = made.heights[np.isfinite(made.heights)]
    assert limits[0] <= kept.min() and kept.max() <= limits[1]
    assert (low, high) == pytest.approx((1e3 * kept.min(), 1e3 * kept.max()))
    assert f"from {1e3 * np.nanmin(made.heights):.4g} to {1e3 * np.nanmax(made.heights):.4g} mm" in tab.told.text()
    assert (steep_sentence(steep_record(made)) in tab.told.text()) and bool(made.steep) == ("walls" in tab.told.text())
    # another width of the cells
    tab.pitch.setValue(2e3 * made.pitch)
    qtbot.waitUntil(lambda: tab.made is not made)
    assert tab.made is not None and tab.made.pitch == pytest.approx(2.0 * made.pitch)


def test_cells_and_points_without_a_height_are_told_apart() -> None:
    """ "95 cells have no height; 1943 points lie in cells without one" read as if the 95 held them all."""
    record = {"cells": 95, "points": 30, "cells_not_measured": 2034, "points_without_height": 31}
    assert steep_sentence(record) == (
        "95 cells have no height, at walls and jumps, where none is the height of a place: 30 points lie in them. "
        "2\u00a0034 other cells were not measured, over holes or outside of the scanned area. "
        "1 point there and beside walls has none."
    ).replace("\u00a0", count(1000)[1])
    one = {"cells": 0, "points": 0, "cells_not_measured": 1, "points_without_height": 0}
    assert steep_sentence(one) == "1 cell was not measured, over holes or outside of the scanned area."
    assert steep_sentence(one | {"cells_not_measured": 0}) == ""


def test_the_mouse_reads_a_cell_and_the_line_its_profile(tab: HeightMapTab) -> None:
    made = tab.made
    assert made is not None
    row, column = (int(one[0]) for one in np.nonzero(np.isfinite(made.heights)))
    tab._moved((tab.view.box.mapViewToScene(QPointF(column, row)),))
    assert f"z {1e3 * made.heights[row, column]:.4f} mm" in tab.read.text()
    assert f"x {1e3 * (made.x + column * made.pitch):.3f} mm" in tab.read.text()
    row, column = (int(one[0]) for one in np.nonzero(np.isnan(made.heights)))
    tab._moved((tab.view.box.mapViewToScene(QPointF(column, row)),))
    assert "no surface" in tab.read.text()
    rows, columns = made.heights.shape
    ends = (0.0, 0.0), (columns - 1.0, rows - 1.0)
    for handle, end in zip(tab.line.getHandles(), ends, strict=True):
        tab.line.movePoint(handle, end, coords="parent")
    distance, height = along(made, *ends)
    x, z = tab.profile.getData()
    np.testing.assert_allclose(x, 1e3 * distance)
    np.testing.assert_allclose(z, 1e3 * height)
    assert height[0] == pytest.approx(made.heights[0, 0], nan_ok=True)
    assert distance[-1] == pytest.approx(made.pitch * np.hypot(columns - 1, rows - 1))


def test_in_little_room_nothing_lies_over_the_profile_and_its_axes_can_be_read(tab: HeightMapTab, qtbot: QtBot) -> None:
    """The text below was printed over "Along the line / mm", and heights had one number and no name."""
    tab.resize(400, 200)
    qtbot.waitUntil(lambda: tab.height() == tab.minimumSizeHint().height())
    qtbot.wait(50)
    assert tab.split.geometry().bottom() < tab.read.geometry().top()
    assert tab.read.geometry().bottom() < tab.told.geometry().top()
    assert tab.told.height() >= tab.told.heightForWidth(tab.told.width())
    assert tab.graph.height() <= tab.split.sizes()[1] and tab.plot.getAxis("left").label.isVisible()


def test_a_difference_of_heights_says_between_which_places_it_is(tab: HeightMapTab) -> None:
    """Heights 72 mm apart were told as those of the ends of a line of 120 mm."""
    distance = np.linspace(0.0, 0.12, 121)
    height = 0.001 - 0.01 * distance
    assert line_sentence(distance, height) == "Line of 120.000 mm, its ends differ by -1.2000 mm"
    height[:30] = height[103:] = height[60] = np.nan
    told = "Line of 120.000 mm, its first and last height, 72.000 mm apart, differ by -0.7200 mm"
    assert line_sentence(distance, height) == told
    height[:102] = np.nan
    assert line_sentence(distance, height) == "Line of 120.000 mm"
    # the tab says the same of its own line
    made = tab.made
    assert made is not None
    heights = np.full_like(made.heights, np.nan)
    tab.made = replace(made, heights=heights)
    tab._show_profile()
    assert "differ" not in tab.read.text()
    columns = heights.shape[1]
    heights[:, columns // 3 : columns // 2] = 0.01
    tab._show_profile()
    assert "its first and last height, " in tab.read.text() and "ends" not in tab.read.text()


def test_what_it_writes_reads_back_as_what_it_shows(
    tab: HeightMapTab, scanned: tuple[Path, Path], tmp_path: Path
) -> None:
    made, file = tab.made, tmp_path / "map.tif"
    assert made is not None
    tab.write(file)
    beside = json.loads(file.with_suffix(".json").read_text())
    numbers = cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
    heights = np.where(numbers > 0, beside["offset"] + beside["scale"] * numbers.astype(float), np.nan)
    limits = file_range(read_points(scanned[1] / "points.ply"))
    assert limits is not None
    np.testing.assert_allclose(heights, made.heights, atol=0.5001 * beside["scale"], rtol=0.0)
    whole = tab.whole
    assert whole is not None
    beyond = (whole.heights < limits[0]) | (whole.heights > limits[1])
    assert beside["left_out"]["cells"] == np.count_nonzero(beyond)
    tab.all_heights.click()
    made = tab.made
    assert made is whole
    tab.write(file)
    beside = json.loads(file.with_suffix(".json").read_text())
    numbers = cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
    heights = np.where(numbers > 0, beside["offset"] + beside["scale"] * numbers.astype(float), np.nan)
    np.testing.assert_allclose(heights, made.heights, atol=0.5001 * beside["scale"], rtol=0.0)
    assert beside["left_out"]["cells"] == 0


def test_what_a_file_leaves_out_is_told(tab: HeightMapTab, tmp_path: Path) -> None:
    """One stray cell 600 mm below took ten times the levels from all others."""
    made = tab.made
    assert made is not None and tab._file_range is not None
    told: list[tuple[str, str]] = []
    tab.session.message.connect(lambda kind, text: told.append((kind, text)))
    heights = np.clip(made.heights, *tab._file_range)
    tab._take(replace(made, heights=heights))
    tab.write(tmp_path / "clean.png")
    row, column = (int(one[0]) for one in np.nonzero(np.isfinite(heights)))
    heights = heights.copy()
    heights[row, column] = -0.6
    tab._take(replace(made, heights=heights))
    assert "1 cell is left out" in tab.told.text() and "heights go from -600 to" in tab.told.text()
    tab.write(tmp_path / "stray.png")
    clean, stray = (json.loads((tmp_path / f"{name}.json").read_text()) for name in ("clean", "stray"))
    assert stray["scale"] == pytest.approx(clean["scale"], rel=0.01) and stray["valid"] == clean["valid"] - 1
    assert stray["left_out"]["cells"] == 1 and stray["left_out"]["all_from"] == -0.6
    assert told[0][0] == "info" and told[1][0] == "warning"
    assert "1 cell is left out" in told[1][1] and "from -600 to" in told[1][1]


def test_a_single_frame_has_none_and_is_told_so(tab: HeightMapTab) -> None:
    world, frame = small_render()
    tab.session.add_render(Render(2, one_frame(), world, frame))
    assert tab.made is None and tab.told.text() == NOTHING and not tab.export.isEnabled()
