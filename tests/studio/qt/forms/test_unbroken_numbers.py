"""Numbers with thousands stay whole where a text is broken into lines."""

from __future__ import annotations

from PySide6.QtGui import QFont, QTextLayout
from pytestqt.qtbot import QtBot

from studio.editing.units import Unit


def test_no_line_breaks_inside_a_number(qtbot: QtBot) -> None:
    """In a narrow panel "Of 1" stood over "633 points": Qt breaks lines at a thin space that is not a no-break one."""
    layout = QTextLayout(f"Of {Unit.of('m').with_unit(1.131)}", QFont())
    layout.beginLayout()
    first = layout.createLine()
    first.setNumColumns(len("Of 1") + 1)
    layout.endLayout()
    assert first.textLength() == len("Of ")
