"""The camera's image with a board in it: residuals, the next pose, coverage; and the depth error as a map."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtGui import QCloseEvent, QShowEvent
from PySide6.QtWidgets import (
    QCheckBox,
    QHBoxLayout,
    QLabel,
    QStackedLayout,
    QTabBar,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from render.base.errors import InputError
from render.base.threads import Cancel
from render.output.tone_mapping import Picture
from studio.calibration.drawings import (
    advised_pose,
    arrow_scale,
    covered,
    dark_squares,
    levels_of,
    outline,
)
from studio.qt.calibrate.board_items import BoardItems
from studio.qt.calibrate.calibration_work import CalibrationWork
from studio.qt.calibrate.depth_plot import DepthPlot
from studio.qt.calibrate.ghost import Ghost
from studio.qt.core import theme
from studio.qt.core.boxes import ChoiceBox
from studio.qt.core.jobs import JobRunner
from studio.qt.core.session import Session, one_of
from studio.qt.core.widgets import flush, text_button
from studio.qt.image.image_item import PictureView
from studio.runtime.jobs import Progress

if TYPE_CHECKING:
    from studio.calibration.view_residuals import Residuals

TABS = (
    ("Residuals", "Corners of the view, and how far off the calibration sees them"),
    ("Next pose", "Where to hold the board next for the largest fall of the depth error"),
    ("Coverage", "Where in the image corners were seen; tinted parts have none"),
    ("Depth error", "What the calibration's errors do to depth, over the working volume"),
)
RESIDUALS, NEXT, COVERAGE, DEPTH = range(len(TABS))
NO_LASER = "The next pose and the depth error are told where a laser is calibrated: depth is what counts."
NOT_YET = "There is no calibration yet."
EMPTY = "Residuals, the next pose, coverage and the depth error are drawn here in the camera's image."


class BoardView(QWidget):
    """Follows the `CalibrationWork` of the session."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.work = one_of(CalibrationWork, session)
        one_of(Ghost, session)
        self.runner = JobRunner(self)
        # tabs without room scroll, as their first letters would not tell them apart
        self.tabs = QTabBar(expanding=False, usesScrollButtons=True, elideMode=Qt.TextElideMode.ElideNone)
        self.tabs.setDrawBase(False)
        for title, tip in TABS:
            self.tabs.setTabToolTip(self.tabs.addTab(title), tip)
        self.laser = ChoiceBox()
        self.laser.setToolTip("Whose depth error is shown")
        self.view, self.plot = PictureView(), DepthPlot()
        self.items = BoardItems(self.view.box)
        self.lit = QCheckBox("Laser on")
        self.lit.setToolTip("The photograph with the laser's line, in place of the board's own")
        self.follow = text_button("Take this view", "One more virtual board, held there")
        self.fit = QToolButton()
        self.fit.setText("Fit")
        self.fit.setToolTip("The whole image")
        self.fit.clicked.connect(self.view.fit)
        self.caption = QLabel(wordWrap=True)
        self.caption.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.caption.setMinimumHeight(2 * self.caption.fontMetrics().lineSpacing() + 8)
        self.caption.setAlignment(Qt.AlignmentFlag.AlignTop)
        self.caption.setContentsMargins(8, 4, 8, 4)
        self._file: Path | None = None
        """Of the photograph that is shown, or will be."""
        self._size = (0, 0)
        self._lay_out()
        self.tabs.currentChanged.connect(self.refresh)
        self.laser.activated.connect(self.refresh)
        self.lit.toggled.connect(self.refresh)
        self.follow.clicked.connect(self.work.follow_advice)
        self.work.state_changed.connect(self._offer)
        for changed in (self.work.material_changed, self.work.solved_changed, self.work.shown_changed):
            changed.connect(self.refresh)
        theme.notice.changed.connect(self._colour)
        self._colour()

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self.refresh()

    def closeEvent(self, event: QCloseEvent) -> None:
        self.runner.close()
        super().closeEvent(event)

    def refresh(self) -> None:
        """Draw what is chosen."""
        if not self.isVisible():
            return
        solved, tab = self.work.solved, self.tabs.currentIndex()
        depths = () if solved is None else solved.result.depth
        self._fill_lasers([self._name(one.volume.laser) for one in depths])
        self.laser.setVisible(tab == DEPTH and len(depths) > 1)
        self.fit.setVisible(tab != DEPTH)
        shot = self.work.shot()
        pair = shot is not None and shot.board is not None and bool(shot.lasers)
        self.lit.setVisible(pair and tab in (RESIDUALS, NEXT))
        self._offer()
        self.stack.setCurrentIndex(1 if tab == DEPTH and depths else 0)
        self.items.clear()
        if tab == DEPTH and depths:
            self._draw_depth(max(self.laser.currentIndex(), 0))
            return
        self._draw_image(photograph=tab != COVERAGE)
        draw = (self._draw_residuals, self._draw_next, self._draw_coverage, self._draw_nothing)[tab]
        self.caption.setText(draw().replace(" um", " µm") if self.work.material is not None else EMPTY)

    def _offer(self) -> None:
        """Virtual boards are held where they are advised at a click."""
        solved = self.work.solved
        advised = self.work.virtual and solved is not None and solved.result.advice is not None
        self.follow.setVisible(advised and self.tabs.currentIndex() == NEXT)
        self.follow.setEnabled(not self.work.running)

    # the image under all

    def _draw_image(self, *, photograph: bool) -> None:
        """The photograph of the view, or what stands for it."""
        work = self.work
        if work.material is None:
            self._file = None
            self.view.item.set_levels([], (1, 1))
            return
        size, shot = work.material.size, work.shot()
        file = None
        if shot is not None and photograph:
            lit = next(iter(shot.lasers.values()), None)
            file = (lit if self.lit.isChecked() else shot.board) or shot.board or lit
        if self._size != size:
            self._size = size
            self.view.item.set_levels([], size)
            self.view.fit()
        if file is not None:
            self._load(file)
            return
        self._file = None
        self.view.item.set_levels([], size)
        self.items.show_sensor(size)
        found = work.residuals()
        if photograph and found is not None and work.solved is not None:
            pose = work.solved.result.estimate, found.rotation, found.translation
            self.items.show_virtual(size, outline(work.solved.board, *pose), dark_squares(work.solved.board, *pose))

    def _load(self, file: Path) -> None:
        if file == self._file:
            return
        self._file = file

        def work(progress: Progress, cancelled: Cancel) -> list[Picture]:
            try:
                return levels_of(file)
            except InputError:  # it was read before: what has become of it since is not asked here
                return []

        def then(levels: list[Picture]) -> None:
            if file == self._file:
                self.view.item.set_levels(levels, self._size)

        self.runner.run("picture", "photograph", work, then)

    # what is drawn on it; each tells what it is

    def _draw_residuals(self) -> str:
        work, found = self.work, self.work.residuals()
        if found is None:
            assert work.material is not None
            view = next((one for one in work.material.views if one.name == work.shown), None)
            if view is None:
                return ""
            self.items.show_corners(view.pixel, np.ones(len(view.pixel), dtype=bool))
            self.items.show_line(np.concatenate([np.empty((0, 2)), *(one.pixel for one in view.stripes)]))
            return f"{view.name}: {len(view.pixel)} corners found"
        scale = arrow_scale(found.off[found.counted], self._size[0])
        self.items.show_corners(found.pixel, found.counted)
        self.items.show_line(found.laser_pixel)
        self.items.show_arrows(found.pixel[found.counted], found.off[found.counted], scale)
        return residuals_text(found, scale)

    def _draw_next(self) -> str:
        from studio.calibration.words import next_sentence

        solved = self.work.solved
        if solved is None:
            return NOT_YET
        advice = solved.result.advice
        if advice is None:
            return NO_LASER
        told = next_sentence(advice, self.work.target_um)
        if not told.startswith("enough"):
            pose = (solved.result.estimate, *advised_pose(advice, solved.board))
            self.items.show_ghost(outline(solved.board, *pose), dark_squares(solved.board, *pose))
        return f"{told[0].upper()}{told[1:]}"

    def _draw_coverage(self) -> str:
        work = self.work
        assert work.material is not None
        views = work.material.without(work.dropped).views
        counts = covered(views, self._size)
        pixel = np.concatenate([np.empty((0, 2)), *(view.pixel for view in views)])
        self.items.show_corners(pixel, np.ones(len(pixel), dtype=bool))
        self.items.show_line(np.concatenate([np.empty((0, 2)), *(s.pixel for view in views for s in view.stripes)]))
        self.items.show_empty(counts, self._size)
        return (
            f"{len(pixel)} corners of {len(views)} views in {np.count_nonzero(counts)} of {counts.size} parts of the "
            "image; nothing is known of the lens in those that are tinted"
        )

    def _draw_nothing(self) -> str:
        return NO_LASER if self.work.solved is not None else NOT_YET

    def _draw_depth(self, number: int) -> None:
        solved = self.work.solved
        assert solved is not None
        one = solved.result.depth[number]
        self.plot.show_map(solved.maps[number])
        name = self._name(one.volume.laser)
        self.caption.setText(
            f"{name[0].upper()}{name[1:]}: depth errs by {1e6 * one.rms:.1f} µm rms, where it is worst by "
            f"{1e6 * one.systematic.max():.1f} µm, by the calibration alone; no mean over scans removes it"
        )

    def _name(self, laser: int) -> str:
        from studio.calibration.words import laser_name

        return laser_name(laser, () if self.work.solved is None else self.work.solved.names)

    def _fill_lasers(self, wanted: list[str]) -> None:
        if wanted != [self.laser.itemText(i) for i in range(self.laser.count())]:
            self.laser.clear()
            self.laser.addItems(wanted)

    def _colour(self) -> None:
        self.view.setBackground(theme.colours().base)

    def _lay_out(self) -> None:
        bar = QHBoxLayout()
        bar.setContentsMargins(0, 0, 6, 0)
        bar.addWidget(self.tabs, 1)
        bar.addWidget(self.fit)
        foot = QHBoxLayout()
        foot.setContentsMargins(0, 0, 6, 0)
        foot.addWidget(self.caption, 1)
        for choice in (self.laser, self.lit, self.follow):
            foot.addWidget(choice, 0, Qt.AlignmentFlag.AlignTop)
        holder = QWidget()
        self.stack = QStackedLayout(holder)
        self.stack.addWidget(self.view)
        self.stack.addWidget(self.plot)
        column = flush(QVBoxLayout(self))
        column.addLayout(bar)
        column.addWidget(holder, 1)
        column.addLayout(foot)


def residuals_text(found: Residuals, scale: float) -> str:
    """What the arrows are, and how long."""
    part = {
        "used": "",
        "left out": ", left out: it does not go with the others",
        "dropped": ", dropped: it has no part in the calibration",
    }[found.part]
    return (
        f"{found.name}: {int(found.counted.sum())} corners, {found.rms:.3f} px rms{part}. Arrows lead from where a "
        f"corner was found to where the calibration sees it, {scale:g} times as long"
    )
