"""The renders made so far and those kept with the project: look at one again, name it, delete it, compare two."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QItemSelectionModel, QModelIndex, QPersistentModelIndex, QPoint, Qt
from PySide6.QtGui import QColor, QIcon, QImage, QPalette, QPixmap
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHBoxLayout,
    QLabel,
    QListWidget,
    QListWidgetItem,
    QMenu,
    QPushButton,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QVBoxLayout,
    QWidget,
)

from render.base.errors import InputError
from studio.qt.core import theme
from studio.qt.core.delete_key import DeleteKey
from studio.qt.core.dialogs import ask_removal, show_trouble
from studio.qt.core.menu_tips import show_tips
from studio.qt.core.render import Render
from studio.qt.core.save_first import saved_first
from studio.qt.core.session import Session
from studio.qt.core.widgets import text_button
from studio.qt.image.compare_view import CompareView
from studio.qt.render.kept_list import MARK, Entry, KeptList, kept_lines, kept_tip, place_holder
from studio.qt.render.python_copy import copy_as_python
from studio.qt.render.render_row import THUMBNAIL, describe, in_short, named, thumbnail, title
from studio.qt.render.render_table import RenderTable, keep_render, open_render
from studio.runtime.error_messages import trouble
from studio.scan.kept_renders import Kept, remove
from studio.scan.remarks import scale_notes

ENTRIES = 3
"""To be seen at once."""
ENTRY_HEIGHT = THUMBNAIL.height() + 4
NEW_LINE = "\u2028"
"""Qt breaks an item's text only here."""
NAMING = "A name keeps no settings: a render is developed as the project is then whenever it is shown."
KEEPING = "Its light, its settings and its figures as they are read now are kept, whatever the project becomes."
GOING = "Kept nowhere: it goes when the project is closed, saved or not."
CLOSING = "Out of this session's renders; it stays kept with the project."

KEPT_BESIDE = "A kept render lies in the folder of its project, and this project is in no file yet."


class _ThreeLines(QStyledItemDelegate):
    """The description below the name, which alone is edited; what is not open is muted."""

    def __init__(self, parent: QWidget, kept: KeptList) -> None:
        super().__init__(parent)
        self.kept = kept

    def initStyleOption(self, option: QStyleOptionViewItem, index: QModelIndex | QPersistentModelIndex) -> None:
        super().initStyleOption(option, index)
        entry: Entry = index.data(Qt.ItemDataRole.UserRole)
        head = title(entry) + (MARK if self.kept.of(entry) is not None else "")
        lines = kept_lines(entry) if isinstance(entry, Kept) else in_short(entry)
        option.text = NEW_LINE.join([head, *lines])
        if isinstance(entry, Kept):
            option.palette.setColor(QPalette.ColorRole.Text, QColor(theme.colours().muted))


class History(QWidget):
    """A list of the session's renders, the latest first, and below them of those that the project keeps."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.session, self.kept = session, KeptList(session)
        self.comparison: CompareView | None = None
        self.list = QListWidget()
        self.list.setIconSize(THUMBNAIL)
        self.list.setMinimumHeight(ENTRIES * ENTRY_HEIGHT)
        self.list.setItemDelegate(_ThreeLines(self.list, self.kept))
        self.list.setWordWrap(True)
        self.list.setSelectionMode(QAbstractItemView.SelectionMode.ExtendedSelection)
        self.list.setEditTriggers(QAbstractItemView.EditTrigger.EditKeyPressed)
        self.list.setContextMenuPolicy(Qt.ContextMenuPolicy.CustomContextMenu)
        self.list.setUniformItemSizes(True)
        self.list.setToolTip(
            "Click or Return shows a render, and opens one that is kept; F2 names it, Delete removes it; select two to "
            f"compare them.\n{NAMING}\n"
            f"Keep with the project, in the menu: {KEEPING[:1].lower()}{KEEPING[1:]}"
        )
        DeleteKey(self.list, self.delete)
        heading = QLabel("Renders")
        heading.setStyleSheet("QLabel { font-weight: 600 }")
        self.compare_button = QPushButton("Compare")
        self.compare_button.setToolTip("Side by side under a line that can be dragged, or their difference")
        self.delete_button = QPushButton("Delete")
        self.table_button = QPushButton("Table")
        self.table_button.setToolTip("Figures and settings of all renders, and of those kept with the project")
        self.keep_button = text_button("Keep", f"With the project. {GOING}\n{KEEPING}")
        self.broken = QLabel(wordWrap=True)
        self.broken.setObjectName("muted")
        top = QHBoxLayout()
        top.addWidget(heading, 1)
        top.addWidget(self.table_button)
        top.addWidget(self.compare_button)
        top.addWidget(self.keep_button)
        top.addWidget(self.delete_button)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addLayout(top)
        layout.addWidget(self.list, 1)
        layout.addWidget(self.broken)
        session.renders_changed.connect(self.refresh)
        session.developed.connect(self._new_images)
        session.document_replaced.connect(self._forget_comparison)
        session.document_replaced.connect(self._read_kept)
        session.project_changed.connect(self._follow_folder)
        self.list.itemClicked.connect(self._clicked)
        self.list.itemActivated.connect(self._clicked)
        self.list.itemChanged.connect(self._renamed)
        self.list.itemSelectionChanged.connect(self._show_buttons)
        self.list.customContextMenuRequested.connect(self._menu)
        self.compare_button.clicked.connect(self.compare)
        self.delete_button.clicked.connect(self.delete)
        self.table_button.clicked.connect(self.open_table)
        self.keep_button.clicked.connect(self._keep_selected)
        self._read_kept()

    def selected(self) -> list[Entry]:
        """In the order of the list."""
        rows = sorted(self.list.row(item) for item in self.list.selectedItems())
        return [self._entry(row) for row in rows]

    def refresh(self) -> None:
        """Follow the session's list; selection stays where it can."""
        shown, entries = self.session.shown, self.kept.rows()
        before = [] if len(self.selected()) < 2 else self.selected()
        self.list.blockSignals(True)
        if self.list.count() != len(entries):
            self.list.clear()
            for entry in entries:
                item = QListWidgetItem()
                item.setData(Qt.ItemDataRole.UserRole, entry)
                item.setFlags(item.flags() | Qt.ItemFlag.ItemIsEditable)
                self.list.addItem(item)
        for row, entry in enumerate(entries):
            item = self.list.item(row)
            self._fill(item, entry)
            item.setSelected(any(entry is other for other in before) if before else entry is shown)
            if entry is shown:
                self.list.setCurrentItem(item, QItemSelectionModel.SelectionFlag.NoUpdate)
        self.list.blockSignals(False)
        self._show_buttons()

    def _entry(self, row: int) -> Entry:
        found: Entry = self.list.item(row).data(Qt.ItemDataRole.UserRole)
        return found

    def delete(self) -> None:
        """Forget the selected renders; those that are kept go from the disk as well, which is asked about."""
        gone = self.selected()
        kept = [one for one in map(self.kept.of, gone) if one is not None]
        if kept and not ask_removal(self.window(), _removal(kept)):
            return
        try:
            for one in kept:
                remove(one)
        except InputError as error:
            show_trouble(self.window(), trouble(error, "remove the render"))
            gone = [one for one in gone if self.kept.of(one) is None]
        self.kept.read()
        self.forget(gone)

    def forget(self, gone: Sequence[Entry]) -> None:
        """Out of the session, whatever the disk holds; the latest of the others is shown."""
        session = self.session
        session.renders = [render for render in session.renders if not any(render is other for other in gone)]
        if any(session.shown is render for render in gone):
            session.shown = session.renders[-1] if session.renders else None
        session.renders_changed.emit()

    def open(self, entry: Entry) -> Render | None:
        """A kept one with its light, shown; None: it cannot be opened, which is told."""
        if isinstance(entry, Render):
            return entry
        try:
            return open_render(self.session, entry)
        except InputError as error:
            show_trouble(self.window(), trouble(error, f"open {entry.name}"))
            return None

    def compare(self) -> None:
        """Open the two selected renders in a window of their own."""
        selected = self.selected()
        pair = [self.open(entry) for entry in selected] if len(selected) == 2 else [None, None]
        later, earlier = pair
        if later is None or earlier is None:
            return
        if self.comparison is None:
            self.comparison = CompareView(self)
        self.comparison.compare(earlier, named(earlier), later, named(later))
        self.comparison.show()
        self.comparison.raise_()

    def open_table(self) -> RenderTable:
        """All renders side by side, the earliest first."""
        table = RenderTable(self, self.session, [(render, title(render)) for render in self.session.renders])
        table.open()
        return table

    def keep(self, render: Render) -> None:
        """With the project, by its name; one that is in no file yet is offered to be saved first."""
        session = self.session
        if not saved_first(session, self, KEPT_BESIDE, lambda: session.document.path is not None):
            return
        try:
            keep_render(session, render, title(render))
        except InputError as error:
            show_trouble(self.window(), trouble(error, "keep the render"))
        self._read_kept()

    def _read_kept(self) -> None:
        self.kept.read()
        count = len(self.kept.wrong)
        self.broken.setText(f"{count} kept render{'' if count == 1 else 's'} cannot be read" if count else "")
        self.broken.setToolTip("\n".join(self.kept.wrong))
        self.broken.setVisible(count > 0)
        self.refresh()

    def _follow_folder(self) -> None:
        if self.kept.elsewhere:
            self._read_kept()

    def _forget_comparison(self) -> None:
        if self.comparison is not None:
            self.comparison.forget()

    def _fill(self, item: QListWidgetItem, render: Entry) -> None:
        if item.data(Qt.ItemDataRole.UserRole) is not render:
            item.setData(Qt.ItemDataRole.UserRole, render)
        item.setText(title(render))
        if isinstance(render, Kept):
            item.setToolTip(kept_tip(render))
            item.setIcon(place_holder())
            return
        when = f", {render.created}" if render.created else ""
        item.setToolTip("\n".join([f"{describe(render)}{when}", *scale_notes(render.scanner_scale)]))
        picture = thumbnail(render)
        if picture is not None:
            height, width = picture.shape
            image = QImage(picture.data, width, height, 4 * width, QImage.Format.Format_RGB32).copy()
            item.setIcon(QIcon(QPixmap.fromImage(image)))

    def _new_images(self) -> None:
        self.list.blockSignals(True)
        for row in range(self.list.count()):
            if self._entry(row) is self.session.shown:
                self._fill(self.list.item(row), self._entry(row))
        self.list.blockSignals(False)

    def _clicked(self, item: QListWidgetItem) -> None:
        entry = item.data(Qt.ItemDataRole.UserRole)
        if len(self.list.selectedItems()) == 1 and entry is not self.session.shown:
            self.show_entry(entry)

    def show_entry(self, entry: Entry) -> None:
        """A render of the session as it is, a kept one with its light."""
        if isinstance(entry, Render):
            self.session.show(entry)
        else:
            self.open(entry)

    def _renamed(self, item: QListWidgetItem) -> None:
        entry: Entry = item.data(Qt.ItemDataRole.UserRole)
        name, kept = item.text().strip(), self.kept.of(entry)
        if name == title(entry):
            return
        if isinstance(entry, Render):
            entry.name = name
        if kept is not None and name:
            try:
                self.kept.rename(kept, name)
            except InputError as error:
                show_trouble(self.window(), trouble(error, "rename the kept render"))
        self.session.renders_changed.emit()

    def _show_buttons(self) -> None:
        count, going = len(self.list.selectedItems()), self._going()
        self.compare_button.setEnabled(count == 2)
        self.delete_button.setEnabled(count > 0)
        self.keep_button.setEnabled(going is not None)

    def _going(self) -> Render | None:
        """The one that is selected, where a person made it and it is kept nowhere."""
        selected = self.selected()
        render = selected[0] if len(selected) == 1 else None
        return render if isinstance(render, Render) and render.is_kept_nowhere else None

    def _keep_selected(self) -> None:
        if (render := self._going()) is not None:
            self.keep(render)

    def _menu(self, where: QPoint) -> None:
        item = self.list.itemAt(where)
        if item is None:
            return
        menu = self.menu_of(item)
        menu.exec(self.list.mapToGlobal(where))
        menu.deleteLater()

    def menu_of(self, item: QListWidgetItem) -> QMenu:
        """What can be done with a render."""
        menu, entry = QMenu(self), item.data(Qt.ItemDataRole.UserRole)
        kept = self.kept.of(entry) is not None
        show_tips(menu)
        menu.addAction("Show" if isinstance(entry, Render) else "Open", lambda: self.show_entry(entry))
        menu.addAction("Rename", lambda: self.list.editItem(item)).setToolTip("" if kept else NAMING)
        if isinstance(entry, Render):
            keep = "Keep again as it is now" if kept else "Keep with the project"
            menu.addAction(keep, lambda: self.keep(entry)).setToolTip(KEEPING)
        compare = menu.addAction("Compare", self.compare)
        compare.setEnabled(len(self.list.selectedItems()) == 2)
        if isinstance(entry, Render):
            menu.addAction("Copy as Python", lambda: copy_as_python(self.session, entry))
        if isinstance(entry, Render) and kept:
            menu.addAction("Close", lambda: self.forget([entry])).setToolTip(CLOSING)
        menu.addAction("Remove from the project…" if kept else "Delete", self.delete)
        return menu


def _removal(kept: Sequence[Kept]) -> str:
    """Which files go, as it is asked."""
    names = ", ".join(one.name for one in kept)
    return f"{names}: light, settings and figures are taken off the disk, and nothing brings them back."
