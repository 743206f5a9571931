"""The panels of the window, built one by one: heavy modules are imported when their panel is made.

Those of the first workspaces are made with the window, the others when they are first seen or asked for: most sessions
need few of them, and the window would open a quarter of a second later.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module

from PySide6.QtGui import QShowEvent
from PySide6.QtWidgets import QVBoxLayout, QWidget

from studio.qt.core.session import Session
from studio.qt.core.widgets import flush

Making = Callable[[str], None]


@dataclass(frozen=True)
class Panel:
    """A panel: its key, the title of its dock, which the splash says as well, and where its class is."""

    key: str
    title: str
    module: str
    name: str
    takes_runner: bool = False
    later: bool = False
    """Made when it is first seen."""


PANELS = (
    Panel("scene", "Scene", "studio.qt.scene.scene_tree", "SceneTree"),
    Panel("viewport", "3D view", "studio.qt.viewport.viewport", "Viewport"),
    Panel("inspector", "Inspector", "studio.qt.scene.inspector", "Inspector"),
    Panel("camera", "Camera view", "studio.qt.image.camera_view", "CameraView"),
    Panel("readout", "Design", "studio.qt.results.readout_panel", "ReadoutPanel"),
    Panel("render", "Render", "studio.qt.render.render_panel", "RenderPanel", True),
    Panel("develop", "Exposure and measurement", "studio.qt.render.develop_panel", "DevelopPanel"),
    Panel("results", "Results", "studio.qt.results.results_panel", "ResultsPanel"),
    Panel("nominal", "Deviation, section, height map", "studio.qt.results.nominal_panel", "NominalPanel", True, True),
    Panel("study", "Study", "studio.qt.study.study_panel", "StudyPanel", True, True),
    Panel("charts", "Charts", "studio.qt.study.charts_panel", "ChartsPanel", True, True),
    Panel("recipe", "Dataset", "studio.qt.dataset.recipe_panel", "RecipePanel", True, True),
    Panel("contact", "Contact sheet", "studio.qt.dataset.contact_panel", "ContactPanel", later=True),
    Panel("calibrate", "Views", "studio.qt.calibrate.calibrate_panel", "CalibratePanel", True),
    Panel("boards", "Camera image", "studio.qt.calibrate.board_view", "BoardView", later=True),
    Panel("calibration", "Calibration", "studio.qt.calibrate.result_panel", "CalibrationPanel", later=True),
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
        for panel in PANELS:
            if panel.later:
                self._rooms[panel.key] = Room(self, panel.key)
            else:
                making(panel.title)
                self._make(panel)

    def __getitem__(self, key: str) -> QWidget:
        if key not in self._made:
            panel = next((panel for panel in PANELS if panel.key == key), None)
            if panel is None:
                raise KeyError(key)
            self._rooms[key].take(self._make(panel))
        return self._made[key]

    def __iter__(self) -> Iterator[tuple[str, QWidget]]:
        """Keys and panels that are made."""
        return iter(list(self._made.items()))

    def place(self, key: str) -> QWidget:
        """What stands in the dock: the panel, or the room for one that comes later."""
        return self._rooms[key] if key in self._rooms else self._made[key]

    def _make(self, panel: Panel) -> QWidget:
        kind = getattr(import_module(panel.module), panel.name)
        made = kind(self._session, self._runner) if panel.takes_runner else kind(self._session)
        self._made[panel.key] = made
        return self._made[panel.key]


class Room(QWidget):
    """Where a panel will be as soon as somebody sees it."""

    def __init__(self, panels: Panels, key: str) -> None:
        super().__init__()
        self._panels, self._key = panels, key
        self._column = flush(QVBoxLayout(self))

    def take(self, panel: QWidget) -> None:
        self._column.addWidget(panel)

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self._panels[self._key].show()
