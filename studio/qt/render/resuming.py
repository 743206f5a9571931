"""Going on with a scan that was stopped, after the project has become another: what is told of it, and asked."""

from __future__ import annotations

from typing import Literal

from PySide6.QtWidgets import QMessageBox, QWidget

from studio.project.project import Project
from studio.study.as_begun import told_apart
from studio.study.scan_apart import frames_of, scan_apart

Answer = Literal["resume", "anew", "cancel"]


def told_before_resuming(begun: Project, now: Project) -> str:
    """That other settings go on than those of the project now, and by which; "": it is the same scan."""
    apart = scan_apart(begun, now)
    if not apart:
        return ""
    were = "were" if begun.scene.frame_count > 1 else "was"
    what = f"{frames_of(begun.scene.motion)} that {were} begun"
    return f"goes on with the {what}; the project is now another: {told_apart(apart)}"


def ask_resume(parent: QWidget, folder: str, told: str) -> Answer:
    """Whether to go on with what was begun in a folder, or to scan the project as it is now; Return and Esc do neither.

    told: of `told_before_resuming`.
    """
    question = "Resume the scan as it was begun?"
    box = QMessageBox(QMessageBox.Icon.Question, "Resume the scan", question, parent=parent)
    box.setObjectName("resume")
    box.setInformativeText(
        f"It {told}.\n\nA new scan of the project as it is now goes into another folder; "
        f"what was begun stays in {folder}."
    )
    resume = box.addButton("Resume as begun", QMessageBox.ButtonRole.AcceptRole)
    anew = box.addButton("New scan…", QMessageBox.ButtonRole.AcceptRole)
    stay = box.addButton(QMessageBox.StandardButton.Cancel)
    box.setDefaultButton(stay)
    box.setEscapeButton(stay)
    box.exec()
    return "resume" if box.clickedButton() is resume else "anew" if box.clickedButton() is anew else "cancel"
