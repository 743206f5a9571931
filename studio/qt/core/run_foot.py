"""The foot of a panel whose work takes hours and goes into a folder: where to, how far it is, and run, stop, go on."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QHBoxLayout, QLabel, QPushButton, QSizePolicy, QVBoxLayout, QWidget

from studio.qt.core.jobs import duration, time_left
from studio.qt.core.widgets import ElidedLabel, ShareBar, flush, text_button
from studio.runtime.jobs import Job, State


class RunFoot(QWidget):
    """Shows what it is told; its buttons are the panel's to connect."""

    def __init__(self, folder_tip: str, stop_tip: str, more: Sequence[QPushButton] = ()) -> None:
        """more: buttons beside run and stop."""
        super().__init__()
        self.folder = ElidedLabel(Qt.TextElideMode.ElideMiddle)
        self.folder.setObjectName("muted")
        self.folder.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self.choose = text_button("Folder…", folder_tip)
        self.run = text_button("Run…", name="primary")
        self.stop = text_button("Stop", stop_tip)
        self.bar = ShareBar()
        self.stage = QLabel(wordWrap=True)
        self.stage.setObjectName("muted")
        self.stage.setMinimumWidth(1)
        # what stands below keeps its place as the sentence gets longer
        self.stage.setMinimumHeight(2 * self.stage.fontMetrics().lineSpacing())
        self.stage.setAlignment(Qt.AlignmentFlag.AlignTop)
        where = QHBoxLayout()
        where.addWidget(self.folder, 1)
        where.addWidget(self.choose)
        buttons = QHBoxLayout()
        for button in (self.run, self.stop, *more):
            buttons.addWidget(button)
        buttons.addStretch(1)
        layout = flush(QVBoxLayout(self))
        layout.setSpacing(4)
        layout.addLayout(where)
        layout.addWidget(self.bar)
        layout.addWidget(self.stage)
        layout.addLayout(buttons)

    def show_state(self, folder: Path | None, job: Job[object] | None, *, begun: bool) -> None:
        """job: the one that runs; begun: the folder holds a part of what is wanted."""
        running = job is not None
        self.run.setVisible(not running)
        self.run.setText("Run…" if folder is None else "Go on" if begun else "Run")
        self.stop.setVisible(running)
        self.stop.setEnabled(job is not None and not job.cancel_asked)
        self.choose.setEnabled(not running)
        for widget in (self.bar, self.stage):
            widget.setVisible(running)
        if not running:
            self.bar.show_none()
            self.stage.clear()
        self.folder.setText(str(folder) if folder is not None else "no folder yet")

    def tell_progress(self, job: Job[object], promised: float | None = None) -> None:
        """promised: s that it was estimated to take, which is not to stand uncorrected while nothing is done."""
        self.bar.show_share(job.done)
        left = "paused" if job.state is State.PAUSED else time_left(job.seconds_left)
        if job.done <= job.there and promised is not None and job.seconds > promised:
            left = f"longer than the {duration(promised)} that were estimated"
        self.stage.setText("stopping" if job.cancel_asked else f"{job.stage}   {left}")
