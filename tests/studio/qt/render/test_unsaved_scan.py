"""The scan of a project that was never saved has its meshes with it, and can be looked at after the window."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
import trimesh
from pytestqt.qtbot import QtBot

from render.base.errors import InputError
from render.scene.scene import SceneObject
from render.scene.shape import MeshFile
from studio.project.document import Document, replaced
from studio.qt.render.motion_panel import MotionPanel
from studio.qt.shell.window import MainWindow
from studio.scan.scan_folder import open_folder
from tests.studio.scan_of_steps import small_project

MESH = "meshes/bar.stl"


@pytest.fixture
def draft(window: MainWindow) -> Path:
    """The window has a project with a mesh in a folder of its own, which goes when it is closed."""
    project = small_project(steps=2)
    folder = window.files.autosave.draft()
    (folder / "meshes").mkdir()
    trimesh.creation.box(extents=(40.0, 30.0, 20.0)).export(folder / MESH)
    bar = SceneObject(name="bar", shape=MeshFile(path=MESH, unit="mm"))
    window.files.replace(Document(replaced(project, ("scene", "objects"), (bar,)), None, folder))
    return folder


def motion(window: MainWindow) -> MotionPanel:
    panel = window.panels["motion"]
    assert isinstance(panel, MotionPanel)
    panel.scale.setCurrentText("half size")
    return panel


def test_its_results_are_opened_when_the_window_has_gone(
    window: MainWindow, draft: Path, qtbot: QtBot, tmp_path: Path
) -> None:
    """The scan named the window's own folder; opened again, it said that its mesh had changed."""
    panel = motion(window)
    with qtbot.waitSignal(panel.runner.finished, timeout=60_000):
        panel.run_into(tmp_path / "scan", report=False)
    shutil.rmtree(draft)
    found = open_folder(tmp_path / "scan")
    assert (found.root / MESH).is_file() and found.root == (tmp_path / "scan").resolve()
    assert window.files.open_results(tmp_path / "scan", ask=False)
    qtbot.waitUntil(lambda: window.session.shown is not None and window.session.shown.scan is not None)


def test_another_mesh_in_the_way_is_named_and_nothing_runs(window: MainWindow, draft: Path, tmp_path: Path) -> None:
    (tmp_path / "scan" / "meshes").mkdir(parents=True)
    (tmp_path / "scan" / MESH).write_bytes(b"another")
    with pytest.raises(InputError, match="in the way"):
        motion(window).run_into(tmp_path / "scan", report=False)
    assert not (tmp_path / "scan" / "scan.json").exists() and draft.is_dir()
