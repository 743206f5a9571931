"""What all panels share: the document, one selection, one hovered scan line, and the renders made so far.

Panels never talk to each other: they change the session, and follow its signals.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from analysis.section import Plane
from render.base.arrays import Float
from render.base.errors import InputError
from render.frame import Frame
from render.world.world import World
from studio.editing.refusals import refusal
from studio.project.document import Document, FieldPath, value_at
from studio.project.project import Project
from studio.qt.core.render import Render
from studio.scan.scan_results import ScanResults

if TYPE_CHECKING:
    from studio.runtime.preferences import PreferencesFile
    from studio.scan.measures_in_3d import MeasureIn3D

Follower = TypeVar("Follower", bound=QObject)


@dataclass(frozen=True)
class ShownSection:
    """The plane of the section as the 3D view has it; m, world frame."""

    plane: Plane
    corners: Float
    """(4, 3) of the sheet that stands for it."""
    true: list[Float]
    """Polylines (n, 3) of the part."""


@dataclass(frozen=True)
class ShownDeviation:
    """Points by their deviation from a nominal part, as the 3D view colours them."""

    points: Float
    """(n, 3) m, where the objects are at step 0."""
    value: Float
    """(n,) m."""
    row: NDArray[np.int32]
    step: NDArray[np.int32]
    limit: float | None = None
    """m, of colours, until a person chooses another."""


class Session(QObject):
    """The state of the desktop, in one place."""

    project_changed = Signal()
    """The document's project is another one; while a drag goes on, once a step."""
    drag_changed = Signal(bool)
    """A drag began or ended: panels that are slow to update wait for its end."""
    selection_changed = Signal()
    frame_requested = Signal()
    """The selection is to fill the 3D view."""
    hover_changed = Signal()
    """`hovered` is another scan line."""
    range_changed = Signal()
    """`range` is another."""
    range_dragged = Signal(float, float)
    """From and to: scan lines that were dragged over in the picture, for results to tell of."""
    pixel_clicked = Signal(float, float, bool)
    """Column and row of the camera's image that were clicked in its picture, and whether that is of the scene now."""
    step_changed = Signal()
    """`step`, the step of the motion that is looked at, is another one."""
    renders_changed = Signal()
    """A render joined, changed or left the history, or another one is shown."""
    developed = Signal()
    """The shown render has new `images`; the measurements of them follow."""
    measured = Signal()
    """The shown render was developed and measured again (power, exposure, method)."""
    render_asked = Signal()
    """A panel other than the render panel asks for a render with the present settings."""
    save_asked = Signal()
    """The project is to be saved, which may ask a person where; when the signal has been heard, it is or is not."""
    results_asked = Signal(object)
    """The scan in a folder is to be opened."""
    problems_changed = Signal()
    """`problems` are others."""
    vary_asked = Signal(object, object)
    """The field at a path, of a `FieldSpec`, is to be varied in a study."""
    message = Signal(str, str)
    """level ("info", "warning", "error") and text, for log and status bar."""
    document_replaced = Signal()
    """Another project was opened."""
    ghost_changed = Signal()
    """`ghost` is another."""
    deviation_changed = Signal()
    """`deviation` is another."""
    measures_changed = Signal()
    """`measures_in_3d` are others."""
    section_changed = Signal()
    """`section` is another."""

    def __init__(self, document: Document) -> None:
        super().__init__()
        self.dragging = False
        self.measures = False
        """Somebody develops and measures what is shown."""
        self.selection: FieldPath = ()
        """The item that panels show, and about which several are turned."""
        self._others: tuple[FieldPath, ...] = ()
        """Items that are selected beside it."""
        self._judged: tuple[Render, Project, bool] | None = None
        self.hovered: int | None = None
        self.range: tuple[float, float] | None = None
        """From and to: the scan lines that the results tell of; None: all, or no range of them."""
        self.step = 0
        self.renders: list[Render] = []
        self.shown: Render | None = None
        self.problems: dict[FieldPath, str] = {}
        """What the live preview cannot show as it is set: by the path of the field, why."""
        self.ghost: Float = np.zeros((0, 4, 3))
        """(k, m, 3) m in the camera frame: dark shapes of the calibration board where it is advised to be held."""
        self.section: ShownSection | None = None
        """What the panel of the section shows in 3D, and the 3D view moves; None: nothing."""
        self.deviation: ShownDeviation | None = None
        """What the panel of the deviation shows in 3D; None: nothing."""
        self.measures_in_3d: tuple[MeasureIn3D, ...] = ()
        """Measures of the part as the results have read them off the shown render."""
        self.preferences: PreferencesFile | None = None
        """Of the window: they keep where a file was opened or saved last."""
        self.document = document
        document.listeners.append(self.project_changed.emit)

    def show_deviation(self, deviation: ShownDeviation | None) -> None:
        """None hides it."""
        if deviation is not self.deviation:
            self.deviation = deviation
            self.deviation_changed.emit()

    def show_measures_in_3d(self, measures: tuple[MeasureIn3D, ...]) -> None:
        if measures or self.measures_in_3d:
            self.measures_in_3d = measures
            self.measures_changed.emit()

    def show_range(self, ends: tuple[float, float] | None) -> None:
        """None: no range of scan lines."""
        if ends != self.range:
            self.range = ends
            self.range_changed.emit()

    def show_section(self, section: ShownSection | None) -> None:
        """None hides it."""
        if section is not self.section:
            self.section = section
            self.section_changed.emit()

    def show_ghost(self, shapes: Float) -> None:
        """(k, m, 3), as `ghost`; none hides it."""
        self.ghost = shapes
        self.ghost_changed.emit()

    @property
    def project(self) -> Project:
        return self.document.project

    @property
    def place(self) -> Path:
        """Where dialogs for files begin: the project's folder, else where one was chosen last, else the person's own.

        A copy that was recovered, which lies among the program's own files, is not saved: none begins there.
        """
        path = self.document.path
        return self.last_place if path is None else path.parent

    @property
    def last_place(self) -> Path:
        """Where a file was chosen last, whatever is open; else the person's own folder."""
        last = "" if self.preferences is None else self.preferences.values.folder
        return Path(last) if last and Path(last).is_dir() else Path.home()

    def chose(self, file: Path) -> None:
        """A file, or a folder of results, was chosen: dialogs of a project that is not saved begin beside it."""
        if self.preferences is not None and str(file.parent) != self.preferences.values.folder:
            self.preferences.change(folder=str(file.parent))

    def replace_document(self, document: Document) -> None:
        """Open another project: history and selection start anew."""
        self.document.listeners.clear()
        self.document = document
        document.listeners.append(self.project_changed.emit)
        self.selection, self._others, self.hovered, self.step, self.renders, self.shown = (), (), None, 0, [], None
        self.document_replaced.emit()
        self.project_changed.emit()
        self.selection_changed.emit()
        self.hover_changed.emit()
        self.step_changed.emit()
        self.renders_changed.emit()

    @property
    def stale(self) -> bool:
        """What is shown is not of the scene as it is now, nor can developing make it so, or is of another step."""
        shown = self.shown
        return shown is not None and not shown.cell and (self.changed or shown.frame.step != self.step)

    @property
    def changed(self) -> bool:
        """The scene has changed since the shown render, in a way that developing cannot follow."""
        shown, project = self.shown, self.project
        if shown is None or shown.cell:
            return False
        if self._judged is None or self._judged[0] is not shown or self._judged[1] is not project:
            self._judged = shown, project, shown.is_stale(project)
        return self._judged[2]

    def select(self, path: FieldPath) -> None:
        """Select an item of the scene by its path: ("scene", "objects", 0), ("scene", "rig", "camera"), ()."""
        self.select_all((path,))

    def select_also(self, path: FieldPath) -> None:
        """Take an item to those that are selected, or out of them."""
        now = self.selections
        self.select_all(tuple(one for one in now if one != path) if path in now else (*now, path))

    def select_all(self, paths: Sequence[FieldPath]) -> None:
        """Several items; the last is the one that panels show."""
        others, chosen = tuple(paths[:-1]), paths[-1] if paths else ()
        if (others, chosen) != (self._others, self.selection):
            self._others, self.selection = others, chosen
            self.selection_changed.emit()

    @property
    def selections(self) -> tuple[FieldPath, ...]:
        """All that is selected and there, the one that panels show last."""
        there = tuple(path for path in self._others if _is_there(self.project, path))
        return (*there, self.selection) if self.selection else there

    def hover(self, scan_line: int | None) -> None:
        if scan_line != self.hovered:
            self.hovered = scan_line
            self.hover_changed.emit()

    def look_at_step(self, step: int) -> None:
        """Another step of the motion; beyond its ends the nearest one."""
        step = min(max(step, 0), self.project.scene.frame_count - 1)
        if step != self.step:
            self.step = step
            self.step_changed.emit()

    def begin_drag(self) -> None:
        self.dragging = True
        self.drag_changed.emit(True)

    def end_drag(self) -> None:
        """The drag becomes one entry of the undo history."""
        self.dragging = False
        self.document.end_merge()
        self.drag_changed.emit(False)

    def set(self, path: FieldPath, value: Any, label: str = "", merge: str = "") -> bool:
        """Change a value; a bad one is told in `message` and refused."""
        try:
            self.document.set(path, value, label, merge)
        except InputError as error:
            self.message.emit("error", refusal(error))
            return False
        return True

    def tell_problems(self, problems: dict[FieldPath, str]) -> None:
        if problems != self.problems:
            self.problems = problems
            self.problems_changed.emit()

    def problem_of(self, path: FieldPath) -> str:
        """Why an item of the scene is not as it is set; empty: it is."""
        return "\n".join(text for field, text in self.problems.items() if path and field[: len(path)] == path)

    def add_render(self, render: Render) -> None:
        self.renders.append(render)
        self.show(render)

    def show(self, render: Render | None) -> None:
        """Look at another render; a scan line of an image of another size is no longer the hovered one."""
        before, self.shown = self.shown, render
        if before is not None and (render is None or render.frame.shape != before.frame.shape):
            self.hover(None)
        self.renders_changed.emit()

    def present(self, render: Render | None) -> Render | None:
        """What stands for a render in the history now: a scan may be at another step; None: it is there no longer."""
        scan = None if render is None else render.scan
        return next(
            (other for other in self.renders if other is render or (scan is not None and other.scan is scan)), None
        )

    def look_at_scan(self, scan: ScanResults, frame: Frame, world: World) -> None:
        """Another step of a scan that is among the renders; what was measured of the one before goes with it."""
        for i, other in enumerate(self.renders):
            if other.scan is scan:
                self.renders[i] = replace(other, frame=frame, world=world, measurements={}, images=[], made_from={})
                self.shown = self.renders[i] if self.shown is other else self.shown
                self.renders_changed.emit()
                return


def _is_there(project: Project, path: FieldPath) -> bool:
    try:
        value_at(project, path)
    except KeyError:
        return False
    return True


def one_of(kind: type[Follower], session: Session) -> Follower:
    """What panels share of a session beside itself, made when it is first asked for."""
    found = session.findChild(kind)
    return found if found is not None else kind(session)
