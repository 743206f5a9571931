"""Qt calls do not use up Python's constants."""

from __future__ import annotations

import sys

import pytest
from PySide6.QtWidgets import QLabel
from pytestqt.qtbot import QtBot

import studio.qt  # noqa: F401  keeps them alive


@pytest.mark.skipif(sys.version_info >= (3, 12), reason="Python's constants cannot die")
def test_a_hundred_thousand_calls_leave_none_and_true_alive(qtbot: QtBot) -> None:
    label = QLabel()
    qtbot.addWidget(label)
    for _ in range(50_000):
        label.setText("a")
        label.isEnabled()
    for constant in (None, True, False):
        assert sys.getrefcount(constant) > 1 << 39
