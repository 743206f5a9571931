"""Baseline, triangulation angle and stand-off as numbers that move laser and rig: typed, or dragged sideways."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
from PySide6.QtCore import QObject, Qt
from PySide6.QtWidgets import QToolTip, QWidget

from render.base.arrays import Float
from render.base.errors import InputError
from studio.editing.forms import FieldSpec
from studio.editing.placement import vector
from studio.editing.placing import at_angle, at_baseline, turned_to
from studio.editing.units import Unit
from studio.preview.preview import Look
from studio.preview.readouts import Readouts, readouts
from studio.preview.remedy_changes import lit_point
from studio.project.document import FieldPath, replaced
from studio.project.project import Project
from studio.qt.core import theme
from studio.qt.core.live_preview import live
from studio.qt.core.session import Session
from studio.qt.forms.number_field import NumberField

SPECS = {
    "baseline": FieldSpec("baseline", "Baseline", "", "number", None, unit=Unit.of("m"), low=1e-3, high=100.0),
    "angle": FieldSpec(
        "angle", "Angle", "", "number", None, unit=Unit.of("rad"), low=math.radians(0.1), high=math.radians(175.0)
    ),
    "standoff": FieldSpec("standoff", "Stand-off", "", "number", None, unit=Unit.of("m"), low=1e-3, high=100.0),
}
"""By the key of the read-out's row."""
LABELS = {"baseline": "baseline", "angle": "triangulation angle", "standoff": "stand-off"}
DIGITS = 4
TRIES, NEAR = 10, 1e-5
"""How often a move is corrected by what is then read, and what is near enough, m or rad."""
Start = tuple[Project, tuple[Float, ...], dict[str, float | None]]
"""Project, lit point of each laser, and read-outs before anything moved."""
WIDTH = 88
NOTHING_LIT = "The laser's line is not in the image: aim the laser (T), move one of them, or undo (Ctrl+Z)"


class PlacingField(NumberField):
    """A read-out that can be set."""

    why = ""
    """What was typed last was refused for."""

    def explain(self, help: str) -> None:
        """What it is, or why it takes nothing."""
        self.setToolTip(help if self.isEnabled() else NOTHING_LIT)

    def mark(self, level: str) -> None:
        """In the colour of what is out of range."""
        colours = theme.colours()
        colour = {"": colours.text, "warning": colours.warning, "error": colours.error}[level]
        style = f"QLineEdit {{ color: {colour}; font-weight: 600 }}"  # and not its tip
        if self.styleSheet() != style:
            self.setStyleSheet(style)


class PlacingFields(QObject):
    """Three fields, each of which moves what it is of from where it was when its drag began."""

    def __init__(self, session: Session, panel: QWidget) -> None:
        """panel: holds the fields, which are hidden until it lays them out."""
        super().__init__(panel)
        self.session = session
        self.laser = 0
        self.values: dict[str, float | None] = {}
        self._look: Look | None = None
        self._start: Start | None = None
        self.fields = {key: PlacingField(spec, panel) for key, spec in SPECS.items()}
        for key, field in self.fields.items():
            field.hide()
            field.setAlignment(Qt.AlignmentFlag.AlignRight)
            field.setFixedWidth(WIDTH)
            field.entered.connect(partial(self.set, key))
            field.refused.connect(partial(self._tell_why, field))
            field.given_up.connect(partial(self._tell_given_up, key))
            field.drag_began.connect(self._begin)
            field.dragged.connect(partial(self._drag, key))
            field.drag_ended.connect(self._end)

    def show_values(self, look: Look, laser: int, found: Readouts) -> None:
        """Follow the read-outs of a laser."""
        self.laser, self._look = laser, look
        self.values = _values(found)
        for key, field in self.fields.items():
            value = self.values[key]
            field.setEnabled(value is not None)
            field.setPlaceholderText("no line" if value is None else "")
            if not field.hasFocus() or not field.pending:
                scale = field.spec.unit.factor
                field.show_value(None if value is None else float(f"{value * scale:.{DIGITS}g}") / scale)

    def set(self, key: str, value: float) -> None:
        """Move the laser, or the rig, so that the read-out becomes a value; one step to undo."""
        self._move(key, value, self._now(), "")

    def _now(self) -> Start:
        look = self._look
        lasers = () if look is None else look.scene.lasers
        # a laser that was just added or removed is not in the look yet
        same = look is not None and len(lasers) == len(self.session.project.scene.lasers)
        points = tuple(lit_point(look, i) for i in range(len(lasers))) if look is not None and same else ()
        return self.session.project, points, dict(self.values)

    def _tell_why(self, field: PlacingField, why: str) -> None:
        """Beside the field, as its row has no room for it."""
        field.why = why or field.why
        QToolTip.showText(field.mapToGlobal(field.rect().bottomLeft()), why, field)

    def _tell_given_up(self, key: str) -> None:
        told = f"{SPECS[key].label}: {self.fields[key].why}. The value is as it was"
        self.session.message.emit("warning", told)

    def _begin(self) -> None:
        self._start = self._now()
        self.session.begin_drag()

    def _drag(self, key: str, value: float) -> None:
        if self._start is not None:
            self._move(key, value, self._start, f"drag {key}")

    def _end(self, keep: bool) -> None:
        start, self._start = self._start, None
        self.session.end_drag()
        if not keep and start is not None and self.session.project != start[0]:
            self.session.document.undo()

    def _move(self, key: str, value: float, start: Start, merge: str) -> None:
        """By as much as makes the read-out the value: what is lit moves over the part, which may be of any shape."""
        if not start[1]:
            return
        asked, made, off = value, None, math.inf
        try:
            for _ in range(TRIES):
                tried = self._moved(key, asked, start)
                found = self._read(key, tried)
                if made is None or (found is not None and abs(found - value) < off):
                    made, off = tried, math.inf if found is None else abs(found - value)
                if found is None or off <= NEAR:
                    break
                asked = SPECS[key].clamped(asked + value - found)
        except InputError as error:
            self.session.message.emit("error", str(error))
            return
        if made is not None:
            self.session.document.apply(f"set the {LABELS[key]}", made, merge)
            if math.isinf(off) and not merge:
                why = f"at this {LABELS[key]} the camera sees nothing that the laser lights; Ctrl+Z takes it back"
                self.session.message.emit("warning", why)

    def _moved(self, key: str, value: float, start: Start) -> Project:
        project, points, before = start
        scene = project.scene
        camera = scene.camera.T_rig_camera.matrix
        pose, point = scene.lasers[self.laser].T_rig_laser, points[self.laser]
        if key == "baseline":
            return replaced(project, _pose_of(self.laser), at_baseline(pose, camera[:3, 3], point, value))
        if key == "angle":
            return replaced(project, _pose_of(self.laser), at_angle(pose, camera[:3, 3], point, value))
        farther = value - (before[key] or 0.0)
        moved = vector(np.array(scene.rig.T_world_rig.translation) - farther * scene.T_world_camera()[:3, 2])
        project = replaced(project, ("scene", "rig", "T_world_rig", "translation"), moved)
        for i, lit in enumerate(points):
            # each laser is aimed to where the camera sees its line at the new distance, which so stays in the image
            offset = lit - camera[:3, 3]
            depth = float(offset @ camera[:3, 2])
            seen = camera[:3, 3] + offset * (depth + farther) / depth
            project = replaced(project, _pose_of(i), turned_to(scene.lasers[i].T_rig_laser, lit, seen))
        return project

    def _read(self, key: str, project: Project) -> float | None:
        return _values(readouts(live(self.session).look_at(project), self.laser))[key]


def _pose_of(laser: int) -> FieldPath:
    return ("scene", "rig", "lasers", laser, "T_rig_laser")


def _values(found: Readouts) -> dict[str, float | None]:
    angle, distance = found.triangulation_angle, found.distance
    return {
        "baseline": found.baseline,
        "angle": None if angle is None else angle.middle,
        "standoff": None if distance is None else distance.middle,
    }
