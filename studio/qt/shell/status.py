"""The status bar: what is being computed, how far, time left, pause and cancel; and the last message."""

from __future__ import annotations

from html import escape
from typing import Any

from PySide6.QtCore import QEvent, QObject, Qt, QTimer, Signal
from PySide6.QtGui import QMouseEvent, QMoveEvent, QResizeEvent, QStatusTipEvent
from PySide6.QtWidgets import QLabel, QSizePolicy, QStatusBar, QWidget

from studio.qt.core.icons import icon, icon_button
from studio.qt.core.jobs import BUSY, RENDER, JobRunner, time_left
from studio.qt.core.session import Session
from studio.qt.core.widgets import ShareBar
from studio.runtime.jobs import Job, State

AS_IT_WAS = "The value is as it was"
"""How a refusal ends that was given up."""
SHORT = 0.4
"""Seconds; work that ends sooner is not worth a progress bar."""
WIDEST, MARGIN = 720, 6
"""px, of a message that stands above the bar."""
IDLE = "Nothing is being computed"
MESSAGE_SECONDS = {"info": 8, "warning": 20, "error": 60}


class StatusBar(QStatusBar):
    """Shows one job at a time, the final render before all others."""

    log_asked = Signal()

    def __init__(self, session: Session, runner: JobRunner, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.session, self.runner = session, runner
        self.job: Job[Any] | None = None
        self.tip = ""
        """Of the command below the mouse."""
        self.setSizeGripEnabled(False)
        self.work = QLabel()
        self.bar = ShareBar(14)
        self.bar.setFixedWidth(160)
        self.left = QLabel()
        self.left.setObjectName("muted")
        self.pause = icon_button("pause", "Pause", self.toggle_pause)
        self.cancel = icon_button("cancel", "Cancel (Shift+F5)", self.cancel_work)
        self.text = _Message()
        self.text.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self.text.clicked.connect(self.log_asked)
        self.text.resized.connect(self._place_whole)
        self.whole = _Message(parent)
        self.whole.setWordWrap(True)
        self.whole.setProperty("note", True)
        self.whole.hide()
        self.whole.clicked.connect(self.log_asked)
        self.whole.clicked.connect(self.whole.hide)
        self.plan = QLabel()
        self.plan.setObjectName("muted")
        # the buttons first: texts that come and go beside them must not move them from under the mouse
        for widget in (self.pause, self.cancel, self.bar, self.work, self.left):
            self.addWidget(widget)
        self.addWidget(self.text, 1)
        self.addPermanentWidget(self.plan)
        self._fade = QTimer(self, singleShot=True)
        self._fade.timeout.connect(lambda: self._say("", "message"))
        self._show_work(False)
        if parent is not None:
            parent.installEventFilter(self)
        session.message.connect(self.show_text)
        session.project_changed.connect(self._drop_refusal)
        runner.progress.connect(self.follow)
        for signal in (runner.finished, runner.failed, runner.cancelled):
            signal.connect(self._end)

    def follow(self, job: Job[Any]) -> None:
        """A job's progress, unless a more important one is shown."""
        if job.ended or (job.seconds < SHORT and job is not self.job):
            return
        if self.job is not None and self.job is not job and (not self.job.ended) and job is not self.runner.job(RENDER):
            return
        self.job = job
        paused = job.state is State.PAUSED
        self.work.setText(f"{job.name}: {job.stage}" if job.stage and job.stage != job.name else job.name)
        self.bar.show_share(job.done)
        self.left.setText("stopping" if job.cancel_asked else "paused" if paused else time_left(job.seconds_left))
        tip = "Go on" if paused else "Pause"
        if tip != self.pause.toolTip():
            self.pause.setIcon(icon("play" if paused else "pause"))
            self.pause.setToolTip(tip)
        self._show_work(True)

    def toggle_pause(self) -> None:
        """Hold the job that is shown, or let it go on."""
        if self.job is None:
            self.session.message.emit("info", IDLE)
        else:
            self.job.resume() if self.job.state is State.PAUSED else self.job.pause()
            self.runner.progress.emit(self.job)  # for the panel that has such a button as well

    def cancel_work(self) -> None:
        """Stop the job that is shown; what it has given so far stays."""
        if self.job is None:
            self.session.message.emit("info", IDLE)
        else:
            self.job.cancel()
            self.follow(self.job)

    def _end(self, job: Job[Any]) -> None:
        if job is self.job:
            self.job = None
            self._show_work(False)
            if self.text.text() == BUSY or self.whole.text() == BUSY:
                self._say("", "message")

    def _show_work(self, visible: bool) -> None:
        for widget in (self.work, self.bar, self.left, self.pause, self.cancel):
            widget.setVisible(visible)

    def show_text(self, level: str, text: str) -> None:
        """A message, for a while; a click on it opens the log."""
        self._say(text, level if level in ("warning", "error") else "message")
        self._fade.start(1000 * MESSAGE_SECONDS.get(level, 8))

    def _drop_refusal(self) -> None:
        """A value was taken: that one before it was not is no longer what counts."""
        if AS_IT_WAS in self.whole.text():
            self._say("", "message")

    def drop_tip(self) -> None:
        """What the mouse rests on is no longer what is spoken of: a key has brought another workspace."""
        self.tip = ""
        self._place_whole()

    def _say(self, text: str, name: str) -> None:
        line = text.splitlines()[0] if text else ""
        self.tip = "" if line else self.tip
        for label in (self.text, self.whole):
            label.setObjectName(name)
            label.style().unpolish(label)
            label.style().polish(label)
        self.whole.setText(line)
        self.text.setToolTip(f"<p>{escape(text)}</p>" if text else "")
        self._place_whole()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Tips take the place of what is no warning: Qt's own way draws them over everything."""
        if isinstance(event, QStatusTipEvent):
            warned = self.whole.text() and self.whole.objectName() != "message"
            self.tip = "" if warned else event.tip()
            self._place_whole()
            return True
        return super().eventFilter(watched, event)

    def moveEvent(self, event: QMoveEvent) -> None:
        super().moveEvent(event)
        self._place_whole()

    def _place_whole(self) -> None:
        """A message that is longer than the bar has room for stands above it, wrapped: the panels keep their sizes."""
        whole = self.whole
        line = self.tip or whole.text()
        seen = self.text.fontMetrics().elidedText(line, Qt.TextElideMode.ElideRight, self.text.width())
        cut = seen != line and not self.tip and self.isVisible()
        self.text.setText(seen)
        if cut:
            width = min(WIDEST, self.width() - 2 * MARGIN)
            whole.resize(width, whole.heightForWidth(width))
            whole.move(self.x() + MARGIN, self.y() - whole.height() - MARGIN)
            whole.raise_()
        whole.setVisible(cut)


class _Message(QLabel):
    clicked = Signal()
    resized = Signal()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.resized.emit()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        self.clicked.emit()
