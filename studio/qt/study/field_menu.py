"""A menu of every field of the project that a study can vary, by what of the scene it belongs to; and of its boards."""

from __future__ import annotations

from functools import partial

from PySide6.QtWidgets import QMenu

from studio.project.project import Project
from studio.qt.core.session import Session
from studio.qt.scene.scene_nodes import nodes
from studio.study.draft import board_fields, fields_of


def fill_field_menu(menu: QMenu, session: Session, project: Project) -> None:
    """One submenu for each item of the scene tree; a field's entry asks the session to vary it."""
    menu.clear()
    for node in nodes(project):
        try:
            fields = fields_of(project, node.path)
        except (KeyError, AttributeError):  # a list of items has no fields of its own
            continue
        if not node.path or not fields:
            continue
        below = menu.addMenu(node.name)
        names = [spec.label for _, spec in fields]
        for path, spec in fields:
            # two of a kind are told apart by what they are part of
            part = next((str(one).replace("_", " ") for one in reversed(path[:-1]) if isinstance(one, str)), "")
            name = spec.label if names.count(spec.label) == 1 else f"{spec.label} ({part})"
            below.addAction(name, partial(session.vary_asked.emit, path, spec)).setToolTip(spec.help)
    below = menu.addMenu("Calibration")
    for path, spec in board_fields():
        below.addAction(spec.label, partial(session.vary_asked.emit, path, spec)).setToolTip(spec.help)
