"""Faults of the program end in a dialog that says what to do, and in the log; never in a crash."""

from __future__ import annotations

import sys
import threading
import traceback
from collections.abc import Callable
from types import TracebackType

from PySide6.QtCore import QMessageLogContext, QObject, Qt, QtMsgType, Signal, qInstallMessageHandler
from PySide6.QtWidgets import QMessageBox, QWidget

from studio.qt.core.dialogs import show_trouble
from studio.qt.core.session import Session
from studio.runtime.error_messages import trouble

HARMLESS = ("propagateSizeHints", "QXcbConnection: XCB error")
"""Qt says these about some window managers; a person can do nothing about them."""


class Faults(QObject):
    """Receives what no one caught, on any thread; tells it on the window's."""

    caught = Signal(object)

    def __init__(self, window: QWidget, session: Session) -> None:
        super().__init__(window)
        self.window, self.session = window, session
        self.dialog: QMessageBox | None = None
        self.caught.connect(self.tell, Qt.ConnectionType.QueuedConnection)

    def tell(self, error: BaseException) -> None:
        """One dialog at a time; further faults go to the log alone, so that a loop of them buries no one."""
        what = trouble(error, "finish what was asked")
        self.session.message.emit("error", f"{what.title}. {what.cause}\n{what.details}".strip())
        if self.dialog is None:
            self.dialog = show_trouble(self.window, what)
            self.dialog.finished.connect(self._closed)

    def _closed(self) -> None:
        self.dialog = None


def catch_faults(window: QWidget, session: Session) -> Faults:
    """From now on no fault ends the program."""
    faults = Faults(window, session)

    def hook(kind: type[BaseException], error: BaseException, where: TracebackType | None) -> None:
        if issubclass(kind, KeyboardInterrupt):
            sys.__excepthook__(kind, error, where)
            return
        traceback.print_exception(kind, error, where)
        faults.caught.emit(error)

    def thread_hook(given: threading.ExceptHookArgs) -> None:
        if given.exc_value is not None and not issubclass(given.exc_type, SystemExit):
            hook(given.exc_type, given.exc_value, given.exc_traceback)

    sys.excepthook = hook
    threading.excepthook = thread_hook
    qInstallMessageHandler(_log_of(session))
    return faults


def _log_of(session: Session) -> Callable[[QtMsgType, QMessageLogContext, str], None]:
    def log(kind: QtMsgType, context: QMessageLogContext, text: str) -> None:
        if kind == QtMsgType.QtDebugMsg or any(part in text for part in HARMLESS):
            return
        print(f"Qt: {text}", file=sys.stderr)

    return log
