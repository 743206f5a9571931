"""What is found in photographs leaves their window as the files that the command `extract` writes."""

from __future__ import annotations

import cv2
import pytest
from click.testing import CliRunner
from PySide6.QtWidgets import QFileDialog

import main
from studio.qt.image import photograph_export
from studio.qt.image.photograph_window import LANE, PhotographWindow
from tests.studio.photographs.colour_photographs import Scene, photograph, write
from tests.studio.qt.small_session import small_session


@pytest.fixture
def made(qtbot, tmp_path):
    """The window with two photographs of one line."""
    for seed in (1, 2):
        write(tmp_path / f"{seed}.png", photograph(Scene(colour=0, room=40.0), seed=seed))
    window = PhotographWindow(small_session())
    qtbot.addWidget(window)
    window.show()
    window.add([tmp_path / "1.png", tmp_path / "2.png"])
    yield window
    window.runner.close()
    window.close()


def measured(qtbot, window):
    window.measure()
    qtbot.waitUntil(lambda: window.found is not None and window.runner.job(LANE) is None)


def written(qtbot, window):
    qtbot.waitUntil(lambda: window.runner.job(photograph_export.LANE) is None)


def test_nothing_is_offered_before_a_line_was_measured(qtbot, made):
    assert not made.export.button.isEnabled()
    made.export.ask()
    assert "press Measure" in made.written.text()
    measured(qtbot, made)
    assert made.export.button.isEnabled() and made.written.text() == ""


def test_the_table_of_the_photograph_that_is_shown_is_that_of_the_command(qtbot, made, tmp_path, monkeypatch):
    measured(qtbot, made)
    made.names.setCurrentRow(1)
    told = []
    made.session.message.connect(lambda level, text: told.append((level, text)))
    asked = []

    def answer(parent, title, start, filters):
        asked.append(start)
        return str(tmp_path / "points"), photograph_export.TABLE

    monkeypatch.setattr(QFileDialog, "getSaveFileName", answer)
    made.export.ask()
    written(qtbot, made)
    assert asked == [str(tmp_path / "2_line.csv")]
    out = tmp_path / "out"
    paths = [str(tmp_path / f"{seed}.png") for seed in (1, 2)]
    assert CliRunner().invoke(main.cli, ["extract", *paths, "--out", str(out), "--overlay", "--quiet"]).exit_code == 0
    assert (tmp_path / "points.csv").read_text() == (out / "2_line.csv").read_text()
    assert "points.csv" in made.written.text() and "px" in made.written.text() and told[0][0] == "info"
    monkeypatch.setattr(
        QFileDialog, "getSaveFileName", lambda *_: (str(tmp_path / "2_line.csv"), photograph_export.PICTURE)
    )
    made.export.ask()
    written(qtbot, made)
    ours, theirs = (cv2.imread(str(folder / "2_line.png")) for folder in (tmp_path, out))
    assert (ours == theirs).all()


def test_all_of_them_go_into_a_folder_by_their_names(qtbot, made, tmp_path, monkeypatch):
    measured(qtbot, made)
    out = tmp_path / "lines"
    out.mkdir()
    monkeypatch.setattr(QFileDialog, "getExistingDirectory", lambda *_: str(out))
    made.export.ask_folder()
    written(qtbot, made)
    names = {f"{seed}_line.{kind}" for seed in (1, 2) for kind in ("csv", "png")}
    assert {path.name for path in out.iterdir()} == names
    before = (out / "1_line.csv").stat().st_mtime_ns
    monkeypatch.setattr(made.export, "_may_replace", lambda folder, there: False)
    made.export.ask_folder()
    assert (out / "1_line.csv").stat().st_mtime_ns == before
    (out / "1_line.csv").write_text("mine")
    made.export.ask_folder()
    assert (out / "1_line.csv").read_text() == "mine" and "1_line.csv" in made.written.text()
