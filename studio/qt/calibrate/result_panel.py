"""What was found, how good it is, and whether it may be believed: the sentences and tables of the command line.

While nothing was calibrated in the session, the calibration that the project has.
"""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtGui import QShowEvent
from PySide6.QtWidgets import QFrame, QTextBrowser, QVBoxLayout, QWidget

from studio.project.calibration import Calibration
from studio.qt.calibrate.calibration_work import CalibrationWork
from studio.qt.calibrate.own_depths import OwnDepths
from studio.qt.core import theme
from studio.qt.core.session import Session, one_of
from studio.qt.core.widgets import flush

if TYPE_CHECKING:
    from analysis.calibration.recheck import Recheck
    from studio.calibration.project_calibration import OwnDepth
    from studio.calibration.solving import Solved
    from studio.project.project import Project

EMPTY = "What is found is told here: parameters with their sigmas, the depth error that they make together, and checks."
WORKING = "How far depth is off by it is being worked out."
OWN = "The project's calibration"
TRUE = "True is how far it is off the scene's camera and laser planes."
BOARD_WARP = (
    "<p>How far the board's middle stands out of the plane of its edges: the first number along its rows, the second "
    "along its columns, each with its sigma. It is found with everything else; a flat board has 0.</p>"
)
COLUMNS = (
    "sigmas by which the calibration tells depth to be off, common to all points: rms of the volume, and at its worst "
    "place; line: what the noise of the line adds to each"
)
TRUE_COLUMN = "; true: how far it is off the scanner that took the views, rms"


class CalibrationPanel(QWidget):
    """Follows the `CalibrationWork` and the project of the session; its text can be copied."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.session, self.work = session, one_of(CalibrationWork, session)
        self.depths = OwnDepths(self.work, self)
        self.text = QTextBrowser()
        self.text.setOpenLinks(False)
        self.text.setFrameShape(QFrame.Shape.NoFrame)
        self.text.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)  # all of it wraps
        self.text.setAccessibleName("Calibration")
        self.text.document().setDocumentMargin(10)
        flush(QVBoxLayout(self), self.text)
        for changed in (self.work.solved_changed, self.depths.changed):
            changed.connect(self.refresh)
        session.project_changed.connect(self._follow_project)
        theme.notice.changed.connect(self.refresh)
        self._own: Calibration | None = None
        """The project's, as it is told."""
        self.refresh()

    def refresh(self) -> None:
        solved, project = self.work.solved, self.session.project
        place = self.text.verticalScrollBar().value()
        if self.work.checked is not None:
            self.text.setHtml(check_page(self.work.checked))
        elif self.tells_own and self.isVisible():
            self.depths.want()
            self.text.setHtml(own_page(project, self.depths.found, self.depths.problem))
        elif solved is None:
            self.text.setHtml(f"<p style='color: {theme.colours().muted}'>{EMPTY}</p>")
        else:
            self.text.setHtml(page(solved, self.work.target_um, self.work.note))
        self.text.verticalScrollBar().setValue(place)

    @property
    def tells_own(self) -> bool:
        """Nothing was calibrated in this session, and the project has a calibration."""
        found = self.work.solved is not None or self.work.checked is not None
        return not found and self.session.project.calibration != Calibration()

    def _follow_project(self) -> None:
        told = self._own
        self._own = self.session.project.calibration if self.tells_own else None
        changed = self._own is not told or (self._own is not None and self.depths.old)
        if changed and self.isVisible():
            self.refresh()

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self.refresh()


def page(solved: Solved, target_um: float | None, note: str = "") -> str:
    """The result as rich text, in the order in which it matters."""
    from studio.calibration.words import check_rows, depth_rows, next_sentence, parameter_rows

    result, c = solved.result, theme.colours()
    parts = []
    for fault in result.faults:
        parts.append(f"<p style='color: {c.warning}'><b>Caution</b> {escape(fault)}</p>")
    if result.faults:
        parts.append("<p></p>")
    if result.depth:
        header = ["Depth sigma / µm", "rms", "worst place", "line", *(["true"] if solved.true else [])]
        rows = depth_rows(result, None if solved.true is None else list(solved.true), solved.names)
        parts.append(_table(header, rows))
        told = f"{COLUMNS}{TRUE_COLUMN if solved.true else ''}"
        parts.append(f"<p style='color: {c.muted}'>{escape(told)}</p>")
    if result.advice is not None:
        name, _, told = next_sentence(result.advice, target_um).partition(": ")
        parts.append(f"<p style='color: {c.good if name == 'enough' else c.accent}'><b>{name}</b> {escape(told)}</p>")
    if note:
        parts.append(f"<p style='color: {c.muted}'>{escape(note)}</p>")
    for name, sentence in check_rows(result, solved.views):
        parts.append(f"<p><b>{escape(name)}</b> {escape(sentence)}</p>")
    parts += ["<p></p>", _table(["Parameter", "value", "sigma"], parameter_rows(result, solved.names))]
    return "".join(parts).replace(" um", " µm")


def own_page(project: Project, found: Sequence[OwnDepth] | None, problem: str = "") -> str:
    """The project's own; found: what it does to depth, None: that is being worked out, or cannot be, which is told."""
    from studio.calibration.project_calibration import own_depth_rows, own_notes, own_rows

    muted = f"<p style='color: {theme.colours().muted}'>"
    parts, notes = [f"<p><b>{OWN}</b>, which its points are made with</p>"], own_notes(project)
    if found is None:
        parts.append(f"{muted}{escape(problem or WORKING)}</p>")
    parts.append("<p></p>")
    if found:
        parts += [_table(["Depth sigma / um", "rms", "worst place", "true"], own_depth_rows(project, found)), "<p></p>"]
        notes = [TRUE, *notes] if any(one.true is not None for one in found) else notes
    parts.append(_table(["Parameter", "value", "sigma"], own_rows(project)))
    parts += ["<p></p>", f"{muted}{escape(' '.join(notes))}</p>"]
    return "".join(parts).replace(" um", " µm")


def check_page(checked: Recheck) -> str:
    """Whether a calibration still holds, and how far each part of it is off."""
    from studio.calibration.words import recheck_sentence, recheck_verdict

    c = theme.colours()
    verdict, _, why = recheck_verdict(checked).partition(": ")
    colour = c.warning if checked.changed else c.good
    parts = [f"<p><b style='color: {colour}'>{escape(verdict)}</b> {escape(why)}</p>", "<p></p>"]
    for part in checked.parts:
        mark = c.warning if part in checked.changed else c.text
        parts.append(f"<p><b style='color: {mark}'>{escape(part.name)}</b> {escape(recheck_sentence(part))}</p>")
    parts += [f"<p style='color: {c.muted}'>{escape(told)}</p>" for told in checked.left_out]
    return "".join(parts).replace(" um", " µm")


def _table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    c = theme.colours()
    head = "".join(
        f"<th align='{'right' if i else 'left'}' style='color: {c.muted}; font-weight: normal'>{escape(text)}</th>"
        for i, text in enumerate(header)
    )
    lines = "".join(
        "<tr>"
        + "".join(f"<td align='{'right' if i else 'left'}'>{_cell(text)}</td>" for i, text in enumerate(row))
        + "</tr>"
        for row in rows
    )
    return f"<table width='100%' cellspacing='0' cellpadding='3'><tr>{head}</tr>{lines}</table>"


def _cell(text: str) -> str:
    """With what explains it where the mouse rests, underlined."""
    from studio.calibration.words import WARP

    return f'<u title="{BOARD_WARP}">{escape(text)}</u>' if text == WARP else escape(text)
