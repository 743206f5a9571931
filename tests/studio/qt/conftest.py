"""A display for the desktop's tests, a session on a small project, and no test that leaves work behind."""

from __future__ import annotations

import gc
import os
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from pytestqt.qtbot import QtBot

from studio.runtime.display import why_no_display

if TYPE_CHECKING:
    from PySide6.QtWidgets import QApplication, QWidget

    from studio.qt.shell.window import MainWindow

os.environ.setdefault("QT_API", "pyside6")
os.environ.setdefault("QT_QPA_PLATFORM", "xcb")
HERE = Path(__file__).parent
PATIENCE_MS = 180_000
"""A wait ends when its condition holds; the machine may be shared by many, and how long it takes decides nothing."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Without a display Qt ends the process: skip instead, and say what is missing."""
    reason = why_no_display()
    if reason is not None:
        for item in items:
            if HERE in item.path.parents:
                item.add_marker(pytest.mark.skip(reason=f"{reason}; install xvfb"))


class PatientBot(QtBot):
    """Every wait for something to happen is this patient, whatever a test says."""

    def waitUntil(self, callback: Callable[[], bool | None], *, timeout: int = 0) -> None:
        super().waitUntil(callback, timeout=max(timeout, PATIENCE_MS))

    def waitSignal(self, signal: Any, *, timeout: int = 0, **options: Any) -> Any:
        return super().waitSignal(signal, timeout=max(timeout, PATIENCE_MS), **options)

    def waitSignals(self, signals: list[Any], *, timeout: int = 0, **options: Any) -> Any:
        return super().waitSignals(signals, timeout=max(timeout, PATIENCE_MS), **options)

    def waitActive(self, widget: QWidget, *, timeout: int = 0) -> Any:
        return super().waitActive(widget, timeout=max(timeout, PATIENCE_MS))

    def waitExposed(self, widget: QWidget, *, timeout: int = 0) -> Any:
        return super().waitExposed(widget, timeout=max(timeout, PATIENCE_MS))


@pytest.fixture
def qtbot(qapp: QApplication, request: pytest.FixtureRequest) -> QtBot:
    return PatientBot(request)


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Preferences and recovery files of a test are its own."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return tmp_path


@pytest.fixture(scope="session", autouse=True)
def kernels() -> None:
    """Compiled, or read from their cache, before any window asks for them: a compiler cannot be cancelled."""
    from studio.scan.kernel_warm_up import STEPS, warm_up

    warm_up(STEPS, lambda stage, done: None, lambda: False)


@pytest.fixture(scope="session", autouse=True)
def styled(qapp: QApplication) -> None:
    """In the style that users see, from the first test on: widths of widgets are its."""
    from studio.qt.core import theme

    theme.apply("light")


@pytest.fixture(autouse=True)
def no_question_is_left(qapp: QApplication) -> Iterator[None]:
    """A dialog that waits for a person would wait for ever: it is closed, and its test fails by its name."""
    from PySide6.QtCore import QTimer

    asked: list[str] = []
    timer = QTimer(interval=PATIENCE_MS)

    def give_up() -> None:
        waiting = qapp.activeModalWidget()
        if waiting is not None:
            asked.append(waiting.objectName() or waiting.windowTitle())
            waiting.close()

    timer.timeout.connect(give_up)
    timer.start()
    yield
    timer.stop()
    assert not asked, f"nobody answered {', '.join(asked)}"


@pytest.fixture(autouse=True)
def no_thread_is_left(request: pytest.FixtureRequest) -> Iterator[None]:
    """A job that outlives its window would crash later, in a test that has nothing to do with it."""
    before = set(threading.enumerate())
    yield
    left = [thread for thread in set(threading.enumerate()) - before if thread.name.startswith("job ")]
    for thread in left:
        thread.join(PATIENCE_MS / 1000)
    assert not [thread.name for thread in left if thread.is_alive()]


def leave_out_of_the_search() -> None:
    """What there is lives to the end: each job ends with a search for garbage, which need not look at it again."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="module", autouse=True)
def what_a_module_leaves() -> Iterator[None]:
    """Panels of the shared window above all, and what was imported and compiled for them."""
    yield
    leave_out_of_the_search()


@pytest.fixture
def small_project(tmp_path: Path) -> Path:
    """A file with the step block, seen in 244 x 204 px, so that a render takes a fraction of a second.

    It is for the errors of the image: how a pixel moves the line takes twenty times as long as all else here.
    """
    from studio.project.project import Project
    from studio.project.templates import template_folder
    from studio.scan.stages import scaled

    project = scaled(Project.load(template_folder("step_block") / "project.json"), 0.1)
    settings = project.render.model_copy(update={"ambient_samples": 1, "laser_error": 0.05, "goal": None})
    path = tmp_path / "project" / "steps.json"
    project.model_copy(update={"render": settings}).save(path)
    return path


@pytest.fixture(scope="session")
def one_window(qapp: QApplication, tmp_path_factory: pytest.TempPathFactory) -> Iterator[MainWindow]:
    """Making a window takes a second: tests share one, and get it as if it were new."""
    made = new_window(tmp_path_factory.mktemp("desktop"), "plane")
    leave_out_of_the_search()
    yield made
    made.files.count_as_saved(made.session.project)
    made.close()
    made.deleteLater()


def new_window(folder: Path, template: str) -> MainWindow:
    """A window with preferences and recovery files of its own."""
    from studio.project.autosave import Autosave
    from studio.project.document import Document
    from studio.project.project import Project
    from studio.project.templates import template_folder
    from studio.qt.core.session import Session
    from studio.qt.shell.window import MainWindow
    from studio.runtime.preferences import PreferencesFile

    file = template_folder(template) / "project.json"
    session = Session(Document(Project.load(file), None, file.parent))
    return MainWindow(session, PreferencesFile(folder / "config"), Autosave(folder / "state"))


@pytest.fixture
def window(qtbot: QtBot, one_window: MainWindow, small_project: Path, tmp_path: Path) -> Iterator[MainWindow]:
    """The whole desktop on the small project, on the screen, nothing remembered, nothing running."""
    from PySide6.QtWidgets import QApplication, QDialog

    from studio.project.document import Document
    from studio.project.project import Project
    from studio.qt.core import theme
    from studio.qt.core.live_preview import live
    from studio.qt.shell.workspaces import workspace
    from studio.runtime.preferences import Preferences

    if theme.colours() != theme.LIGHT:
        theme.apply("light")
    preferences = one_window.preferences
    preferences.path, preferences.values = tmp_path / "config" / "preferences.json", Preferences()
    one_window.files.replace(Document(Project.load(small_project), small_project))
    one_window.resize(1440, 900)
    one_window.show()
    with qtbot.waitActive(one_window):
        one_window.activateWindow()  # there is no window manager to do it
    if one_window.workspace != "setup":
        one_window.switch_to("setup")
        preferences.values = Preferences()  # leaving a workspace remembers how it stood
    usual = {name for column in workspace("setup").columns for name, _ in column.docks}
    if usual != {name for name, dock in one_window.docks.items() if dock.isVisible()}:
        one_window.rearrange()
    qtbot.waitUntil(lambda: not live(one_window.session).is_loading)
    yield one_window
    for lane in ("render", "export"):
        one_window.runner.cancel(lane)
    qtbot.waitUntil(lambda: not one_window.runner.busy)
    for dialog in QApplication.topLevelWidgets():
        if isinstance(dialog, QDialog):
            dialog.close()
    one_window.files.count_as_saved(one_window.session.project)
    one_window.files.autosave.forget()


@pytest.fixture
def own_window(qtbot: QtBot, tmp_path: Path) -> Iterator[MainWindow]:
    """One to be closed by the test."""
    made = new_window(tmp_path, "plane")
    made.show()
    qtbot.waitExposed(made)
    yield made
    made.files.count_as_saved(made.session.project)
    made.close()
    made.deleteLater()
