"""What the camera sees: a live estimate while things move, then the rendered frame and each of its light groups."""

from __future__ import annotations

import pyqtgraph as pg
from PySide6.QtCore import QEvent, QPointF, Qt
from PySide6.QtGui import QCloseEvent, QResizeEvent, QShowEvent
from PySide6.QtWidgets import (
    QCheckBox,
    QHBoxLayout,
    QLabel,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from render.base.threads import Cancel
from render.output.tone_mapping import Picture, pyramid
from studio.project.same_lasers import same_lasers
from studio.qt.core import theme
from studio.qt.core.boxes import ChoiceBox
from studio.qt.core.jobs import JobRunner
from studio.qt.core.laser_box import laser_of
from studio.qt.core.live_preview import live
from studio.qt.core.render import Render
from studio.qt.core.scan_steps import awaits_step, scan_steps
from studio.qt.core.session import Session
from studio.qt.core.widgets import flush, upper_and_lower
from studio.qt.image.badge import Badge
from studio.qt.image.image_item import PictureView
from studio.qt.image.line_overlay import BOX_PX, LineOverlay, swatch
from studio.qt.image.picture_clicks import PictureClicks
from studio.qt.image.row_profile import RowProfile
from studio.qt.image.scan_line_marks import ScanLineMarks
from studio.qt.image.zooms import Zooms
from studio.runtime.jobs import Progress
from studio.scan.frame_views import OF_A_LASER, SATURATED, View, at_live_pixel, at_pixel, live_picture, picture, views

DRAG_SECONDS, REST_SECONDS = 0.016, 0.08
"""Of work for a live picture: while something is dragged, and when it has come to rest."""
HOVER_HZ = 30
LOW = 400
"""px of height, for picture and profile together."""
NARROW, TINY, LEAST_CHOICE = 600, 480, 124
"""px, below which lines' boxes take room of the choice, which keeps so much; and zooming is one button."""
MARGIN_PX, SPACE_PX = 6, 8
LEAST_HEIGHT = 260
"""px, from which names of lines may have a row of their own."""
SATURATED_NAME = "Saturated"
LIVE = "Live estimate"


class CameraView(QWidget):
    """Image, read-out and row profile. Follows the session; hovering tells the scan line."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.session = session
        self.runner = JobRunner(self)
        self.live = live(session)
        self.view = PictureView()
        self.overlay = LineOverlay(self.view.box)
        self.marks = ScanLineMarks(session, self.view)
        PictureClicks(session, self.view, lambda: self.is_live or not session.stale)
        self.profile = RowProfile(session)
        self.choice = ChoiceBox()
        self.choice.setSizeAdjustPolicy(ChoiceBox.SizeAdjustPolicy.AdjustToContents)
        self.bright = QCheckBox("Brighten")
        self.bright.setChecked(True)
        self.saturated = QCheckBox(SATURATED_NAME)
        self.saturated.setIcon(swatch(SATURATED))
        self.saturated.setChecked(True)
        self.zooms = Zooms(self.view)
        self.readout = QLabel()
        self.badge = Badge(session)
        self.lines = QWidget()
        self.is_live, self._gave_way = True, False
        """The render was shown until the scene changed; it comes back where that is undone."""
        self._chosen = 0
        self._last_shown: Render | None = None
        self._size = (0, 0)
        self._fitted = False
        self._cursor: tuple[int, int] | None = None
        """Column and row that are read out."""
        self._hover = pg.SignalProxy(self.view.scene().sigMouseMoved, rateLimit=HOVER_HZ, slot=self._moved)
        self._lay_out()
        self._connect()
        self._renders_changed()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        # a low panel shows the picture alone rather than two strips
        self.profile.setVisible(self.height() >= LOW)
        self._name_boxes()

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self.refresh()

    def changeEvent(self, event: QEvent) -> None:
        if event.type() == QEvent.Type.PaletteChange and hasattr(self, "badge"):
            self._colour()
        super().changeEvent(event)

    def refresh(self) -> None:
        """Draw what is chosen."""
        self._draw_live() if self.is_live else self._draw_render()

    def _lay_out(self) -> None:
        self.choice.setToolTip("What to look at")
        self.bright.setToolTip("Square root of the light, to see what is faint")
        self.saturated.setToolTip("Paint the pixels of an image that are saturated")
        self.bar, self.first, self.second = QHBoxLayout(), QHBoxLayout(), QHBoxLayout()
        for widget in (self.choice, self.bright, self.saturated):
            self.bar.addWidget(widget)
            self.bar.addSpacing(SPACE_PX)
        self.lines.setLayout(self.overlay.bar)
        self.overlay.bar.setContentsMargins(0, 0, 0, 0)
        self.overlay.bar.addStretch(1)
        # many methods must not make the panel, and so the window, wider
        self.lines.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self.first.addWidget(self.lines, 1)
        self.bar.addLayout(self.first, 1)
        self.bar.addWidget(self.zooms)
        self.readout.setContentsMargins(8, 2, 8, 2)
        self.readout.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.readout.setMinimumWidth(1)
        picture = QWidget()
        column = flush(QVBoxLayout(picture), self.badge)
        column.addWidget(self.view, 1)
        column.addWidget(self.readout)
        layout = flush(QVBoxLayout(self))
        bars = QVBoxLayout()
        bars.setContentsMargins(MARGIN_PX, 4, MARGIN_PX, 4)
        bars.addLayout(self.bar)
        bars.addLayout(self.second)
        layout.addLayout(bars)
        layout.addWidget(upper_and_lower(picture, self.profile, (300, 140)), 1)
        self._colour()

    def closeEvent(self, event: QCloseEvent) -> None:
        self.runner.close()
        super().closeEvent(event)

    def _connect(self) -> None:
        session = self.session
        session.renders_changed.connect(self._renders_changed)
        session.project_changed.connect(self._project_changed)
        session.step_changed.connect(self._step_changed)
        session.problems_changed.connect(self._show_badge)
        scan_steps(session).told.connect(self._project_changed)
        session.developed.connect(self._developed)
        session.measured.connect(self._draw_overlay)
        session.hover_changed.connect(self._hover_changed)
        session.selection_changed.connect(self._follow_selection)
        session.document_replaced.connect(self._start_anew)
        self.live.changed.connect(self._live_changed)
        self.live.loading.connect(lambda on: self._show_badge())
        self.choice.activated.connect(self._choose)
        for box in (self.bright, self.saturated):
            box.toggled.connect(lambda on: self.refresh())

    def _colour(self) -> None:
        self.view.setBackground(theme.colours().base)
        self.badge.colour()

    # what is shown

    def _start_anew(self) -> None:
        """What is looked at in one project is no place in another."""
        self._fitted = False
        self._read_out(None)

    def _renders_changed(self) -> None:
        shown = self.session.shown
        new = shown is not self._last_shown
        self._last_shown = shown
        if new:
            self.is_live, self._gave_way = shown is None or self._has_changed(), False
            self._read_out(None)
        self._fill_choice()
        self._profile_of_view()
        self.refresh()

    def _project_changed(self) -> None:
        changed = self._has_changed()
        if changed and not self.is_live:
            self.is_live = self._gave_way = True
            self._fill_choice()
        elif self._gave_way and not changed:
            self.is_live = self._gave_way = False
            self._fill_choice()
            self.refresh()
        self._show_badge()

    def _has_changed(self) -> bool:
        """The shown render is not what is looked at, nor will it be in a moment."""
        return self.session.stale and not awaits_step(self.session)

    def _step_changed(self) -> None:
        self.live.show_step(self.session.step)
        self._project_changed()

    def _fill_choice(self) -> None:
        """The live estimate, and below it the ways to look at the shown render."""
        shown = self.session.shown
        self.choice.blockSignals(True)
        self.choice.clear()
        self.choice.addItem(LIVE, None)
        if shown is not None:
            for view in views(shown.project.scene, shown.frame):
                self.choice.addItem(view.label, view)
            self._chosen = min(max(self._chosen, 1), self.choice.count() - 1)
        self.choice.setCurrentIndex(0 if self.is_live else self._chosen)
        self.choice.blockSignals(False)
        self._show_badge()

    def _choose(self, index: int) -> None:
        self.is_live, self._gave_way = index == 0, False
        if index > 0:
            self._chosen = index
            self._profile_of_view()
        self._show_badge()
        self.refresh()

    def _follow_selection(self) -> None:
        """What is seen of one laser is seen of another that is selected."""
        shown, selected = self.session.shown, laser_of(self.session.selection)
        view = self.choice.itemData(self._chosen)
        if shown is None or selected is None or not isinstance(view, View) or view.kind not in OF_A_LASER:
            return
        laser = same_lasers(self.session.project.scene, shown.project.scene).get(selected, view.laser)
        for i in range(1, self.choice.count()):
            one = self.choice.itemData(i)
            if laser != view.laser and (one.kind, one.laser) == (view.kind, laser):
                self._chosen = i
                self._fill_choice()
                self._profile_of_view()
                self.refresh()
                return

    def _profile_of_view(self) -> None:
        """The row profile is of the laser that is looked at."""
        view = self.choice.itemData(self._chosen)
        self.profile.show_laser(view.laser if view is not None and view.kind in OF_A_LASER else 0)

    def _show_badge(self) -> None:
        self.badge.tell(self.is_live, self.live.ready)

    # the live estimate

    def _live_changed(self) -> None:
        if self.is_live:
            self._draw_live()

    def _draw_live(self) -> None:
        if not self.isVisible() or not self.live.ready:
            return
        look = self.live.look
        image = look.image(seconds=DRAG_SECONDS if self.session.dragging else REST_SECONDS)
        camera = look.scene.camera
        drawn = live_picture(look.project, image, self.saturated.isChecked())
        self._place([drawn], (camera.width, camera.height))
        curves = [look.lit_curve(i) for i in range(len(look.scene.lasers))]
        self.overlay.show_truth(curves)
        self.overlay.show_methods([])
        self._name_boxes()

    # the render

    def _developed(self) -> None:
        if not self.is_live:
            view = self.choice.currentData()
            if view is not None and view.kind == "image":
                self._draw_render()

    def _draw_render(self) -> None:
        shown, view = self.session.shown, self.choice.currentData()
        if shown is None or view is None or not self.isVisible():
            return
        scene, frame, images = shown.project.scene, shown.frame, list(shown.images)
        bright, paint = self.bright.isChecked(), self.saturated.isChecked()

        def work(progress: Progress, cancelled: Cancel) -> list[Picture] | None:
            made = picture(view, scene, frame, images, bright, paint)
            return None if made is None else pyramid(made)

        def then(levels: list[Picture] | None) -> None:
            if levels is not None and not self.is_live and self.session.shown is shown:
                self._place(levels, (levels[0].shape[1], levels[0].shape[0]))
                self._draw_overlay()

        self.runner.run("picture", "drawing", work, then)

    def _place(self, levels: list[Picture], size: tuple[int, int]) -> None:
        """Put a picture up; the part that is seen stays the same when its scale changes."""
        before = self._size
        self.view.item.set_levels(levels, size)
        self._size = size
        if not self._fitted or before == (0, 0):
            self._fitted = True
            self.view.fit()
        elif before != size:
            self.view.keep_place(before, size)
        self._read_out(self._cursor if before == size else None)

    def _name_boxes(self) -> None:
        """Lines' boxes have their names where there is room for them: beside the others, else in a row of their own."""
        width, lines = self.width(), self.overlay.width_named()
        self.choice.setMaximumWidth(LEAST_CHOICE if width < NARROW else self.choice.sizeHint().width())
        self.zooms.spread(width >= TINY)
        shown = self.choice, self.bright, self.zooms
        spaces = (len(shown) + 4) * max(self.bar.spacing(), 0) + 2 * SPACE_PX + 2 * MARGIN_PX
        others = sum(min(box.sizeHint().width(), box.maximumWidth()) for box in shown) + spaces + BOX_PX
        name = self.saturated.fontMetrics().horizontalAdvance(SATURATED_NAME)
        row = width - 2 * MARGIN_PX
        helps = self.height() >= LEAST_HEIGHT and lines <= row
        least = others + self.overlay.width_within(0)
        below = others + name + lines > width and (helps or least > width)
        (self.second if below else self.first).addWidget(self.lines, 1)
        room = row if below else width - others
        named = others + name <= width if below else name + self.overlay.width_within(room) <= room
        self.saturated.setText(SATURATED_NAME if named else "")
        self.overlay.show_names_within(room - (name if named and not below else 0))

    def _draw_overlay(self) -> None:
        shown = self.session.shown
        if shown is None or self.is_live:
            return
        self.overlay.show_truth(list(shown.frame.curves))
        self.overlay.show_methods([item.line for items in shown.measurements.values() for item in items])
        self._name_boxes()

    # under the cursor

    def _hover_changed(self) -> None:
        """What is read out is on the hovered scan line, or on none."""
        if self._cursor is not None and self.session.hovered != self._scan_line(*self._cursor) and not self.is_live:
            self._read_out(None)

    def _scan_line(self, column: int, row: int) -> int:
        return row if self.marks.axis == "rows" else column

    def _moved(self, event: tuple[QPointF]) -> None:
        where = self.view.box.mapSceneToView(event[0])
        column, row = round(where.x()), round(where.y())
        width, height = self._size
        if not (0 <= column < width and 0 <= row < height):
            self._read_out(None)
            return
        self._read_out((column, row))
        if not self.is_live and self.session.shown is not None:
            self.session.hover(self._scan_line(column, row))

    def _read_out(self, cursor: tuple[int, int] | None) -> None:
        """The values at a pixel (column, row) of what is shown now; None: the cursor is at none."""
        self._cursor = cursor
        if cursor is None:
            self.readout.clear()
            return
        (column, row), shown = cursor, self.session.shown
        if self.is_live or shown is None:
            look = self.live.look
            image = look.image(seconds=DRAG_SECONDS if self.session.dragging else REST_SECONDS)
            self.readout.setText(readout_text(at_live_pixel(look.scene, image, row, column)))
        else:
            self.readout.setText(readout_text(at_pixel(shown.project.scene, shown.frame, shown.images, row, column)))


def readout_text(values: list[tuple[str, str]]) -> str:
    """In one line."""
    return "   ".join(f"<b>{name}</b>&nbsp;{value}" for name, value in values)
