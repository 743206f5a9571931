"""The panels of the window, built one by one: heavy modules are imported when their panel is made.

Those that the first look does not need come after the window: soon, so that it answers while their modules are imported
beside it (the 3D view's take longer than all others' together), or later, when they are first seen or asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from importlib import import_module
from threading import Thread
from typing import Literal

from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QShowEvent
from PySide6.QtOpenGLWidgets import QOpenGLWidget
from PySide6.QtWidgets import QLabel, QVBoxLayout, QWidget

from studio.qt.core.session import Session
from studio.qt.core.widgets import flush
from studio.qt.shell.quick_start import no_collection

Making = Callable[[str], None]
POLL_MS, PAUSE_MS = 15, 1000
"""Between looks whether the modules of a panel are there; before those of the next one, as the first picture comes."""


@dataclass(frozen=True)
class Panel:
    """A panel: its key, the title of its dock, which the splash says as well, and where its class is."""

    key: str
    title: str
    module: str
    name: str
    takes_runner: bool = False
    when: Literal["now", "soon", "later"] = "now"
    """Made with the window, right after it, or when it is first seen."""


PANELS = (
    Panel("scene", "Scene", "studio.qt.scene.scene_tree", "SceneTree"),
    Panel("viewport", "3D view", "studio.qt.viewport.viewport", "Viewport", when="soon"),
    Panel("inspector", "Inspector", "studio.qt.scene.inspector", "Inspector"),
    Panel("camera", "Camera view", "studio.qt.image.camera_view", "CameraView"),
    Panel("readout", "Design", "studio.qt.results.readout_panel", "ReadoutPanel"),
    Panel("render", "Render", "studio.qt.render.render_panel", "RenderPanel", True),
    Panel("develop", "Exposure and measurement", "studio.qt.render.develop_panel", "DevelopPanel"),
    Panel("results", "Results", "studio.qt.results.results_panel", "ResultsPanel", when="soon"),
    Panel(
        "nominal", "Deviation, section, height map", "studio.qt.results.nominal_panel", "NominalPanel", True, "later"
    ),
    Panel("study", "Study", "studio.qt.study.study_panel", "StudyPanel", True, "later"),
    Panel("charts", "Charts", "studio.qt.study.charts_panel", "ChartsPanel", True, "later"),
    Panel("recipe", "Dataset", "studio.qt.dataset.recipe_panel", "RecipePanel", True, "later"),
    Panel("contact", "Contact sheet", "studio.qt.dataset.contact_panel", "ContactPanel", when="later"),
    Panel("calibrate", "Views", "studio.qt.calibrate.calibrate_panel", "CalibratePanel", True),
    Panel("boards", "Camera image", "studio.qt.calibrate.board_view", "BoardView", when="later"),
    Panel("calibration", "Calibration", "studio.qt.calibrate.result_panel", "CalibrationPanel", when="later"),
    Panel("motion", "Motion", "studio.qt.render.motion_panel", "MotionPanel", True),
    Panel("log", "Messages", "studio.qt.shell.log_panel", "LogPanel"),
)


class Panels:
    """Every panel by its key; one that comes later is made when it is asked for here or its room is first seen."""

    def __init__(self, session: Session, runner: object, making: Making = lambda title: None) -> None:
        """making: hears the title of each panel that is made now; those made later are nobody's wait for a window."""
        self._session, self._runner = session, runner
        self._made: dict[str, QWidget] = {}
        self._rooms: dict[str, Room] = {}
        self._wanted: dict[str, list[Callable[[QWidget], None]]] = {}
        self._imports: Thread | None = None
        self._quiet = ExitStack()
        """While panels are being made."""
        for panel in PANELS:
            if panel.when == "now":
                making(panel.title)
                self._make(panel)
            else:
                self._rooms[panel.key] = Room(self, panel)
        self._next = QTimer(self._rooms["viewport"], interval=POLL_MS)
        self._next.timeout.connect(self._make_next)
        self._next.destroyed.connect(self._quiet.close)

    def __getitem__(self, key: str) -> QWidget:
        if key not in self._made:
            panel = next((panel for panel in PANELS if panel.key == key), None)
            if panel is None:
                raise KeyError(key)
            self._rooms[key].take(self._make(panel))
        return self._made[key]

    def is_made(self, key: str) -> bool:
        return key in self._made

    def when_made(self, key: str, then: Callable[[QWidget], None]) -> None:
        """Call `then` with the panel: now, or as soon as it is there."""
        if key in self._made:
            then(self._made[key])
        else:
            self._wanted.setdefault(key, []).append(then)

    def make_soon(self) -> None:
        """Those that come right after the window, one after the other, so that it answers in between."""
        if not self._next.isActive():
            self._quiet.enter_context(no_collection())
            self._next.start()

    def close(self) -> None:
        """All that are made, and no more are."""
        self._rest()
        for panel in self._made.values():
            panel.close()

    def _rest(self) -> None:
        self._next.stop()
        self._quiet.close()

    def _make_next(self) -> None:
        left = [panel for panel in PANELS if panel.when == "soon" and panel.key not in self._made]
        if not left:
            self._rest()
        elif self._imports is None:
            self._imports = Thread(target=import_module, args=(left[0].module,), name="imports")
            self._imports.start()
            self._next.setInterval(POLL_MS)
        elif not self._imports.is_alive():
            _ = self[left[0].key]  # where the module could not be imported, this tells why
            self._imports = None
            self._next.setInterval(PAUSE_MS)

    def __iter__(self) -> Iterator[tuple[str, QWidget]]:
        """Keys and panels that are made."""
        return iter(list(self._made.items()))

    def place(self, key: str) -> QWidget:
        """What stands in the dock: the panel, or the room for one that comes later."""
        return self._rooms[key] if key in self._rooms else self._made[key]

    def _make(self, panel: Panel) -> QWidget:
        kind = getattr(import_module(panel.module), panel.name)
        made: QWidget = kind(self._session, self._runner) if panel.takes_runner else kind(self._session)
        self._made[panel.key] = made
        for then in self._wanted.pop(panel.key, []):
            then(made)
        return made


class Room(QWidget):
    """Where a panel will be as soon as somebody sees it, or the window has been seen."""

    def __init__(self, panels: Panels, panel: Panel) -> None:
        super().__init__()
        self._panels, self._panel = panels, panel
        self._wait = QLabel(f"{panel.title} …" if panel.when == "soon" else "", alignment=Qt.AlignmentFlag.AlignCenter)
        self._wait.setObjectName("muted")
        self._column = flush(QVBoxLayout(self), self._wait)
        if panel.key == "viewport":
            # a window that first holds a view in OpenGL when it is shown is taken away by Qt and made anew
            QOpenGLWidget(self).hide()

    def take(self, panel: QWidget) -> None:
        self._wait.hide()
        self._column.addWidget(panel)
        panel.show()

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        if self._panel.when == "later":
            _ = self._panels[self._panel.key]
