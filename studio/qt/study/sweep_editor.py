"""What one sweep of a study asks: fields and their values, how they are sampled, methods, measure, limit and chart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any, get_args

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QAction
from PySide6.QtWidgets import (
    QCheckBox,
    QFormLayout,
    QHBoxLayout,
    QLabel,
    QMenu,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from analysis.line.settings import Method
from analysis.report.colour import method_colour, method_name
from studio.editing.forms import FieldSpec
from studio.editing.units import Unit
from studio.qt.core.boxes import DecimalBox, WholeBox
from studio.qt.core.widgets import text_button
from studio.qt.forms.fields import ChoiceField
from studio.qt.forms.number_field import NumberField
from studio.qt.image.line_overlay import ticked_swatch
from studio.qt.scene.field_menu import add_board_fields, fill_field_menu
from studio.qt.study.parameter_row import ParameterRow, kind_of
from studio.qt.study.study_work import StudyWork
from studio.study.draft import spec_of
from studio.study.measures import MEASURES, measure_of, part_names

SAMPLINGS = [
    ("All combinations", "grid", "Every value of one field with every value of the others"),
    ("Quasi-random", "sobol", "Spread evenly over the ranges (Sobol)"),
    ("Search the limit", "bisection", "Where the limit is crossed, from the first end, where it holds, to the other"),
    ("Search a boundary", "boundary", "Where the limit is crossed in a map: along the second field, over the first"),
    ("Each effect", "effects", "What makes the depth error: every effect switched off, and switched on alone"),
]
CHARTS = [
    ("Over the first field", "sweep", "A line for each method and each combination of the other fields"),
    ("Over processor time", "speed", "What more accuracy costs, with the front and its knee"),
    ("Map of two fields", "map", "Of the first method, with the limit as a line"),
    ("The line itself", "profile", "Positions, depths and their errors along the line, of the first repeat"),
    ("Images", "pictures", "Side by side, of the first repeat and method"),
    ("Error budget", "budget", "What each effect makes of bias and spread"),
]
TOLERANCE, SAMPLES = 0.05, 16


def measure_choices(work: StudyWork, asked: Sequence[str] = ()) -> list[tuple[str, Any, str]]:
    """Those of every run, the project's own of the part, and what is asked already."""
    names = dict.fromkeys([*MEASURES, *part_names(work.project().measures), *asked])
    shown = [(name, measure_of(name)) for name in names]
    return [
        (f"{one.label[:1].upper()}{one.label[1:]}" + (f" ({one.unit})" if one.unit else ""), name, "")
        for name, one in shown
    ]


class SweepEditor(QWidget):
    """Changes the draft of a `StudyWork`, and follows it."""

    rows_made = Signal()
    """Of fields that are varied, anew."""

    def __init__(self, work: StudyWork) -> None:
        super().__init__()
        self.work = work
        self.rows: list[ParameterRow] = []
        self._structure: Any = None
        self.list = QVBoxLayout()
        self.list.setSpacing(2)
        self.hint = QLabel(
            "Nothing is varied yet: right-click a field of the inspector, or add one here.", wordWrap=True
        )
        self.hint.setObjectName("muted")
        self.add = text_button(
            "Vary a field", "Every field of the project; the same is in the menu of each field of the inspector"
        )
        menu = QMenu(self.add)
        menu.aboutToShow.connect(partial(self._fill_fields, menu))
        self.add.setMenu(menu)
        self.sampling, self.chart = ChoiceField(SAMPLINGS), ChoiceField(CHARTS)
        self.samples = WholeBox(minimum=2, maximum=65536)
        self.tolerance = DecimalBox(minimum=0.01, maximum=50.0, decimals=2, suffix=" %")
        self.samples.setKeyboardTracking(False)
        self.tolerance.setKeyboardTracking(False)
        self.tolerance.setToolTip("Of the range: the search ends in a bracket of this width, or where noise decides")
        self.methods_button = text_button("", name="choice")
        self.methods_button.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        self.methods_menu = QMenu(self.methods_button)
        self.methods_button.setMenu(self.methods_menu)
        self.methods = {method: self._method_action(method) for method in get_args(Method)}
        self.measure, self.limit_of = (ChoiceField(measure_choices(work)) for _ in range(2))
        self.has_limit = QCheckBox("Limit")
        self.has_limit.setToolTip("A bar that a set-up has to keep: a line in the chart, and what a search looks for")
        self.side = ChoiceField([("at most", True, "Broken above"), ("at least", False, "Broken below")])
        self.limit = NumberField(FieldSpec("limit", "Limit", "", "number", 0.0))
        self.limit.refused.connect(self.limit.setToolTip)
        self.limit.given_up.connect(self._tell_given_up)
        self._lay_out()
        self._connect()
        work.draft_changed.connect(self.refresh)
        work.session.project_changed.connect(self._follow_project)
        self.refresh()

    def _fill_fields(self, menu: QMenu) -> None:
        asked = self.work.session.vary_asked.emit
        fill_field_menu(menu, self.work.project(), asked)
        add_board_fields(menu, asked)

    def refresh(self) -> None:
        """Follow the draft."""
        sweep = self.work.sweep
        self._show_parameters()
        sampling = sweep.get("sampling", "grid")
        self.sampling.show_value(sampling)
        self.form.setRowVisible(self.samples, sampling == "sobol")
        self.form.setRowVisible(self.tolerance, sampling == "bisection")
        for box, value in (
            (self.samples, sweep.get("samples", SAMPLES)),
            (self.tolerance, 100.0 * sweep.get("tolerance", 0.01)),
        ):
            box.blockSignals(True)
            box.setValue(value)
            box.blockSignals(False)
        chosen = self._chosen_methods()
        for method, action in self.methods.items():
            action.setChecked(method in chosen)
        text = ", ".join(method_name(method) for method in chosen)
        more = f"{method_name(chosen[0])} and {len(chosen) - 1} more" if len(chosen) > 1 else text
        self.methods_button.setText(more)
        self.methods_button.setToolTip(text)
        asked = [sweep.get("measure", "depth_rmse"), *([sweep["limit"]["measure"]] if sweep.get("limit") else [])]
        for field in (self.measure, self.limit_of):
            field.offer(measure_choices(self.work, asked))
        self.measure.show_value(sweep.get("measure", "depth_rmse"))
        self.chart.show_value(sweep.get("chart", "sweep"))
        self._show_limit()

    def _follow_project(self) -> None:
        if self.work.watched:
            self._structure = None
            self._show_parameters()

    def _show_parameters(self) -> None:
        work, effects = self.work, self.work.sweep.get("sampling") == "effects"
        vary = [] if effects else work.sweep["vary"]
        structure = work.chosen, [(one["field"], kind_of(one)) for one in vary], id(work.loaded)
        if structure != self._structure:
            self._structure = structure
            for row in self.rows:
                self.list.removeWidget(row)
                row.hide()
                row.deleteLater()
            project = work.project()
            self.rows = [ParameterRow(project, one, spec_of(project, one["field"])) for one in vary]
            for number, row in enumerate(self.rows):
                row.changed.connect(partial(work.set_values, number))
                row.removed.connect(partial(self._remove, number))
                row.given_up.connect(partial(work.session.message.emit, "warning"))
                self.list.addWidget(row)
            self.rows_made.emit()
        for row, parameter in zip(self.rows, vary, strict=True):
            row.refresh(parameter)
            row.allow_count(work.sweep.get("sampling", "grid") in ("grid", "boundary"))
        self.hint.setVisible(not vary and not effects)
        self.add.setVisible(not effects)

    def _remove(self, number: int) -> None:
        vary = self.work.sweep["vary"]
        self.work.change_sweep(vary=[*vary[:number], *vary[number + 1 :]])

    def _tell_given_up(self) -> None:
        told = f"Limit: {self.limit.toolTip()}. The value is as it was"
        self.work.session.message.emit("warning", told)

    def _show_limit(self) -> None:
        limit = self.work.sweep.get("limit")
        self.has_limit.setChecked(limit is not None)
        for widget in (self.limit_of, self.side, self.limit):
            widget.setVisible(limit is not None)
        if limit is not None:
            self.limit_of.show_value(limit["measure"])
            self.side.show_value(limit.get("above", True))
            measure = measure_of(limit["measure"])
            unit = Unit("", measure.unit, measure.scale)
            if unit != self.limit.spec.unit:
                self.limit.spec = replace(self.limit.spec, unit=unit)
                self.limit.suffix = unit.shown
                width = self.limit.fontMetrics().horizontalAdvance(unit.shown)
                self.limit.setTextMargins(0, 0, width + 6, 0)
            self.limit.show_value(limit["value"])

    def _chosen_methods(self) -> list[str]:
        return list(self.work.sweep.get("methods") or self.work.draft.get("methods", ["likelihood"]))

    def _method_action(self, method: str) -> QAction:
        action = self.methods_menu.addAction(ticked_swatch(method_colour(method)), method_name(method))
        action.setCheckable(True)
        return action

    def _choose_methods(self) -> None:
        chosen = [method for method, action in self.methods.items() if action.isChecked()]
        if chosen:
            self.work.change_sweep(methods=chosen)
        else:
            self.refresh()  # one at least

    def _choose_sampling(self, sampling: str) -> None:
        values: dict[str, Any] = {"sampling": sampling}
        values["samples"] = self.work.sweep.get("samples", SAMPLES) if sampling == "sobol" else None
        values["tolerance"] = self.work.sweep.get("tolerance", TOLERANCE) if sampling == "bisection" else None
        # effects are no fields, and have a chart of their own
        if "effects" in (sampling, self.work.sweep.get("sampling")):
            values |= {"vary": [], "chart": "budget" if sampling == "effects" else "sweep"}
        if sampling == "boundary":
            values["chart"] = "map"
        if sampling in ("bisection", "boundary") and "limit" not in self.work.sweep:
            values["limit"] = self._first_limit()
        self.work.change_sweep(**values)

    def _first_limit(self) -> dict[str, Any]:
        return {"measure": self.work.sweep.get("measure", "depth_rmse"), "value": 1e-4, "above": True}

    def _change_limit(self, **values: Any) -> None:
        self.work.change_sweep(limit={**(self.work.sweep.get("limit") or self._first_limit()), **values})

    def _connect(self) -> None:
        work = self.work
        self.sampling.entered.connect(self._choose_sampling)
        self.samples.valueChanged.connect(lambda count: work.change_sweep(samples=count))
        self.tolerance.valueChanged.connect(lambda percent: work.change_sweep(tolerance=round(percent / 100.0, 6)))
        for action in self.methods.values():
            action.triggered.connect(lambda _checked: self._choose_methods())
        self.measure.entered.connect(lambda name: work.change_sweep(measure=name))
        self.chart.entered.connect(lambda name: work.change_sweep(chart=name))
        self.has_limit.clicked.connect(lambda on: work.change_sweep(limit=self._first_limit() if on else None))
        self.limit_of.entered.connect(lambda name: self._change_limit(measure=name))
        self.side.entered.connect(lambda above: self._change_limit(above=above))
        self.limit.entered.connect(lambda value: self._change_limit(value=float(value)))
        self.limit.dragged.connect(lambda value: self._change_limit(value=float(value)))

    def _lay_out(self) -> None:
        limit = QHBoxLayout()
        limit.setSpacing(4)
        limit.addWidget(self.side)
        limit.addWidget(self.limit, 1)
        self.form = QFormLayout()
        self.form.setFieldGrowthPolicy(QFormLayout.FieldGrowthPolicy.AllNonFixedFieldsGrow)
        self.form.addRow("Sampling", self.sampling)
        self.form.addRow("Samples", self.samples)
        self.form.addRow("Tolerance", self.tolerance)
        self.form.addRow("Methods", self.methods_button)
        self.form.addRow("Measure", self.measure)
        self.form.addRow("Chart", self.chart)
        self.form.addRow(self.has_limit, self.limit_of)
        self.form.addRow("", limit)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addLayout(self.list)
        column.addWidget(self.hint)
        column.addWidget(self.add, 0, Qt.AlignmentFlag.AlignLeft)
        column.addLayout(self.form)
