"""The tabs of a study's charts."""

from __future__ import annotations

from tests.studio.qt.study.desk import Desk


def test_names_of_charts_without_room_scroll_and_keep_their_words(desk: Desk) -> None:
    """ "Too little li…" stood there."""
    names = ["How fast and how exact", "Too little light", "Noise and speckle", "A shiny groove"]
    tabs = desk.charts.tabs
    desk.charts._show_tabs(names)
    tabs.resize(200, tabs.height())
    for i, name in enumerate(names):
        assert tabs.tabText(i) == name
        assert tabs.tabRect(i).width() >= tabs.fontMetrics().horizontalAdvance(name)
    assert tabs.minimumSizeHint().width() <= 200
