"""The table of measures: a column a method, each row explained where the mouse rests."""

from __future__ import annotations

import math

from PySide6.QtCore import Qt
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QAbstractItemView, QHeaderView, QTableWidget, QTableWidgetItem

from analysis.report.colour import method_name
from analysis.report.units import digits, digits_of_percent, grouped
from studio.qt.core import theme
from studio.scan.result_series import COVERED, OUTLIERS, UNCERTAINTY, readable_unit

HONEST = 88.0
"""Percent within 2 sigma below which more than noise moves the line; the report remarks on it from there as well."""
USUAL = "and also more than five robust sigmas, or half the line's width where that is less"
COUNTED = "Completeness counts them unless they are outliers in the image too; those of a wrong calibration are not."
EXPLAINED = {
    "Points": "Points measured.",
    "Completeness": "Share of the scan lines on which the line can be seen that have a point of it, and no outlier in "
    "the image.",
    "False scan lines": "Scan lines on which a position was found although no line is to be seen there, "
    "also where its ray gives no point.",
    "Bias": "Mean error: what averaging does not remove.",
    UNCERTAINTY: "Twice the standard deviation of the bias, as neighbouring scan lines err alike: a smaller one may be "
    "chance.",
    "Sigma": "Spread of the errors about their mean, as a standard deviation.",
    "RMSE": "Bias and sigma together: the root of the mean squared error.",
    "Robust sigma": "The spread as it would be without outliers.",
    "95 % within": "95 % of the errors are smaller than this.",
    OUTLIERS["depth"]: f"Points whose error in depth is more than one pixel makes, {USUAL}. {COUNTED}",
    OUTLIERS["surface"]: f"Points whose distance from the surface is more than one pixel makes, {USUAL}. {COUNTED}",
    OUTLIERS[
        "position"
    ]: f"Peaks whose distance from the line is more than one pixel, {USUAL}. Completeness leaves them out.",
    COVERED: "Share of the errors within twice the predicted sigma, of the image's noise and, where points are made "
    "with a calibration, of that: 95 % where nothing else moves the line. Less: texture or edges under it, or too few "
    "pixels. A calibration's error is common to all points, so that all of them may be within or without.",
}

ROW_PX = 22


def shown(value: float, unit: str = "") -> str:
    """Three digits, or all of a whole number; a share that is not all of it is never rounded up to 100 %."""
    if math.isnan(value):
        return "-"
    if value == round(value):
        return grouped(value)
    return digits_of_percent(value) if unit == "%" else digits(value)


def readable(rows: list[tuple[str, str, list[float]]]) -> list[tuple[str, str, list[float]]]:
    """Rows as they are shown: all lengths in mm where one of them has more than four digits in um."""
    largest: dict[str, float] = {}
    for _, unit, values in rows:
        finite = (abs(value) for value in values if math.isfinite(value))
        largest[unit] = max((largest.get(unit, 0.0), *finite))
    made = []
    for name, unit, values in rows:
        shown_in, factor = readable_unit(unit, largest[unit])
        made.append((name, shown_in, [factor * value for value in values]))
    return made


class ReadOnlyTable(QTableWidget):
    """Rows can be selected and copied."""

    def __init__(self) -> None:
        super().__init__()
        self._ends = False
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.setSelectionMode(QAbstractItemView.SelectionMode.ContiguousSelection)
        self.setShowGrid(False)
        self.setAlternatingRowColors(True)
        self.verticalHeader().setDefaultSectionSize(ROW_PX)
        self.horizontalHeader().setSectionResizeMode(QHeaderView.ResizeMode.Stretch)
        self.horizontalScrollBar().rangeChanged.connect(self._bar_changed)

    def show_methods(self, methods: list[str], count: int) -> None:
        """A column for each of them, and so many rows."""
        self.setColumnCount(len(methods))
        self.setRowCount(count)
        self.setHorizontalHeaderLabels([method_name(method).replace(" ", "\n", 1) for method in methods])

    def show_cell(self, row: int, column: int, text: str) -> QTableWidgetItem:
        item = QTableWidgetItem(text)
        item.setTextAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        self.setItem(row, column, item)
        return item

    def _bar_changed(self) -> None:
        if self._ends:
            self.end_with_rows()

    def end_with_rows(self) -> None:
        """No higher than its rows, with the bar below them where they are too wide."""
        self._ends = True
        bar = self.horizontalScrollBar()
        across = bar.sizeHint().height() if bar.maximum() > bar.minimum() else 0
        rows = ROW_PX * self.rowCount() + across
        self.setMaximumHeight(self.horizontalHeader().sizeHint().height() + rows + 2 * self.frameWidth())


class MeasuresTable(ReadOnlyTable):
    """What the errors of each method come to."""

    def __init__(self) -> None:
        super().__init__()
        self.setMinimumWidth(360)

    def show_measures(self, methods: list[str], rows: list[tuple[str, str, list[float]]]) -> None:
        """rows: name, unit, and a value for each method, NaN where there is none."""
        self.show_methods(methods, len(rows))
        for row, (name, unit, values) in enumerate(readable(rows)):
            heading = QTableWidgetItem(f"{name} / {unit}" if unit else name)
            heading.setToolTip(f"<p>{EXPLAINED[name]}</p>")
            self.setVerticalHeaderItem(row, heading)
            for column, value in enumerate(values):
                item = self.show_cell(row, column, shown(value, unit))
                item.setToolTip(f"<p>{EXPLAINED[name]}</p>")
                if name == COVERED and value < HONEST:
                    item.setForeground(QColor(theme.colours().warning))
        self.end_with_rows()
