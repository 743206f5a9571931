"""What was found, how good it is, and whether it may be believed: the sentences and tables of the command line."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFrame, QTextBrowser, QVBoxLayout, QWidget

from studio.qt.calibrate.calibration_work import CalibrationWork
from studio.qt.core import theme
from studio.qt.core.session import Session, one_of
from studio.qt.core.widgets import flush

if TYPE_CHECKING:
    from analysis.calibration.recheck import Recheck
    from studio.calibration.solving import Solved

EMPTY = "What is found is told here: parameters with their sigmas, the depth error that they make together, and checks."


class CalibrationPanel(QWidget):
    """Follows the `CalibrationWork` of the session; its text can be copied."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.work = one_of(CalibrationWork, session)
        self.text = QTextBrowser()
        self.text.setOpenLinks(False)
        self.text.setFrameShape(QFrame.Shape.NoFrame)
        self.text.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)  # all of it wraps
        self.text.setAccessibleName("Calibration")
        self.text.document().setDocumentMargin(10)
        flush(QVBoxLayout(self), self.text)
        self.work.solved_changed.connect(self.refresh)
        theme.notice.changed.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        solved = self.work.solved
        place = self.text.verticalScrollBar().value()
        if self.work.checked is not None:
            self.text.setHtml(check_page(self.work.checked))
        elif solved is None:
            self.text.setHtml(f"<p style='color: {theme.colours().muted}'>{EMPTY}</p>")
        else:
            self.text.setHtml(page(solved, self.work.target_um, self.work.note))
        self.text.verticalScrollBar().setValue(place)


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
        header = ["Depth error / µm", "rms", "worst", "line", *(["true"] if solved.true else [])]
        rows = depth_rows(result, None if solved.true is None else list(solved.true), solved.names)
        parts.append(_table(header, rows))
    if result.advice is not None:
        name, _, told = next_sentence(result.advice, target_um).partition(": ")
        parts.append(f"<p style='color: {c.good if name == 'enough' else c.accent}'><b>{name}</b> {escape(told)}</p>")
    if note:
        parts.append(f"<p style='color: {c.muted}'>{escape(note)}</p>")
    for name, sentence in check_rows(result, solved.views):
        parts.append(f"<p><b>{escape(name)}</b> {escape(sentence)}</p>")
    parts += ["<p></p>", _table(["Parameter", "value", "sigma"], parameter_rows(result, solved.names))]
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
        + "".join(f"<td align='{'right' if i else 'left'}'>{escape(text)}</td>" for i, text in enumerate(row))
        + "</tr>"
        for row in rows
    )
    return f"<table width='100%' cellspacing='0' cellpadding='3'><tr>{head}</tr>{lines}</table>"
