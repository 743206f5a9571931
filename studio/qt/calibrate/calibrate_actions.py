"""The calibrate menu, and photographs that are dropped on the window."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QWidget

from render.base.errors import InputError
from studio.project.calibration import Calibration
from studio.qt.calibrate.calibrate_panel import CalibratePanel
from studio.qt.calibrate.calibration_work import CalibrationWork
from studio.qt.calibrate.keeping import remove, use, use_file
from studio.qt.core.actions import Actions
from studio.qt.core.session import Session, one_of

if TYPE_CHECKING:
    from studio.qt.image.photograph_window import PhotographWindow


def is_photograph(path: Path) -> bool:
    """By its name."""
    from studio.calibration.image_views import SUFFIXES

    return path.suffix.lower() in SUFFIXES


def holds_photographs(path: Path) -> bool:
    """A folder with one or more."""
    try:
        return any(is_photograph(file) for file in path.iterdir())
    except OSError:
        return False


def is_calibration(path: Path) -> bool:
    """A calibration file, not a project."""
    from studio.project.calibration import read_calibration_file

    try:
        return path.suffix.lower() == ".json" and bool(read_calibration_file(path, str(path)))
    except InputError:
        return False


class CalibrateActions(QObject):
    """What the menus ask of the panel and of the work."""

    began = Signal()
    """Something is to be calibrated: its workspace is wanted."""

    def __init__(self, parent: QObject, session: Session, actions: Actions, panel: QWidget) -> None:
        """panel: the `CalibratePanel`, which asks for files."""
        super().__init__(parent)
        assert isinstance(panel, CalibratePanel)
        self.work, self.actions = one_of(CalibrationWork, session), actions
        for key, begin in (("calibrate_photographs", panel.ask_folder), ("calibrate_project", self.work.simulate)):
            actions.connect(key, self.began.emit)
            actions.connect(key, begin)
        self.photographs: PhotographWindow | None = None
        actions.connect("photographs", self.open_photographs)
        actions.connect("export_photographs", lambda: self.open_photographs().export.ask())
        actions.connect("drop_view", self.toggle_view)
        actions.connect("save_calibration", panel.ask_and_save)
        actions.connect("use_calibration", lambda: use(self.work))
        actions.connect("use_calibration_file", panel.ask_and_use)
        actions.connect("remove_calibration", lambda: remove(self.work))
        session.project_changed.connect(self.refresh)
        self.work.solved_changed.connect(self.refresh)
        self.work.material_changed.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        for key in ("save_calibration", "use_calibration"):
            self.actions[key].setEnabled(self.work.solved is not None)
        self.actions["remove_calibration"].setEnabled(self.work.session.project.calibration != Calibration())
        self.actions["drop_view"].setEnabled(self.work.material is not None)

    def open_photographs(self) -> PhotographWindow:
        """The window of photographs of a line, which takes what is dropped on it."""
        if self.photographs is None:
            from studio.qt.image.photograph_window import PhotographWindow  # and with it OpenCV

            parent = self.parent()
            self.photographs = PhotographWindow(self.work.session, parent if isinstance(parent, QWidget) else None)
        self.photographs.show()
        self.photographs.raise_()
        return self.photographs

    def toggle_view(self) -> None:
        """The view that is looked at counts no longer, or again."""
        name = self.work.shown
        if name:
            self.work.drop(name, dropped=name not in self.work.dropped)

    def take(self, paths: list[Path], *, folders: bool) -> list[Path]:
        """Photographs among what was dropped, calibration files, and folders of photographs where they are such;
        returns what was taken.
        """
        opened = [path for path in paths if folders and holds_photographs(path)]
        files = [path for path in paths if is_photograph(path) and not path.is_dir()]
        calibrations = [path for path in paths if is_calibration(path)]
        if opened or files or calibrations:
            self.began.emit()
        for folder in opened:
            self.work.open_folder(folder)
        if files:
            self.work.add(files)
        for calibration in calibrations:
            use_file(self.work, calibration)
        return [*opened, *files, *calibrations]
