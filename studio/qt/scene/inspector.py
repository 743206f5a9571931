"""The inspector: the selected item as a form, with its presets."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtGui import QFont
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QMenu, QScrollArea, QToolButton, QVBoxLayout, QWidget

from render.base.errors import InputError
from studio.editing.forms import Alternative, FieldSpec, describe_item, kind_label, start_value
from studio.editing.presets import presets_for
from studio.project.document import FieldPath, value_at
from studio.project.mesh_import import copied_beside
from studio.project.project import Project
from studio.qt.core import theme
from studio.qt.core.dialogs import choose_file
from studio.qt.core.session import Session
from studio.qt.forms.fields import tool_button
from studio.qt.forms.form import Form
from studio.qt.scene import mesh_importer, scene_actions
from studio.qt.scene.mesh_bar import MeshBar, take_mesh
from studio.qt.scene.scene_icons import item_icon
from studio.scan.logo import gone, logo_uri

TITLES = {"scene": "Scene", "rig": "Rig", "camera": "Camera", "sensor": "Sensor", "render": "Render settings",
          "extraction": "Line extraction", "delivery": "Report to hand over",
          "environment": "Environment", "motion": "Motion"}  # fmt: skip
LIST_HINTS = {
    "lasers": "The line lasers of the rig.",
    "objects": "What the scanner looks at. Drop mesh files on the scene to add more.",
    "lights": "Ambient light besides the environment.",
}
LOGO_FILES = "Images (*.png *.jpg *.jpeg);;All files (*)"
IMAGE_FILES = "Images (*.png *.jpg *.jpeg *.tif *.tiff *.bmp);;All files (*)"


class Inspector(QWidget):
    """A form for what is selected in the session."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.session = session
        self.setMinimumWidth(280)
        self.icon = QLabel()
        self.title = QLabel()
        font = QFont(self.title.font())
        font.setPointSizeF(font.pointSizeF() * 1.15)
        font.setBold(True)
        self.title.setFont(font)
        self.kind = QLabel()
        self.kind.setObjectName("muted")
        self.presets = tool_button("Presets ▾", "Cameras, sensors, lasers and materials with their sources")
        self.add = tool_button("Add ▾", "Add to the scene")
        head = QHBoxLayout()
        head.setContentsMargins(0, 0, 0, 0)
        head.setSpacing(7)
        for widget in (self.icon, self.title, self.kind):
            head.addWidget(widget)
        head.addStretch(1)
        for button in (self.presets, self.add):
            button.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
            button.setStyleSheet("QToolButton::menu-indicator { image: none; width: 0; }")
            button.setMenu(QMenu(button))
            head.addWidget(button)
        self.hint = QLabel(wordWrap=True)
        self.hint.setObjectName("muted")
        self.problem = QLabel(wordWrap=True)
        self.problem.setObjectName("error")
        self.problem.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.mesh_bar = MeshBar(session)
        self.form = Form(session, self._choose_file)
        self.form.adjust = self.mesh_bar.after_edit
        content = QWidget()
        column = QVBoxLayout(content)
        column.setContentsMargins(10, 8, 8, 8)
        column.setSpacing(6)
        column.addLayout(head)
        column.addWidget(self.hint)
        column.addWidget(self.problem)
        column.addWidget(self.mesh_bar)
        column.addWidget(self.form)
        column.addStretch(1)
        self.area = QScrollArea(widgetResizable=True)
        self.area.setFrameShape(QFrame.Shape.NoFrame)
        self.area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.area.setWidget(content)
        outer = QVBoxLayout(self)
        outer.setContentsMargins(0, 0, 0, 0)
        outer.addWidget(self.area)
        self._menus_path: FieldPath | None = None
        session.selection_changed.connect(self.refresh)
        session.project_changed.connect(self.refresh)
        session.problems_changed.connect(self._show_problem)
        theme.notice.changed.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Show the selection as it is now; an item that is gone, as nothing selected."""
        path = self.session.selection
        try:
            value = value_at(self.session.project, path)
        except KeyError:
            path, value = (), self.session.project
        is_list = isinstance(value, tuple)
        spec = FieldSpec("", "", "", "model", value) if is_list else describe_item(self.session.project, path)
        name = getattr(value, "name", None)
        self.title.setText(name or TITLES.get(str(path[-1]), str(path[-1]).capitalize()))
        self.icon.setPixmap(item_icon(self.session.project, path).pixmap(20, 20))
        self.kind.setText("" if name is None else _kind(self.session.project, path))
        hint = LIST_HINTS.get(str(path[-1]), "") if is_list else ""
        if not is_list and spec.kind != "union" and not spec.fields:
            hint = spec.help
        others = len(self.session.selections) - 1
        if others > 0:
            hint = (
                f"{others} more selected: all move, turn, are copied and deleted together; the fields are of this one."
            )
        self.hint.setText(hint)
        self.hint.setVisible(bool(hint))
        self.form.show_item(path, spec)
        self._show_problem()
        if path != self._menus_path:
            self._menus_path = path
            self._fill_menus(path, is_list)
            self.area.verticalScrollBar().setValue(0)

    def _show_problem(self) -> None:
        """Why the selection is not as it is set: in words, and at its fields."""
        text, problems = self.session.problem_of(self.session.selection), self.session.problems
        if self.session.selection == ("delivery",):
            project = self.session.project
            odd = {"logo": logo_uri(project.delivery.logo, self.session.document.root)[1], "surface_of": gone(project)}
            problems = {**problems, **{("delivery", name): why for name, why in odd.items() if why}}
            text = "\n".join(filter(None, [text, *odd.values()]))
        self.problem.setText(text)
        self.problem.setVisible(bool(text))
        self.form.mark(problems)

    def _fill_menus(self, path: FieldPath, is_list: bool) -> None:
        self.presets.menu().clear()
        scene_actions.fill_presets_menu(self.presets.menu(), self.session)
        self.presets.setVisible(not is_list and bool(presets_for(self.session.project, path)))
        self.add.menu().clear()
        if is_list:
            scene_actions.fill_add_menu(self.add.menu(), self.session, self, str(path[-1]))
        self.add.setVisible(is_list)

    def _choose_file(self, path: FieldPath, kind: Alternative | None) -> None:
        """For the mesh or image of what is at a path: a dialog, a copy into the project, and the edit."""
        root = self.session.document.root
        if path[-1] == "shape":
            file = mesh_importer.choose_mesh(self.session, self)
            if file is not None:
                mesh_importer.import_meshes(self.session, [file], self, partial(take_mesh, self.session, path[:3]))
            return
        file = choose_file(self.session, self, "Image", LOGO_FILES if path == ("delivery",) else IMAGE_FILES)
        if file is None or not mesh_importer.may_copy(self, [file], root):
            return
        try:
            self._take_image(path, kind, copied_beside(file, root, "textures"))
        except InputError as error:
            self.session.message.emit("error", str(error))

    def _take_image(self, path: FieldPath, kind: Alternative | None, image: str) -> None:
        label = f"use {Path(image).name}"
        if path == ("delivery",):
            self.session.set((*path, "logo"), image, label)
        elif kind is None:
            self.session.set((*path, "path"), image, label)
        else:
            self.session.set(path, start_value(kind, value_at(self.session.project, path), image), label)


def _kind(project: Project, path: FieldPath) -> str:
    value = value_at(project, path)
    if not path:
        return "project"
    if hasattr(value, "shape"):
        return kind_label(type(value.shape)).lower()
    return "line laser" if hasattr(value, "wavelength_nm") else f"{kind_label(type(value)).lower()} light"
