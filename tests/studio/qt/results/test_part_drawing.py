"""Every kind of measure is drawn in the profile once it is chosen."""

from __future__ import annotations

import pytest
from pytestqt.qtbot import QtBot

from analysis.gauges.gauge import REGIONS, Gauge, Kind
from studio.qt.results.results_panel import PART
from tests.studio.qt.small_session import measured_results

GROUND, ARC, BESIDE = (-0.25, -0.15), (-0.03, 0.03), (0.15, 0.25)
"""m, across the profile of the sphere on its ground."""
PLACES = {1: (ARC,), 2: (GROUND, BESIDE), 3: (GROUND, ARC, BESIDE)}
READ = ("step", "angle", "opening", "radius", "straightness", "point_to_point", "flush", "thickness")
"""Kinds that the places above suit."""


@pytest.mark.parametrize("kind", REGIONS)
def test_a_measure_of_any_kind_is_drawn_with_its_regions(kind: Kind, qtbot: QtBot) -> None:
    panel = measured_results(qtbot)
    session = panel.session
    panel.figures.setCurrentIndex(PART)
    regions = PLACES[len(REGIONS[kind])]
    session.set(("measures",), (Gauge(name="one", kind=kind, regions=regions),))
    panel.part.table.selectRow(0)
    (reading,) = panel.part.readings
    assert "by maximum likelihood, as Extraction says" in panel.part.told.text()
    assert not (kind in READ and reading.reason)
    spans = panel.part.drawing.spans
    assert [span.isVisible() for span in spans] == [True] * len(regions)
    assert len(panel.part.drawing.texts) == (0 if reading.reason else 1)
