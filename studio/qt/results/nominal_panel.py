"""Deviation from the nominal part, sections by a plane, the height map: a profiler's own program, of what is shown."""

from __future__ import annotations

from PySide6.QtWidgets import QTabWidget, QVBoxLayout, QWidget

from studio.qt.core.jobs import JobRunner
from studio.qt.core.session import Session
from studio.qt.core.widgets import Scrolled
from studio.qt.results.deviation_tab import DeviationTab
from studio.qt.results.height_map_tab import HeightMapTab
from studio.qt.results.section_tab import SectionTab


class NominalPanel(QWidget):
    """A tab for each."""

    def __init__(self, session: Session, runner: JobRunner) -> None:
        super().__init__()
        self.deviation, self.section = DeviationTab(session, runner), SectionTab(session, runner)
        self.heights = HeightMapTab(session, runner)
        self.tabs = QTabWidget()
        self.tabs.setDocumentMode(True)
        for tab, title in ((self.deviation, "Deviation"), (self.section, "Section"), (self.heights, "Height map")):
            self.tabs.addTab(Scrolled(tab), title)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.tabs)
        self.setMinimumWidth(300)

    def show_tab(self, tab: QWidget) -> None:
        self.tabs.setCurrentIndex((self.deviation, self.section, self.heights).index(tab))
