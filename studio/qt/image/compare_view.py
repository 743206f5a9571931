"""Two renders in one window: a line to drag between them, or their signed difference."""

from __future__ import annotations

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QEvent, QPointF, QSize, Qt
from PySide6.QtGui import QCloseEvent, QImage, QPixmap, QShortcut
from PySide6.QtWidgets import QHBoxLayout, QLabel, QToolButton, QVBoxLayout, QWidget

from analysis.report.colour import DIVERGING
from render.base.threads import Cancel
from render.output.tone_mapping import Picture, colour_table, pyramid
from studio.editing.units import Unit
from studio.qt.core import theme
from studio.qt.core.boxes import ChoiceBox
from studio.qt.core.jobs import JobRunner
from studio.qt.core.render import Render
from studio.qt.image.image_item import PictureItem, PictureView
from studio.runtime.jobs import Progress
from studio.scan.compare import Comparison, Quantity, compare, quantities
from studio.scan.redevelop import Development

LABELS: dict[Quantity, str] = {
    "image": "Image",
    "laser": "Laser light",
    "reflected": "Laser light, reflected on",
    "ambient": "Ambient light",
}
WIPE, DIFFERENCE = "Wipe", "Difference"
Drawn = tuple[Comparison, list[Picture], list[Picture], list[Picture], float]


class CompareView(QWidget):
    """A window that lives as long as its parent; `compare` fills it."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent, Qt.WindowType.Window)
        self.setWindowTitle("Compare renders")
        self.resize(900, 680)
        self.runner = JobRunner(self)
        self.comparison: Comparison | None = None
        self._pair: tuple[Render, str, Render, str] | None = None
        self._fitted = False
        self.view = PictureView()
        self.over = PictureItem()
        self.view.box.addItem(self.over)
        self.wipe = pg.InfiniteLine(angle=90, movable=True)
        self.wipe.setZValue(20)
        self.view.box.addItem(self.wipe, ignoreBounds=True)
        self.mode = ChoiceBox()
        self.mode.addItems([WIPE, DIFFERENCE])
        self.quantity = ChoiceBox()
        self.left, self.right, self.told = QLabel(), QLabel(), QLabel()
        self.told.setObjectName("muted")
        self.scale = QLabel()
        QShortcut(Qt.Key.Key_Escape, self, self.close)
        self._lay_out()
        self.wipe.sigPositionChanged.connect(lambda line: self.over.set_clip(float(line.value())))
        self.mode.currentTextChanged.connect(lambda text: self._show_mode())
        self.quantity.activated.connect(lambda i: self._compute())
        self._hover = pg.SignalProxy(self.view.scene().sigMouseMoved, rateLimit=30, slot=self._moved)
        self._colour()

    def closeEvent(self, event: QCloseEvent) -> None:
        # the window may be opened again: the runner stays, what runs ends
        self.runner.cancel("compare")
        super().closeEvent(event)

    def changeEvent(self, event: QEvent) -> None:
        if event.type() == QEvent.Type.PaletteChange and hasattr(self, "wipe"):
            self._colour()
        super().changeEvent(event)

    def compare(self, a: Render, name_a: str, b: Render, name_b: str) -> None:
        """Show a on the left and b on the right."""
        self._pair = (a, name_a, b, name_b)
        self.left.setText(f"◀ {name_a}")
        self.right.setText(f"{name_b} ▶")
        shared = [item for item in quantities(a.frame) if item in quantities(b.frame)]
        self.quantity.clear()
        for item in shared:
            self.quantity.addItem(LABELS[item], item)
        self._fitted = False
        self._compute()

    def forget(self) -> None:
        """Close, and hold neither of the renders."""
        self._pair = self.comparison = None
        self.close()

    def _lay_out(self) -> None:
        bar = QHBoxLayout()
        bar.setContentsMargins(8, 6, 8, 6)
        bar.addWidget(self.mode)
        bar.addWidget(self.quantity)
        bar.addStretch(1)
        bar.addWidget(self.left)
        bar.addSpacing(16)
        bar.addWidget(self.right)
        bar.addStretch(1)
        fit = QToolButton()
        fit.setText("Fit")
        fit.clicked.connect(self.view.fit)
        bar.addWidget(fit)
        foot = QHBoxLayout()
        foot.setContentsMargins(8, 4, 8, 6)
        foot.addWidget(self.told, 1)
        foot.addWidget(self.scale)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addLayout(bar)
        layout.addWidget(self.view, 1)
        layout.addLayout(foot)

    def _colour(self) -> None:
        colours = theme.colours()
        self.view.setBackground(colours.base)
        self.wipe.setPen(pg.mkPen(colours.accent, width=2))
        self.wipe.setHoverPen(pg.mkPen(colours.accent, width=4))

    def _compute(self) -> None:
        if self._pair is None:
            return
        a, _, b, _ = self._pair
        quantity: Quantity = self.quantity.currentData()
        first, second = (a.frame, list(a.images)), (b.frame, list(b.images))

        def work(progress: Progress, cancelled: Cancel) -> Drawn | None:
            found = compare(quantity, first, second)
            if found is None:
                return None
            left, right = found.pictures()
            difference, limit = found.difference_picture()
            return found, pyramid(left), pyramid(right), pyramid(difference), limit

        self.told.setText("comparing")
        self.runner.run("compare", "comparing", work, self._take)

    def _take(self, drawn: Drawn | None) -> None:
        if drawn is None:
            self.told.setText("one of the renders has no image yet")
            return
        if self._pair is None:  # forgotten meanwhile
            return
        self.comparison, *self._levels, self._limit = drawn
        self._show_mode()
        if not self._fitted:
            self._fitted = True
            self.view.fit()
            self.wipe.setValue(self.comparison.a.shape[1] / 2)

    def _show_mode(self) -> None:
        if self.comparison is None:
            return
        wiping = self.mode.currentText() == WIPE
        left, right, difference = self._levels
        self.view.item.set_levels(left if wiping else difference)
        self.over.set_levels(right)
        self.over.setVisible(wiping)
        self.wipe.setVisible(wiping)
        self.over.set_clip(float(self.wipe.value()))
        self.scale.setVisible(not wiping)
        unit = self.comparison.unit
        self.told.setText(f"difference (right minus left): RMS {self.comparison.rms:.4g} {unit}{self._exposed()}")
        if not wiping:
            self._show_scale(unit)

    def _exposed(self) -> str:
        """How the images were made: renders are developed with the exposure and powers of now as they are looked at."""
        if self._pair is None or self.quantity.currentData() != "image":
            return ""
        made = [(one, one.made_from.get("images")) for one in (self._pair[0], self._pair[2])]
        told = [_developed_with(how[1], one.image_scale) for one, how in made if how is not None]
        if len(told) < 2:
            return ""
        left, right = told
        return f"; both developed with {left}" if left == right else f"; developed with {left} left, {right} right"

    def _show_scale(self, unit: str) -> None:
        table = np.ascontiguousarray(np.broadcast_to(colour_table(DIVERGING, 160), (12, 160)))
        image = QImage(table.data, 160, 12, 4 * 160, QImage.Format.Format_RGB32).copy()
        self.scale.setPixmap(QPixmap.fromImage(image).scaled(QSize(160, 12)))
        self.scale.setToolTip(f"-{self._limit:.3g} to +{self._limit:.3g} {unit}")
        self.told.setText(f"{self.told.text()}, colours from -{self._limit:.3g} to +{self._limit:.3g} {unit}")

    def _moved(self, event: tuple[QPointF]) -> None:
        if self.comparison is None:
            return
        where = self.view.box.mapSceneToView(event[0])
        column, row = round(where.x()), round(where.y())
        a, b = self.comparison.a, self.comparison.b
        unit = self.comparison.unit
        if 0 <= row < a.shape[0] and 0 <= column < a.shape[1]:
            left, right = float(a[row, column]), float(b[row, column])
            self.told.setText(f"u, v {column}, {row}: {left:.4g}, {right:.4g}, difference {right - left:+.4g} {unit}")


def _developed_with(how: Development, image_scale: float) -> str:
    """The exposure, and the power of each laser, whatever it was when the light was rendered."""
    exposure = Unit.of("s").with_unit(float(f"{how.project.sensor.exposure_time / image_scale**2:.4g}"))
    lasers = how.project.scene.lasers
    powers = [Unit.of("W").with_unit(power) for power in how.laser_power]
    several = len(lasers) > 1
    return ", ".join(
        [
            exposure,
            *(f"{laser.name} {power}" if several else power for laser, power in zip(lasers, powers, strict=True)),
        ]
    )
