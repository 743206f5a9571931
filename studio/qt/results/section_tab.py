"""A plane through what is shown: where it cuts the true part, and the points near it, in a plot and as DXF or CSV.

While the tab is looked at the plane stands in the 3D view, where it is moved and turned by the mouse.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QTimer
from PySide6.QtGui import QHideEvent, QResizeEvent
from PySide6.QtWidgets import (
    QBoxLayout,
    QCheckBox,
    QFileDialog,
    QFormLayout,
    QHBoxLayout,
    QLabel,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from analysis.report.colour import TRUTH, method_colour
from analysis.report.units import counted
from analysis.section import Plane
from render.base.arrays import Float
from render.base.errors import InputError
from studio.editing.units import Unit
from studio.qt.core import theme
from studio.qt.core.boxes import ChoiceBox
from studio.qt.core.dialogs import beside_project, show_trouble
from studio.qt.core.jobs import JobRunner
from studio.qt.core.session import Session, ShownSection
from studio.qt.core.widgets import text_button
from studio.qt.forms.unit_box import UnitBox
from studio.qt.results import plots
from studio.qt.results.shown_points import NOTHING, are_there, shown_points
from studio.runtime.error_messages import trouble
from studio.scan.section import THINNEST, Scanned, Section, from_scanned, write_section

LANE = "section"
NORMALS = {"across x": (1.0, 0.0, 0.0), "across y": (0.0, 1.0, 0.0), "level (across z)": (0.0, 0.0, 1.0)}
MM = Unit.named("mm")
REST_MS = 120
LOW, WIDE = 330, 560
"""px of height, below which the plot has no room under the fields; of width, from which it has some beside them: more
than both need at least, or a panel that becomes narrow would keep them so."""
WIDEST = 999.0
"""mm, of what has room for its number and unit."""
BESIDE_TEXT = 16
"""px, of a box's frame and padding."""
FILES = "DXF drawing (*.dxf);;CSV table (*.csv)"


class SectionTab(QWidget):
    """Follows its plane; points and part are read once for what is shown."""

    def __init__(self, session: Session, runner: JobRunner) -> None:
        super().__init__()
        self.session, self.runner = session, runner
        self.section: Section | None = None
        self._read: Scanned | None = None
        self.normal = ChoiceBox()
        for name, normal in NORMALS.items():
            self.normal.addItem(name, normal)
        self.normal.addItem("by its normal", None)
        self.own = [_box("Normal", Unit(), -1.0, 1.0, value, 5) for value in (1.0, 0.0, 0.0)]
        self.through = [_box("Through", MM, -1e5, 1e5, 0.0) for _ in range(3)]
        self.thickness = _box("Slab", MM, 0.001, 1000.0, 1e3 * THINNEST)
        self.thickness.setToolTip(
            "Points so near to the plane are shown; until you type it, no thinner than the scan's step"
        )
        self._typed = False
        """The slab is as it was asked for, whatever the scan's step."""
        self.middle = text_button("To the middle", "The plane through the middle of the points")
        self.export = text_button("Export…", "DXF (mm, layers TRUE and MEASURED) or CSV")
        self.in_view = QCheckBox("In 3D")
        self.in_view.setToolTip("Drag the arrow to move the plane, the rings to turn it; Ctrl for whole steps")
        self.in_view.setChecked(True)
        self.told = QLabel(wordWrap=True)
        self.view = pg.GraphicsLayoutWidget()
        self.view.setMinimumSize(160, 120)
        self.view.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Ignored)
        self.plot = plots.new_plot("Across / mm", "Up", "mm")
        self.view.addItem(self.plot)
        self.plot.setAspectLocked(True)
        self.truth, self.dots = plots.curve(TRUTH), plots.dots(method_colour("likelihood"))
        self.plot.addItem(self.truth)
        self.plot.addItem(self.dots)
        self._rest = QTimer(self, singleShot=True, interval=REST_MS)
        self._rest.timeout.connect(self.cut)
        self._lay_out()
        for box in (*self.own, *self.through, self.thickness):
            box.valueChanged.connect(self._moved)
            box.refused.connect(partial(session.message.emit, "warning"))
        self.thickness.valueChanged.connect(self._slab_typed)
        self.normal.currentIndexChanged.connect(self._another_normal)
        self.middle.clicked.connect(self.to_middle)
        self.export.clicked.connect(self._ask)
        self.in_view.toggled.connect(self._place)
        session.section_changed.connect(self._follow)
        theme.notice.changed.connect(self._repaint)
        for signal in (session.renders_changed, session.measured):
            signal.connect(self.refresh)
        self._another_normal()
        self._untouched = True
        """The plane is where it stood at first."""
        self._repaint()
        self.refresh()

    @property
    def plane(self) -> Plane:
        x, y, z = (1e-3 * box.value() for box in self.through)
        normal = self.normal.currentData()
        a, b, c = normal if normal is not None else (box.value() for box in self.own)
        return Plane((x, y, z), (a, b, c))

    def refresh(self) -> None:
        """Something else is shown: it is read when the tab is looked at."""
        self._read, self.section = None, None
        self.truth.setData([], [])
        self.dots.setData([], [])
        there = are_there(self.session)
        self.told.setText("" if there else NOTHING)
        self.export.setEnabled(False)
        self._place()
        if there and self.isVisible():
            self._rest.start()

    def showEvent(self, event: object) -> None:
        super().showEvent(event)  # type: ignore[arg-type]
        if self.section is None or self.section.plane != self.plane:
            self._rest.start()
        self._place()

    def hideEvent(self, event: QHideEvent) -> None:
        super().hideEvent(event)
        self.session.show_section(None)

    def take(self, plane: Plane) -> None:
        """Another plane, as exactly as the fields have it."""
        normal = tuple(np.round(plane.axes[2], 5).tolist())
        known = [self.normal.itemData(i) for i in range(self.normal.count() - 1)]
        fields = [*zip(self.through, (1e3 * value for value in plane.point), strict=True)]
        fields += zip(self.own, normal, strict=True)
        for field, value in fields:
            field.blockSignals(True)
            field.setValue(value)
            field.blockSignals(False)
        self.normal.blockSignals(True)
        self.normal.setCurrentIndex(known.index(normal) if normal in known else len(known))
        self.normal.blockSignals(False)
        self.form.setRowVisible(self.normals, self.normal.currentData() is None)
        self._moved()

    def along_most(self) -> None:
        """Upright through the middle of the points, near to most of them: of a single frame along its line."""
        if self._read is None:
            return
        near = 0.5 * THINNEST
        points = np.column_stack([self._read.pieces[0][name] for name in "xyz"])
        middle = np.median(points, axis=0)
        beside = np.sum(np.abs(points[:, :2] - middle[:2]) <= near, axis=0)
        x, y, z = middle.tolist()
        self.take(Plane((x, y, z), list(NORMALS.values())[int(np.argmax(beside))]))

    def to_middle(self) -> None:
        """Of the points, by their medians."""
        if self._read is None:
            return
        x, y, z = (float(np.median(self._read.pieces[0][name])) for name in "xyz")
        self.take(Plane((x, y, z), self.plane.normal))

    def cut(self) -> None:
        """In the background; the last plane counts."""
        try:
            scene, root, read = shown_points(self.session)
            plane, before = self.plane, self._read
            thickness = 1e-3 * self.thickness.value() if self._typed else None
            _ = plane.axes
        except InputError as error:
            self.told.setText(str(error))
            return

        def work(progress: object, cancelled: object) -> tuple[Section, Scanned]:
            have = Scanned.of(scene, root, [read()]) if before is None else before
            return from_scanned(have, plane, thickness), have

        def then(found: tuple[Section, Scanned]) -> None:
            first = self._read is None
            self.section, self._read = found
            self._show()
            if first and self._untouched:
                self.along_most()
            elif first:
                self.to_middle()

        self.runner.run(LANE, "section", work, then)

    def write(self, path: Path) -> None:
        """InputError: there is nothing, or the file cannot be written."""
        if self.section is None:
            raise InputError("there is no section yet")
        write_section(self.section, path)
        self.session.message.emit("info", f"Wrote {path}")

    def _moved(self) -> None:
        """What is cut follows soon, while a drag goes on too; out of sight, once it is looked at."""
        self._untouched = False
        self._place()
        if self.isVisible() and not self._rest.isActive():
            self._rest.start()

    def _slab_typed(self) -> None:
        """It no longer follows the plane."""
        self._typed = True

    def _follow(self) -> None:
        """The 3D view has moved the plane."""
        shown = self.session.section
        if shown is not None and shown.plane != self.plane:
            self.take(shown.plane)

    def _place(self) -> None:
        """Into the 3D view, with the line that was cut last."""
        if self._read is None or not (self.isVisible() and self.in_view.isChecked()):
            self.session.show_section(None)
            return
        plane, made = self.plane, self.section
        try:
            sheet = plane.sheet(*self._read.box)
        except InputError:
            return
        true = [] if made is None else [made.plane.world(line) for line in made.true]
        self.session.show_section(ShownSection(plane, sheet, true))

    def _show(self) -> None:
        made = self.section
        assert made is not None
        gap = np.full((1, 2), np.nan)
        lines = np.concatenate([gap, *(piece for line in made.true for piece in (1e3 * line, gap))])
        self.truth.setData(*lines.T, connect="finite")
        self.dots.setData(*(1e3 * made.measured[:, :2]).T)
        self.plot.setLabel("bottom", f"{along('Across', made.plane.axes[0])} / mm")
        self.plot.setLabel("left", f"{along('Up', made.plane.axes[1])} / mm")
        self.plot.enableAutoRange()
        part, points = counted(len(made.true), "line"), counted(len(made.measured), "point")
        told = f"{part} of the true part, {points} within the slab"
        self.told.setText(f"{told}, {made.remark}" if made.remark else told)
        if not self._typed:
            self.thickness.blockSignals(True)
            self.thickness.setValue(1e3 * made.thickness)
            self.thickness.blockSignals(False)
        self.export.setEnabled(bool(made.true) or len(made.measured) > 0)
        self._place()

    def _another_normal(self) -> None:
        self.form.setRowVisible(self.normals, self.normal.currentData() is None)
        self._moved()

    def _repaint(self) -> None:
        self.view.setBackground(theme.colours().base)
        plots.paint(self.plot)

    def _ask(self) -> None:
        start = beside_project(self.session, "section.dxf")
        chosen, kind = QFileDialog.getSaveFileName(self.window(), "Export", start, FILES)
        if not chosen:
            return
        path = Path(chosen)
        self.session.chose(path)
        if path.suffix.lower() not in (".dxf", ".csv"):
            path = path.with_name(path.name + (".csv" if "csv" in kind else ".dxf"))
        try:
            self.write(path)
        except InputError as error:
            show_trouble(self.window(), trouble(error, "export the section"))

    def _lay_out(self) -> None:
        self.form = QFormLayout()
        self.normals = _row(self.own)
        self.form.addRow("Plane", self.normal)
        self.form.addRow("Normal", self.normals)
        self.form.addRow("Through", _row(self.through))
        self.form.addRow("Slab", self.thickness)
        buttons = QHBoxLayout()
        buttons.addWidget(self.middle)
        buttons.addWidget(self.export)
        buttons.addWidget(self.in_view)
        buttons.addStretch(1)
        fields = QVBoxLayout()
        fields.addLayout(self.form)
        fields.addLayout(buttons)
        fields.addWidget(self.told)
        fields.addStretch(1)
        self.column = QBoxLayout(QBoxLayout.Direction.TopToBottom, self)
        self.column.setContentsMargins(8, 8, 8, 8)
        self.column.addLayout(fields)
        self.column.addWidget(self.view, 1)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """A low panel has the plot beside the fields, where it need not be scrolled to."""
        super().resizeEvent(event)
        room = self.parentWidget()
        low = room is not None and room.height() < LOW and room.width() >= WIDE
        direction = QBoxLayout.Direction.LeftToRight if low else QBoxLayout.Direction.TopToBottom
        self.column.setDirection(direction)


def along(name: str, axis: Float) -> str:
    """A plane's own axis by the world's that it is, where it is one: a section is seen from one of two sides."""
    which = int(np.argmax(np.abs(axis)))
    if abs(axis[which]) < 1.0 - 1e-6:
        return name
    sign = "" if axis[which] > 0.0 else "−"  # noqa: RUF001 - as numbers have it
    return f"{name} = {sign}{'xyz'[which]}"


def _box(name: str, unit: Unit, low: float, high: float, value: float, decimals: int = 3) -> UnitBox:
    box = UnitBox(unit, low, high, decimals)
    box.setAccessibleName(name)
    box.setValue(value)
    box.setButtonSymbols(UnitBox.ButtonSymbols.NoButtons)  # three side by side have no room for arrows
    text = f"{-WIDEST:.{decimals}f}{box.suffix()}" if unit is MM else f"{low:.{decimals}f}"
    box.setMinimumWidth(box.fontMetrics().horizontalAdvance(text) + BESIDE_TEXT)
    box.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
    return box


def _row(boxes: list[UnitBox]) -> QWidget:
    held = QWidget()
    row = QHBoxLayout(held)
    row.setContentsMargins(0, 0, 0, 0)
    for box in boxes:
        row.addWidget(box, 1)
    return held
