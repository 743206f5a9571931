"""From step to step of a motion: buttons, a slider, play; a scan plays as fast as its steps are measured."""

from __future__ import annotations

from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import QHBoxLayout, QWidget

from studio.qt.core.boxes import Slider
from studio.qt.core.icons import icon, icon_button
from studio.qt.core.scan_steps import awaits_step
from studio.qt.core.session import Session

PLAY_MS = 100
PATIENCE = 50
"""Times `PLAY_MS` that a step of a scan is waited for, at most."""


class StepBar(QWidget):
    """Changes `session.step` and follows it; every view stands at that step."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.session = session
        look = session.look_at_step
        self.slider = Slider(Qt.Orientation.Horizontal)
        self.slider.setMaximum(0)
        self.slider.valueChanged.connect(look)
        self.play = icon_button("play", "Play the motion", self.toggle_play)
        self._timer = QTimer(self, interval=PLAY_MS)
        self._timer.timeout.connect(self._next)
        self._waited = 0
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        for widget in (
            icon_button("first", "First step", lambda: look(0)),
            icon_button("previous", "Step back", lambda: look(session.step - 1)),
            self.play,
            icon_button("next", "Step on", lambda: look(min(session.step + 1, self.slider.maximum()))),
            icon_button("last", "Last step", lambda: look(self.slider.maximum())),
        ):
            row.addWidget(widget)
        row.addWidget(self.slider, 1)
        session.step_changed.connect(self._follow)

    def set_count(self, count: int) -> None:
        """So many steps there are; one is nothing to play."""
        self.slider.blockSignals(True)
        self.slider.setMaximum(max(0, count - 1))
        self.slider.blockSignals(False)
        if count < 2 and self._timer.isActive():
            self.toggle_play()
        self._follow()

    def toggle_play(self) -> None:
        """Play to the end, from the start where it stands at the end; or stop."""
        if self._timer.isActive():
            self._timer.stop()
        else:
            if self.session.step >= self.slider.maximum():
                self.session.look_at_step(0)
            self._timer.start()
        self.play.setIcon(icon("pause" if self._timer.isActive() else "play"))

    def _next(self) -> None:
        if self._waited < PATIENCE and self._is_to_come():
            self._waited += 1
            return
        self._waited = 0
        if self.session.step >= self.slider.maximum():
            self.toggle_play()
        else:
            self.session.look_at_step(self.session.step + 1)

    def _is_to_come(self) -> bool:
        """The picture of the step that is looked at, where that is of a scan, or its points."""
        session, shown = self.session, self.session.shown
        if shown is None or shown.scan is None or session.changed or not session.measures:
            return awaits_step(session)
        measured = bool(shown.measurements or not shown.project.scene.lasers)
        return awaits_step(session) or not (shown.images and measured)

    def _follow(self) -> None:
        self.slider.blockSignals(True)
        self.slider.setValue(self.session.step)
        self.slider.blockSignals(False)
