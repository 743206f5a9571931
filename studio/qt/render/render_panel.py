"""The final render: what will be computed and why, how well, how far it is, and the renders made so far."""

from __future__ import annotations

import time
from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QCloseEvent, QShowEvent
from PySide6.QtWidgets import (
    QFormLayout,
    QHBoxLayout,
    QLabel,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from render.base.threads import Cancel
from render.checkpoint import RenderState
from render.frame import Frame
from render.run import Memory, Run
from render.world.world import World
from studio.editing.forms import choice_label
from studio.project.project import Project
from studio.qt.core.boxes import ChoiceBox, DecimalBox, WholeBox
from studio.qt.core.jobs import BUSY, RENDER, JobRunner, time_left
from studio.qt.core.render import Render
from studio.qt.core.session import Session
from studio.qt.core.widgets import ShareBar, bring_into_view, text_button
from studio.qt.render.history import History
from studio.qt.render.render_job import FirstFigures, can_go_on, render_frames
from studio.qt.render.render_texts import error_text, plan_text
from studio.runtime.jobs import Job, Progress, State
from studio.scan.stages import scaled

SCALES = (1.0, 0.5, 0.25, 0.125)
TRANSPORT = {
    "auto": "A pilot measures what each further step adds, and leaves out what is negligible",
    "direct": "To one surface",
    "interreflection": "From surface to surface as well",
    "caustic": "Also through clear glass and off mirrors, on one side of a rough surface",
    "specular-chain": "Also on both sides of it, as through a plate",
    "subsurface": "Also below the surface of wax, marble, nylon or skin",
}
"""How far a laser's light is followed, in the words of README and project file; each step includes those before."""


class RenderPanel(QWidget):
    """Starts, holds and stops the render; its frames join the session's history as they get better."""

    _refined = Signal(object, object)

    def __init__(self, session: Session, runner: JobRunner, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.session, self.runner = session, runner
        self._job: Job[None] | None = None
        self._render: Render | None = None
        self._before: Render | None = None
        self._keep = False
        self.asked = True
        """By a person: the render under way."""
        self._memory = Memory()
        """Ambient light of before, for renders that only the lasers tell apart."""
        self._state = RenderState({})
        self._figures = FirstFigures(session)
        self.plan = QLabel(wordWrap=True, textFormat=Qt.TextFormat.RichText)
        self.plan.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self.laser_error = DecimalBox(decimals=2, minimum=0.01, maximum=100.0)
        self.laser_error.setSuffix(" %")
        self.laser_error.setStepType(DecimalBox.StepType.AdaptiveDecimalStepType)
        self.laser_error.setToolTip("Relative RMS error of the laser light over the lit pixels.")
        self.samples = WholeBox(minimum=1, maximum=65536)
        self.samples.setStepType(WholeBox.StepType.AdaptiveDecimalStepType)
        self.samples.setToolTip(
            "The ambient light ends here where its error is not reached. Samples of a pixel, on average: noisy places "
            "get more; four times as many halve the noise."
        )
        self.ambient_error = DecimalBox(decimals=2, minimum=0.01, maximum=100.0)
        self.ambient_error.setSuffix(" %")
        self.ambient_error.setStepType(DecimalBox.StepType.AdaptiveDecimalStepType)
        self.ambient_error.setToolTip("Relative RMS error of the ambient light at which it ends.")
        self.goal = DecimalBox(decimals=2, minimum=0.0, maximum=10.0, singleStep=0.05)
        self.goal.setSuffix(" sigma")
        self.goal.setSpecialValueText("errors of the image")
        self.goal.setToolTip("What the render's own noise may add to the line, over its sigma by the sensor's noise.")
        self.limit = WholeBox(minimum=0, maximum=86400)
        self.limit.setSuffix(" s")
        self.limit.setSpecialValueText("none")
        self.limit.setToolTip("The best frame so far is kept when the time is over.")
        for box in (self.laser_error, self.ambient_error, self.samples, self.goal, self.limit):
            box.setKeyboardTracking(False)
        self.transport = ChoiceBox()
        for i, (value, text) in enumerate(TRANSPORT.items()):
            self.transport.addItem(choice_label(value), value)
            self.transport.setItemData(i, text, Qt.ItemDataRole.ToolTipRole)
        self.transport.setToolTip(
            "How far the light of the lasers is followed. Auto: a pilot decides; else the last step that is computed."
        )
        self.scale = ChoiceBox()
        self.start_button = text_button("Render", name="primary")
        self.continue_button = text_button(
            "Continue", "Go on with the shown render, which was stopped before it reached its errors"
        )
        self.pause_button = text_button("Pause")
        self.keep_button = text_button("Keep", "Stop here and keep the image as it is")
        self.cancel_button = text_button("Cancel", "Stop and forget this render")
        self.bar = ShareBar()
        self.stage = QLabel()
        self.errors = QLabel(textFormat=Qt.TextFormat.RichText, wordWrap=True)
        self.history = History(session)
        self._lay_out()
        self._connect()
        self._follow_project()
        self._show_state()

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self._show_plan()
        self._tell_render()

    def closeEvent(self, event: QCloseEvent) -> None:
        self.cancel()
        super().closeEvent(event)

    # what a person does

    def go_on(self) -> None:
        """Go on with the shown render where it was stopped."""
        render = self.session.shown
        if render is None or render.final or render.state is None or not self._may_start():
            return
        self._before, self._keep, self.asked = render, True, True
        self._render, state, render.state = render, render.state, None
        self._run(render.project, self.session.document.root, render.frame.step, render.world, state)

    def start(self, image_scale: float | None = None, asked: bool = True) -> None:
        """Render the project as it is now; one render at a time. asked: by a person."""
        if not self._may_start():
            return
        self.asked = asked
        session = self.session
        source, root, step = session.project, session.document.root, session.step
        image_scale = self.scale.currentData() if image_scale is None else image_scale
        project = scaled(source, image_scale)
        world = self._same_world(project, step)
        self._render, self._before, self._keep = None, session.shown, False
        number = max([render.number for render in session.renders], default=0) + 1
        self._template = (number, project, source, image_scale)
        self._figures.of(None)
        self._run(project, root, step, world, RenderState({}))

    def _may_start(self) -> bool:
        if self.runner.job(RENDER) is not None:
            self.session.message.emit("warning", BUSY)
            return False
        return True

    def _run(self, project: Project, root: Path, step: int, world: World | None, state: RenderState) -> None:
        refined, figures, limit, self._state = self._refined, self._figures, self.limit.value() or None, state

        def work(progress: Progress, cancelled: Cancel) -> None:
            kept = lambda: self._keep  # noqa: E731
            run = Run(cancelled=cancelled, keep_partial=kept, seconds=limit, checkpoint=state, memory=self._memory)
            render_frames(project, root, step, world, run, progress, refined.emit, figures.wait)

        self._job = self.runner.run(RENDER, "render", work)
        self._show_state()
        bring_into_view(self.pause_button)
        self._tell_render()

    def pause(self) -> None:
        """Hold the render, or let it go on."""
        if self._job is None:
            return
        if self._job.state is State.PAUSED:
            self._job.resume()
        else:
            self._job.pause()
        self._show_state()

    def keep(self) -> None:
        """Stop here; the frame so far stays."""
        if self._job is not None:
            self._keep = True
            self._job.cancel()
            self._show_state()

    def cancel(self) -> None:
        """Stop and forget."""
        if self._job is not None:
            # what was there before it went on stays
            self._keep = self._render is not None and self._render is self._before
            self._job.cancel()
            self._show_state()

    # what follows

    def _lay_out(self) -> None:
        form = QFormLayout()
        form.setFieldGrowthPolicy(QFormLayout.FieldGrowthPolicy.AllNonFixedFieldsGrow)
        for name, widget in (
            ("Light transport", self.transport),
            ("Goal", self.goal),
            ("Laser error", self.laser_error),
            ("Ambient error", self.ambient_error),
            ("Ambient samples", self.samples),
            ("Time limit", self.limit),
            ("Image", self.scale),
        ):
            form.addRow(name, widget)
        # a second click where a render was started must not meet what ends it
        begin, hold = QHBoxLayout(), QHBoxLayout()
        for row, buttons in (
            (begin, (self.start_button, self.continue_button)),
            (hold, (self.pause_button, self.keep_button, self.cancel_button)),
        ):
            for button in buttons:
                row.addWidget(button)
        for label in (self.stage, self.errors):
            label.setObjectName("muted")
        self.stage.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        layout = QVBoxLayout(self)
        layout.addLayout(form)
        layout.addLayout(begin)
        layout.addLayout(hold)
        layout.addWidget(self.bar)
        layout.addWidget(self.stage)
        layout.addWidget(self.history, 1)
        # texts last: of any length, they must not move what is clicked
        layout.addWidget(self.errors)
        layout.addWidget(self.plan)

    def _connect(self) -> None:
        session, runner = self.session, self.runner
        session.project_changed.connect(self._follow_project)
        session.document_replaced.connect(self._document_replaced)
        session.render_asked.connect(self.start)
        runner.progress.connect(self._tell_progress)
        for ended in (runner.finished, runner.failed, runner.cancelled):
            ended.connect(self._ended)
        self._refined.connect(self._take_frame)
        self.laser_error.valueChanged.connect(
            lambda percent: session.set(("render", "laser_error"), round(percent / 100, 8), "laser error")
        )
        self.ambient_error.valueChanged.connect(
            lambda percent: session.set(("render", "ambient_error"), round(percent / 100, 8), "ambient error")
        )
        self.goal.valueChanged.connect(
            lambda depth: session.set(("render", "goal"), {"depth": round(depth, 2)} if depth else None, "goal")
        )
        self.samples.valueChanged.connect(
            lambda count: session.set(("render", "ambient_samples"), count, "ambient samples")
        )
        self.scale.currentIndexChanged.connect(lambda index: self._show_plan())
        self.transport.activated.connect(
            lambda i: session.set(("render", "transport"), self.transport.itemData(i), "laser light")
        )
        self.start_button.clicked.connect(lambda: self.start())
        self.continue_button.clicked.connect(self.go_on)
        session.renders_changed.connect(self._show_state)
        session.renders_changed.connect(self._tell_render)
        self.pause_button.clicked.connect(self.pause)
        self.keep_button.clicked.connect(self.keep)
        self.cancel_button.clicked.connect(self.cancel)

    def _follow_project(self) -> None:
        project = self.session.project
        goal = project.render.goal
        for box in (self.laser_error, self.ambient_error, self.samples, self.goal):
            box.blockSignals(True)
        self.goal.setValue(0.0 if goal is None else goal.depth)
        self.ambient_error.setEnabled(goal is None)
        self.laser_error.setValue(100 * project.render.laser_error)
        self.ambient_error.setValue(100 * project.render.ambient_error)
        self.samples.setValue(project.render.ambient_samples)
        self.transport.setCurrentIndex(self.transport.findData(project.render.transport))
        for box in (self.laser_error, self.ambient_error, self.samples, self.goal):
            box.blockSignals(False)
        camera, chosen = project.scene.camera, max(0, self.scale.currentIndex())
        sizes = []
        for scale in SCALES:
            small = camera.scaled(scale)
            sizes.append(f"{small.width} x {small.height} px" + ("" if scale == 1.0 else f" ({scale:.3g} x)"))
        if sizes != [self.scale.itemText(i) for i in range(self.scale.count())]:
            self.scale.clear()
            for text, scale in zip(sizes, SCALES, strict=True):
                self.scale.addItem(text, scale)
            self.scale.setCurrentIndex(chosen)
        self._show_plan()

    def _show_plan(self) -> None:
        if not self.isVisible():
            return
        from render.products import expected_plan  # takes a while: a window opens without this panel

        project = self.session.project
        scale = self.scale.currentData()
        scene = project.scene.scaled(scale if scale is not None else 1.0)
        self.plan.setText(plan_text(expected_plan(scene, project.render_settings)))

    def _tell_render(self) -> None:
        """What was computed of the running render, else of the shown one, and how well it is known."""
        render = self.session.shown if self._job is None else self._render
        self.errors.setText("" if render is None else error_text(render))
        self.errors.setVisible(bool(self.errors.text()))
        if render is not None and not render.is_stale(self.session.project):
            self.plan.setText(plan_text(render.frame.plan))

    def _document_replaced(self) -> None:
        self._render, self._before = None, None
        self.cancel()

    def _same_world(self, project: Project, step: int) -> World | None:
        """The world of an earlier render in which every object stands where it stands now."""
        for render in reversed(self.session.renders):
            scene, now = render.project.scene, project.scene
            if (scene.objects, scene.motion, render.frame.step) == (now.objects, now.motion, step):
                return render.world
        return None

    def _take_frame(self, world: World, frame: Frame) -> None:
        if self._job is None or (self._job.cancel_asked and not self._keep):
            return
        if self._render is None:
            number, project, source, image_scale = self._template
            self._render = Render(
                number,
                project,
                world,
                frame,
                final=False,
                created=time.strftime("%H:%M:%S"),
                image_scale=image_scale,
                source=source,
                asked=self.asked,
            )
            self._figures.of(self._render)
            self.session.add_render(self._render)
        else:
            self._render.frame = frame.carrying(self._render.frame)
            self._render.kept = None  # what is with the project is of less light
            self.session.renders_changed.emit()
        self._figures.warn(frame.warnings)

    def _tell_progress(self, job: Job[None]) -> None:
        if job is self._job:
            self.pause_button.setText(_to_pause(job))
            if job.done > 0.0:  # the status bar's runs to and fro until then
                self.bar.show_share(job.done)
            left = "paused" if job.state is State.PAUSED else time_left(job.seconds_left)
            self.stage.setText(f"{job.stage}   {left}")

    def _ended(self, job: Job[None]) -> None:
        if job is not self._job:
            return
        render, self._job = self._render, None
        session = self.session
        if render is not None:
            self._state.pause()
            early = render.frame.unfinished
            render.state = self._state if early or job.state is not State.DONE else None
        if job.state is State.DONE and render is not None:
            render.final = render.state is None
            session.renders_changed.emit()
        elif render is not None and not (self._keep and job.state is State.CANCELLED):
            session.renders = [other for other in session.renders if other is not render]
            session.show(session.present(self._before) if session.shown is render else session.shown)
        elif render is not None:
            session.renders_changed.emit()
        if job.state is State.FAILED and job.problem is not None:
            session.message.emit("error", job.problem.text)
        self._show_state()
        self._tell_render()

    def _show_state(self) -> None:
        job = self._job
        running = job is not None
        self.start_button.setEnabled(not running)
        self.continue_button.setEnabled(not running)
        if not running:  # while it runs what stands there stays
            self.continue_button.setVisible(can_go_on(self.session.shown))
        for button in (self.pause_button, self.keep_button, self.cancel_button):
            button.setVisible(running)
            button.setEnabled(job is not None and not job.cancel_asked)
        self.pause_button.setText(_to_pause(job))
        self.bar.setVisible(running)
        self.stage.setVisible(running)
        if not running:
            self.bar.show_none()
            self.stage.clear()


def _to_pause(job: Job[None] | None) -> str:
    return "Go on" if job is not None and job.state is State.PAUSED else "Pause"
