"""Motion: play or scrub through the steps of a scan, run it, and see its cloud grow."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import Qt, QTimer, QUrl, Signal
from PySide6.QtGui import QDesktopServices
from PySide6.QtWidgets import (
    QComboBox,
    QFileDialog,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QSizePolicy,
    QSlider,
    QStackedLayout,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from analysis.cloud import cloud
from analysis.report.model import FrameResult
from render.errors import InputError
from render.motion import LinearStage, NoMotion, Turntable
from render.threads import Cancel
from studio.console import FRAMES, frame_of
from studio.jobs import Job, Progress
from studio.qt.icons import icon
from studio.qt.jobs import BUSY, RENDER, JobRunner
from studio.qt.session import Session
from studio.scan import ScanResult, run_scan
from studio.scene_edits import set_motion

PLAY_MS = 100
SCALES = {"full size": 1.0, "half size": 0.5, "quarter size": 0.25}


class MotionPanel(QWidget):
    """Changes `session.step`; the scan runs in the render lane, so that two never compete."""

    grew = Signal(object)
    """A `Cloud`: the points of one more step of the running scan."""
    began = Signal()
    """A scan began: what was shown of an earlier one goes."""
    _measured = Signal(object)

    def __init__(self, session: Session, runner: JobRunner, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.session, self.runner = session, runner
        self.report: Path | None = None
        self.slider = QSlider(Qt.Orientation.Horizontal)
        self.slider.valueChanged.connect(session.look_at_step)
        self.play = self._button("play", "Play the motion", self.toggle_play)
        self.told = QLabel()
        self.told.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self.scale = QComboBox()
        self.scale.addItems(list(SCALES))
        self.scale.setCurrentIndex(1)
        self.scale.setToolTip("Size of the rendered images: half size takes about a quarter of the time")
        self.run = QPushButton("Run the scan…")
        self.run.setToolTip("Render and measure every step, into a folder, with points and report")
        self.run.clicked.connect(lambda: self.ask_and_run())
        self.open = QPushButton("Open the report")
        self.open.clicked.connect(self._open_report)
        self.open.hide()
        self._timer = QTimer(self, interval=PLAY_MS)
        self._timer.timeout.connect(self._next)
        self._lay_out()
        self._measured.connect(self.grew)
        session.project_changed.connect(self.refresh)
        session.step_changed.connect(self._follow_step)
        self.refresh()

    def refresh(self) -> None:
        """Follow the project's motion."""
        scene = self.session.project.scene
        moves = not isinstance(scene.motion, NoMotion)
        self.stack.setCurrentIndex(1 if moves else 0)
        self.slider.blockSignals(True)
        self.slider.setMaximum(scene.frame_count - 1)
        self.slider.blockSignals(False)
        if self.session.step >= scene.frame_count:
            self.session.look_at_step(scene.frame_count - 1)
        if not moves and self._timer.isActive():
            self.toggle_play()
        self._follow_step()

    def toggle_play(self) -> None:
        """Play to the end, from the start where it stands at the end; or stop."""
        if self._timer.isActive():
            self._timer.stop()
        else:
            if self.session.step == self.slider.maximum():
                self.session.look_at_step(0)
            self._timer.start()
        self.play.setIcon(icon("pause" if self._timer.isActive() else "play"))

    def ask_and_run(self) -> None:
        """Ask for the folder of the results, then run the scan."""
        start = self.session.document.path
        base = (start.parent if start is not None else Path.home()) / f"{self.session.project.name} scan"
        chosen = QFileDialog.getExistingDirectory(self, "Folder for the scan's results", str(base.parent))
        if chosen:
            self.run_into(Path(chosen))

    def run_into(self, folder: Path, report: bool = True) -> Job[ScanResult] | None:
        """Run the scan into a folder; None: something else is being rendered."""
        session = self.session
        if self.runner.job(RENDER) is not None:
            session.message.emit("warning", BUSY)
            return None
        project, root, scale = session.project, session.document.root, SCALES[self.scale.currentText()]
        source = session.document.path

        def each(frame: FrameResult) -> None:
            clouds = [
                cloud(laser.extractions[0].points, laser.extractions[0].errors, i, frame.step, project.scene)
                for i, laser in enumerate(frame.lasers)
            ]
            for one in clouds:
                self._measured.emit(one)

        def work(progress: Progress, cancelled: Cancel) -> ScanResult:
            at, where = 0.0, ""

            def tell(stage: str, done: float) -> None:
                nonlocal at, where
                at = max(at, share(stage, done) or 0.0)
                if stage == FRAMES:
                    where = f"{frame_of(done, project.scene.frame_count)}: " if done < 1.0 else ""
                else:
                    progress(where + stage, at)

            return run_scan(
                project,
                root,
                out=folder,
                image_scale=scale,
                progress=tell,
                cancelled=cancelled,
                each=each,
                report=report,
                source=source,
            )

        self.open.hide()
        self.began.emit()
        return self.runner.run(RENDER, "scan", work, self._done)

    def _done(self, result: ScanResult) -> None:
        self.report = next((path for path in result.report if path.suffix == ".html"), None)
        self.open.setVisible(self.report is not None)
        for text in result.manifest["notes"]:
            self.session.message.emit("warning", text)
        self.session.message.emit("info", f"The scan is done: {result.folder}")

    def _open_report(self) -> None:
        if self.report is not None:
            QDesktopServices.openUrl(QUrl.fromLocalFile(str(self.report)))

    def _next(self) -> None:
        if self.session.step >= self.slider.maximum():
            self.toggle_play()
        else:
            self.session.look_at_step(self.session.step + 1)

    def _follow_step(self) -> None:
        scene, step = self.session.project.scene, self.session.step
        self.slider.blockSignals(True)
        self.slider.setValue(step)
        self.slider.blockSignals(False)
        self.told.setText(f"step {step + 1} of {scene.frame_count}: {describe(scene.motion, step)}")

    def _set_motion(self, kind: type[LinearStage] | type[Turntable]) -> None:
        try:
            project, path = set_motion(self.session.project, kind)
        except InputError as error:
            self.session.message.emit("error", str(error))
            return
        self.session.document.apply("add motion", project)
        self.session.select(path)

    def _button(self, name: str, tip: str, handler: object) -> QToolButton:
        button = QToolButton()
        button.setIcon(icon(name))
        button.setToolTip(tip)
        button.clicked.connect(handler)
        return button

    def _lay_out(self) -> None:
        still = QWidget()
        column, row = QVBoxLayout(still), QHBoxLayout()
        column.setContentsMargins(8, 8, 8, 6)
        column.addWidget(QLabel("Nothing moves: a scan is a single frame.", wordWrap=True))
        column.addLayout(row)
        column.addStretch(1)
        for text, kind in (("Add a linear stage", LinearStage), ("Add a turntable", Turntable)):
            button = QPushButton(text)
            button.clicked.connect(lambda _checked=False, kind=kind: self._set_motion(kind))
            row.addWidget(button)
        row.addStretch(1)
        moving = QWidget()
        inside = QVBoxLayout(moving)
        inside.setContentsMargins(8, 4, 8, 6)
        top, bottom = QHBoxLayout(), QHBoxLayout()
        look = self.session.look_at_step
        top.addWidget(self._button("first", "First step", lambda: look(0)))
        top.addWidget(self._button("previous", "Step back", lambda: look(self.session.step - 1)))
        top.addWidget(self.play)
        top.addWidget(self._button("next", "Step on", lambda: look(self.session.step + 1)))
        top.addWidget(self._button("last", "Last step", lambda: look(self.slider.maximum())))
        top.addWidget(self.slider, 1)
        bottom.addStretch(1)
        for widget in (self.open, self.scale, self.run):
            bottom.addWidget(widget)
        inside.addLayout(top)
        inside.addWidget(self.told)
        inside.addLayout(bottom)
        inside.addStretch(1)
        self.stack = QStackedLayout(self)
        self.stack.addWidget(still)
        self.stack.addWidget(moving)


def share(stage: str, done: float) -> float | None:
    """How much of a scan is done; None: the stage does not say."""
    if stage == FRAMES:
        return 0.02 + 0.93 * done
    return 0.96 + 0.03 * done if stage in ("writing points", "report") else None


def describe(motion: object, step: int) -> str:
    """Where a step stands, for a person."""
    if isinstance(motion, LinearStage):
        x, y, z = (1e3 * step * value for value in motion.step)
        return f"{motion.moves} moved by ({x:.2f}, {y:.2f}, {z:.2f}) mm"
    if isinstance(motion, Turntable):
        import math

        return f"{motion.moves} turned by {math.degrees(step * motion.angle_step):.2f} deg"
    return "at its listed pose"
