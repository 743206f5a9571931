"""Forms made of `FieldSpec`s: rows in sections that fold, kind choosers; updated in place as the project changes."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

from PySide6.QtCore import QPointF, QSize, Qt
from PySide6.QtGui import QColor, QFont, QPainter, QPaintEvent
from PySide6.QtWidgets import QAbstractButton, QHBoxLayout, QLabel, QVBoxLayout, QWidget

from render.base.errors import InputError
from studio.editing.forms import Alternative, FieldSpec, describe_item, edited, field_path, start_value
from studio.editing.scene_edits import new_motion
from studio.editing.targets import other_frame
from studio.project.document import FieldPath, value_at
from studio.project.project import Project
from studio.project.project_files import in_project
from studio.qt.core import theme
from studio.qt.core.session import Session
from studio.qt.core.widgets import bring_into_view
from studio.qt.forms.fields import ChoiceField, TextField, reason, tool_button
from studio.qt.forms.form_rows import LABEL_WIDTH, RESET_WIDTH, SPACING, Row
from studio.qt.forms.pose_rows import PositionRow, RotationRow

GROUPS = ("model", "union", "list", "pose")
"""Kinds that stand in a section of their own."""
PLACES = {"world": "Pose in the world", "rig": "Pose on the rig"}
"""What a pose is called by its frame."""
MAX_ITEMS = 12
"""Of a list, shown."""
ChooseFile = Callable[[FieldPath, Alternative | None], object]
"""(path of a shape, texture or material, the kind it is to have or None for its own): let a person choose a file."""
Adjust = Callable[[FieldPath, Project, Project], Project]
"""(path of the owner of a field, the project before and after its edit) -> with what else has to follow."""


class Fold(QAbstractButton):
    """The title of a section: an arrow, the name, a hairline above."""

    def __init__(self, title: str) -> None:
        super().__init__(text=title, checkable=True)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        font = QFont(self.font())
        font.setBold(True)
        self.setFont(font)
        self.setFixedHeight(self.fontMetrics().height() + 12)

    def sizeHint(self) -> QSize:
        return QSize(self.fontMetrics().horizontalAdvance(self.text()) + 24, self.height())

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        colours = theme.colours()
        painter.setPen(QColor(colours.line))
        painter.drawLine(0, 0, self.width(), 0)
        text = QColor(colours.accent if self.underMouse() or self.hasFocus() else colours.text)
        middle = self.height() / 2 + 1
        arrow = [(1, middle - 2), (9, middle - 2), (5, middle + 3)]
        if not self.isChecked():
            arrow = [(3, middle - 4), (8, middle), (3, middle + 4)]
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(colours.muted))
        painter.drawPolygon([QPointF(x, y) for x, y in arrow])
        painter.setPen(text)
        painter.drawText(self.rect().adjusted(15, 2, 0, 0), Qt.AlignmentFlag.AlignVCenter, self.text())
        painter.end()


class Section(QWidget):
    """A title that folds what is under it."""

    folded: dict[str, bool] = {}  # noqa: RUF012 - shared on purpose: a section folded once stays so for every item

    def __init__(self, title: str, help: str = "", tools: tuple[QWidget, ...] = ()) -> None:
        """tools: small buttons at the end of the title's line."""
        super().__init__()
        self.title = title
        self.button = Fold(title)
        self.button.setToolTip(help)
        self.body = QWidget()
        self.rows = QVBoxLayout(self.body)
        self.rows.setContentsMargins(0, 0, 0, 6)
        self.rows.setSpacing(4)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 2, 0, 0)
        column.setSpacing(0)
        head = QHBoxLayout()
        head.setContentsMargins(0, 0, RESET_WIDTH + SPACING if tools else 0, 0)
        head.addWidget(self.button, 1)
        for tool in tools:
            head.addWidget(tool)
        column.addLayout(head)
        column.addWidget(self.body)
        shown = not Section.folded.get(title, False)
        self.button.setChecked(shown)
        self.body.setVisible(shown)
        self.button.toggled.connect(self._fold)

    def _fold(self, shown: bool) -> None:
        Section.folded[self.title] = not shown
        self.body.setVisible(shown)


class Form(QWidget):
    """The fields of one item of the project."""

    elsewhere: set[str] = set()  # noqa: RUF012 - shared on purpose, as what is folded
    """Names of poses that are shown in the other frame, the world's or the rig's."""

    def __init__(self, session: Session, choose: ChooseFile) -> None:
        super().__init__()
        self.session, self.choose_file = session, choose
        self.adjust: Adjust = lambda owner, before, after: after
        self.rows: dict[FieldPath, list[Row]] = {}
        """By where the value stands; a pose has two."""
        self.kinds: dict[FieldPath, ChoiceField] = {}
        self.dragged = False
        self._structure: Any = None
        self._column = QVBoxLayout(self)
        self._column.setContentsMargins(0, 0, 0, 0)
        self._column.setSpacing(4)
        self._content: QWidget | None = None
        session.step_changed.connect(self._follow_step)

    def show_item(self, path: FieldPath, spec: FieldSpec) -> None:
        """Show an item; in place where only values differ, so that focus and folding stay."""
        structure = (path, spec.structure)
        if structure != self._structure:
            self._structure = structure
            self._rebuild(path, spec)
        else:
            self._refresh(path, spec)

    def mark(self, wrong: Iterable[FieldPath]) -> None:
        """Outline the fields at these paths; of one that has no field of its own, the choice of its kind."""
        marked = {self._shown_at(path) for path in wrong}
        for path, rows in self.rows.items():
            for row in rows:
                row.mark(path in marked)
        for path, kind in self.kinds.items():
            kind.set_invalid(path in marked)

    def go_to(self, path: FieldPath) -> None:
        """The field at a path gets the focus, where it is seen; of one that has no field, the choice of its kind."""
        at = self._shown_at(path)
        shown: QWidget | None = self.rows[at][0].editor if at in self.rows else self.kinds.get(at)
        if shown is None:
            return
        above = shown.parentWidget()
        while above is not None and above is not self:
            if isinstance(above, Section):
                above.button.setChecked(True)
            above = above.parentWidget()
        parts = (shown, *shown.findChildren(QWidget))  # an editor may be several fields
        field = next((one for one in parts if one.focusPolicy() != Qt.FocusPolicy.NoFocus), shown)
        field.setFocus(Qt.FocusReason.OtherFocusReason)
        bring_into_view(field)

    def _shown_at(self, path: FieldPath) -> FieldPath:
        while path and path not in self.rows and path not in self.kinds:
            path = path[:-1]
        return path

    def change(self, owner: FieldPath, spec: FieldSpec, value: Any, label: str, merge: str) -> str | None:
        """Edit the document; why it was refused, or None."""
        document = self.session.document
        value = in_project(value, document.root) if spec.kind == "file" else value
        try:
            project = self.adjust(owner, document.project, edited(document.project, owner, spec, value))
        except InputError as error:
            return reason(error)
        before = document.project
        document.apply(label or f"change {spec.label.lower()}", project, merge)
        self.dragged = self.dragged or (bool(merge) and before != project)
        return None

    def _rebuild(self, path: FieldPath, spec: FieldSpec) -> None:
        self.rows, self.kinds = {}, {}
        if self._content is not None:
            # leaving the focused field must not enter anything into the next item
            for field in self._content.findChildren(TextField):
                field.pending = False
            self._column.removeWidget(self._content)
            self._content.hide()
            self._content.deleteLater()
        self._content = QWidget()
        layout = QVBoxLayout(self._content)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(4)
        if spec.kind == "union":
            self._add_kind(layout, path, spec)
        self._add_fields(layout, path, spec.fields)
        self._column.addWidget(self._content)

    def _add_fields(self, layout: QVBoxLayout, owner: FieldPath, fields: tuple[FieldSpec, ...]) -> None:
        for spec in fields:
            if spec.kind not in GROUPS:
                self._add_row(layout, Row(self, owner, spec))
        for spec in fields:
            if spec.kind in GROUPS:
                self._add_group(layout, owner, spec)

    def _add_group(
        self, layout: QVBoxLayout, owner: FieldPath, spec: FieldSpec, tools: tuple[QWidget, ...] = ()
    ) -> None:
        path = field_path(owner, spec)
        poses = spec.kind == "list" and all(item.kind == "pose" for item in spec.fields)
        if poses:
            tools = (self._tool("+", "Add a pose like the last one", lambda: self._add_item(path)),)
        title, other = spec.label, other_frame(self.session.project, path, self.session.step)
        if spec.kind == "pose" and other is not None:
            there, frame = spec.name in self.elsewhere, other[0]
            here = "rig" if frame == "world" else "world"
            title = PLACES[frame] if there else title
            tools = (*tools, self._frame_switch(spec.name, here if there else frame))
        section = Section(title, spec.help, tools)
        if spec.kind == "pose":
            self._add_row(section.rows, PositionRow(self, owner, spec))
            self._add_row(section.rows, RotationRow(self, owner, spec))
        elif spec.kind == "list":
            for i, item in enumerate(spec.fields[:MAX_ITEMS]):
                if poses and len(spec.fields) > 1:
                    remove = self._tool("\u2212", "Remove this pose", partial(self._remove_item, path, i))
                    self._add_group(section.rows, path, item, (remove,))
                elif item.kind in GROUPS:
                    self._add_group(section.rows, path, item)
                else:
                    self._add_row(section.rows, Row(self, path, item))
            if len(spec.fields) > MAX_ITEMS:
                section.rows.addWidget(QLabel(f"and {len(spec.fields) - MAX_ITEMS} more"))
        else:
            if spec.kind == "union":
                self._add_kind(section.rows, path, spec)
            self._add_fields(section.rows, path, spec.fields)
        layout.addWidget(section)

    def _tool(self, text: str, tip: str, handler: Callable[[], object]) -> QWidget:
        button = tool_button(text, tip)
        button.setFixedSize(RESET_WIDTH, RESET_WIDTH)
        button.clicked.connect(lambda _checked=False: handler())
        return button

    def _frame_switch(self, name: str, frame: str) -> QWidget:
        """Shows poses of this name in the other frame."""
        button = tool_button(frame.capitalize(), f"{PLACES[frame]} in place of this")
        button.clicked.connect(lambda _checked=False: self._switch_frame(name))
        return button

    def _switch_frame(self, name: str) -> None:
        self.elsewhere.symmetric_difference_update({name})
        path = self._structure[0]
        self._rebuild(path, describe_item(self.session.project, path))

    def _follow_step(self) -> None:
        """Where a motion carries what is shown in the other frame."""
        for rows in self.rows.values():
            for row in rows:
                if row.is_stale(row.spec):
                    row.refresh(row.spec)

    def _add_item(self, path: FieldPath) -> None:
        items = value_at(self.session.project, path)
        self.session.set(path, (*items, items[-1]), "add a pose")

    def _remove_item(self, path: FieldPath, index: int) -> None:
        items = value_at(self.session.project, path)
        self.session.set(path, (*items[:index], *items[index + 1 :]), "remove a pose")

    def _add_kind(self, layout: QVBoxLayout, path: FieldPath, spec: FieldSpec) -> None:
        if len(spec.alternatives) < 2:
            return
        field = ChoiceField([(kind.label, i, kind.help) for i, kind in enumerate(spec.alternatives)])
        field.show_value(spec.chosen)
        field.setToolTip(spec.alternatives[spec.chosen].help)
        field.entered.connect(lambda i: self._change_kind(path, i))
        self.kinds[path] = field
        line = QHBoxLayout()
        line.setContentsMargins(0, 0, RESET_WIDTH + SPACING, 0)
        line.setSpacing(SPACING)
        label = QLabel("Kind")
        label.setFixedWidth(LABEL_WIDTH)
        line.addWidget(label)
        line.addWidget(field, 1)
        layout.addLayout(line)

    def _change_kind(self, path: FieldPath, chosen: int) -> None:
        spec = describe_item(self.session.project, path)
        alternative = spec.alternatives[chosen]
        if chosen == spec.chosen:
            return
        if alternative.file:
            self.kinds[path].show_value(spec.chosen)
            self.choose_file(path, alternative)
            return
        label = f"change {spec.label.lower()} to {alternative.label.lower()}"
        if path == ("scene", "motion"):  # a stage has its direction from the laser
            value: object = new_motion(self.session.project, alternative.type)
        else:
            value = start_value(alternative, spec.value)
        self.session.set(path, value, label)
        if path in self.kinds:
            self.kinds[path].show_value(describe_item(self.session.project, path).chosen)

    def _add_row(self, layout: QVBoxLayout, row: Row) -> None:
        self.rows.setdefault(field_path(row.owner, row.spec), []).append(row)
        layout.addWidget(row)

    def _refresh(self, owner: FieldPath, spec: FieldSpec) -> None:
        for field in spec.fields:
            path = field_path(owner, field)
            for row in self.rows.get(path, ()):
                if row.is_stale(field):
                    row.refresh(field)
            if field.kind in GROUPS:
                self._refresh(path, field)
