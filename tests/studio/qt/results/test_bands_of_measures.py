"""The bands of a measure in the profile: moved where the measure is seen, and in nobody's way elsewhere."""

from __future__ import annotations

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from studio.qt.results.results_panel import PART, REGION, ResultsPanel
from tests.studio.qt.results.test_part_tab import drag, panel, with_a_step

__all__ = ["panel"]
ERRORS = 0


@pytest.mark.parametrize("tab", [ERRORS, REGION])
def test_a_drag_from_a_band_whose_measure_is_not_seen_chooses_a_region(
    panel: ResultsPanel, tab: int, qtbot: QtBot
) -> None:
    gauge = with_a_step(panel.session)
    panel.figures.setCurrentIndex(PART)
    panel.part.table.selectRow(0)
    panel.figures.setCurrentIndex(tab)
    a_pixel = panel.profile.plot.vb.viewPixelSize()[0]
    drag(qtbot, panel.profile, 150.0 + 2.0 * a_pixel, 50.0)
    assert panel.session.project.measures == (gauge,)
    region = panel.region.region
    assert region is not None and panel.figures.currentIndex() == REGION
    assert [region.low, region.high] == pytest.approx([0.05, 0.15], abs=6e-3 * a_pixel)


def test_a_drag_of_its_edge_moves_a_measures_band_where_its_table_is_in_front(
    panel: ResultsPanel, qtbot: QtBot
) -> None:
    with_a_step(panel.session)
    panel.figures.setCurrentIndex(REGION)
    panel.part.table.selectRow(0)
    panel.figures.setCurrentIndex(PART)
    drag(qtbot, panel.profile, 150.0, 200.0)
    a_pixel = 1e-3 * panel.profile.plot.vb.viewPixelSize()[0]
    assert np.abs(np.array(panel.session.project.measures[0].regions[1]) - (0.2, 0.25)).max() < 6.0 * a_pixel
    assert panel.region.region is None
