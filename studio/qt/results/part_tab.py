"""Measures of the part: those of the project, read off the shown frame; added by dragging, edited, judged."""

from __future__ import annotations

from typing import Any

from PySide6.QtCore import QSignalBlocker, Qt, Signal
from PySide6.QtGui import QColor, QHideEvent, QShowEvent
from PySide6.QtWidgets import (
    QHBoxLayout,
    QLabel,
    QMenu,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from analysis.gauges.gauge import KINDS_OF_SCAN, MOST_GAUGES, REGIONS, TITLES, Gauge, Kind
from analysis.gauges.profile import Profile
from analysis.gauges.read import Reading
from analysis.report.colour import method_name
from analysis.report.gauge_table import DEFINITIONS, beside_nominal, cells, marked_verdict, missing_of, remark_of
from analysis.report.units import NONE
from studio.project.same_lasers import same_lasers
from studio.qt.core import theme
from studio.qt.core.boxes import ChoiceBox
from studio.qt.core.delete_key import DeleteKey
from studio.qt.core.menu_tips import show_tips
from studio.qt.core.session import Session
from studio.qt.core.widgets import keep_room, no_higher, text_button
from studio.qt.results.measure_tip import first_upper, measure_tip
from studio.qt.results.part_drawing import PartDrawing
from studio.qt.results.part_editor import PartEditor
from studio.qt.results.part_menu import PartMenu
from studio.qt.results.part_steps import PartSteps, value_of_worst
from studio.qt.results.part_table import PartTable
from studio.qt.results.results_profile import ProfilePlot
from studio.qt.results.scan_bar import ScanBar
from studio.scan.gauging import OF_SCAN, WITHOUT_SCAN, judged_over_steps, kept_readings, profiles, read_each
from studio.scan.measures_in_3d import MeasureIn3D, measures_in_3d
from studio.scan.remarks import best
from studio.scan.sheet_lean import SECTIONS, lean_text

SECTION_TIP = (
    "List of sections, what measures and profile are of: the laser's plane, as a scanner delivers it, in which heights "
    "are longer where it leans; or a section across a direction along which the part is the same, where it is as drawn"
)
NONE_YET = "Add a measure and drag its regions in the profile or the row charts."


class PartTab(QWidget):
    """Follows the shown render and the project's `measures`; draws them in the profile's plot."""

    placing_changed = Signal()
    """`placing` is another kind, or none."""

    def __init__(self, session: Session, profile: ProfilePlot, scan_bar: ScanBar) -> None:
        """scan_bar: whether the figures are of all steps."""
        super().__init__()
        self.session = session
        self.laser = 0
        """Whose profile is shown."""
        self.placing: Kind | None = None
        """The kind that is being added, region by region."""
        self.chosen = -1
        """Of the project's measures."""
        self.readings: tuple[Reading, ...] = ()
        self._profiles: dict[int, tuple[Profile, Profile]] = {}
        self._method = ""
        """By which the points were found."""
        self._steps = PartSteps(session, scan_bar)
        self._entries: tuple[dict[str, Any] | None, ...] = ()
        """Rows of the table, each as a scan's report would have it."""
        self._placed: list[tuple[float, float]] = []
        self._measures: tuple[Gauge, ...] = ()
        """The project's."""
        self._read: tuple[Gauge, ...] = ()
        """The same, each of its laser as the shown render has it."""
        self.drawing = PartDrawing(profile.plot, self)
        self.table = PartTable()
        DeleteKey(self.table, self.delete)
        self.editor = PartEditor(session)
        self.add: QPushButton = text_button("Add", "Read another dimension off the profile")
        self.remove = text_button("Delete", "The chosen measure (Del in the table)")
        self.remove.setFocusPolicy(Qt.FocusPolicy.ClickFocus)  # by Tab it would get a space meant for the table
        self.menu = PartMenu(session, self.table, self.delete)
        self.section = ChoiceBox()
        for value, title in SECTIONS.items():
            self.section.addItem(title, value)
        self.section.setToolTip(SECTION_TIP)
        self.told = QLabel(wordWrap=True)
        self.told.setObjectName("muted")
        keep_room(self.told, 3)
        self._lay_out()
        self.remove.clicked.connect(self.delete)
        self.section.activated.connect(self._choose_section)
        self.table.itemSelectionChanged.connect(self._select)
        self.drawing.moving.connect(self._moving)
        self.drawing.moved.connect(self._moved)
        session.project_changed.connect(self._project_changed)
        session.document_replaced.connect(self.cancel)
        self.placing_changed.connect(lambda: setattr(profile, "held", self.placing is not None))

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self._lock(False)

    def hideEvent(self, event: QHideEvent) -> None:
        super().hideEvent(event)
        self._lock(True)

    def _lock(self, locked: bool) -> None:
        """A region is moved only where its measure is seen, so that no drag that means something else changes it."""
        self.drawing.locked = locked
        self._show_regions()

    def follow(self, laser: int) -> None:
        """Another frame, measurement or laser is shown."""
        render, self.laser = self.session.shown, laser
        self._profiles = {}
        if render is not None and render.measurements:
            found = best(render.measurements, render.developed_by(self.session.project))
            self._method = next(name for name, one in render.measurements.items() if one is found)
            used = {laser, *(gauge.laser for gauge in self._as_rendered())}
            self._profiles = {
                i: profiles(render.project, render.frame, one, self.session.project.measured_in)
                for i, one in enumerate(found)
                if i in used
            }
        self.refresh()

    def refresh(self) -> None:
        """Read and show all measures anew."""
        render = self.session.shown
        self._measures, self._read = self.session.project.measures, self._as_rendered()
        self.section.setCurrentIndex(self.section.findData(self.session.project.measured_in))
        self.chosen = min(self.chosen, len(self._read) - 1)
        step = 0 if render is None else render.frame.step
        self.readings = read_each(self._read, step, self._profiles) if self._profiles else ()
        of_scan = any(gauge.of_scan for gauge in self._read)
        if of_scan and self.readings and render is not None and render.scan is not None:
            scanned, rows = render.scan.measured_as.measures, render.scan.found.manifest.get("measures")
            kept = kept_readings(self._read, scanned, rows)
            self.readings = tuple(kept.get(one.gauge, one) for one in self.readings)
        self._show()
        self._show_regions()

    def _as_rendered(self) -> tuple[Gauge, ...]:
        """The project's measures; those of a laser that the shown render does not have are of none that it has."""
        now, render = self.session.project, self.session.shown
        if render is None:
            return now.measures
        there = same_lasers(now.scene, render.project.scene)
        beyond = len(render.project.scene.lasers)
        return tuple(
            gauge.model_copy(update={"laser": there.get(gauge.laser, beyond + gauge.laser)}) for gauge in now.measures
        )

    def _laser_now(self) -> int | None:
        """The laser whose profile is shown, among those of the project; None: it is gone."""
        now, render = self.session.project.scene, self.session.shown
        return self.laser if render is None else same_lasers(render.project.scene, now).get(self.laser)

    def start(self, kind: Kind) -> None:
        """The next drags are the regions of a new measure."""
        if self._laser_now() is None:
            gone = "this laser is no longer in the project: undo that, or render what is there now"
            self.session.message.emit("warning", gone)
            return
        self.placing, self._placed = kind, []
        self._show_regions()
        self._tell()
        self.placing_changed.emit()

    def cancel(self) -> None:
        """No measure is added after all."""
        if self.placing is not None:
            self._end_placing()
            self.refresh()

    def place(self, low: float, high: float) -> None:
        """The next region of the measure that is being added, m across the fan."""
        kind = self.placing
        if kind is None or not high > low:
            return
        self._placed.append((round(low, 8), round(high, 8)))
        if len(self._placed) < len(REGIONS[kind]):
            self._show_regions()
            self._tell()
            return
        now, laser = self.session.project.measures, self._laser_now() or 0
        gauge = Gauge(name=_free_name(kind, now), kind=kind, laser=laser, regions=tuple(self._placed))
        self._end_placing()
        self.chosen = len(now)
        if not self.session.set(("measures",), (*now, gauge), f"add {TITLES[kind].lower()}"):
            self.chosen = len(now) - 1
            self.refresh()
        self.table.setFocus()  # Del is about the measure, not about a part of the scene

    def delete(self) -> None:
        now = self.session.project.measures
        if 0 <= self.chosen < len(now):
            kept = (*now[: self.chosen], *now[self.chosen + 1 :])
            name = now[self.chosen].name
            if self.session.set(("measures",), kept, f"delete {name}"):
                self.session.message.emit("info", f"deleted {name} (Ctrl+Z brings it back)")

    def _show_regions(self) -> None:
        """Of the measure that is being added, else of the chosen one."""
        own = self._own()
        if self.placing is not None:
            self.drawing.show_regions(self.placing, self._placed)
        elif own is not None and self._profiles:
            self.drawing.show_regions(own.kind, own.regions)
        else:
            self.drawing.show_regions(None)

    def _end_placing(self) -> None:
        self.placing, self._placed = None, []
        self.placing_changed.emit()

    def _choose_section(self, index: int) -> None:
        self.session.set(("measured_in",), self.section.itemData(index), "section of the measures")

    def _own(self) -> Gauge | None:
        """The chosen measure, where it is of the profile that is shown."""
        if not 0 <= self.chosen < len(self._read):
            return None
        gauge = self._read[self.chosen]
        return gauge if gauge.laser == self.laser else None

    def _project_changed(self) -> None:
        if self.session.project.measures is not self._measures:
            if {gauge.laser for gauge in self._as_rendered()} <= self._profiles.keys():
                self.refresh()
            else:
                self.follow(self.laser)

    def _select(self) -> None:
        row = self.table.currentRow()
        if row != self.chosen and self.table.selectedItems():
            self.chosen = row
            self.cancel()
            self.refresh()

    def _moving(self, regions: object) -> None:
        """While an edge is dragged its measure is read, the project keeps what it has."""
        self._with_regions(regions)
        self._show()

    def _moved(self, regions: object) -> None:
        if self._with_regions(regions):
            self.session.set(("measures", self.chosen, "regions"), regions, "move a region")
            self.table.setFocus()
        else:
            self.refresh()

    def _with_regions(self, regions: object) -> bool:
        gauge = self._own()
        if gauge is None or not isinstance(regions, tuple) or any(not high > low for low, high in regions):
            return False
        moved = read_each([gauge.model_copy(update={"regions": regions})], self._step(), self._profiles)
        self.readings = (*self.readings[: self.chosen], *moved, *self.readings[self.chosen + 1 :])
        return True

    def _step(self) -> int:
        return 0 if self.session.shown is None else self.session.shown.frame.step

    def _show(self) -> None:
        """Table, editor and drawing of `readings`."""
        self._entries = tuple(map(self._entry, range(len(self._read))))
        with QSignalBlocker(self.table):
            self.table.setRowCount(len(self._read))
            for row, gauge in enumerate(self._read):
                self._show_row(row, gauge, self._entries[row])
            if self.chosen >= 0:
                self.table.selectRow(self.chosen)
        self.table.setVisible(bool(self._read))
        self.table.end_with_rows()
        self.table.fit()
        index = self.chosen
        self.editor.show_gauge(index, self._read[index] if 0 <= index < len(self._read) else None)
        self.remove.setEnabled(index >= 0)
        self.add.setEnabled(bool(self._profiles) and len(self._read) < MOST_GAUGES)
        of_laser = [one for one in self.readings if one.gauge.laser == self.laser]
        own = self.readings[index].gauge if self.readings and index >= 0 else None
        profile = self._profiles[self.laser][0] if self.laser in self._profiles else None
        self.drawing.show_readings(of_laser, profile, own, self._steps.drawn)
        self.session.show_measures_in_3d(self._in_3d())
        self._tell()

    def _in_3d(self) -> tuple[MeasureIn3D, ...]:
        """Of all lasers, where they were read."""
        render, section = self.session.shown, self.session.project.measured_in
        if render is None:
            return ()
        scene, step, found = render.project.scene, render.frame.step, []
        for laser, (measured, _) in self._profiles.items():
            of_laser = [one for one in self.readings if one.gauge.laser == laser]
            found += measures_in_3d(of_laser, measured, scene, laser, step, section, self._steps.drawn)
        return tuple(found)

    def _entry(self, row: int) -> dict[str, Any] | None:
        """Of all steps where these are asked for and measured like this, else of the step that is looked at."""
        reading = self.readings[row] if self.readings else None
        of_all = self._steps.shown(self._read[row] if reading is None else reading.gauge)
        return of_all or (None if reading is None else judged_over_steps(reading.gauge, [reading]))

    def _show_row(self, row: int, gauge: Gauge, entry: dict[str, Any] | None) -> None:
        lasers, laser = self.session.project.scene.lasers, self._measures[row].laser
        of_laser = f" ({lasers[laser].name})" if len(lasers) > 1 and laser < len(lasers) else ""
        texts = [gauge.name + of_laser, NONE, NONE, NONE, NONE]
        of = "" if entry is None or entry["readings"] > 1 else self._steps.of_which(gauge)
        if entry is not None:
            _, value, sigma, _, _, _, error, _ = cells(entry)
            # counts have no room beside a name: the tip has them, but for those that leave it undecided
            verdict = "not measured" if entry["reason"] else marked_verdict(entry)
            missing = entry["verdicts"].get("none", 0) if entry["readings"] > 1 else 0
            if missing and entry["verdict"] == "undecided":
                verdict += f", {missing} of {entry['readings']} not measured"
            verdict = f"{verdict}{of}" if verdict != NONE or not of else of.removeprefix(", ")
            texts[1:] = [value_of_worst(entry, value), sigma, error, verdict]
        tip = measure_tip(gauge, entry, of)
        for column, text in enumerate(texts):
            item = self.table.show_cell(row, column, text)
            item.setToolTip(tip)
            if column == 0:
                item.setTextAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
            if column == len(texts) - 1 and entry is not None and entry["verdict"]:
                item.setForeground(QColor(theme.verdict_colour(entry["verdict"])))

    def _tell(self) -> None:
        """What to do next, or why the chosen measure has no value."""
        text = "" if self._read else NONE_YET
        chosen = self.chosen if 0 <= self.chosen < len(self._read) else None
        gauge, entry = (None, None) if chosen is None else (self._read[chosen], self._entries[chosen])
        if self.placing is not None:
            names = REGIONS[self.placing]
            count = f" ({len(self._placed) + 1} of {len(names)})" if len(names) > 1 else ""
            text = f"<b>{TITLES[self.placing]}</b>: drag across the {names[len(self._placed)]}{count}. Esc gives up."
            if self.placing in KINDS_OF_SCAN and (self.session.shown is None or self.session.shown.scan is None):
                text += f" {first_upper(OF_SCAN)}."
        elif entry is not None and (reason := missing_of(entry)):
            text = first_upper(reason)
        elif gauge is not None and (odd := beside_nominal(gauge, None if entry is None else entry["value"])):
            text = odd
        elif entry is not None and entry["remark"]:
            text = first_upper(f"{remark_of(entry)}.")
        elif self.readings and (render := self.session.shown) is not None:
            text = lean_text(render.project.scene, self.laser, render.frame.step, self.session.project.measured_in)
        if self.readings and self.placing is None:
            before = f"{text.rstrip('.')}. " if text else ""
            text = f"{before}Points are by {method_name(self._method)}, as Extraction says."
        if self._read and self.placing is None:
            kept = entry is not None and entry["reason"] not in WITHOUT_SCAN
            text = f"{self._steps.told(gauge, kept, self._read)} {text}".strip()
        self.told.setText(text)
        self.told.setToolTip(text)
        self.told.setVisible(bool(text))

    def _lay_out(self) -> None:
        menu = QMenu(self.add)
        show_tips(menu)
        for kind, title in TITLES.items():
            asked = menu.addAction(title)
            asked.setToolTip(DEFINITIONS.get(kind, ""))
            asked.triggered.connect(lambda _checked, kind=kind: self.start(kind))
        self.add.setMenu(menu)
        buttons = QHBoxLayout()
        buttons.addWidget(self.add)
        buttons.addWidget(self.remove)
        buttons.addStretch(1)
        buttons.addWidget(self.section)
        column = QVBoxLayout(self)
        column.setContentsMargins(4, 6, 4, 0)
        column.addLayout(buttons)
        column.addWidget(self.told)
        column.addWidget(self.table, 1)
        column.addWidget(self.editor)
        column.addStretch(0)  # room that no row needs is below all, and not between
        no_higher(self.told, self.editor)
        self.table.viewport().installEventFilter(self.editor)


def _free_name(kind: Kind, taken: tuple[Gauge, ...]) -> str:
    names, short = {gauge.name for gauge in taken}, TITLES[kind].split(" (")[0]
    return next(name for i in range(1, MOST_GAUGES + 2) if (name := f"{short} {i}") not in names)
