"""A box about points of a whole scan: its figures are those of all steps."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from studio.project.document import Document
from studio.project.project import Project
from studio.qt.core.scan_steps import scan_steps
from studio.qt.core.session import Session
from studio.qt.results.results_panel import ResultsPanel
from studio.scan.region import Box, scan_table
from studio.scan.result_series import ERROR_VIEWS
from studio.scan.scan_folder import open_folder
from tests.studio.scan_of_steps import small_scan


@pytest.fixture(scope="module")
def scanned(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    return small_scan(tmp_path_factory.mktemp("steps"))


@pytest.fixture
def panel(scanned: tuple[Path, Path], qtbot: QtBot) -> Iterator[ResultsPanel]:
    file, folder = scanned
    session = Session(Document(Project.load(file), file))
    made = ResultsPanel(session)
    qtbot.addWidget(made)
    made.resize(1366, 420)
    made.show()
    steps = scan_steps(session)
    steps.show(open_folder(folder))
    qtbot.waitUntil(lambda: session.shown is not None)
    yield made
    steps.close()


def test_its_figures_are_of_all_steps(panel: ResultsPanel, tmp_path: Path) -> None:
    shown = panel.session.shown
    assert shown is not None and shown.scan is not None and panel.scan_bar.whole is shown.scan
    points = shown.scan.points
    low, high = (np.percentile(points["x"], share) for share in (20.0, 80.0))
    box = Box(low=(low, -np.inf, -np.inf), high=(high, np.inf, np.inf))
    here = (points["x"] >= low) & (points["x"] <= high)
    assert len(np.unique(points["step"][here])) > 1
    panel.choose(box)
    view = ERROR_VIEWS[0]
    shown_texts = [panel.region.table.item(row, 0).text() for row in range(panel.region.table.rowCount())]
    assert shown_texts == [texts[0] for _, texts in scan_table(box, points, 0, view)]
    assert int(shown_texts[0]) == np.count_nonzero(here)
    error = points["error_depth"][here]
    rmse = np.sqrt(np.nanmean(error**2)) * view.scale
    assert float(shown_texts[2].split(" ± ")[0]) == pytest.approx(rmse, rel=0.02)
    panel.region.write(tmp_path / "box.csv")
    with open(tmp_path / "box.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    # its figures can be had from it again
    assert len(rows) == np.count_nonzero(here) and {"u_px", "error_surface_m"} <= rows[0].keys()
    written = np.array([float(row["error_depth_m"] or "nan") for row in rows])
    np.testing.assert_allclose(written, error, rtol=1e-9)
    assert "keeps the points of one method" in panel.region.title.text()


def test_figures_of_a_sample_say_of_which(panel: ResultsPanel) -> None:
    shown = panel.session.shown
    assert shown is not None and shown.scan is not None
    names = [
        scan_table(Box(low=(-9.0,) * 3, high=(9.0,) * 3), shown.scan.points, 0, ERROR_VIEWS[0], one_in)[0][0]
        for one_in in (1, shown.scan.one_in, 4)
    ]
    assert names == ["Points", "Points", "Points, one in 4"]


def test_a_box_beside_the_part_holds_nothing(panel: ResultsPanel) -> None:
    panel.choose(Box(low=(5.0, 5.0, 5.0), high=(6.0, 6.0, 6.0)))
    assert [panel.region.table.item(row, 0).text() for row in (0, 1)] == ["0", "-"]
