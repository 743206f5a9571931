"""The scene tree: everything in the project as items that are selected, renamed, hidden, added and removed."""

from __future__ import annotations

from dataclasses import replace
from html import escape
from pathlib import Path

from PySide6.QtCore import QModelIndex, QPersistentModelIndex, QPoint, QSize, Qt, QTimer, Signal
from PySide6.QtGui import (
    QColor,
    QContextMenuEvent,
    QDragEnterEvent,
    QDragMoveEvent,
    QDropEvent,
    QKeyEvent,
    QMouseEvent,
    QPainter,
)
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHeaderView,
    QLineEdit,
    QMenu,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QTreeWidget,
    QTreeWidgetItem,
    QWidget,
)

from render.base.errors import InputError
from render.scene.scene import SceneObject
from studio.editing.scene_edits import LASERS, LIGHTS, OBJECTS, in_list, rename
from studio.project.document import FieldPath, value_at
from studio.project.mesh_import import is_mesh
from studio.project.project import Project
from studio.qt.core import theme
from studio.qt.core.drops import accept_copy, dragged_files
from studio.qt.core.session import Session
from studio.qt.scene import scene_actions
from studio.qt.scene.mesh_bar import replace_mesh
from studio.qt.scene.mesh_importer import import_meshes
from studio.qt.scene.scene_icons import scene_icon
from studio.qt.scene.scene_nodes import Node, nodes

PATH, DETAIL = Qt.ItemDataRole.UserRole, Qt.ItemDataRole.UserRole + 1
NAME, EYE = 0, 1
MOTION = ("scene", "motion")


class _Delegate(QStyledItemDelegate):
    """Names with a quiet detail behind them."""

    def paint(
        self, painter: QPainter, option: QStyleOptionViewItem, index: QModelIndex | QPersistentModelIndex
    ) -> None:
        super().paint(painter, option, index)
        detail = index.data(DETAIL)
        if not detail or index.column() != NAME:
            return
        metrics = option.fontMetrics
        used = metrics.horizontalAdvance(index.data(Qt.ItemDataRole.DisplayRole)) + option.decorationSize.width() + 18
        area = option.rect.adjusted(used, 0, -2, 0)
        if area.width() < 24:
            return
        selected = bool(option.state & QStyle.StateFlag.State_Selected)
        colour = QColor(theme.colours().on_accent if selected else theme.colours().muted)
        painter.save()
        painter.setPen(colour)
        painter.drawText(
            area,
            Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignLeft,
            metrics.elidedText(detail, Qt.TextElideMode.ElideRight, area.width()),
        )
        painter.restore()

    def sizeHint(self, option: QStyleOptionViewItem, index: QModelIndex | QPersistentModelIndex) -> QSize:
        hint = super().sizeHint(option, index)
        return QSize(hint.width(), max(hint.height(), option.fontMetrics.height() + 8))

    def createEditor(
        self, parent: QWidget, option: QStyleOptionViewItem, index: QModelIndex | QPersistentModelIndex
    ) -> QWidget:
        editor = QLineEdit(parent, maxLength=100)
        editor.setFrame(False)
        editor.setAutoFillBackground(True)
        return editor


class SceneTree(QTreeWidget):
    """The tree of the session's project; shares the selection, of several items with Ctrl or Shift."""

    motion_clicked = Signal()
    """The motion has a panel of its own, beside its fields in the inspector."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.session = session
        self.setColumnCount(2)
        self.setHeaderHidden(True)
        self.setIndentation(15)
        self.setIconSize(QSize(17, 17))
        self.setFrameShape(QTreeWidget.Shape.NoFrame)
        self.setEditTriggers(QAbstractItemView.EditTrigger.EditKeyPressed)
        self.setExpandsOnDoubleClick(False)
        self.setSelectionMode(QAbstractItemView.SelectionMode.ExtendedSelection)
        self.setItemDelegate(_Delegate(self))
        self.setAcceptDrops(True)
        self.setDragEnabled(True)
        self.setDragDropMode(QAbstractItemView.DragDropMode.DragDrop)
        self.setMinimumWidth(180)
        header = self.header()
        header.setStretchLastSection(False)
        header.setMinimumSectionSize(26)
        header.setSectionResizeMode(NAME, QHeaderView.ResizeMode.Stretch)
        header.setSectionResizeMode(EYE, QHeaderView.ResizeMode.Fixed)
        header.resizeSection(EYE, 26)
        self._nodes: list[Node] = []
        self._items: dict[FieldPath, QTreeWidgetItem] = {}
        self._filling = False
        self._dragged: FieldPath = ()
        session.project_changed.connect(self.refresh)
        session.problems_changed.connect(self.refresh)
        session.selection_changed.connect(self._follow_selection)
        theme.notice.changed.connect(self._repaint)
        session.document_replaced.connect(self.expandAll)
        self.itemSelectionChanged.connect(self._selected)
        self.itemChanged.connect(self._renamed)
        self.itemClicked.connect(lambda item, _column: self.motion_clicked.emit() if _path(item) == MOTION else None)
        self.itemDoubleClicked.connect(lambda _item, _column: session.frame_requested.emit())
        self.refresh()

    def item(self, path: FieldPath) -> QTreeWidgetItem:
        """The item of a path. KeyError: there is none."""
        return self._items[path]

    def refresh(self) -> None:
        """Show the project as it is now; in place while the same items are there."""
        now = [self._with_problem(node) for node in nodes(self.session.project)]
        if now == self._nodes:
            return
        self._filling = True
        if [node.path for node in now] != [node.path for node in self._nodes]:
            self._rebuild(now)
        for node in now:
            self._fill(self._items[node.path], node)
        self._nodes = now
        self._filling = False
        self._keep_selection()
        self._follow_selection()

    def _with_problem(self, node: Node) -> Node:
        text = self.session.problem_of(node.path) if in_list(node.path) else ""
        return replace(node, problem=text) if text else node

    def _repaint(self) -> None:
        """Another theme holds: what was given a colour of its own takes the new one."""
        self._filling = True
        for node in self._nodes:
            self._fill(self._items[node.path], node)
        self._filling = False

    def rename_selection(self) -> None:
        """Edit the selected item's name in place."""
        item = self._items.get(self.session.selection)
        if item is not None and item.flags() & Qt.ItemFlag.ItemIsEditable:
            self.setFocus()
            self.editItem(item, NAME)

    def _rebuild(self, now: list[Node]) -> None:
        folded = {path for path, item in self._items.items() if not item.isExpanded() and item.childCount()}
        self.clear()
        self._items = {}
        for node in now:
            parent = self.invisibleRootItem() if node.parent is None else self._items[node.parent]
            item = QTreeWidgetItem(parent)
            item.setData(NAME, PATH, node.path)
            if node.path == () or in_list(node.path):
                item.setFlags(item.flags() | Qt.ItemFlag.ItemIsEditable)
            if not in_list(node.path):
                item.setFlags(item.flags() & ~Qt.ItemFlag.ItemIsDragEnabled)
            self._items[node.path] = item
        for path, item in self._items.items():
            item.setExpanded(path not in folded)

    def _fill(self, item: QTreeWidgetItem, node: Node) -> None:
        item.setText(NAME, node.name)
        item.setData(NAME, DETAIL, node.detail)
        wrong = bool(node.problem)
        item.setIcon(NAME, scene_icon("problem") if wrong else scene_icon(*node.icon))
        told = node.problem or node.detail
        item.setToolTip(NAME, f"<p>{escape(node.name)}: {escape(told)}</p>" if told else node.name)
        if node.visible is not None:
            item.setIcon(EYE, scene_icon("eye" if node.visible else "hidden"))
            item.setToolTip(EYE, "Hide" if node.visible else "Show")
        shown = node.visible is not False
        colour = theme.colours().error if wrong else None if shown else theme.colours().muted
        # nothing for a shown one: the palette of whatever theme holds
        item.setData(NAME, Qt.ItemDataRole.ForegroundRole, None if colour is None else QColor(colour))

    def _keep_selection(self) -> None:
        """A selected item that is gone (an undo) hands its place to the next above that is there."""
        path = self.session.selection
        try:
            value_at(self.session.project, path)
        except KeyError:
            while path and path not in self._items:
                path = path[:-1]
            self.session.select(path)

    def _follow_selection(self) -> None:
        item = self._items.get(self.session.selection)
        chosen = {*self.session.selections, self.session.selection}
        self._filling = True
        if item is not None and self.currentItem() is not item:
            self.setCurrentItem(item)
        for path, other in self._items.items():
            if other.isSelected() != (path in chosen):
                other.setSelected(path in chosen)
        self._filling = False

    def _selected(self) -> None:
        chosen = self.selectedItems()
        if chosen and not self._filling:
            current = self.currentItem()
            last = current if current is not None and current in chosen else chosen[-1]
            self.session.select_all([*(_path(item) for item in chosen if item is not last), _path(last)])

    def _renamed(self, item: QTreeWidgetItem, column: int) -> None:
        if self._filling or column != NAME:
            return
        path, name = _path(item), item.text(NAME)
        try:
            self.session.document.apply("rename", rename(self.session.project, path, name))
        except InputError as error:
            self.session.message.emit("error", f"the name stays as it was: {error}")
        self._filling = True
        item.setText(NAME, value_at(self.session.project, path).name)
        self._filling = False

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """The tree's own keys, where no menu of the window has them."""
        control = event.modifiers() == Qt.KeyboardModifier.ControlModifier
        if event.key() == Qt.Key.Key_Delete:
            scene_actions.remove(self.session)
        elif control and event.key() == Qt.Key.Key_D:
            scene_actions.duplicate(self.session)
        elif event.key() == Qt.Key.Key_F2:
            self.rename_selection()
        elif event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter) and self.state() != self.State.EditingState:
            self.session.frame_requested.emit()
        else:
            super().keyPressEvent(event)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """A click on the eye hides or shows, and selects nothing."""
        place = event.position().toPoint()
        item = self.itemAt(place)
        if item is not None and self.columnAt(place.x()) == EYE and _is_object(self.session.project, _path(item)):
            if event.button() == Qt.MouseButton.LeftButton:
                scene_actions.toggle_visible(self.session, _path(item))
            return
        super().mousePressEvent(event)

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        item = self.itemAt(event.pos())
        if item is not None and not item.isSelected():
            self.setCurrentItem(item)
        menu = self.menu_for(() if item is None else _path(item))
        menu.exec(event.globalPos())
        menu.deleteLater()

    def menu_for(self, path: FieldPath) -> QMenu:
        """What can be done with an item."""
        session, menu = self.session, QMenu(self)
        if in_list(path):
            self._item_entries(menu, path)
        elif path in (LASERS, OBJECTS, LIGHTS):
            scene_actions.fill_add_menu(menu.addMenu("Add"), session, self, str(path[-1]))
        elif path == MOTION:
            scene_actions.fill_motion_menu(menu, session)
        else:
            if path == ():
                menu.addAction("Rename", self.rename_selection)
            scene_actions.fill_add_menu(menu.addMenu("Add"), session, self)
        if path in (("scene", "rig", "camera"), ("sensor",)) or path[:-1] in (LASERS, OBJECTS):
            scene_actions.fill_presets_menu(menu.addMenu("Presets"), session)
        if path[:1] == ("scene",):
            menu.addSeparator()
            menu.addAction("Frame in the 3D view", session.frame_requested.emit)
        return menu

    def _item_entries(self, menu: QMenu, path: FieldPath) -> None:
        session = self.session
        siblings = len(value_at(session.project, path[:-1]))
        menu.addAction("Rename\tF2", self.rename_selection)
        menu.addAction("Duplicate\tCtrl+D", lambda: scene_actions.duplicate(session))
        if _is_object(session.project, path):
            shown = value_at(session.project, path).visible
            alone = None if path in session.selections else path
            menu.addAction("Hide" if shown else "Show", lambda: scene_actions.toggle_visible(session, alone))
            menu.addAction("Replace mesh…", lambda: replace_mesh(session, self))
        menu.addAction("Move up", lambda: scene_actions.move(session, -1)).setEnabled(path[-1] != 0)
        menu.addAction("Move down", lambda: scene_actions.move(session, 1)).setEnabled(path[-1] != siblings - 1)
        menu.addSeparator()
        menu.addAction("Delete\tDel", lambda: scene_actions.remove(session))
        menu.addSeparator()
        scene_actions.fill_add_menu(menu.addMenu("Add"), session, self, str(path[-2]))

    def startDrag(self, actions: Qt.DropAction) -> None:
        """An item is dragged to another place in its list."""
        self._dragged = self.session.selection
        super().startDrag(actions)
        self._dragged = ()

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        if _meshes(event):
            accept_copy(event)
        elif self._dragged:
            event.acceptProposedAction()

    def dragMoveEvent(self, event: QDragMoveEvent) -> None:
        super().dragMoveEvent(event)  # it scrolls, and draws where the item would go
        if _meshes(event):
            accept_copy(event)
        elif self._place(event.position().toPoint()) is not None:
            event.acceptProposedAction()
        else:
            event.ignore()

    def dropEvent(self, event: QDropEvent) -> None:
        path, files, place = self._dragged, _meshes(event), self._place(event.position().toPoint())
        self.setState(self.State.NoState)
        if files:
            accept_copy(event)
            import_meshes(self.session, files, self)
        elif path and place is not None:
            event.acceptProposedAction()
            # after the drag has ended: it still knows the items that are replaced now
            QTimer.singleShot(0, self, lambda: scene_actions.move_to(self.session, path, place))

    def _place(self, at: QPoint) -> int | None:
        """The index in its list that the dragged item gets where it is dropped; None: not there, or no change."""
        item, path = self.itemAt(at), self._dragged
        if item is None or not path:
            return None
        over, index = _path(item), int(path[-1])
        if over == path[:-1]:
            place = 0
        elif over[:-1] == path[:-1]:
            below = at.y() > self.visualItemRect(item).center().y()
            place = int(over[-1]) + below
            place -= place > index
        else:
            return None
        return None if place == index else place


def _path(item: QTreeWidgetItem) -> FieldPath:
    return tuple(item.data(NAME, PATH))


def _is_object(project: Project, path: FieldPath) -> bool:
    return path[:-1] == OBJECTS and isinstance(value_at(project, path), SceneObject)


def _meshes(event: QDropEvent) -> list[Path]:
    """The mesh files among what is dragged in."""
    return [file for file in dragged_files(event) if is_mesh(file)]
