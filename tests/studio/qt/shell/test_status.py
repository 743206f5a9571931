"""The status bar: messages, tips of commands and the progress of work, none over another."""

from __future__ import annotations

from threading import Event

from PySide6.QtGui import QStatusTipEvent
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from studio.qt.shell.window import MainWindow


def show_tip(window: MainWindow, text: str) -> None:
    """As Qt tells a command that the mouse is over; empty when it leaves."""
    QApplication.sendEvent(window, QStatusTipEvent(text))


def test_a_tip_stands_beside_the_progress_and_a_message_comes_back_after_it(window: MainWindow, qtbot: QtBot) -> None:
    status, done = window.status, Event()
    window.runner.run("render", "render", lambda progress, cancelled: progress("light", 0.4) or done.wait(60))
    qtbot.waitUntil(status.bar.isVisible)
    window.session.message.emit("info", "Saved.")
    show_tip(window, "Render the frame")
    assert status.bar.isVisible() and status.work.isVisible()
    assert status.text.text() == "Render the frame"
    show_tip(window, "")
    assert status.text.text() == "Saved."
    done.set()
    qtbot.waitUntil(lambda: not status.bar.isVisible())


def test_what_is_said_after_a_tip_is_read_and_no_tip_hides_a_warning(window: MainWindow) -> None:
    """The mouse rests on the command that was just clicked."""
    show_tip(window, "Render the frame")
    window.session.message.emit("warning", "A frame is being rendered.")
    assert window.status.text.text() == "A frame is being rendered."
    show_tip(window, "Pause")
    assert window.status.text.text() == "A frame is being rendered."
    window.session.message.emit("info", "Saved.")
    show_tip(window, "Pause")
    assert window.status.text.text() == "Pause"
