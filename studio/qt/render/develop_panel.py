"""Exposure, gain, bits, laser power and noise of a render that exists: developed and measured again, never rendered."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from functools import partial
from html import escape
from typing import get_args

from PySide6.QtCore import Qt, QTimer, Signal
from PySide6.QtGui import QAction, QCloseEvent
from PySide6.QtWidgets import (
    QCheckBox,
    QFormLayout,
    QLabel,
    QMenu,
    QVBoxLayout,
    QWidget,
)

from analysis.line.settings import Method
from analysis.report.colour import hex_colour, method_colour, method_name, wavelength_colour
from analysis.report.units import micrometres, percent
from render.base.errors import InputError
from render.base.threads import Cancel
from render.frame import Frame
from render.sensor.develop import Image
from studio.preview.inspection import view_warnings
from studio.preview.remedy_changes import FILLED
from studio.preview.saturation import counted_saturated, shares
from studio.project.document import FieldPath
from studio.qt.core.boxes import ChoiceBox
from studio.qt.core.figures_age import FiguresAge
from studio.qt.core.jobs import JobRunner
from studio.qt.core.render import Render
from studio.qt.core.session import Session, one_of
from studio.qt.core.widgets import text_button
from studio.qt.forms.log_field import LogField
from studio.qt.image.line_overlay import swatch, ticked_swatch
from studio.qt.render.automatic_exposure import filling
from studio.runtime.jobs import Job, Progress
from studio.scan.brightness import brightness
from studio.scan.redevelop import Development, develop_again, development, measure_again
from studio.scan.results import METHODS
from studio.scan.stages import Measurement

OF_A_CELL = "This is a cell of a study, as it was measured; the settings above are for the project's own renders."
REST_MS = 120
"""Without a change before the lines are measured: while something is dragged, new images come first."""
RESTED, WITHOUT_FIGURES = 3.0, 9.0
"""Times what developing and measuring took, until a render that goes on is looked at again: it has the processor. The
latter while its light shows no figures yet."""


class DevelopPanel(QWidget):
    """Edits the sensor and the lasers' power in the project; follows every change with new images and measures."""

    _images_ready = Signal(object, object, object, float, str)

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.session = session
        session.measures = True
        self.runner = JobRunner(self)
        self.develop_seconds = 0.0
        self._followed = session.project
        self._told_of: Render | None = None
        """The render that brightness and measures are of."""
        self._to_measure: tuple[Render, Frame, Development, list[Image], tuple[Method, ...]] | None = None
        self._measured: list[Image] | None = None
        """Images that were measured last: of these, other methods are not asked again."""
        self._began = self._free_at = 0.0
        self._without_figures = False
        self._later = QTimer(self, singleShot=True)
        self._later.timeout.connect(self.refresh)
        self._rest = QTimer(self)
        self._rest.setSingleShot(True)
        self._rest.timeout.connect(self._measure)
        self.exposure = LogField(1e-6, 1.0, 1e3, "ms", 4)
        self.exposure.setToolTip("Exposure time: longer is brighter, until the line saturates.")
        self.automatic_exposure = text_button("Automatic")
        self.automatic_exposure.setToolTip(
            f"The line's peaks, without noise, at {FILLED:.0%} of full: of the render at full scale, else as estimated"
        )
        self.automatic_gain = QCheckBox("full well fills the range")
        self.gain = LogField(1e-3, 100.0, 1.0, "DN/e-", 4)
        self.bits = ChoiceBox()
        for bits in (8, 10, 12, 16):
            self.bits.addItem(f"{bits} bit", bits)
        self.noise = QCheckBox("shot, dark, read, pixels")
        self.noise.setChecked(True)
        self.noise.setToolTip("Off: the mean image, still saturated and quantised. A look only, the project keeps it.")
        self.exposures = ChoiceBox()
        for count in range(1, 9):
            self.exposures.addItem("one" if count == 1 else f"{count}, fused", count)
        self.exposures.setToolTip("Several are fused in electrons, each shorter than the one before by the ratio")
        self.continuous = QCheckBox("continuous")
        self.continuous.setToolTip("Of all peaks of a scan line the one that continues the line, or none")
        self.possible = QCheckBox("geometric check")
        self.possible.setToolTip("On the laser's plane, within its fan and the working volume, no wider than its sheet")
        self.powers: list[LogField] = []
        self.methods_button = text_button("", name="choice")
        self.methods_button.setToolTip("Every chosen method measures the same image")
        self.methods_menu = QMenu(self.methods_button)
        self.methods_button.setMenu(self.methods_menu)
        self.methods = {method: self._method_action(method) for method in get_args(Method) if method != "auto"}
        self.told = QLabel(wordWrap=True)
        self.told.setObjectName("muted")
        self.table = QLabel(textFormat=Qt.TextFormat.RichText)
        self.noted = QLabel(wordWrap=True)
        self.noted.setObjectName("muted")
        self._form = QFormLayout()
        self._power_rows = QVBoxLayout()
        self._lay_out()
        self._connect()
        self._follow_project()

    def closeEvent(self, event: QCloseEvent) -> None:
        self._rest.stop()
        self._later.stop()
        self.runner.close()
        super().closeEvent(event)

    @property
    def busy(self) -> bool:
        """What was asked for is not all done yet."""
        return self.runner.busy or self._rest.isActive() or self._later.isActive()

    def chosen(self) -> tuple[Method, ...]:
        """The methods to measure by; the own one first: of the project, or of the study's cell that is shown."""
        shown, now = self.session.shown, self.session.project
        own = (now if shown is None else shown.developed_by(now)).extraction.method
        return (own, *(m for m, action in self.methods.items() if m != own and action.isChecked()))

    def _lay_out(self) -> None:
        form = self._form
        form.setFieldGrowthPolicy(QFormLayout.FieldGrowthPolicy.AllNonFixedFieldsGrow)
        form.setRowWrapPolicy(QFormLayout.RowWrapPolicy.WrapLongRows)
        form.addRow("Exposure", self.exposure)
        form.addRow("", self.automatic_exposure)
        form.addRow("Gain", self.automatic_gain)
        form.addRow("", self.gain)
        form.addRow("Bit depth", self.bits)
        form.addRow("Laser power", self._power_rows)
        form.addRow("Noise", self.noise)
        form.addRow("Exposures", self.exposures)
        form.addRow("Selection", self.continuous)
        form.addRow("", self.possible)
        form.addRow("Measure by", self.methods_button)
        layout = QVBoxLayout(self)
        layout.addLayout(form)
        layout.addWidget(self.told)
        layout.addWidget(self.table)
        layout.addWidget(self.noted)
        layout.addStretch(1)

    def _method_action(self, method: Method) -> QAction:
        action = QAction(ticked_swatch(method_colour(method)), method_name(method), self)
        action.setCheckable(True)
        action.setChecked(method in METHODS)
        self.methods_menu.addAction(action)
        return action

    def _connect(self) -> None:
        session = self.session
        session.project_changed.connect(self._project_changed)
        session.renders_changed.connect(self._another_frame)
        self.exposure.changed.connect(self._setter(("sensor", "exposure_time"), "exposure"))
        self.gain.changed.connect(self._setter(("sensor", "gain"), "gain"))
        for field in (self.exposure, self.gain):
            field.released.connect(self._end_merge)
            field.refused.connect(partial(self.session.message.emit, "warning"))
        self.automatic_gain.clicked.connect(self._choose_gain)
        self.automatic_exposure.clicked.connect(self.expose)
        self.bits.activated.connect(lambda i: session.set(("sensor", "bits"), self.bits.itemData(i), "bit depth"))
        self.exposures.activated.connect(
            lambda i: session.set(("extraction", "exposures"), self.exposures.itemData(i), "exposures")
        )
        self.continuous.clicked.connect(
            lambda on: session.set(("extraction", "select"), "continuous" if on else "strongest", "selection")
        )
        self.possible.clicked.connect(lambda on: session.set(("extraction", "geometry"), on, "geometric check"))
        self.noise.toggled.connect(self.refresh)
        for action in self.methods.values():
            action.toggled.connect(self._methods_changed)
        self._images_ready.connect(self._take_images)
        self.runner.failed.connect(self._tell_failure)
        # old figures are pale beside the new brightness
        one_of(FiguresAge, session).changed.connect(self.table.setDisabled)

    def _setter(self, path: FieldPath, label: str) -> Callable[[float, bool], None]:
        def set_value(value: float, held: bool) -> None:
            if not self.session.set(path, value, f"change {label}", f"develop {label}" if held else ""):
                self._follow_project()

        return set_value

    def expose(self) -> None:
        """Choose the exposure time; where no line is to be seen it stays, and that is told."""
        session = self.session
        try:
            found = filling(session)
        except InputError as error:
            session.message.emit("error", str(error))
            return
        if found is None:
            session.message.emit("error", "no laser line is in the image: there is nothing to expose by")
        elif session.set(("sensor", "exposure_time"), found.time, "automatic exposure"):
            session.message.emit("info", found.told)

    def _end_merge(self) -> None:
        self.session.document.end_merge()

    def _choose_gain(self, automatic: bool) -> None:
        sensor = self.session.project.sensor
        self.session.set(("sensor", "gain"), None if automatic else float(f"{sensor.dn_per_electron:.4g}"), "gain")

    def _methods_changed(self) -> None:
        self._tell_methods()
        self.refresh()

    def _project_changed(self) -> None:
        before, self._followed = self._followed, self.session.project
        after = self._followed
        if before.read_as(after) != after:
            self._follow_project()
            self.refresh()  # measures of the part are read off what was measured

    def _follow_project(self) -> None:
        project = self.session.project
        sensor, lasers = project.sensor, project.scene.lasers
        self.exposure.set_value(sensor.exposure_time)
        self.automatic_gain.setChecked(sensor.gain is None)
        self.gain.setEnabled(sensor.gain is not None)
        self.gain.set_value(sensor.dn_per_electron)
        self.bits.setCurrentIndex(self.bits.findData(sensor.bits))
        self.exposures.setCurrentIndex(self.exposures.findData(project.extraction.exposures))
        self.continuous.setChecked(project.extraction.select == "continuous")
        self.possible.setChecked(project.extraction.geometry)
        if len(self.powers) != len(lasers):
            self._make_powers(len(lasers))
        for field, laser in zip(self.powers, lasers, strict=True):
            field.set_value(laser.power)
            field.setToolTip(f"{laser.name}, {laser.wavelength_nm:g} nm")
            colour = hex_colour(wavelength_colour(laser.wavelength_nm))
            field.sign.setPixmap(swatch(colour).pixmap(10, 10))
        for method, action in self.methods.items():
            # the project's own method is always measured
            action.setEnabled(method != project.extraction.method)
        self._tell_methods()

    def _tell_methods(self) -> None:
        chosen = self.chosen()
        more = f" and {len(chosen) - 1} more" if len(chosen) > 1 else ""
        self.methods_button.setText(f"{method_name(chosen[0])}{more}")

    def _make_powers(self, count: int) -> None:
        for field in self.powers:
            self._power_rows.removeWidget(field)
            field.deleteLater()
        self.powers = [LogField(1e-5, 10.0, 1e3, "mW") for _ in range(count)]
        for i, field in enumerate(self.powers):
            field.changed.connect(self._setter(("scene", "rig", "lasers", i, "power"), f"power of laser {i + 1}"))
            field.released.connect(self._end_merge)
            field.refused.connect(partial(self.session.message.emit, "warning"))
            self._power_rows.addWidget(field)

    def _another_frame(self) -> None:
        """Of a render that goes on the next light waits, so that looking at it does not take longer than it does."""
        render, wait = self.session.shown, self._free_at - time.perf_counter()
        if render is None or render is not self._told_of or not render.refining or wait <= 0.0:
            self.refresh()
        elif self._without_figures and not render.frame.awaits_ambient:
            self.refresh()  # the first figures are what is waited for
        elif not self._later.isActive():
            self._later.start(math.ceil(1e3 * wait))

    def refresh(self) -> None:
        """Develop and measure the shown render; what is asked for meanwhile is done once, with the latest values."""
        self._later.stop()
        self._began, render = time.perf_counter(), self.session.shown
        if render is not self._told_of:
            self._told_of = render
            for label in (self.told, self.table, self.noted):
                label.clear()
        if render is None:
            self._rest.stop()
            self.runner.cancel("develop")
            self.runner.cancel("measure")
            self.told.setText("Render the scene, then change these as often as you like.")
            return
        # of light that is still to come the project's own method tells enough, and takes no time from the render
        frame, noise, methods = render.frame, self.noise.isChecked(), self.chosen()[: 1 if render.refining else None]
        now = render.developed_by(self.session.project)
        awaits_depth = render.awaits_depth(now)
        if awaits_depth:
            now = now.model_copy(update={"sensor": now.sensor.model_copy(update={"defocus": False})})
        how = development(render.project, now, render.image_scale)
        names = [laser.name for laser in render.project.scene.lasers]

        def work(progress: Progress, cancelled: Cancel) -> list[Image]:
            start = time.perf_counter()
            images = develop_again(frame, how, noise=noise, cancelled=cancelled)
            seconds = time.perf_counter() - start
            blur = how.project.sensor.defocus_by(how.project.scene.camera.lens.model)
            told = brightness(images, names, frame) + (f"\ndefocus by {blur}" if blur != "nothing" else "")
            told += "\nin focus until its depth is rendered" if awaits_depth else ""
            told += f"\n{OF_A_CELL}" if render.cell else ""
            render.noise = noise
            self._images_ready.emit(render, (frame, how), images, seconds, told)
            return images

        def then(images: list[Image]) -> None:
            self._without_figures = awaits_depth or (render.refining and frame.awaits_ambient)
            if self._without_figures:
                self._rest_from(self._began, WITHOUT_FIGURES)
                return  # figures without its noise or blur would be too good, and take time from it
            self._to_measure = (render, frame, how, images, methods)
            self._rest.start(0 if render.refining else REST_MS)  # nobody drags light

        self._rest.stop()
        self.runner.cancel("measure")
        if self.runner.job("develop") is None and render.noise == noise and render.has("images", how):
            then(render.images)  # the light that came last was all there was to come
        else:
            self.runner.run("develop", "developing", work, then)

    def _take_images(
        self, render: Render, made_from: tuple[Frame, Development], images: list[Image], seconds: float, told: str
    ) -> None:
        render.images, render.made_from["images"] = images, made_from
        self.develop_seconds = seconds
        if render is self.session.shown:
            self.told.setText(told)
            self.session.developed.emit()

    def _measure(self) -> None:
        if self._to_measure is None or self.runner.job("develop") is not None:
            return
        render, frame, how, images, methods = self._to_measure
        self._to_measure = None
        world = render.world

        known = render.measurements if images is self._measured else {}
        if tuple(known) == methods and render.has("measurements", how):
            return  # the scene changed, and nothing that was measured

        def work(progress: Progress, cancelled: Cancel) -> tuple[dict[str, list[Measurement]], list[str]]:
            missing = tuple(method for method in methods if method not in known)
            found = {**known, **measure_again(frame, world, how, images, missing, cancelled=cancelled)}
            measured: dict[str, list[Measurement]] = {method: found[method] for method in methods if method in found}
            saturated = shares(counted_saturated(images, frame.curves))
            return measured, view_warnings(how.project, frame, how.laser_power, saturated)

        def then(done: tuple[dict[str, list[Measurement]], list[str]]) -> None:
            found, render.doubts = done
            render.measurements, render.made_from["measurements"], self._measured = found, (frame, how), images
            self._rest_from(self._began)
            if render is self.session.shown:
                self._tell_measures(found)
                self.session.measured.emit()

        self.runner.run("measure", "measuring", work, then, interrupt=True)

    def _rest_from(self, began: float, times: float = RESTED) -> None:
        """What was begun then is done."""
        now = time.perf_counter()
        self._free_at = now + times * (now - began)

    def _tell_measures(self, found: dict[str, list[Measurement]]) -> None:
        small = f" at {self._told_of.scanner_scale:.3g} x" if self._told_of and self._told_of.scanner_scale != 1 else ""
        rows = [f"<tr><th align='left'>RMSE{small}&nbsp;</th><th>px</th><th>depth</th><th>rows</th></tr>"]
        lasers = [laser.name for laser in self._told_of.project.scene.lasers] if self._told_of else []
        for method, by_laser in found.items():
            for item in by_laser:
                name = method_name(method) + (f", {escape(lasers[item.laser])}" if len(by_laser) > 1 else "")
                u, depth = item.errors.u.rmse, micrometres(item.errors.depth_z.rmse)
                rows.append(
                    f"<tr><td><span style='color:{method_colour(method)}'>&#9632;</span> {name}&nbsp;&nbsp;</td>"
                    f"<td align='right'>{u:.3f}&nbsp;&nbsp;</td><td align='right'>{depth}&nbsp;&nbsp;</td>"
                    f"<td align='right'>{percent(item.errors.completeness)}</td></tr>"
                )
        self.table.setText(f"<table cellspacing='2'>{''.join(rows)}</table>")
        own = next(iter(found.values()), [])
        notes = [item.line.note for item in own if item.line.note]
        if self.session.project.extraction.spacetime:
            notes.append("Along time is for whole scans: Motion, Run the scan")
        self.noted.setText("\n".join(dict.fromkeys(notes)))

    def _tell_failure(self, job: Job[object]) -> None:
        if job.problem is not None:
            self.session.message.emit("error", job.problem.text)
            one_of(FiguresAge, self.session).give_up()
