"""A quiet word in the status bar that the program crashed last time: to look at, to copy, to put away."""

from __future__ import annotations

import platform

from PySide6.QtCore import qVersion
from PySide6.QtWidgets import QApplication, QHBoxLayout, QLabel, QWidget

from studio.qt.core.icons import icon
from studio.qt.forms.fields import tool_button
from studio.qt.shell.window import MainWindow
from studio.runtime.fault_log import Fault
from studio.runtime.version import version


class FaultNotice(QWidget):
    """Waits until it is answered, and holds up nothing."""

    def __init__(self, fault: Fault, window: MainWindow) -> None:
        super().__init__()
        self.fault, self.window_above = fault, window
        self.label = QLabel("The program crashed last time")
        self.label.setObjectName("warning")
        self.label.setToolTip(f"At {fault.when}. Where each of its threads was is kept, for a report.")
        self.show_button = tool_button("Show", "Show it among the messages")
        self.copy_button = tool_button("Copy", "Copy it, for a report")
        self.close_button = tool_button("", "Put it away")
        self.close_button.setIcon(icon("cancel"))
        self.show_button.clicked.connect(self.show_fault)
        self.copy_button.clicked.connect(self.copy)
        self.close_button.clicked.connect(self.put_away)
        line = QHBoxLayout(self)
        line.setContentsMargins(0, 0, 0, 0)
        line.setSpacing(2)
        for widget in (self.label, self.show_button, self.copy_button, self.close_button):
            line.addWidget(widget)

    def text(self) -> str:
        """What a report needs."""
        on = f"Blazer Studio {version()}, Python {platform.python_version()}, Qt {qVersion()}, {platform.platform()}"
        return f"The program crashed at {self.fault.when}\n{on}\n{self.fault.text}".strip()

    def show_fault(self) -> None:
        self.window_above.session.message.emit("warning", self.text())
        self.window_above.show_panel("log")
        self.put_away()

    def copy(self) -> None:
        QApplication.clipboard().setText(self.text())
        self.window_above.session.message.emit("info", "Copied: please report it")
        self.put_away()

    def put_away(self) -> None:
        self.hide()
        self.deleteLater()


def offer(window: MainWindow, fault: Fault) -> FaultNotice:
    """At the end of the window's status bar."""
    notice = FaultNotice(fault, window)
    window.status.addPermanentWidget(notice)
    return notice
