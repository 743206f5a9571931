"""Tab goes through a panel as it is read, also where a part of it was made later."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFormLayout, QLayout, QLayoutItem, QScrollArea, QWidget

ROLES = (QFormLayout.ItemRole.LabelRole, QFormLayout.ItemRole.FieldRole, QFormLayout.ItemRole.SpanningRole)


def tab_as_laid_out(panel: QWidget) -> None:
    """From top to bottom, and within a row from left to right, as the layouts have it; again after they changed."""
    for before, after in pairwise(_stops(panel)):
        QWidget.setTabOrder(before, after)


def _stops(widget: QWidget) -> Iterator[QWidget]:
    """Of a widget and what it holds, those that Tab can reach."""
    if isinstance(widget, QScrollArea):
        if (held := widget.widget()) is not None:
            yield from _stops(held)
        return
    if widget.focusPolicy() & Qt.FocusPolicy.TabFocus:
        yield widget
    if (layout := widget.layout()) is not None:
        yield from _stops_of(layout)


def _stops_of(layout: QLayout) -> Iterator[QWidget]:
    for item in _items(layout):
        if (widget := item.widget()) is not None:
            yield from _stops(widget)
        elif (inner := item.layout()) is not None:
            yield from _stops_of(inner)


def _items(layout: QLayout) -> list[QLayoutItem]:
    if isinstance(layout, QFormLayout):
        found = [layout.itemAt(row, role) for row in range(layout.rowCount()) for role in ROLES]
    else:
        found = [layout.itemAt(i) for i in range(layout.count())]
    return [item for item in found if item is not None]
