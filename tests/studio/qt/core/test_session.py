"""The session's own answers to its panels."""

from __future__ import annotations

from pathlib import Path

from studio.project.document import Document
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.qt.core.session import Session
from studio.runtime.preferences import PreferencesFile


def test_dialogs_begin_in_the_project_s_folder_else_where_a_file_was_chosen_last(tmp_path: Path) -> None:
    """Those of a project that was not saved yet began in the home folder, although a last one was remembered."""
    project = Project.load(template_folder("plane"))
    new = Session(Document(project))
    assert new.place == Path.home()
    new.preferences = PreferencesFile(tmp_path / "home")
    new.chose(tmp_path / "part.stl")
    assert new.place == new.last_place == tmp_path
    new.chose(tmp_path / "gone" / "part.stl")
    assert new.place == Path.home()
    file = tmp_path / "mine" / "project.json"
    saved = Session(Document(project, file))
    saved.preferences = PreferencesFile(tmp_path / "home")
    saved.chose(tmp_path / "scan")
    assert saved.place == file.parent and saved.last_place == tmp_path
