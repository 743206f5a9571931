"""Deviation from the nominal part, and sections by a plane: what a profiler's own program has, of what is shown."""

from __future__ import annotations

from PySide6.QtWidgets import QTabWidget, QVBoxLayout, QWidget

from studio.qt.core.jobs import JobRunner
from studio.qt.core.session import Session
from studio.qt.core.widgets import scrolled
from studio.qt.results.deviation_tab import DeviationTab
from studio.qt.results.section_tab import SectionTab


class NominalPanel(QWidget):
    """A tab for each."""

    def __init__(self, session: Session, runner: JobRunner) -> None:
        super().__init__()
        self.deviation, self.section = DeviationTab(session, runner), SectionTab(session, runner)
        self.tabs = QTabWidget()
        self.tabs.setDocumentMode(True)
        self.tabs.addTab(scrolled(self.deviation), "Deviation")
        self.tabs.addTab(scrolled(self.section), "Section")
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.tabs)
        self.setMinimumWidth(300)

    def show_tab(self, tab: QWidget) -> None:
        self.tabs.setCurrentIndex(0 if tab is self.deviation else 1)
