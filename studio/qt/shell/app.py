"""Starts the desktop: checks what it needs, shows a splash, opens the window, and turns faults into dialogs."""

from __future__ import annotations

import gc
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from studio.qt.shell.quick_start import no_collection, plain_imports, pyplot_when_asked_for
from studio.runtime.display import INSTEAD, why_no_display
from studio.runtime.fault_log import last_fault, watch
from studio.runtime.preferences import state_folder
from studio.runtime.system import message, missing_desktop_needs, missing_needs, why_not_in_this_folder

if TYPE_CHECKING:
    from PySide6.QtWidgets import QApplication

    from studio.qt.shell.window import MainWindow

SAMPLE = "weld_seam"
BAD_INPUT = 2
FIRST_LOOK_MS = 100
FIRST_SELECTION = ("scene", "rig", "lasers", 0)
"""So that the first screen shows handles to drag and a form to type into."""


def why_not() -> str | None:
    """Why the desktop cannot open here, with what to do; None: it can."""
    missing = [*missing_needs(), *missing_desktop_needs()]
    if missing:
        return f"the system lacks libraries\n{message(missing)}"
    reason = why_not_in_this_folder()
    if reason is not None:
        return reason
    reason = why_no_display()
    return None if reason is None else f"{reason}; {INSTEAD}"


def open_studio(path: Path | None = None) -> int:
    """Open the desktop on a project, or on the sample; returns the exit code when its window was closed."""
    reason = why_not()
    if reason is not None:
        print(f"error: the studio does not open: {reason}", file=sys.stderr)
        return BAD_INPUT
    fault = last_fault(state_folder())
    watch(state_folder())
    app = application()
    window = start(path)
    if fault is not None:
        from studio.qt.shell.fault_notice import offer

        offer(window, fault)
    # what is there now stays to the end: looking through it for garbage would only hold up the window
    gc.freeze()
    code = app.exec()
    window.deleteLater()
    return code


def application() -> QApplication:
    """The one Qt application, made with what Qt and its companions must know beforehand."""
    os.environ.setdefault("QT_API", "pyside6")
    os.environ.setdefault("PYQTGRAPH_QT_LIB", "PySide6")
    os.environ.setdefault("NUMBA_THREADING_LAYER", "omp")
    if sys.platform.startswith("linux"):
        # VTK's window does not work on Wayland; XWayland is everywhere
        os.environ.setdefault("QT_QPA_PLATFORM", "xcb")
    from PySide6.QtCore import Qt

    plain_imports()
    pyplot_when_asked_for()
    from PySide6.QtGui import QGuiApplication, QSurfaceFormat
    from PySide6.QtWidgets import QApplication

    from studio.qt.shell.overrides import let_faults_out
    from studio.runtime.memory import return_large_blocks

    let_faults_out()
    there = QApplication.instance()
    if isinstance(there, QApplication):
        return there
    return_large_blocks()
    QGuiApplication.setHighDpiScaleFactorRoundingPolicy(Qt.HighDpiScaleFactorRoundingPolicy.PassThrough)
    surface = QSurfaceFormat.defaultFormat()
    surface.setVersion(3, 2)
    surface.setProfile(QSurfaceFormat.OpenGLContextProfile.CoreProfile)
    QSurfaceFormat.setDefaultFormat(surface)
    app = QApplication(sys.argv[:1])
    app.setApplicationName("blazer-studio")
    app.setApplicationDisplayName("")
    app.setDesktopFileName("blazer-studio")
    return app


@no_collection()
def start(path: Path | None) -> MainWindow:
    """The window, shown, on a project, recovered work or the sample. A bad project is told over the sample."""
    from PySide6.QtCore import QTimer

    from studio.qt.core import theme
    from studio.qt.shell.preferring import take_units
    from studio.qt.shell.splash import Splash
    from studio.runtime.preferences import PreferencesFile, recovery_folder

    preferences = PreferencesFile()
    theme.apply(preferences.values.theme)
    take_units(preferences.values)
    splash = Splash()
    splash.show()
    splash.tell("the sample")
    from studio.project.autosave import Autosave
    from studio.qt.core.session import Session
    from studio.qt.shell.file_actions import template
    from studio.qt.shell.uncaught_errors import catch_faults
    from studio.qt.shell.window import MainWindow

    autosave = Autosave(recovery_folder())
    session = Session(template(SAMPLE, autosave))
    window = MainWindow(session, preferences, autosave, making=splash.tell)
    catch_faults(window, session)
    session.select(FIRST_SELECTION)
    window.show()
    splash.close()
    splash.deleteLater()
    if path is not None:
        window.files.open(path, ask=False)
    elif not window.files.recover():
        # the first screen shows at once what the program is for: the sample with its errors
        window.panels.when_made("viewport", lambda _: QTimer.singleShot(FIRST_LOOK_MS, window, window.render_first))
        if not preferences.values.toured:
            window.start_tour()
    if preferences.trouble:
        session.message.emit("warning", preferences.trouble)
    return window
