"""Name and tolerance of the chosen measure of the part."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

from PySide6.QtCore import QEvent, QObject
from PySide6.QtWidgets import QApplication, QGridLayout, QLabel, QSizePolicy, QWidget

from analysis.gauges.gauge import NEVER_NEGATIVE, Gauge
from render.base.errors import InputError
from studio.editing.forms import describe_item
from studio.editing.units import Unit
from studio.project.document import FieldPath, value_at
from studio.qt.core.session import Session
from studio.qt.core.widgets import keep_room
from studio.qt.forms.fields import TextField, reason
from studio.qt.forms.number_field import NumberField

LIMITS = ("lower", "upper")
FIELDS = ("name", "nominal", *LIMITS)
NOMINAL_FIRST = "Give the nominal first: what is allowed is a deviation from it"
IDEALLY_ZERO = ("flatness", "straightness", "flush")
"""Kinds of which every drawing means 0, and gives the tolerance alone."""
NOMINAL_ZERO = "The nominal becomes 0, as drawings mean it where they give a tolerance alone"
BOTH_SIDES = f"{NOMINAL_ZERO}, and the tolerance is one to both sides"


class PartEditor(QWidget):
    """Of the measure at `path`; typed or dragged, each change one step of undo."""

    def __init__(self, session: Session) -> None:
        super().__init__()
        self.session = session
        self.path: FieldPath = ()
        self.fields: dict[str, TextField] = {}
        self.problem = QLabel(wordWrap=True)
        self.problem.setObjectName("error")
        keep_room(self.problem, 1)
        self.problem.hide()
        self._grid = QGridLayout(self)
        self._grid.setContentsMargins(0, 0, 0, 0)
        self._grid.setHorizontalSpacing(4)
        self._grid.setVerticalSpacing(2)
        self._grid.addWidget(self.problem, 2, 0, 1, len(FIELDS))
        for column, share in enumerate((4, 3, 3, 3)):
            self._grid.setColumnStretch(column, share)
        self._made_for: tuple[FieldPath, str] = (), ""
        self._ideal: float | None = None
        """The nominal of a measure that has none, once a tolerance is given; None: a person has to say it."""
        self._tip_of_ideal = NOMINAL_ZERO
        self._dragged = False
        self._given_up = ""
        """Why what was typed was dropped, as its field is about to be left."""

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Tips of what stands above would lie over the fields while something is typed into one."""
        focus = QApplication.focusWidget()
        return event.type() == QEvent.Type.ToolTip and focus is not None and self.isAncestorOf(focus)

    def show_gauge(self, index: int, gauge: Gauge | None) -> None:
        """None: there is none to edit."""
        self.setVisible(gauge is not None)
        if gauge is None:
            return
        self.path = ("measures", index)
        if self._made_for != (self.path, gauge.unit):
            self._made_for = self.path, gauge.unit
            self._make(gauge)
        self._ideal = 0.0 if gauge.kind in IDEALLY_ZERO else None
        self._tip_of_ideal = NOMINAL_ZERO if gauge.kind in NEVER_NEGATIVE else BOTH_SIDES
        for name, field in self.fields.items():
            field.show_value(getattr(gauge, name))
        self._allow_limits(gauge.nominal is not None)

    def _allow_limits(self, has_nominal: bool) -> None:
        """Without a nominal only where it is known; a field that is not allowed looks like the panel behind it."""
        allowed = has_nominal or self._ideal is not None
        tip = "" if has_nominal else self._tip_of_ideal if allowed else NOMINAL_FIRST
        for name in LIMITS:
            field = self.fields[name]
            field.setEnabled(allowed)
            field.setToolTip(tip or field.spec.help)
            field.setPlaceholderText("none" if allowed else "nominal first")

    def _make(self, gauge: Gauge) -> None:
        for i in range(self._grid.count() - 1, -1, -1):
            item = self._grid.itemAt(i)
            widget = None if item is None else item.widget()
            if widget is not None and widget is not self.problem:
                self._grid.removeWidget(widget)
                widget.hide()
                widget.deleteLater()
        self._tell("")
        specs = {spec.name: spec for spec in describe_item(self.session.project, self.path).fields}
        self.fields = {}
        for column, name in enumerate(FIELDS):
            spec = specs[name]
            if name == "name":
                field: TextField = TextField(spec)
            else:
                unit = Unit.of(gauge.unit)
                spec = replace(spec, unit=unit, help=f"{spec.help} In {unit.shown}, unless another unit is typed.")
                field = NumberField(spec)
                field.drag_began.connect(self.session.begin_drag)
                field.dragged.connect(partial(self._drag, name))
                field.drag_ended.connect(self._end_drag)
            label = QLabel(spec.label)
            label.setObjectName("muted")
            label.setBuddy(field)
            field.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
            field.setToolTip(spec.help)
            field.setAccessibleName(spec.label)
            field.entered.connect(partial(self._enter, name))
            field.refused.connect(self._hear)
            field.given_up.connect(partial(self._tell_given_up, name))
            if name == "nominal":
                # while it is typed, so that Tab goes on to them
                field.textEdited.connect(lambda text: self._allow_limits(bool(text.strip())))
            self._grid.addWidget(label, 0, column)
            self._grid.addWidget(field, 1, column)
            self.fields[name] = field

    def _enter(self, name: str, value: Any) -> None:
        field = self.fields[name]
        try:
            self._set(name, value)
        except InputError as error:
            field.reject()
            self._tell(reason(error))
            return
        self._tell("")

    def _tell_given_up(self, name: str) -> None:
        self._given_up = f"{self.fields[name].spec.label}: {self.problem.text()}. The value is as it was"
        self.session.message.emit("warning", self._given_up)

    def _hear(self, why: str) -> None:
        """Of a field. What was given up is told until something else is typed."""
        told, self._given_up = self._given_up, ""
        self._tell(why or told)

    def _drag(self, name: str, value: Any) -> None:
        try:
            self._set(name, value, merge=f"drag {self.path} {name}")
            self._dragged = True
        except InputError as error:
            self._tell(reason(error))

    def _end_drag(self, keep: bool) -> None:
        self.session.end_drag()
        if self._dragged and not keep:
            self.session.document.undo()
        self._dragged = False
        self._tell("")

    def _set(self, name: str, value: Any, merge: str = "") -> None:
        gauge, what = value_at(self.session.project, self.path), f"change {name} of a measure"
        if name in LIMITS and value is not None and gauge.nominal is None and self._ideal is not None:
            # one step of undo, and no moment at which the measure is a tolerance of nothing
            limits = {name: value} if gauge.kind in NEVER_NEGATIVE else {"lower": -abs(value), "upper": abs(value)}
            changed = gauge.model_copy(update={"nominal": self._ideal, **limits})
            self.session.document.set(self.path, changed, what, merge)
        else:
            self.session.document.set((*self.path, name), value, what, merge)

    def _tell(self, why: str) -> None:
        self.problem.setText(why)
        self.problem.setVisible(bool(why))
