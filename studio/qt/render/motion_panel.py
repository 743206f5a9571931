"""Motion: play or scrub through the steps of a scan, run it, and see its cloud grow."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import (
    QHBoxLayout,
    QLabel,
    QPushButton,
    QSizePolicy,
    QStackedLayout,
    QVBoxLayout,
    QWidget,
)

from analysis.cloud import Cloud, cloud
from analysis.report.frame_result import FrameResult
from analysis.report.units import counted
from render.base.errors import InputError
from render.base.threads import Cancel
from render.scene.motion import LinearStage, NoMotion, Turntable
from studio.editing.scene_edits import set_motion
from studio.project.document import Document
from studio.project.project import Project
from studio.project.project_files import carry
from studio.qt.core.boxes import ChoiceBox
from studio.qt.core.dialogs import show_trouble
from studio.qt.core.folders import ask_results_folder, may_replace_scan, unused_name
from studio.qt.core.jobs import BUSY, RENDER, JobRunner
from studio.qt.core.report_opener import open_report
from studio.qt.core.scan_progress import scan_progress, share
from studio.qt.core.scan_steps import scan_steps
from studio.qt.core.session import Session
from studio.qt.core.step_bar import StepBar
from studio.qt.render.resuming import ask_resume, told_before_resuming
from studio.runtime.console import FRAMES
from studio.runtime.error_messages import trouble
from studio.runtime.jobs import Job, Progress
from studio.scan.options import Listener, ScanOptions
from studio.scan.scan_folder import MANIFEST, frame_stem, open_folder
from studio.scan.scan_results import holds_scan, is_unfinished
from studio.scan.stages import scaled

if TYPE_CHECKING:
    from studio.scan.scan import ScanResult

SCALES = {"full size": 1.0, "half size": 0.5, "quarter size": 0.25, "eighth size": 0.125}


@dataclass(frozen=True)
class Order:
    """A scan as it was asked for, so that it can go on as it began."""

    document: Document
    """What was open."""
    project: Project
    """At full scale."""
    root: Path
    folder: Path
    image_scale: float
    report: bool


class MotionPanel(QWidget):
    """Changes `session.step`; the scan runs in the render lane, so that two never compete."""

    grew = Signal(object)
    """A `Cloud`: the points of one more step of the running scan."""
    began = Signal(float)
    """A scan began, at this image scale: what was shown of an earlier one goes."""
    stopped_changed = Signal()
    """`stopped` is another one."""
    _measured = Signal(object, object)

    def __init__(self, session: Session, runner: JobRunner, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.session, self.runner = session, runner
        self.report: Path | None = None
        self.steps = StepBar(session)
        self.told = QLabel()
        self.told.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self.scale = ChoiceBox()
        for text, scale in SCALES.items():
            self.scale.addItem(text, scale)
        self.scale.setToolTip(
            "Size of the rendered images, at first that of the preferences: half size takes about a quarter of the time"
        )
        self.run = QPushButton("Run the scan…")
        self.run.setToolTip("Render and measure every step, into a folder, with points and report")
        self.run.clicked.connect(lambda: self.ask_and_run())
        self.go_on = QPushButton("Resume")
        self.go_on.clicked.connect(self.ask_and_resume)
        self.go_on.hide()
        self.other = QLabel(wordWrap=True)
        self.other.setObjectName("warning")
        self.other.hide()
        self.stopped: Order | None = None
        """The scan that was cancelled, or failed, before its end."""
        self._running: tuple[Job[ScanResult], Order] | None = None
        self.open = QPushButton("Open the report")
        self.open.clicked.connect(self._open_report)
        self.open.hide()
        self._lay_out()
        self._measured.connect(self._grow)
        for signal in (runner.cancelled, runner.failed):
            signal.connect(self._stop)
        session.project_changed.connect(self.refresh)
        session.document_replaced.connect(self._forget)
        session.step_changed.connect(self._follow_step)
        self.refresh()

    def refresh(self) -> None:
        """Follow the project's motion."""
        scene = self.session.project.scene
        moves = not isinstance(scene.motion, NoMotion)
        self.stack.setCurrentIndex(1 if moves else 0)
        self.steps.set_count(scene.frame_count)
        if self.session.step >= scene.frame_count:
            self.session.look_at_step(scene.frame_count - 1)
        self._follow_step()
        self._tell_scan()

    def ask_and_run(self) -> None:
        """Ask for the folder of the results, then run the scan; while something is rendered, nothing is asked."""
        if self._is_busy():
            return  # the folder that a person chooses is made
        session, place = self.session, self.session.place
        name = unused_name(place, f"{session.project.name} scan")
        # the size of a single render is another one
        size = f"{counted(session.project.scene.frame_count, 'frame')} at {self.scale.currentText()}"
        chosen = ask_results_folder(self, f"Folder for the scan's results: {size}", place, name)
        if chosen is None:
            return
        session.chose(chosen)
        goes_on = is_unfinished(chosen, scaled(session.project, SCALES[self.scale.currentText()]))
        if goes_on or holds_scan(chosen) is None or may_replace_scan(self, chosen):
            try:
                self.run_into(chosen)
            except InputError as error:
                show_trouble(self.window(), trouble(error, "run the scan"))

    def run_into(self, folder: Path, report: bool = True) -> Job[ScanResult] | None:
        """Run the scan into a folder; None: something else is being rendered. What the folder holds of it is kept.

        The meshes of a project that was never saved are copied there, or nobody could open the results later.
        InputError: they cannot be.
        """
        if self._is_busy():
            return None
        session, scale = self.session, SCALES[self.scale.currentText()]
        document, root = session.document, session.document.root
        if document.files_may_go:
            carry(session.project, root, folder)
            root = folder
        order = Order(document, session.project, root, folder, scale, report)
        return self._start(order, resume=is_unfinished(folder, scaled(order.project, scale)))

    def ask_and_resume(self) -> None:
        """Go on with the scan that was stopped; where the project is another by now, a person is asked first."""
        if self.stopped is None or self._is_busy():
            return
        told = told_before_resuming(self.stopped.project, self.session.project)
        answer = ask_resume(self, str(self.stopped.folder), told) if told else "resume"
        if answer == "resume":
            self.resume()
        elif answer == "anew":
            self.ask_and_run()

    def resume(self) -> Job[ScanResult] | None:
        """Go on with the scan that was stopped, as it was asked for, whatever has changed in the project since."""
        return None if self.stopped is None else self._start(self.stopped, resume=True)

    def _is_busy(self) -> bool:
        """Something else is being rendered: the person is told."""
        busy = self.runner.job(RENDER) is not None
        if busy:
            self.session.message.emit("warning", BUSY)
        return busy

    def _start(self, order: Order, resume: bool) -> Job[ScanResult] | None:
        if self._is_busy():
            return None
        count, source = order.project.scene.frame_count, order.document.path

        def each(frame: FrameResult) -> None:
            for i, laser in enumerate(frame.lasers):
                best = laser.extractions[0]
                points = cloud(best.points, best.errors, i, frame.step, order.project.scene)
                self._measured.emit(order, points)

        there = frames_there(order.folder, count) if resume else 0

        def work(progress: Progress, cancelled: Cancel) -> ScanResult:
            from studio.scan.scan import run_scan  # takes a while: not before a scan

            return run_scan(
                order.project,
                order.root,
                out=order.folder,
                options=ScanOptions(image_scale=order.image_scale, report=order.report, resume=resume),
                listener=Listener(scan_progress(progress, count), cancelled, measured=each),
                source=source,
            )

        self.stopped = None
        self.stopped_changed.emit()
        for button in (self.open, self.go_on):
            button.hide()
        self.began.emit(order.image_scale)
        job = self.runner.run(RENDER, "scan", work, lambda result: self._done(result, order))
        job.there = share(FRAMES, there / count) or 0.0 if there else 0.0
        self._running = job, order
        self._tell_scan()
        return job

    def _grow(self, order: Order, points: Cloud) -> None:
        """More points, unless another project was opened meanwhile."""
        if order.document is self.session.document:
            self.grew.emit(points)

    def _done(self, result: ScanResult, order: Order) -> None:
        self._running = None
        self._tell_scan()
        self.session.message.emit("info", f"The scan is done: {result.folder}")
        if self.session.document is not order.document:
            return
        self.report = next((path for path in result.report if path.suffix == ".html"), None)
        self.open.setVisible(self.report is not None)
        for text in result.manifest["notes"]:
            self.session.message.emit("warning", text)
        self.session.message.emit("info", f"The scan is done: {result.folder}")
        try:
            found = open_folder(result.folder)
        except InputError as error:
            self.session.message.emit("error", str(error))
        else:
            scan_steps(self.session).show(found, order.project, order.image_scale)

    def _stop(self, job: Job[ScanResult]) -> None:
        """It was cancelled, or could not go on."""
        if self._running is None or self._running[0] is not job:
            return
        order, self._running = self._running[1], None
        if order.document is self.session.document:
            self.stopped = order
            self._tell_scan()
            self.go_on.show()
            self.stopped_changed.emit()
            if (order.folder / MANIFEST).is_file():
                told = "All is measured, the report is not written; Render > Resume the scan writes it"
            else:
                told = f"The scan was stopped; Render > Resume the scan goes on at {size_of(order)}"
            self.session.message.emit("info", f"{told}: {order.folder}")

    def _tell_scan(self) -> None:
        """In what the project is another by now than the scan that was stopped, or that is under way."""
        order = self.stopped or (self._running[1] if self._running is not None else None)
        ours = order is not None and order.document is self.session.document
        other = told_before_resuming(order.project, self.session.project) if order is not None and ours else ""
        self.other.setText(f"{'Resume' if self.stopped is not None else 'The scan under way'} {other}")
        self.other.setVisible(bool(other))
        if self.stopped is not None:
            size, place = size_of(self.stopped), self.stopped.folder
            self.go_on.setText(f"Resume ({size})")
            tip = f"Go on at {size}, as it began, whatever is chosen now, where the scan into {place} was stopped"
            self.go_on.setToolTip("\n".join(filter(None, (tip, other))))

    def _forget(self) -> None:
        """Another project was opened: what was scanned of the one before goes."""
        self.report = self.stopped = None
        self.stopped_changed.emit()
        for button in (self.open, self.go_on):
            button.hide()
        self._tell_scan()

    def _open_report(self) -> None:
        if self.report is not None:
            open_report(self.session, self.report)

    def _follow_step(self) -> None:
        scene, step = self.session.project.scene, self.session.step
        self.told.setText(f"step {step + 1} of {scene.frame_count}: {describe(scene.motion, step)}")

    def _set_motion(self, kind: type[LinearStage] | type[Turntable]) -> None:
        try:
            project, path = set_motion(self.session.project, kind)
        except InputError as error:
            self.session.message.emit("error", str(error))
            return
        self.session.document.apply("add motion", project)
        self.session.select(path)

    def _lay_out(self) -> None:
        still = QWidget()
        column = QVBoxLayout(still)
        column.setContentsMargins(8, 8, 8, 6)
        column.addWidget(QLabel("Nothing moves: a scan is a single frame.", wordWrap=True))
        for text, kind in (("Add a linear stage", LinearStage), ("Add a turntable", Turntable)):
            button = QPushButton(text)
            button.clicked.connect(lambda _checked=False, kind=kind: self._set_motion(kind))
            # one below the other: a low screen has them beside the camera's view
            column.addWidget(button, alignment=Qt.AlignmentFlag.AlignLeft)
        column.addStretch(1)
        moving = QWidget()
        inside = QVBoxLayout(moving)
        inside.setContentsMargins(8, 4, 8, 6)
        bottom = QHBoxLayout()
        bottom.addStretch(1)
        for widget in (self.open, self.go_on, self.scale, self.run):
            bottom.addWidget(widget)
        inside.addWidget(self.steps)
        inside.addWidget(self.told)
        inside.addWidget(self.other)
        inside.addLayout(bottom)
        inside.addStretch(1)
        self.stack = QStackedLayout(self)
        self.stack.addWidget(still)
        self.stack.addWidget(moving)


def size_of(order: Order) -> str:
    """The name of a scan's size."""
    return next((name for name, scale in SCALES.items() if scale == order.image_scale), "")


def frames_there(folder: Path, count: int) -> int:
    """Of the first frames of a scan, those that an earlier run has left in its folder."""
    return next((i for i in range(count) if not (folder / f"{frame_stem(i)}.json").is_file()), count)


def describe(motion: object, step: int) -> str:
    """Where a step stands, for a person."""
    if isinstance(motion, LinearStage):
        x, y, z = (round(1e3 * step * value, 2) + 0.0 for value in motion.step)  # no -0.00
        return f"{motion.moves} moved by ({x:.2f}, {y:.2f}, {z:.2f}) mm"
    if isinstance(motion, Turntable):
        import math

        return f"{motion.moves} turned by {math.degrees(step * motion.angle_step):.2f} deg"
    return "at its listed pose"
