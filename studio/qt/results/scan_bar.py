"""What is looked at of a scan: which of its steps, and whether the measures are of that step or of all."""

from __future__ import annotations

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QHBoxLayout, QLabel, QToolButton, QWidget

from studio.qt.core.boxes import ChoiceBox
from studio.qt.core.report_opener import open_report
from studio.qt.core.scan_steps import scan_steps
from studio.qt.core.session import Session
from studio.qt.core.step_bar import StepBar
from studio.scan.scan_results import ScanResults


class ScanBar(QWidget):
    """Hidden while what is shown is no scan."""

    scope_changed = Signal(bool)
    """True: measures, histogram and cloud are of all steps."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.session, self.steps = session, StepBar(session)
        self.scan: ScanResults | None = None
        self.steps.setMinimumWidth(260)
        self.told = QLabel()
        self.scope = ChoiceBox()
        self.scope.addItems(["Figures of all steps", "Figures of this step"])
        self.scope.setToolTip("What the measures, the histogram and the points in the 3D view are of")
        self.scope.currentIndexChanged.connect(self._rescope)
        self.report = QToolButton()
        self.report.setText("Report")
        self.report.clicked.connect(self._open_report)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.addWidget(self.scope)
        row.addWidget(self.steps, 1)
        row.addWidget(self.told)
        row.addWidget(self.report)
        self.told.setAlignment(Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignRight)
        self.steps_of = scan_steps(session)
        session.step_changed.connect(self._tell)
        self.follow()

    @property
    def whole(self) -> ScanResults | None:
        """The scan of which the measures are, all steps together; None: they are of one frame."""
        return self.scan if self.scan is not None and self.scan.measured and self.scope.currentIndex() == 0 else None

    def follow(self) -> None:
        """The shown render is another one."""
        render = self.session.shown
        self.scan = None if render is None else render.scan
        self.setVisible(self.scan is not None)
        if self.scan is not None:
            self.steps.set_count(self.scan.count)
            self.scope.setVisible(self.scan.measured)
            self.report.setVisible(self.scan.report is not None)
            self.report.setToolTip(f"Open the report in {self.scan.found.folder}")
        self._tell()

    def _tell(self) -> None:
        if self.scan is not None:
            step = min(self.session.step, self.scan.count - 1)
            charts = "charts: " if self.whole is not None else ""
            self.told.setText(f"{charts}step {step + 1} of {self.scan.count}")

    def _rescope(self, index: int) -> None:
        self._tell()
        self.scope_changed.emit(index == 0)

    def _open_report(self) -> None:
        if self.scan is None or self.scan.report is None:
            return
        open_report(self.session, self.scan.report)
