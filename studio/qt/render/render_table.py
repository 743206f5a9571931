"""The renders of the session and those kept with the project, side by side: figures, differences, settings."""

from __future__ import annotations

from dataclasses import replace
from html import escape
from pathlib import Path

from PySide6.QtCore import QMargins, QSize, Qt
from PySide6.QtGui import QFont
from PySide6.QtWidgets import (
    QAbstractItemView,
    QDialog,
    QHBoxLayout,
    QLabel,
    QStyle,
    QTableWidget,
    QTableWidgetItem,
    QVBoxLayout,
)

from render.base.errors import InputError
from render.world.material_checks import scene_warnings
from render.world.world import build_world
from studio.project.date_and_time import read_out
from studio.qt.core.dialogs import export_csv, show_trouble
from studio.qt.core.figures_age import FiguresAge
from studio.qt.core.render import Render
from studio.qt.core.session import Session, one_of
from studio.qt.core.widgets import room_for_a_window, text_button
from studio.runtime.error_messages import trouble
from studio.scan.gauging import readings
from studio.scan.kept_renders import Kept, as_read_now, at_full_scale, figures_of, keep, kept_renders, open_kept
from studio.scan.remarks import best, scale_name, scale_notes
from studio.study.side_by_side import Row, developed_as, read_alike, scale_warnings, side_by_side, write_table

MEASURING = "The shown render is being measured with the settings of now; its figures are still those of before."
HINT = (
    "Figures are followed by their difference from the first column's. Other settings that all have alike are left out."
)
MOST_NOTES = 4
"""Of measures, below the table."""
RAISED = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")
FEWEST_PX, WIDEST_PX = 230, 1280


def as_kept(session: Session, render: Render, name: str) -> Kept:
    """A render of the session as a column of the table."""
    found = best(render.measurements, render.measured_as) if render.measurements else []
    made = render.made_from.get("measurements") if render.measurements else None
    project = (render.project if made is None else made[1].project).read_as(session.project)
    scene = project.scene
    # of now's measures those of lasers and steps that the render has: its file would be refused with others
    own = tuple(
        gauge
        for gauge in project.measures
        if gauge.laser < len(scene.lasers) and (gauge.step is None or gauge.step < scene.frame_count)
    )
    project = project.model_copy(update={"measures": own})
    return Kept(
        name,
        render.created,
        project,
        render.scanner_scale,
        figures_of(found),
        readings=readings(render.project.read_as(project), render.frame, found),
        laser_power=() if made is None else made[1].laser_power,
        stopped=not render.final and not render.refining,
    )


def keep_render(session: Session, render: Render, name: str) -> Kept:
    """With the project. InputError: the project has no file yet, or files cannot be written."""
    if session.document.path is None:
        raise InputError("the project has no folder of its own yet", cure="save it first")
    shown = as_kept(session, render, name)
    kept = keep(session.document.root, replace(shown, created=""), render.frame)
    render.kept = kept.folder
    session.message.emit("info", f"Kept {name} in {kept.folder}")
    return kept


def open_render(session: Session, kept: Kept) -> Render:
    """A kept one, in the history and shown; one that is there already is shown. InputError: as of `open_kept`."""
    there = next((one for one in session.renders if kept.folder is not None and one.kept == kept.folder), None)
    if there is not None:
        session.show(there)
        return there
    root = session.document.root
    frame = open_kept(kept, root)
    world = build_world(kept.project.scene, root, frame.step)
    # a frame's file has what rendering warned of, and not what the scene does
    warnings = dict.fromkeys((*frame.warnings, *scene_warnings(world, kept.project.scene, frame.step)))
    frame = replace(frame, warnings=tuple(warnings))
    number = max([render.number for render in session.renders], default=0) + 1
    render = Render(number, kept.project, world, frame, name=kept.name, created=read_out(kept.created))
    render.image_scale, render.final, render.stopped = kept.image_scale, not kept.stopped, kept.stopped
    render.source, render.kept = at_full_scale(kept, session.project), kept.folder
    session.add_render(render)
    return render


def _titled(render: Render, name: str) -> str:
    """Its figures are those of one step, where it is a scan."""
    return name if render.scan is None else f"{name}, step {render.frame.step + 1} of {render.scan.count}"


class RenderTable(QDialog):
    """A column for each render."""

    def __init__(self, parent: object, session: Session, shown: list[tuple[Render, str]]) -> None:
        """shown: the session's renders with their titles, in the order of the columns."""
        super().__init__(parent)  # type: ignore[arg-type]
        self.session = session
        self.setObjectName("render-table")
        self.setWindowTitle("Renders side by side")
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self._shown = shown
        self._kept, self.wrong = kept_renders(session.document.root) if session.document.path is not None else ([], [])
        self.renders, self.rows = self._read()
        self.table = QTableWidget()
        self.table.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.table.setAlternatingRowColors(True)
        self.table.setShowGrid(False)
        self.developed = QLabel(wordWrap=True)
        self.open_button = text_button(
            "Open", "The light of the kept render of the chosen column, in the history, developed as the project is now"
        )
        self.export = text_button("Export as CSV…")
        self.told = QLabel(wordWrap=True)
        self.told.setObjectName("muted")
        buttons = QHBoxLayout()
        buttons.addWidget(self.open_button)
        buttons.addWidget(self.export)
        buttons.addStretch(1)
        column = QVBoxLayout(self)
        column.addWidget(self.developed)
        column.addWidget(self.table, 1)
        column.addWidget(self.told)
        column.addLayout(buttons)
        self.open_button.clicked.connect(self.open_chosen)
        self.export.clicked.connect(self._ask)
        self.table.itemSelectionChanged.connect(self._show_buttons)
        for changed in (session.measured, session.project_changed):
            changed.connect(self._refresh)
        self.age = one_of(FiguresAge, session)
        self.age.changed.connect(self._tell)
        self._fill()
        self._tell()
        self._show_buttons()
        self.table.ensurePolished()
        self.resize(self._wanted(column.contentsMargins()).boundedTo(room_for_a_window(self)))

    def _wanted(self, margins: QMargins) -> QSize:
        """Room for every column, up to a width at which the eye still finds its way; margins: about the table."""
        table, bar = self.table, self.style().pixelMetric(QStyle.PixelMetric.PM_ScrollBarExtent)
        columns = max(2 * FEWEST_PX, table.horizontalHeader().length())
        beside = table.verticalHeader().sizeHint().width() + 2 * table.frameWidth() + bar
        return QSize(min(WIDEST_PX, columns + beside + margins.left() + margins.right()), 480)

    def _read(self) -> tuple[list[Kept], list[Row]]:
        """Columns and rows, by the figures of now; a kept render that is open has one where it is read as kept."""
        session, own = self.session, []
        kept = {one.folder: as_read_now(one, session.project) for one in self._kept}
        for render, name in self._shown:
            column, there = as_kept(session, render, _titled(render, name)), kept.get(render.kept)
            if there is None or not read_alike(column, there):
                own.append(column)
            elif column.figures:
                kept[there.folder] = replace(column, name=there.name, created=there.created, folder=there.folder)
        renders = [*own, *kept.values()]
        return renders, side_by_side(renders, session.project)

    def _refresh(self) -> None:
        self.renders, self.rows = self._read()
        self._fill()
        self._tell()

    def _tell(self) -> None:
        measuring = [MEASURING] if self.age.old else []
        self.developed.setText(developed_as(self.renders, self.session.project) if self.renders else "")
        notes = [f"{mark} {text}" for mark, text in zip(self._marks(), self._notes(), strict=True)]
        more = [f"{len(notes) - MOST_NOTES} more are told where the mouse rests on their cells"]
        more = more if len(notes) > MOST_NOTES else []
        told = [*scale_warnings(self.renders), *notes[:MOST_NOTES], *more, *measuring, HINT, *self.wrong]
        self.told.setText("\n".join(told))

    def _notes(self) -> list[str]:
        """What is told of measures, row by row."""
        return [
            f"{one.name}, {row.label.rpartition(' / ')[0]}: {note}"
            for row in self.rows
            for one, note in zip(self.renders, row.notes, strict=False)
            if note
        ]

    def _marks(self) -> list[str]:
        """1, 2, ... as small raised figures, which lead from a cell to its note."""
        return [str(number).translate(RAISED) for number in range(1, 1 + len(self._notes()))]

    def chosen(self) -> Kept | None:
        """The kept render of the column that is chosen."""
        at = self.table.currentColumn()
        found = self.renders[at] if 0 <= at < len(self.renders) else None
        return found if found is not None and found.folder is not None else None

    def open_chosen(self) -> None:
        """The kept render, which the table would lie over."""
        kept = self.chosen()
        if kept is None:
            return
        try:
            open_render(self.session, kept)
        except InputError as error:
            show_trouble(self, trouble(error, f"open {kept.name}"))
        else:
            self.accept()

    def write(self, path: Path) -> None:
        """InputError: the file cannot be written."""
        write_table(path, self.renders, self.rows)
        self.session.message.emit("info", f"Wrote {path}")

    def _fill(self) -> None:
        table, bold = self.table, QFont(self.font())
        bold.setBold(True)
        marks = iter(self._marks())
        table.setColumnCount(len(self.renders))
        table.setRowCount(len(self.rows))
        for k, render in enumerate(self.renders):
            when = f"\nkept {read_out(render.created)}" if render.folder is not None else "\nthis session"
            small = scale_name(render.image_scale)
            head = QTableWidgetItem(render.name + when + (f"\n{small}" if small else ""))
            head.setToolTip("\n".join(scale_notes(render.image_scale)))
            table.setHorizontalHeaderItem(k, head)
        for i, row in enumerate(self.rows):
            table.setVerticalHeaderItem(i, QTableWidgetItem(row.label))
            for k, text in enumerate(row.cells):
                item = QTableWidgetItem(text)
                item.setTextAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
                table.setItem(i, k, item)
                note = row.notes[k] if row.notes else ""
                item.setToolTip(f"<p>{escape(text)}</p><p>{escape(note)}</p>" if note else text)
                if note:
                    item.setText(f"{text} {next(marks)}")
                if row.measured:
                    item.setFont(bold)
        table.horizontalHeader().setMinimumSectionSize(FEWEST_PX)

    def _show_buttons(self) -> None:
        self.open_button.setEnabled(self.chosen() is not None)
        self.export.setEnabled(bool(self.rows))

    def _ask(self) -> None:
        export_csv(self, self.session, "renders", "the table", self.write)
