"""A menu of every field of a project that a study can vary or a recipe draw, by what of the scene it belongs to."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from PySide6.QtWidgets import QMenu

from studio.editing.forms import FieldSpec
from studio.project.document import FieldPath
from studio.project.project import Project
from studio.qt.scene.scene_nodes import nodes
from studio.study.draft import board_fields, fields_of


def named_fields(project: Project, item: FieldPath) -> list[tuple[FieldPath, FieldSpec, str]]:
    """Every field of an item with its name; two of a kind are told apart by what they are part of."""
    try:
        fields = fields_of(project, item)
    except (KeyError, AttributeError):  # a list of items has no fields of its own
        return []
    labels, found = [spec.label for _, spec in fields], []
    for path, spec in fields:
        part = next((str(one).replace("_", " ") for one in reversed(path[:-1]) if isinstance(one, str)), "")
        found.append((path, spec, spec.label if labels.count(spec.label) == 1 else f"{spec.label} ({part})"))
    return found


def fill_field_menu(menu: QMenu, project: Project, chosen: Callable[[FieldPath, FieldSpec], None]) -> None:
    """One submenu for each item of the scene tree; each field's entry tells that it was chosen."""
    menu.clear()
    for node in nodes(project):
        fields = named_fields(project, node.path) if node.path else []
        below = menu.addMenu(node.name) if fields else menu
        for path, spec, name in fields:
            below.addAction(name, partial(chosen, path, spec)).setToolTip(spec.help)


def add_board_fields(menu: QMenu, chosen: Callable[[FieldPath, FieldSpec], None]) -> None:
    """Another submenu, of the boards that a study calibrates by."""
    below = menu.addMenu("Calibration")
    for path, spec in board_fields():
        below.addAction(spec.label, partial(chosen, path, spec)).setToolTip(spec.help)
