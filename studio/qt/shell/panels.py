"""The panels of the window, built one by one: heavy modules are imported when their panel is made."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module

from PySide6.QtWidgets import QWidget

from studio.qt.core.session import Session

Making = Callable[[str], None]


@dataclass(frozen=True)
class Panel:
    """A panel: its key, the title of its dock, which the splash says as well, and where its class is."""

    key: str
    title: str
    module: str
    name: str
    takes_runner: bool = False


PANELS = (
    Panel("scene", "Scene", "studio.qt.scene.scene_tree", "SceneTree"),
    Panel("viewport", "3D view", "studio.qt.viewport.viewport", "Viewport"),
    Panel("inspector", "Inspector", "studio.qt.scene.inspector", "Inspector"),
    Panel("camera", "Camera view", "studio.qt.image.camera_view", "CameraView"),
    Panel("readout", "Design", "studio.qt.results.readout_panel", "ReadoutPanel"),
    Panel("render", "Render", "studio.qt.render.render_panel", "RenderPanel", True),
    Panel("develop", "Exposure and measurement", "studio.qt.render.develop_panel", "DevelopPanel"),
    Panel("results", "Results", "studio.qt.results.results_panel", "ResultsPanel"),
    Panel("nominal", "Deviation, section, height map", "studio.qt.results.nominal_panel", "NominalPanel", True),
    Panel("study", "Study", "studio.qt.study.study_panel", "StudyPanel", True),
    Panel("charts", "Charts", "studio.qt.study.charts_panel", "ChartsPanel", True),
    Panel("recipe", "Dataset", "studio.qt.dataset.recipe_panel", "RecipePanel", True),
    Panel("contact", "Contact sheet", "studio.qt.dataset.contact_panel", "ContactPanel"),
    Panel("calibrate", "Views", "studio.qt.calibrate.calibrate_panel", "CalibratePanel", True),
    Panel("boards", "Camera image", "studio.qt.calibrate.board_view", "BoardView"),
    Panel("calibration", "Calibration", "studio.qt.calibrate.result_panel", "CalibrationPanel"),
    Panel("motion", "Motion", "studio.qt.render.motion_panel", "MotionPanel", True),
    Panel("log", "Messages", "studio.qt.shell.log_panel", "LogPanel"),
)


def make_panels(session: Session, runner: object, making: Making = lambda title: None) -> dict[str, QWidget]:
    """Every panel by its key; `making` hears the title of each before it is made."""
    made: dict[str, QWidget] = {}
    for panel in PANELS:
        making(panel.title)
        kind = getattr(import_module(panel.module), panel.name)
        made[panel.key] = kind(session, runner) if panel.takes_runner else kind(session)
    return made
