"""The status bar: messages, tips of commands and the progress of work, none over another."""

from __future__ import annotations

from threading import Event

from PySide6.QtGui import QStatusTipEvent
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from render.base.threads import Cancel
from studio.qt.shell.window import MainWindow
from studio.runtime.jobs import Progress


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


def test_a_refusal_goes_with_the_next_value_that_is_taken(window: MainWindow) -> None:
    """It stood there for twenty seconds beside a power that had been accepted."""
    window.session.message.emit("warning", "Power: must be at most 10 000 000 mW. The value is as it was")
    assert "as it was" in window.status.text.text()
    window.session.set(("scene", "rig", "lasers", 0, "power"), 0.003, "change power")
    assert not window.status.text.text()
    window.session.message.emit("warning", "A frame is being rendered.")
    window.session.set(("scene", "rig", "lasers", 0, "power"), 0.004, "change power")
    assert window.status.text.text() == "A frame is being rendered."


def test_a_tip_goes_when_another_workspace_comes(window: MainWindow) -> None:
    """The mouse rests on the toolbar's Measure, and F12 brings Study."""
    show_tip(window, "Measure")
    assert window.status.text.text() == "Measure"
    window.commands["study"].trigger()
    assert window.status.text.text() != "Measure"


def test_the_buttons_stay_where_they_are_while_texts_come_and_go(window: MainWindow, qtbot: QtBot) -> None:
    """Who aimed at Cancel hit Pause."""
    status, go, done = window.status, Event(), Event()

    def work(progress: Progress, cancelled: Cancel) -> None:
        progress("plan", 0.0)
        go.wait(60)
        # so little that the time left is still told where the window is drawn once a second
        progress("reflected light of the laser, frame 3 of 8", 0.1)
        done.wait(60)

    window.runner.run("render", "render", work)
    qtbot.waitUntil(status.cancel.isVisible)
    before = status.pause.pos(), status.cancel.pos()
    go.set()
    qtbot.waitUntil(lambda: "frame 3" in status.work.text() and status.left.text() != "")
    qtbot.wait(20)
    assert (status.pause.pos(), status.cancel.pos()) == before
    done.set()
    qtbot.waitUntil(lambda: not status.bar.isVisible())
