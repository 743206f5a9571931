"""One field that a study varies: its name, and its values as a list or a range, in the units that people read."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import (
    QHBoxLayout,
    QLabel,
    QLayout,
    QMenu,
    QPushButton,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from render.base.errors import InputError
from studio.editing.forms import FieldSpec, choice_label
from studio.project.document import FieldPath, value_at
from studio.project.project import Project
from studio.qt.core.boxes import WholeBox
from studio.qt.core.icons import icon_button
from studio.qt.forms.fields import ChoiceField, TextField
from studio.qt.forms.number_field import NumberField
from studio.study.draft import COUNT, Data
from studio.study.study import MOST_VALUES, parts_of

KINDS = [
    ("List", "list", "Values one by one"),
    ("Range", "linear", "From, to, and how many at equal steps"),
    ("Log range", "logarithmic", "From, to, and how many at equal factors"),
]
UNTIL_MENDED = "Until it is mended the study has the values from before."
UNKNOWN = FieldSpec("", "", "", "number", 0.0)
"""Of a field that the base project does not have."""


class ValuesField(TextField):
    """A list of numbers in the shown unit, separated by spaces or commas; one that will not do stays to be mended."""

    def text_of(self, value: Any) -> str:
        return "  ".join(self.spec.unit.format(one) for one in value)

    def read(self, text: str) -> list[float]:
        parts = text.replace(",", " ").split()
        if not parts:
            raise InputError("a value is missing")
        return [self._read_one(part) for part in parts]

    def _read_one(self, part: str) -> float:
        """InputError: which entry will not do, and why."""
        try:
            value = self.spec.unit.parse(part)
        except InputError as error:
            raise InputError(f"“{part}”: {error.what}", allowed=error.allowed) from None
        whole = self.spec.kind == "integer"
        problem = "must be a whole number" if whole and value != int(value) else self.spec.problem(value)
        if problem:
            raise InputError(f"“{part}” {problem}")
        return int(value) if whole else value

    def leave(self) -> None:
        """A list is long to type again: unlike a single value it is not dropped for one bad entry."""
        self.enter()
        if self.pending:
            self.given_up.emit()


class ChoicesButton(QPushButton):
    """Several of a few values, ticked in a menu."""

    entered = Signal(object)

    def __init__(self, choices: tuple[Any, ...]) -> None:
        super().__init__()
        self.choices = choices
        self.list = QMenu(self)
        self.setMenu(self.list)
        self.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        self.actions_ = [self.list.addAction(_called(choice)) for choice in choices]
        for action in self.actions_:
            action.setCheckable(True)
            action.triggered.connect(lambda _checked: self.entered.emit(self.chosen()))

    def chosen(self) -> list[Any]:
        return [choice for choice, action in zip(self.choices, self.actions_, strict=True) if action.isChecked()]

    def show_value(self, values: Any) -> None:
        for choice, action in zip(self.choices, self.actions_, strict=True):
            action.setChecked(choice in values)
        text = ", ".join(_called(value) for value in values) or "none"
        self.setText(self.fontMetrics().elidedText(text, Qt.TextElideMode.ElideRight, 230))
        self.setToolTip(text)


class ParameterRow(QWidget):
    """`changed` carries the parameter as a study's file has it."""

    changed = Signal(object)
    removed = Signal()
    given_up = Signal(str)
    """Why what was typed is dropped, as its field is left."""

    def __init__(self, project: Project, parameter: Data, spec: FieldSpec | None) -> None:
        """spec: None, the base project has no such field."""
        super().__init__()
        self.parameter, self.spec = parameter, spec or UNKNOWN
        self.title = QLabel()
        self.title.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        name = parameter.get("label") or (spec.label if spec is not None else parameter["field"])
        owner = owner_name(project, tuple(parts_of(parameter["field"])))
        self.title.setText(f"{name}   <span style='font-weight: 400'>{owner}</span>" if owner else name)
        self.title.setStyleSheet("QLabel { font-weight: 600 }")
        self.title.setToolTip(parameter["field"])
        remove = icon_button("cancel", f"No longer vary {name}", self.removed.emit)
        self.remove = remove
        self.reason = QLabel(wordWrap=True)
        self.reason.setObjectName("error")
        self.reason.hide()
        head = QHBoxLayout()
        head.setSpacing(2)
        head.addWidget(self.title, 1)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 2, 0, 4)
        column.setSizeConstraint(QLayout.SizeConstraint.SetMinimumSize)  # until the panel has grown to hold it
        column.setSpacing(3)
        column.addLayout(head)
        column.addLayout(self._editors(head))
        head.addWidget(remove)
        column.addWidget(self.reason)
        self.refresh(parameter)

    @property
    def kind(self) -> str:
        return kind_of(self.parameter)

    def refresh(self, parameter: Data) -> None:
        """The same field with other values, of the same kind."""
        self.parameter = parameter
        if self.choices is not None:
            self.choices.show_value(parameter.get("values", []))
            return
        self.kinds.show_value(self.kind)
        if self.kind == "list":
            self.values.show_value(parameter["values"])
        else:
            self.low.show_value(parameter.get("low"))
            self.high.show_value(parameter.get("high"))
            self.count.blockSignals(True)
            self.count.setValue(parameter.get("count", COUNT))
            self.count.blockSignals(False)

    def allow_count(self, allowed: bool) -> None:
        """False: how many there are is decided by the sampling."""
        if self.choices is None and self.kind != "list":
            self.count.setEnabled(allowed)

    def _editors(self, head: QHBoxLayout) -> QHBoxLayout:
        """The line of values; how they are told joins the head."""
        line, spec = QHBoxLayout(), self.spec
        line.setSpacing(4)
        self.choices: ChoicesButton | None = None
        others = spec.choices if spec.kind == "choice" else (False, True) if spec.kind == "flag" else ()
        listed = self.parameter.get("values", [])
        if not others and any(isinstance(value, str | bool) or value is None for value in listed):
            others = tuple(listed)
        if others:
            self.choices = ChoicesButton(others)
            self.choices.entered.connect(lambda values: self._change(values=values))
            line.addWidget(self.choices)
            return line
        self.kinds = ChoiceField(KINDS)
        self.kinds.setAccessibleName("Values as")
        self.kinds.entered.connect(self._change_kind)
        head.addWidget(self.kinds)
        if self.kind == "list":
            self.values = ValuesField(replace(spec, value=listed))
            self.values.setToolTip(f"Values in {spec.unit.shown}" if spec.unit.shown else "Values")
            self.values.entered.connect(lambda values: self._change(values=values))
            self.values.refused.connect(self._tell)
            self.values.given_up.connect(lambda: self._tell(f"{self.reason.text()}. {UNTIL_MENDED}"))
            line.addWidget(self.values, 1)
            unit = QLabel(spec.unit.shown)
            unit.setObjectName("muted")
            line.addWidget(unit)
            return line
        self.low, self.high = (self._end(name) for name in ("low", "high"))
        self.count = WholeBox(minimum=2, maximum=MOST_VALUES)
        self.count.setToolTip("How many values, both ends among them")
        self.count.setKeyboardTracking(False)
        self.count.valueChanged.connect(lambda count: self._change(count=count))
        self.count.setMinimumHeight(self.low.sizeHint().height())
        for field in (self.low, self.high):
            line.addWidget(field, 1)
        line.addWidget(self.count)
        return line

    def _end(self, name: str) -> NumberField:
        # the values of a range need not be allowed one by one: a search goes from where a limit holds
        field = NumberField(replace(self.spec, kind="number", value=self.parameter.get(name), optional=False))
        field.setToolTip("From" if name == "low" else "To")
        field.entered.connect(lambda value: self._change(**{name: float(value)}))
        field.dragged.connect(lambda value: self._change(**{name: float(value)}))
        field.refused.connect(self._tell)
        field.given_up.connect(self._tell_given_up)
        return field

    def _tell(self, why: str) -> None:
        self.reason.setText(why[:1].upper() + why[1:])
        self.reason.setVisible(bool(why))

    def _tell_given_up(self) -> None:
        self.given_up.emit(f"{self.reason.text()}. The value is as it was")

    def _change(self, **values: Any) -> None:
        self._tell("")
        self.changed.emit({**self.parameter, **values})

    def _change_kind(self, kind: str) -> None:
        if kind != self.kind:
            self.changed.emit(as_kind(self.parameter, kind, self.spec))


def kind_of(parameter: Data) -> str:
    """list, linear or logarithmic."""
    return "list" if parameter.get("values") is not None else str(parameter.get("spacing", "linear"))


def as_kind(parameter: Data, kind: str, spec: FieldSpec) -> Data:
    """The same field with about the same values, told in another way."""
    kept: Data = {name: parameter[name] for name in ("field", "label") if name in parameter}
    if kind == "list":
        from studio.study.study import Parameter

        values = [float(f"{value:.4g}") for value in Parameter.model_validate(parameter).grid()]
        if spec.kind == "integer":
            values = sorted({round(value) for value in values})
        return {**kept, "values": values}
    if kind_of(parameter) == "list":
        values = [float(value) for value in parameter["values"]]
        low, high, count = values[0], values[-1], max(len(values), 2)
        if low == high:
            high = 2.0 * low or 1.0
    else:
        low, high, count = parameter["low"], parameter["high"], parameter.get("count", COUNT)
    return {**kept, "low": low, "high": high, "count": count, "spacing": kind}


def owner_name(project: Project, path: FieldPath) -> str:
    """What of the scene a field belongs to: "Line laser", "sensor"."""
    for above in range(len(path) - 1, 0, -1):
        try:
            name = getattr(value_at(project, path[:above]), "name", "")
        except KeyError:
            return ""
        if name:
            return str(name)
    words = [str(part) for part in path if isinstance(part, str)]
    return next((word for word in ("camera", "rig", "environment", "motion") if word in words[:-1]), words[0])


def _called(value: Any) -> str:
    return {True: "on", False: "off"}[value] if isinstance(value, bool) else choice_label(value)
