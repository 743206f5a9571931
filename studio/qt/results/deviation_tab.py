"""How far the points that are shown are from the nominal part: what is asked, the figures, and the map in bands."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import get_args

import numpy as np
from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QHideEvent, QImage, QPixmap, QResizeEvent, QShowEvent
from PySide6.QtWidgets import (
    QCheckBox,
    QFormLayout,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QVBoxLayout,
    QWidget,
)

from analysis.deviation import Alignment
from analysis.report.delivery import Delivery
from analysis.report.deviation_figure import draw
from render.base.errors import InputError
from render.scene.shape import Unit
from studio.commands.deviation import asked, details, sentence
from studio.editing.units import Unit as ShownUnit
from studio.project.step_file import is_step
from studio.qt.core.boxes import ChoiceBox
from studio.qt.core.dialogs import choose_file, export_csv, show_trouble
from studio.qt.core.jobs import JobRunner
from studio.qt.core.session import Session, ShownDeviation
from studio.qt.core.widgets import ElidedLabel, text_button
from studio.qt.forms.unit_box import UnitBox
from studio.qt.results.heads import measured_otherwise
from studio.qt.results.shown_points import NOTHING, are_there, shown_points
from studio.runtime.error_messages import trouble
from studio.runtime.jobs import Job
from studio.scan.deviation import Compared, Question, compare_cloud, map_of, write_deviation
from studio.scan.first_range import deviation_limit
from studio.scan.logo import gone

LANE = "deviation"
ALIGNMENTS: dict[Alignment, str] = {
    "none": "As measured",
    "best-fit": "Best fit",
    "3-2-1": "3-2-1, by six spots",
}
FILES = "Nominal part (*.step *.stp *.stl *.ply *.obj *.glb *.gltf *.off)"
ALL = "All objects"
CHANGED = "Changed since: Compare again. The figures are still of what they name."
ANOTHER = "Other points are shown since: Compare again."
MARGIN = 8
FIRST_UM, MOST_UM = 100.0, 1_000_000.0
INTO_REPORT = "The report judges the surface by this tolerance as well, of this part; as yet it has another, or none"
TAKEN = (
    "Reports that are exported from now on judge the surface by this tolerance, against the part as it was scanned and "
    "without an alignment; Ctrl+Z takes it back"
)
SPOTS_HINT = "x,y,z of six places on the nominal, mm, world: three, two, one; between them semicolons"
OTHERWISE = (
    "The points are as the scan was measured last; laser power, sensor, extraction or calibration has changed since."
)


class DeviationTab(QWidget):
    """Asks, compares in the background, and shows."""

    def __init__(self, session: Session, runner: JobRunner) -> None:
        super().__init__()
        self.session, self.runner = session, runner
        self.compared: Compared | None = None
        self._running: Job[tuple[Compared, QImage]] | None = None
        self.cad: Path | None = None
        self._picture = QPixmap()
        self._given_part: str | None = None
        self._given_limits: tuple[float | None, float | None] = None, None
        """As the project's report had them last."""
        self.part = ChoiceBox()
        self.nominal = ElidedLabel(Qt.TextElideMode.ElideLeft)
        self.choose = text_button("File…", "A CAD file in the part's place: STEP, STL, PLY, OBJ, GLB")
        self.unit = ChoiceBox()
        self.unit.addItem("unit of the part", None)
        for unit in get_args(Unit):
            self.unit.addItem("µm" if unit == "um" else unit, unit)
        self.unit.setToolTip("That the nominal's file is in, which a mesh does not say")
        self.as_scanned = text_button("As scanned", "The part of the scene itself is the nominal")
        self.alignment = ChoiceBox()
        for key, name in ALIGNMENTS.items():
            self.alignment.addItem(name, key)
        self.spots = QLineEdit()
        self.spots.setPlaceholderText("10,5,20; 40,5,20; …")
        self.spots.setToolTip(SPOTS_HINT)
        self.least, self.most = _limit(-FIRST_UM), _limit(FIRST_UM)
        self.compare_button = text_button("Compare", "", "primary")
        self.export = text_button("Export as CSV…", "Every point, with map and figures beside it")
        self.to_report = text_button("Into the report", INTO_REPORT)
        self.in_view = QCheckBox("In 3D")
        self.in_view.setToolTip("While this is looked at the points there have the colours of their deviation")
        self.in_view.setChecked(True)
        self.in_view.toggled.connect(self._place)
        self.changed = QLabel(CHANGED, wordWrap=True)
        """Beside figures of other inputs than those that stand above them."""
        self.changed.setObjectName("warning")
        self.changed.hide()
        self.told = QLabel(wordWrap=True)
        self.told.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.map = QLabel(alignment=Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignTop)
        self.map.setMinimumSize(1, 1)
        self._lay_out()
        for limit in (self.least, self.most):
            limit.refused.connect(partial(session.message.emit, "warning"))
        self.choose.clicked.connect(self._choose)
        self.as_scanned.clicked.connect(lambda: self.take_nominal(None))
        self.alignment.currentIndexChanged.connect(self._show_rows)
        for changed in (
            *(box.currentIndexChanged for box in (self.part, self.unit, self.alignment)),
            self.spots.textChanged,
            *(limit.valueChanged for limit in (self.least, self.most)),
        ):
            changed.connect(self._check)
        self.compare_button.clicked.connect(self.compare)
        self.to_report.clicked.connect(self._judge_the_report)
        self.export.clicked.connect(self._ask)
        for signal in (session.renders_changed, session.measured):
            signal.connect(self.refresh)
        session.project_changed.connect(self._follow_delivery)
        runner.failed.connect(self._tell_failure)
        self.take_nominal(None)
        self.refresh()

    def refresh(self) -> None:
        """Follow what is shown; figures of something else leave the screen."""
        render = self.session.shown
        names = [] if render is None else [item.name for item in render.project.scene.visible_objects]
        wanted = [ALL, *names] if len(names) > 1 else names
        if wanted != [self.part.itemText(i) for i in range(self.part.count())]:
            self.part.clear()
            self.part.addItems(wanted)
            self._given_part = None
        self._follow_delivery()
        there = are_there(self.session)
        self.compare_button.setEnabled(there)
        compared, self._running = self.compared is not None or self._running is not None, None
        compared |= self.told.text() == ANOTHER
        self._show(None)
        if not there:
            self.told.setText(NOTHING)
        elif compared:
            self.told.setText(ANOTHER)

    def _follow_delivery(self) -> None:
        """Object and limits as the project's report has them, so that both judge alike; a person's own stay."""
        told = self.session.project.delivery
        if told.surface_of != self._given_part:
            self._given_part = told.surface_of
            self.part.setCurrentIndex(max(0, self.part.findText(told.surface_of or ALL)))
            if missing := gone(self.session.project):
                self.session.message.emit("warning", missing)
        limits = told.lower, told.upper
        if limits != self._given_limits:
            self._given_limits = limits
            shown = limits if told.has_tolerance else (-1e-6 * FIRST_UM, 1e-6 * FIRST_UM)
            for box, limit in zip((self.least, self.most), shown, strict=True):
                box.setValue(box.minimum() if limit is None else 1e6 * limit)
        self._check()

    def take_nominal(self, file: Path | None) -> None:
        """A CAD file; None: the part as it was scanned."""
        self.cad = file
        self.nominal.setText("the part as it was scanned" if file is None else str(file))
        self.as_scanned.setEnabled(file is not None)
        self.unit.setVisible(file is not None and not is_step(file))
        self._check()

    def question(self) -> Question:
        """What is asked. InputError: the spots are no places."""
        alignment: Alignment = self.alignment.currentData()
        lower, upper = _metres(self.least), _metres(self.most)
        part = self.part.currentText()
        return Question(
            part=None if part in ("", ALL) else part,
            cad=self.cad,
            cad_unit=self.unit.currentData(),
            alignment=alignment,
            datums=tuple(_places(self.spots.text())) if alignment == "3-2-1" else (),
            lower=lower,
            upper=upper,
        )

    def compare(self) -> None:
        """In the background; the last question counts."""
        try:
            scene, root, read = shown_points(self.session)
            question = self.question()
        except InputError as error:
            show_trouble(self.window(), trouble(error, "compare"))
            return
        self._show(None)
        self.told.setText("Comparing…")

        def work(progress: object, cancelled: object) -> tuple[Compared, QImage]:
            found = compare_cloud(scene, root, read(), question)
            made = draw(map_of(found))
            made.set_dpi(160)
            made.canvas.draw()
            width, height = made.canvas.get_width_height()
            picture = QImage(made.canvas.buffer_rgba(), width, height, 4 * width, QImage.Format.Format_RGBA8888).copy()
            return found, picture

        def then(found: tuple[Compared, QImage]) -> None:
            if self._running is not job:
                return  # of points that are no longer shown
            self._running = None
            self._picture = QPixmap.fromImage(found[1])
            self._show(found[0])

        job = self._running = self.runner.run(LANE, "compare with the nominal", work, then)

    def write(self, path: Path) -> None:
        """InputError: nothing was compared, or a file cannot be written."""
        if self.compared is None:
            raise InputError("nothing was compared yet", cure="press Compare first")
        if self.is_changed:
            raise InputError("the figures are of other inputs than those that are shown", cure="press Compare first")
        files = write_deviation(self.compared, path, [] if self.cad is None else [self.cad])
        self.session.message.emit("info", f"Wrote {', '.join(str(file) for file in files)}")

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self._place()

    def hideEvent(self, event: QHideEvent) -> None:
        super().hideEvent(event)
        self.session.show_deviation(None)

    @property
    def is_changed(self) -> bool:
        """The figures are of other inputs than those that are shown now."""
        if self.compared is None:
            return False
        try:
            return self.question() != self.compared.question
        except InputError:
            return True

    def _check(self) -> None:
        """An input may have changed; with its old value again the figures count again."""
        there, changed = self.compared is not None, self.is_changed
        self.export.setEnabled(there and not changed)
        self.to_report.setEnabled(self._as_report() != self.session.project.delivery)
        if self.changed.isHidden() != changed:
            return
        self.changed.setVisible(changed)
        for widget in (self.told, self.map):
            widget.setEnabled(not changed)
        self._place()

    def _as_report(self) -> Delivery:
        """The report as it would be judged by this tolerance."""
        part, told = self.part.currentText(), self.session.project.delivery
        limits = {"lower": _metres(self.least), "upper": _metres(self.most)}
        return told.model_copy(update={**limits, "surface_of": "" if part == ALL or self.part.count() < 2 else part})

    def _judge_the_report(self) -> None:
        if self.session.set(("delivery",), self._as_report(), "surface tolerance of the report"):
            self.session.message.emit("info", TAKEN)

    def _place(self) -> None:
        """Into the 3D view, where it is to be seen; what is of other inputs is not, as nothing there would say so."""
        found, shown = self.compared, None
        if found is not None and not self.is_changed and self.isVisible() and self.in_view.isChecked():
            row, step = (found.columns[name].astype(np.int32) for name in ("row", "step"))
            shown = ShownDeviation(found.found.points, found.found.value, row, step, deviation_limit(found))
        self.session.show_deviation(shown)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._fit()

    def _show(self, found: Compared | None) -> None:
        self.compared = found
        self._check()
        self._place()
        self.map.setVisible(found is not None)
        if found is None:
            self.map.setMinimumHeight(1)
        if found is None:
            self.told.setText("")
            return
        record = found.record
        texts = [asked(record), f"{record['points']} points: {sentence(record)}", *details(record)]
        if (shown := self.session.shown) is not None and measured_otherwise(self.session, shown):
            texts.insert(0, OTHERWISE)
        self.told.setText("\n".join(texts))
        self._fit()

    def _fit(self) -> None:
        """The map as wide as the panel, at most as large as it was drawn."""
        if self._picture.isNull() or self.compared is None:
            return
        ratio = self.devicePixelRatioF()
        room = QSize(max(1, round((self.width() - 2 * MARGIN) * ratio)), self._picture.height())
        scaled = self._picture.scaled(
            room.boundedTo(self._picture.size()),
            Qt.AspectRatioMode.KeepAspectRatio,
            Qt.TransformationMode.SmoothTransformation,
        )
        scaled.setDevicePixelRatio(ratio)
        self.map.setPixmap(scaled)
        # so that the panel scrolls to it where it is low
        self.map.setMinimumHeight(round(scaled.height() / ratio))

    def _tell_failure(self, job: Job[object]) -> None:
        if job is self._running and job.problem is not None:
            self._running = None
            self.told.setText(job.problem.text)

    def _choose(self) -> None:
        chosen = choose_file(self.session, self.window(), "Nominal part", FILES)
        if chosen is not None:
            self.take_nominal(chosen)

    def _ask(self) -> None:
        export_csv(self.window(), self.session, "deviation", "the deviation", self.write)

    def _show_rows(self) -> None:
        self.form.setRowVisible(self.spots, self.alignment.currentData() == "3-2-1")

    def _lay_out(self) -> None:
        self.form = QFormLayout()
        files = QHBoxLayout()
        files.addWidget(self.choose)
        files.addWidget(self.unit)
        files.addWidget(self.as_scanned)
        files.addStretch(1)
        limits = QHBoxLayout()
        limits.addWidget(self.least, 1)
        limits.addWidget(QLabel("to"))
        limits.addWidget(self.most, 1)
        self.form.addRow("Part", self.part)
        self.form.addRow("Nominal", self.nominal)
        self.form.addRow("", files)
        self.form.addRow("Alignment", self.alignment)
        self.form.addRow("Spots", self.spots)
        self.form.addRow("Tolerance", limits)
        report = QHBoxLayout()
        report.addWidget(self.to_report)
        report.addStretch(1)
        self.form.addRow("", report)
        buttons = QHBoxLayout()
        buttons.addWidget(self.compare_button)
        buttons.addWidget(self.export)
        buttons.addWidget(self.in_view)
        buttons.addStretch(1)
        column = QVBoxLayout(self)
        column.setContentsMargins(MARGIN, MARGIN, MARGIN, MARGIN)
        column.addLayout(self.form)
        column.addLayout(buttons)
        column.addWidget(self.changed)
        column.addWidget(self.told)
        column.addWidget(self.map)
        column.addStretch(1)
        self._show_rows()


def _limit(value: float) -> UnitBox:
    """um; its least value means that there is none."""
    box = UnitBox(ShownUnit.named("µm"), -MOST_UM, MOST_UM, 3)
    box.setSpecialValueText("none")
    box.setAccessibleName("Tolerance")
    box.setValue(value)
    box.setMinimumWidth(box.fontMetrics().horizontalAdvance("-1000.0 µm") + 32)
    return box


def _metres(limit: UnitBox) -> float | None:
    return None if limit.value() == limit.minimum() else 1e-6 * limit.value()


def _places(text: str) -> list[tuple[float, float, float]]:
    """ "1,2,3; 4,5,6" in mm as places in m. InputError: one is none."""
    places = []
    for part in filter(str.strip, text.split(";")):
        try:
            x, y, z = (1e-3 * float(number) for number in part.split(","))
        except ValueError:
            raise InputError("this is no place", found=part.strip(), allowed="x,y,z in mm") from None
        places.append((x, y, z))
    return places
