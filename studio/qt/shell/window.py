"""The main window: panels in docks, six workspaces, menus, toolbar and status bar over one session."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QSize, Qt, QTimer
from PySide6.QtGui import QActionGroup, QCloseEvent, QDragEnterEvent, QDropEvent, QResizeEvent, QShortcut, QShowEvent
from PySide6.QtWidgets import QDockWidget, QMainWindow, QMenu, QWidget

from studio.editing.forms import FieldSpec
from studio.project.autosave import Autosave
from studio.project.document import FieldPath
from studio.project.mesh_import import is_mesh
from studio.qt.calibrate.calibrate_actions import CalibrateActions, is_photograph
from studio.qt.core import theme
from studio.qt.core.actions import Actions
from studio.qt.core.dialogs import about, show_trouble
from studio.qt.core.drops import accept_copy, dragged_files
from studio.qt.core.jobs import JobRunner
from studio.qt.core.live_preview import live
from studio.qt.core.session import Session, one_of
from studio.qt.core.widgets import Scrolled, room_for_a_window
from studio.qt.forms.leaving import leave_typing
from studio.qt.render.python_copy import copy_shown
from studio.qt.results.export_actions import ExportActions
from studio.qt.results.measure_actions import MeasureActions
from studio.qt.results.scan_again import ScanAgain
from studio.qt.scene import scene_actions
from studio.qt.scene.mesh_bar import replace_mesh
from studio.qt.scene.mesh_importer import choose_meshes, import_meshes
from studio.qt.shell.command_keys import CommandKeys
from studio.qt.shell.command_search import CommandSearch
from studio.qt.shell.escape import escape
from studio.qt.shell.file_actions import FileActions
from studio.qt.shell.going import others_may_go, what_goes
from studio.qt.shell.help import Help, panel_with_focus
from studio.qt.shell.motion_calls import MotionCalls
from studio.qt.shell.panels import PANELS, Making, Panels
from studio.qt.shell.preferring import Preferring
from studio.qt.shell.seen_selection import where_seen
from studio.qt.shell.shortcuts import CheatSheet
from studio.qt.shell.status import StatusBar
from studio.qt.shell.toolbar import SWITCH, add_toolbar
from studio.qt.shell.tour import Step, Tour
from studio.qt.shell.workspaces import (
    arrange,
    hide_stray_tabs,
    remembered,
    restore,
    sealed,
    share_out,
    unsealed,
    workspace,
)
from studio.qt.study.cell_opener import CellOpener
from studio.runtime.error_messages import trouble
from studio.runtime.jobs import Job
from studio.runtime.memory import return_what_is_free
from studio.runtime.preferences import PreferencesFile
from studio.runtime.version import version

if TYPE_CHECKING:
    from studio.qt.viewport.error_cloud import ErrorCloud

TALL = ("render", "develop")
"""Panels that scroll."""
TRIM_MS, SETTLING_MS = 1000, 1000
"""From opening another project until the memory of the former one is given back; from showing to the window's size."""


class MainWindow(QMainWindow):
    """Panels know only the session; this window knows the panels."""

    def __init__(
        self,
        session: Session,
        preferences: PreferencesFile | None = None,
        autosave: Autosave | None = None,
        making: Making = lambda title: None,
    ) -> None:
        """preferences, autosave: None for those of this person; making hears the title of each panel being made."""
        super().__init__()
        self.session = session
        self.preferences = preferences or PreferencesFile()
        session.preferences = self.preferences
        self.workspace, self._settling = "", False
        self._called: set[str] = set()
        """Panels that no person put where they are."""
        self.setObjectName("main")
        self.setAcceptDrops(True)
        self.setDockOptions(QMainWindow.DockOption.AllowTabbedDocks | QMainWindow.DockOption.AllowNestedDocks)
        self.resize(1440, 900)
        self.commands = Actions(self, before=leave_typing)
        CommandKeys(self)
        self.runner = JobRunner(self)
        self.panels = Panels(session, self.runner, making)
        self.docks = self._make_docks()
        self.status = StatusBar(session, self.runner, self)
        self.setStatusBar(self.status)
        self.files = FileActions(self, session, self.preferences, autosave)
        self.files.going = partial(what_goes, session, self.runner, self.panels)
        self.files.others_may_go = partial(others_may_go, session, self)
        self.exports = ExportActions(self, session, self.runner, self.preferences, self.commands)
        self.panels.when_made("results", self.exports.follow)
        self.measuring = MeasureActions(self, session, self.commands)
        ScanAgain(session, self.runner, self.commands)
        self.calibrating = CalibrateActions(self, session, self.commands, self.panels["calibrate"])
        self.preferring = Preferring(self)
        self.help = Help(self)
        self.tour: Tour | None = None
        self._cloud: ErrorCloud | None = None
        self.panels.when_made("viewport", self._join_cloud)
        add_toolbar(self, self.commands)
        self._connect()
        self._restore()
        self._tell_document()

    def switch_to(self, key: str) -> None:
        """Another workspace; the panels stand as they were left there."""
        one_of(CellOpener, self.session).go_on()
        if self.workspace:
            self._send_back()
            self._remember_arrangement()
        wanted, size = workspace(key), self.size()
        self.workspace = wanted.key
        # before the panels come: all together they may need more room than the window has, and it would grow
        self.panels.place("viewport").setVisible(wanted.viewport)
        if not self._restore_panels():
            self.rearrange()
        QTimer.singleShot(0, self, partial(self._fit_panels, size))
        self.commands[SWITCH[wanted.key]].setChecked(True)
        self.panels.when_made("viewport", self._pin)
        self.preferences.change(workspace=wanted.key)
        self.status.drop_tip()

    def rearrange(self) -> None:
        """The panels of this workspace back where they belong."""
        arrange(self, self.docks, workspace(self.workspace))

    def show_panel(self, key: str) -> None:
        """Bring a panel to the front, wherever it is."""
        self.docks[key].show()
        self.docks[key].raise_()

    def call_panel(self, key: str) -> None:
        """Show a panel for what is done just now: it goes with the workspace, and is not remembered as part of it."""
        if self.docks[key].isHidden():
            self._called.add(key)
        self.show_panel(key)

    def render_first(self) -> None:
        """Of what is open, as large as the scanner's image: its first figures are true ones."""
        if not self.session.renders and not self.runner.busy:
            self.panels["render"].start(1.0, asked=False)  # type: ignore[attr-defined]

    def choose_theme(self, choice: theme.Choice) -> None:
        theme.apply(choice)
        self.preferences.change(theme=choice)
        self.commands[f"theme_{choice}"].setChecked(True)

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        if not event.spontaneous():
            self._settling = True
            QTimer.singleShot(SETTLING_MS, self, partial(setattr, self, "_settling", False))
            QTimer.singleShot(0, self, self._fit_panels)
            QTimer.singleShot(0, self, self.panels.make_soon)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        if self._settling:  # the system maximises it once it is shown: panels remembered in that size fit only then
            QTimer.singleShot(0, self, self._fit_panels)

    def closeEvent(self, event: QCloseEvent) -> None:
        if not self.files.may_close(quits=True):
            event.ignore()
            return
        self._send_back()
        self._remember_arrangement()
        self.preferences.change(geometry=sealed(self.saveGeometry()))
        if self.tour is not None:
            self.tour.end()
        self.runner.close()
        live(self.session).close()
        self.panels.close()
        self.files.close()
        event.accept()

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        paths = dragged_files(event)
        if any(is_mesh(path) or is_photograph(path) or may_be_project(path) for path in paths):
            accept_copy(event)

    def dropEvent(self, event: QDropEvent) -> None:
        paths = dragged_files(event)
        accept_copy(event)
        # after the drop has ended: a dialog inside it would hold up the program that the file comes from
        QTimer.singleShot(0, self, lambda: self.take(paths))

    def take(self, paths: list[Path]) -> None:
        """Files dropped on the window: meshes join the scene, photographs are calibrated from, a project is opened."""
        meshes = [path for path in paths if is_mesh(path)]
        if meshes:
            import_meshes(self.session, meshes, self)
        taken = self.calibrating.take(paths, folders=self.workspace == "calibrate")
        for path in paths:
            if path not in meshes and path not in taken:
                self.files.open(path)

    def _make_docks(self) -> dict[str, QDockWidget]:
        self.setCentralWidget(self.panels.place("viewport"))
        docks = {}
        for panel in PANELS:
            if panel.key == "viewport":
                continue
            dock = QDockWidget(panel.title, self)
            dock.setObjectName(panel.key)
            place = self.panels.place(panel.key)
            dock.setWidget(Scrolled(place) if panel.key in TALL else place)
            # added here once; from now on Qt moves docks only by restoring a state
            self.addDockWidget(Qt.DockWidgetArea.RightDockWidgetArea, dock)
            dock.hide()
            self.commands.submenus["panels"].addAction(dock.toggleViewAction())
            dock.toggleViewAction().triggered.connect(lambda _on, key=panel.key: self._called.discard(key))
            docks[panel.key] = dock
        return docks

    @property
    def cloud(self) -> ErrorCloud:
        """The points in the 3D view, which comes with them."""
        _ = self.panels["viewport"]
        assert self._cloud is not None
        return self._cloud

    def _join_cloud(self, viewport: Any) -> None:
        from studio.qt.shell.points_in_3d import points_in_3d

        self._cloud = points_in_3d(self.session, self.panels, viewport)

    def _pin(self, viewport: Any) -> None:
        """The workspace says what stands in the 3D view beside the scene."""
        self.cloud.pin(self.workspace == "measure")
        viewport.ghost.show(self.workspace != "measure")

    def start_tour(self) -> None:
        """Show the way around, from the start."""
        if self.tour is None:
            self.tour = Tour(self, self._place_tour)
            self.tour.ended.connect(self._end_tour)

    def _place_tour(self, step: Step) -> QWidget | None:
        if step.workspace != self.workspace:
            self.switch_to(step.workspace)
        if step.panel in self.docks:
            self.show_panel(step.panel)
            return self.docks[step.panel]
        return self.panels[step.panel] if step.panel else None

    def _end_tour(self) -> None:
        self.tour = None
        self.preferences.change(toured=True)

    def _connect(self) -> None:
        files, session, runner = self.files, self.session, self.runner
        handlers: dict[str, Callable[[], object]] = {
            "new": files.new,
            "open": files.open_dialog,
            "open_results": files.open_results_dialog,
            "save": files.save,
            "save_as": files.save_as,
            "quit": self.close,
            "undo": lambda: scene_actions.undo(session),
            "redo": lambda: scene_actions.redo(session),
            "duplicate": where_seen(scene_actions.duplicate, session, self.docks, self.panels.place("viewport")),
            "delete": where_seen(scene_actions.remove, session, self.docks, self.panels.place("viewport")),
            "rename": lambda: (self.show_panel("scene"), self.panels["scene"].rename_selection()),  # type: ignore
            "hide": where_seen(scene_actions.toggle_visible, session, self.docks, self.panels.place("viewport")),
            "copy_python": lambda: copy_shown(session),
            "deselect": lambda: session.select(()),
            "import_mesh": lambda: choose_meshes(session, self),
            "replace_mesh": lambda: replace_mesh(session, self),
            "aim": lambda: self.panels["viewport"].begin_aim(),  # type: ignore[attr-defined]
            "arrange": self.rearrange,
            "full_screen": lambda: self.setWindowState(self.windowState() ^ Qt.WindowState.WindowFullScreen),
            "render": session.render_asked.emit,
            "expose": self.panels["develop"].expose,  # type: ignore[attr-defined]
            "pause": self.status.toggle_pause,
            "cancel": self.status.cancel_work,
            "frame_points": lambda: self.cloud.frame(),
            "log": lambda: self.show_panel("log"),
            "help": lambda: self.help.open_page(panel_with_focus(self.panels, self.workspace)),
            "search": lambda: CommandSearch(self).open(),
            "shortcuts": lambda: CheatSheet(self).open(),
            "tour": self.start_tour,
            "about": lambda: about(self, version()),
        }
        for key, handler in handlers.items():
            self.commands.connect(key, handler)
        self.motion_calls = MotionCalls(self.panels, self.commands, self.docks, self.call_panel, lambda: self.workspace)
        for key, command in SWITCH.items():
            self.commands.connect(command, partial(self.switch_to, key))
        themes = QActionGroup(self)
        for choice in theme.CHOICES:
            themes.addAction(self.commands[f"theme_{choice}"])
            self.commands.connect(f"theme_{choice}", partial(self.choose_theme, choice))
        self.commands[f"theme_{self.preferences.values.theme}"].setChecked(True)
        menus = self.commands.submenus
        filled: dict[str, Callable[[QMenu], None]] = {
            "recent": files.fill_recent,
            "add": lambda menu: scene_actions.fill_add_menu(menu, session, self),
            "presets": lambda menu: scene_actions.fill_presets_menu(menu, session),
            "motion": lambda menu: scene_actions.fill_motion_menu(menu, session),
        }
        for key, fill in filled.items():
            menus[key].aboutToShow.connect(lambda menu=menus[key], fill=fill: (menu.clear(), fill(menu)))
        QShortcut(Qt.Key.Key_Escape, self).activated.connect(lambda: escape(self))
        self.status.log_asked.connect(lambda: self.show_panel("log"))
        self.calibrating.began.connect(lambda: self.switch_to("calibrate"))
        files.results_opened.connect(lambda: self.switch_to("measure"))
        one_of(CellOpener, session).opened.connect(lambda: self.switch_to("measure"))
        session.project_changed.connect(self._tell_document)
        session.document_replaced.connect(self._tell_document)
        session.document_replaced.connect(self.motion_calls.offer)
        session.document_replaced.connect(lambda: QTimer.singleShot(TRIM_MS, self, return_what_is_free))
        session.selection_changed.connect(self._tell_selection)
        session.step_changed.connect(lambda: live(session).show_step(session.step))
        session.vary_asked.connect(self._vary)
        runner.failed.connect(self._tell_failure)
        self._tell_selection()

    def _vary(self, path: FieldPath, spec: FieldSpec) -> None:
        from studio.qt.study.study_work import StudyWork

        one_of(StudyWork, self.session).vary(path, spec)

    def _tell_selection(self) -> None:
        for key in ("duplicate", "delete", "rename", "hide"):
            self.commands[key].setEnabled(scene_actions.can_change(self.session))

    def _tell_failure(self, job: Job[object]) -> None:
        if job.problem is not None and job.problem.exception is not None:
            what = trouble(job.problem.exception, f"finish: {job.name}")
            self.session.message.emit("error", f"{what}\n{what.details}".strip())
            show_trouble(self, what)

    def _restore(self) -> None:
        values = self.preferences.values
        # the panels first: of what is restored into a window that is hidden and maximized, Qt keeps a second copy, and
        # lays it out again after another state has freed the docks' places in it
        self.switch_to(values.workspace)
        geometry = unsealed(values.geometry)
        # of a screen that was much larger, or smaller, Qt restores nothing
        if geometry is None or not self.restoreGeometry(geometry):
            self._fit_screen()

    def _fit_screen(self) -> None:
        """On a screen that is too small for the usual window, it takes all of it."""
        fitting = self.size().boundedTo(room_for_a_window(self))
        if fitting != self.size():
            self.resize(fitting)
            self.setWindowState(Qt.WindowState.WindowMaximized)

    def _restore_panels(self) -> bool:
        return restore(self, self.preferences.values.arrangements.get(self.workspace, ""))

    def _fit_panels(self, size: QSize | None = None) -> None:
        """Once more, in the size that the window has come to; size: which it had, and is not to outgrow."""
        if size is not None and not (self.isMaximized() or self.isFullScreen()):
            self.resize(self.size().boundedTo(size))  # the last workspace's columns may have made it grow
        if not self._restore_panels():
            share_out(self, self.docks, workspace(self.workspace))
        self.motion_calls.offer()
        hide_stray_tabs(self)

    def _send_back(self) -> None:
        self.motion_calls.leave()
        while self._called:
            self.docks[self._called.pop()].hide()

    def _remember_arrangement(self) -> None:
        self.preferences.change(arrangements={**self.preferences.values.arrangements, self.workspace: remembered(self)})

    def _tell_document(self) -> None:
        """Title, undo and redo follow the document."""
        document = self.session.document
        name = document.path.name if document.path is not None else "not saved yet"
        self.setWindowTitle(f"{document.project.name}[*] ({name}) - Blazer Studio")
        self.setWindowModified(self.files.unsaved)
        for key, label in (("undo", document.undo_label), ("redo", document.redo_label)):
            self.commands[key].setEnabled(label is not None)
            self.commands[key].setText(f"&{key.capitalize()} {label or ''}".rstrip())


def may_be_project(path: Path) -> bool:
    """By its name; a folder may hold one."""
    return path.suffix.lower() == ".json" or path.is_dir()
