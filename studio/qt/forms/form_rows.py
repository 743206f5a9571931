"""The rows of a form: label, editor, reset and the reason why a value was refused."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import Qt
from PySide6.QtGui import QContextMenuEvent
from PySide6.QtWidgets import QBoxLayout, QGridLayout, QHBoxLayout, QLabel, QMenu, QVBoxLayout, QWidget

from studio.editing.forms import REQUIRED, FieldSpec, field_path
from studio.project.document import FieldPath
from studio.qt.forms.fields import ChoiceField, CurveField, CurvePlot, FlagField, NumbersField, TextField, tool_button
from studio.qt.forms.number_field import NumberField, VectorField
from studio.study.draft import varying

if TYPE_CHECKING:
    from studio.qt.forms.form import Form

LABEL_WIDTH, RESET_WIDTH, SPACING = 100, 20, 5


def _itself(value: Any) -> Any:
    return value


class Row(QWidget):
    """One field: label, editor, reset button, and under them why a value was refused."""

    def __init__(self, form: Form, owner: FieldPath, spec: FieldSpec) -> None:
        super().__init__()
        self.form, self.owner, self.spec = form, owner, spec
        self.setObjectName(spec.name)
        grid = QGridLayout(self)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setHorizontalSpacing(SPACING)
        grid.setVerticalSpacing(1)
        grid.setColumnStretch(1, 1)
        self.label = self._make_label()
        self.editor = self._make_editor()
        self.reset = tool_button("↺", "Back to the default")
        self.reset.setFixedSize(RESET_WIDTH, RESET_WIDTH)
        self.reset.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        policy = self.reset.sizePolicy()
        policy.setRetainSizeWhenHidden(True)
        self.reset.setSizePolicy(policy)
        self.reset.clicked.connect(lambda: self.change(self._default(), f"reset {self.spec.label.lower()}"))
        self.reason = QLabel(wordWrap=True)
        self.reason.setObjectName("error")
        self.reason.hide()
        grid.addWidget(self.label, 0, 0, Qt.AlignmentFlag.AlignTop)
        grid.addWidget(self.editor, 0, 1)
        grid.addWidget(self.reset, 0, 2, Qt.AlignmentFlag.AlignTop)
        grid.addWidget(self.reason, 1, 1, 1, 2)
        self.label.setMinimumHeight(self.editor.sizeHint().height() if spec.kind != "curve" else 0)
        self.setToolTip(self._help())
        self.refresh(spec)

    def refresh(self, spec: FieldSpec) -> None:
        """The same field with another value."""
        self.spec = spec
        for editor, value in self._parts():
            editor.show_value(value)
        default = self._default()
        known = default is not REQUIRED and self._text(self._value()) != self._text(default)
        self.reset.setVisible(known)
        if known:
            self.reset.setToolTip(f"Back to the default: {self._text(default)}")

    def is_stale(self, spec: FieldSpec) -> bool:
        """Whether something else is to be shown, now that the field is this."""
        return bool(self.spec.value != spec.value or self.spec.default != spec.default)

    def change(self, value: Any, label: str = "", merge: str = "") -> bool:
        """Ask the form for the change; a refusal is told under the field."""
        why = self.form.change(self.owner, self.spec, value, label, merge)
        self.tell(why or "")
        return why is None

    def tell(self, why: str) -> None:
        self.reason.setText(why[:1].upper() + why[1:])
        self.reason.setVisible(bool(why))

    def varied(self) -> list[tuple[FieldPath, FieldSpec]]:
        """What a study can vary here."""
        return varying(field_path(self.owner, self.spec), self.spec)

    def fill_menu(self, menu: QMenu) -> None:
        """What can be done with the field, besides what its editor offers."""
        session = self.form.session
        for path, spec in self.varied():
            ask = partial(session.vary_asked.emit, path, spec)
            menu.addAction(f"Vary {spec.label} in a study", ask)

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        menu = QMenu(self)
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.fill_menu(menu)
        if menu.actions():
            menu.popup(event.globalPos())

    def mark(self, wrong: bool) -> None:
        """Outline the value as one that will not do; what is being typed has its own say."""
        for editor, _ in self._parts():
            if isinstance(editor, TextField | ChoiceField) and not getattr(editor, "pending", False):
                editor.set_invalid(wrong)

    def _title(self) -> tuple[str, str]:
        """What the label says, and the unit where the editor does not show it."""
        return self.spec.label, self.spec.unit.shown if self.spec.kind == "numbers" else ""

    def _make_label(self) -> QWidget:
        title, unit = self._title()
        holder = QWidget()
        holder.setFixedWidth(LABEL_WIDTH)
        layout = QBoxLayout(QBoxLayout.Direction.LeftToRight if len(unit) < 5 else QBoxLayout.Direction.TopToBottom)
        holder.setLayout(layout)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(SPACING if len(unit) < 5 else 0)
        layout.addWidget(QLabel(title, wordWrap=len(unit) == 0))
        if unit:
            muted = QLabel(unit.replace("^2", "²"))
            muted.setObjectName("muted")
            layout.addWidget(muted)
            layout.addStretch(1)
        return holder

    def _help(self) -> str:
        spec = self.spec
        parts = [f"<b>{spec.label}</b>", spec.help]
        if spec.low is not None and spec.high is not None and spec.kind in ("number", "integer"):
            opens = "more than " if spec.low_open else ""
            parts.append(f"{opens}{spec.unit.format(spec.low)} to {spec.unit.with_unit(spec.high)}")
        if spec.kind in ("number", "integer"):
            parts.append("<i>Click to type (other units too), drag sideways to change.</i>")
        return "<br>".join(part for part in parts if part)

    def _value(self) -> Any:
        return self.spec.value

    def _default(self) -> Any:
        return self.spec.default

    def _text(self, value: Any) -> str:
        if value is None:
            return "none"
        if isinstance(value, tuple):
            return " ".join(self._text(part) for part in value) or "none"
        if isinstance(value, float | int) and not isinstance(value, bool):
            return self.spec.unit.with_unit(value)
        return str(value)

    def _make_editor(self) -> QWidget:
        spec = self.spec
        if spec.kind == "curve":
            return self._curve()
        if spec.kind == "file":
            return self._file()
        if spec.kind == "numbers" and spec.length is not None:
            return self._vector([replace(spec, kind="number", value=value) for value in spec.value], self._with_part)
        editor: FlagField | ChoiceField | TextField
        if spec.kind == "flag":
            editor = FlagField(spec)
        elif spec.kind == "choice":
            editor = ChoiceField.of(spec)
        elif spec.kind in ("number", "integer"):
            editor = NumberField(spec)
        else:
            editor = (NumbersField if spec.kind == "numbers" else TextField)(spec)
        self._connect(editor)
        return editor

    def _parts(self) -> list[tuple[Any, Any]]:
        """The editors and what each shows."""
        if isinstance(self.editor, VectorField):
            return list(zip(self.editor.fields, self._value(), strict=True))
        if self.spec.kind == "curve":
            self.plot.show_curve(self.spec.value)
            return [(self.text, self.spec.value)]
        if self.spec.kind == "file":
            return [(self.text, self.spec.value)]
        return [(self.editor, self.spec.value)]

    def _with_part(self, i: int, part: Any) -> Any:
        value = self._value()
        return (*value[:i], part, *value[i + 1 :])

    def _vector(self, specs: list[FieldSpec], whole: Callable[[int, Any], Any]) -> VectorField:
        vector = VectorField(specs)
        for i, field in enumerate(vector.fields):
            self._connect(field, partial(whole, i))
        return vector

    def _connect(self, field: FlagField | ChoiceField | TextField, whole: Callable[[Any], Any] = _itself) -> None:
        """Wire an editor of the value, or of a part of it that `whole` completes."""

        def enter(value: Any) -> None:
            if self.change(whole(value)):
                self.refresh(self.spec)  # as it is written here: 20 for 20.0
            else:
                field.reject()

        field.entered.connect(enter)
        if isinstance(field, TextField):
            field.refused.connect(self.tell)
            field.given_up.connect(self._tell_given_up)
            field.menu_asked.connect(self.fill_menu)
        if isinstance(field, NumberField):
            merge = f"drag {field_path(self.owner, self.spec)} {id(field)}"
            field.drag_began.connect(self.form.session.begin_drag)
            field.dragged.connect(lambda value: self.change(whole(value), merge=merge))
            field.drag_ended.connect(self._end_drag)

    def _tell_given_up(self) -> None:
        why = self.reason.text().rstrip(".")
        self.form.session.message.emit("warning", f"{self.spec.label}: {why}. The value is as it was")

    def _end_drag(self, keep: bool) -> None:
        changed = self.form.session.document.undo_label is not None and self.form.dragged
        self.form.session.end_drag()
        if changed and not keep:
            self.form.session.document.undo()
        self.form.dragged = False
        self.tell("")

    def _curve(self) -> QWidget:
        holder = QWidget()
        column = QVBoxLayout(holder)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(3)
        self.plot = CurvePlot()
        self.plot.show_curve(self.spec.value)
        self.text: TextField = CurveField(self.spec)
        self._connect(self.text)
        column.addWidget(self.plot)
        column.addWidget(self.text)
        return holder

    def _file(self) -> QWidget:
        holder = QWidget()
        line = QHBoxLayout(holder)
        line.setContentsMargins(0, 0, 0, 0)
        line.setSpacing(3)
        self.text = TextField(self.spec)
        self._connect(self.text)
        browse = tool_button("…", "Choose a file")
        browse.clicked.connect(lambda: self.form.choose_file(self.owner, None))
        line.addWidget(self.text)
        line.addWidget(browse)
        return holder
