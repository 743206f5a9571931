"""A study is saved as a file; one that a person changed does not go unasked, be it with the window or for another."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtWidgets import QFileDialog, QWidget

from render.base.errors import InputError
from studio.qt.core.dialogs import ask_to_keep
from studio.qt.core.save_first import saved_first
from studio.qt.study.study_work import StudyWork
from studio.study.draft import by_names, new_draft
from studio.study.folder_run import in_window
from studio.study.kept_draft import asks_something
from studio.study.study_file import check_base, waits_for_project, write_study

NAMES_PROJECT = (
    "A study's file names that of its project, and this project is in no file as it is now. Save the study beside it "
    "then, or in a folder above."
)
ENDING = ".json"
FILES = "Studies (*.json);;All files (*)"
LOST = "It is in no file as it is now: without saving, its sweeps are lost. What was measured stays in its folder."


def save(work: StudyWork, file: Path) -> bool:
    """Write the study's file; False: told in `failure`, nothing is written."""
    try:
        write_study(file, work.study(), work.session.document, work.loaded)
    except InputError as error:
        work.tell_failure(by_names(in_window(error), work.draft))
        return False
    work.as_it_came = work.draft
    work.tell_failure("")
    work.session.message.emit("info", f"Saved the study: {file}")
    return True


def ask_and_save(work: StudyWork, parent: QWidget) -> bool:
    """Ask where, and save there; False: it is in no file."""
    if not _may_be_saved(work, parent):
        return False
    file = _ask_where(parent, work.session.place / f"{work.draft['name']}.json")
    if file is None:
        return False
    work.session.chose(file)
    return save(work, file)


def may_be_replaced(work: StudyWork, parent: QWidget) -> bool:
    """Whether another study may come in its place; asks where a person's changes would go."""
    return not _unsaved(work) or _ask(work, parent)


def may_go(work: StudyWork, parent: QWidget, *, quits: bool) -> bool:
    """Whether the open project may be closed; asks where the study's changes go with it. quits: the window closes.

    The study of a project that is a file is kept until that is opened again, unless it is in a file of its own, which
    nobody would look for it beside; another stays in the window as long as it is of base projects of its own, or has
    begun.
    """
    kept = work.kept_with_project and work.as_it_came == new_draft(work.base_name)
    stays = not quits and (work.loaded or work.running or work.found is not None)
    return bool(kept or stays) or may_be_replaced(work, parent)


def _ask_where(parent: QWidget, suggestion: Path) -> Path | None:
    """With the ending that a study is opened by. The dialog asks before it gives a file that is there already, which
    one is only by the ending that is added: it is shown once more.
    """
    chosen, _ = QFileDialog.getSaveFileName(parent, "Save the study", str(suggestion), FILES)
    if not chosen:
        return None
    path = Path(chosen)
    if path.suffix.lower() == ENDING:
        return path
    ended = path.with_name(path.name + ENDING)
    return _ask_where(parent, ended) if ended.exists() else ended


def _unsaved(work: StudyWork) -> bool:
    """A person changed it, and neither a file nor the folder of its results holds it as it is now."""
    if work.draft == work.as_it_came or not asks_something(work.draft):
        return False
    try:
        return work.found is None or work.found.study != work.study()
    except InputError:
        return True


def _ask(work: StudyWork, parent: QWidget) -> bool:
    question = f"Save the changes to the study “{work.draft['name']}”?"
    answer = ask_to_keep(parent.window(), "unsaved-study", question, LOST, "Save…")
    return answer == "discard" or (answer == "save" and ask_and_save(work, parent))


def _may_be_saved(work: StudyWork, parent: QWidget) -> bool:
    """Before a person is asked where: there is a study, and a file of the project that it can name."""
    session = work.session
    try:
        base = work.study().base
        if not saved_first(
            session, parent, NAMES_PROJECT, lambda: not waits_for_project(base, session.document, work.loaded)
        ):
            return False
        check_base(base, session.document, work.loaded)
    except InputError as error:
        session.message.emit("warning", f"The study cannot be saved: {by_names(in_window(error), work.draft)}")
        return False
    return True
