"""The desktop starts, in a process of its own, whatever lies in its way."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from studio.project.templates import new_project

LATER = {
    "analysis.line.extract",
    "matplotlib.figure",
    "render.products",
    "render.progressive",
    "scipy.ndimage",
    "scipy.optimize",
    "studio.scan.scan",
    "studio.study.runner",
}
"""Imported when something is rendered, measured, drawn or run."""
ROOT = Path(__file__).resolve().parents[4]
CHILD = """
import json, sys
from pathlib import Path
from studio.qt.shell import app

made = app.start

def start(path):
    from PySide6.QtCore import QTimer

    window = made(path)

    def end():
        VISIT
        log = window.panels["log"].as_text()
        print(json.dumps({"title": window.windowTitle(), "log": log, "modules": sorted(sys.modules)}), flush=True)
        window.files.count_as_saved(window.session.project)
        window.close()

    QTimer.singleShot(0, window, end)
    return window

app.start = start
sys.exit(app.open_studio(*map(Path, sys.argv[1:])))
"""

WALK = """
        for command in ("render_workspace", "measure", "study", "calibrate", "dataset", "setup"):
            window.commands[command].trigger()
            app.application().processEvents()
"""
FAULT = """
        from PySide6.QtWidgets import QMessageBox, QWidget

        class Faulty(QWidget):
            def showEvent(self, event):
                int("nothing")

        QTimer.singleShot(0, Faulty(window).show)
        for _ in range(3):
            app.application().processEvents()
        for dialog in window.findChildren(QMessageBox):
            dialog.close()
"""


def opened(home: Path, *arguments: str, cwd: Path | None = None, visit: str = "") -> dict[str, Any]:
    """What the window shows after the visit, lines of Python; it was closed in order."""
    preferences = home / "config" / "blazer-studio" / "preferences.json"
    if not os.path.lexists(preferences):
        preferences.parent.mkdir(parents=True)
        preferences.write_text('{"toured": true}')
    done = subprocess.run(
        [sys.executable, "-c", CHILD.replace("VISIT", visit.strip() or "pass"), *arguments],
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=600.0,
    )
    assert done.returncode == 0, done.stderr
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return found


@pytest.mark.skipif(sys.platform != "linux", reason="file names are bytes there")
@pytest.mark.parametrize(
    "given", ["path", *(pytest.param(how, marks=pytest.mark.validation) for how in ("relative", "folder alone"))]
)
def test_in_a_folder_whose_name_is_not_text(home: Path, given: str) -> None:
    folder = Path(os.fsdecode(os.fsencode(home) + b"/\xff"))
    new_project("plane", folder)
    if given == "path":
        found = opened(home, str(folder / "project.json"))
    else:
        found = opened(home, *(["project.json"] if given == "relative" else []), cwd=folder)
    assert ("Weld seam" if given == "folder alone" else "Tilted plane") in found["title"]


@pytest.mark.skipif(os.name == "nt", reason="pipes of POSIX")
def test_with_a_pipe_in_place_of_the_preferences(home: Path) -> None:
    path = home / "config" / "blazer-studio" / "preferences.json"
    path.parent.mkdir(parents=True)
    os.mkfifo(path)
    found = opened(home)
    assert not set(found["modules"]) & LATER, "these take a third of the start, and no window needs them"
    assert "preferences could not be read" in found["log"] and "preferences.damaged.json" in found["log"]
    assert path.is_file() and path.with_suffix(".damaged.json").is_fifo()


def test_every_workspace_opens_after_the_start(home: Path) -> None:
    assert not set(opened(home, visit=WALK)["log"].split()) & {"error", "Error"}


def test_a_fault_in_an_override_is_told_in_place_of_a_crash(home: Path) -> None:
    assert "invalid literal for int() with base 10: 'nothing'" in opened(home, visit=FAULT)["log"]
