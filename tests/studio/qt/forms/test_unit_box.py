"""Numbers beside the project take units and sums as its own fields do, and lose nothing without a word."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel, QLineEdit, QVBoxLayout, QWidget
from pytestqt.qtbot import QtBot

from studio.editing.units import Unit
from studio.qt.forms.unit_box import UnitBox

Asked = tuple[UnitBox, QLineEdit, list[str]]


@pytest.fixture
def asked(qtbot: QtBot) -> Iterator[Asked]:
    """A box in um from -1e5, "none", to 1e5, a field beside it, and what it tells."""
    held, box, other, told = QWidget(), UnitBox(Unit.named("µm"), -1e5, 1e5, 1), QLineEdit(), []
    box.setSpecialValueText("none")
    box.setValue(20.0)
    box.refused.connect(told.append)
    column = QVBoxLayout(held)
    column.addWidget(box)
    column.addWidget(other)
    qtbot.addWidget(held)
    held.show()
    with qtbot.waitActive(held):
        held.activateWindow()
    box.setFocus()
    box.selectAll()
    yield box, other, told


@pytest.mark.parametrize(
    ("typed", "value", "shown"),
    [
        ("1 mm", 1000.0, "1000.0 µm"),
        ("0.5mm", 500.0, "500.0 µm"),
        ("25 um", 25.0, "25.0 µm"),
        ("150+25", 175.0, "175.0 µm"),
        ("1,5", 1.5, "1.5 µm"),
        ("0.1 in", 2540.0, "2540.0 µm"),
        ("none", -1e5, "none"),
    ],
)
@pytest.mark.parametrize("key", [Qt.Key.Key_Tab, Qt.Key.Key_Return])
def test_units_and_sums_are_understood(
    asked: Asked, qtbot: QtBot, key: Qt.Key, typed: str, value: float, shown: str
) -> None:
    box, _, told = asked
    qtbot.keyClicks(box.lineEdit(), typed)
    qtbot.keyClick(box.lineEdit(), key)
    assert box.value() == pytest.approx(value) and box.text() == shown and not told


@pytest.mark.parametrize(
    ("typed", "why"), [("1 mW", "unit does not fit"), ("abc", "not a number"), ("1 m", "at most 100000 µm")]
)
def test_what_will_not_do_is_told_by_return_and_by_tab(asked: Asked, qtbot: QtBot, typed: str, why: str) -> None:
    box, other, told = asked
    qtbot.keyClicks(box.lineEdit(), typed)
    qtbot.keyClick(box.lineEdit(), Qt.Key.Key_Return)
    assert why in told[0] and typed in box.text(), "it stays, to be mended"
    qtbot.keyClick(box.lineEdit(), Qt.Key.Key_Tab)
    assert other.hasFocus() and why in told[1] and "as it was" in told[1]
    assert box.value() == 20.0 and box.text() == "20.0 µm"


def test_arrows_step_what_has_been_typed(asked: Asked, qtbot: QtBot) -> None:
    box, _, _ = asked
    qtbot.keyClicks(box.lineEdit(), "1 mm")
    qtbot.keyClick(box.lineEdit(), Qt.Key.Key_Up)
    assert box.value() == 1001.0


def test_a_word_in_place_of_a_number_has_the_unit_beside_it(asked: Asked, qtbot: QtBot) -> None:
    """Half a millimetre was typed into an empty field, and was half a micrometre."""
    box, _, _ = asked
    (unit,) = box.lineEdit().findChildren(QLabel)
    assert not unit.isVisible()
    box.setValue(box.minimum())
    qtbot.waitUntil(unit.isVisible)
    assert box.text() == "none" and unit.text() == "µm"
    assert unit.geometry().right() < box.lineEdit().width()
    box.setFixedWidth(60)
    qtbot.waitUntil(lambda: not unit.isVisible())
