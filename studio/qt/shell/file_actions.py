"""Projects as files: new, open, recent, save, unsaved changes, autosave and recovery."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QObject, QTimer, Signal
from PySide6.QtWidgets import QDialog, QFileDialog, QMenu, QWidget

from render.base.errors import InputError
from studio.editing.units import Unit
from studio.project.autosave import Autosave, Recovery, find, find_of, sweep
from studio.project.date_and_time import read_out
from studio.project.document import Document
from studio.project.project import Project, project_file
from studio.project.project_files import carry, missing_files
from studio.project.templates import template_folder
from studio.qt.core.dialogs import (
    TemplateDialog,
    ask_changed_on_disk,
    ask_loss,
    ask_recovery,
    ask_under_way,
    ask_unsaved,
    show_trouble,
)
from studio.qt.core.scan_steps import scan_steps
from studio.qt.core.session import Session
from studio.qt.shell.going import Going, not_saved
from studio.qt.shell.missing_files import may_open
from studio.runtime.error_messages import trouble
from studio.runtime.preferences import PreferencesFile, recovery_folder
from studio.scan.scan_folder import ScanFolder, image_scale_of, measured_project, open_folder
from studio.scan.scan_results import holds_scan, is_scan_of, source_of
from studio.scan.stages import scaled

MAX_NAME = 200
FILTER = "Blazer project (*.json)"
AFTER_A_CHANGE = 2.0
"""Seconds of rest after an edit until it is kept."""
AT_LEAST_EVERY = 20.0
"""Seconds, while edits never rest."""


def template(key: str, autosave: Autosave) -> Document:
    """A new document from a project that comes with the program; it has no file yet, its meshes are in a draft."""
    source = template_folder(key)
    project = Project.load(source / "project.json")
    try:
        root = autosave.draft()
        carry(project, source, root)
    except InputError:  # nothing can be imported into it then, but it can be looked at and saved elsewhere
        root = source
    return Document(project, None, root)


def _scanned(found: ScanFolder) -> Document:
    """The project of a scan: the file it was made from, or, where that has changed since, what the scan kept of it.

    What it kept is with the measures and settings of its last measurement, and the scanner's own camera wherever that
    follows from the scan's. InputError: meshes or textures are missing.
    """
    source = source_of(found)
    project = measured_project(found) if source is None else Project.load(source)
    gone = missing_files(project.scene, found.root)
    if gone:
        cure = "put the project's folder back to where it was when it was scanned"
        raise InputError("a file of the scanned project is missing", where=str(gone[0][1]), cure=cure)
    if source is not None:
        return Document(project, source)
    scale = image_scale_of(found)
    if _at_full_scale(found) is not None:
        return Document(scaled(project, 1.0 / scale), None, found.root)
    # its camera is the scan's: the name says so, wherever it is shown or saved
    name = project.name if scale == 1.0 else f"{project.name} at {scale:.3g} x"
    return Document(project.model_copy(update={"name": name[:MAX_NAME]}), None, found.root)


def _as_saved(document: Document, read: Callable[[], Document]) -> Document:
    """A document, read again where the file has been saved since, as closing what was open may do."""
    try:
        return read() if document.changed_on_disk else document
    except (InputError, OSError, MemoryError):
        return document


def _at_full_scale(found: ScanFolder) -> Project | None:
    """What was scanned, with the scanner's own camera and exposure; None: rounding has hidden them."""
    whole = scaled(found.project, 1.0 / image_scale_of(found))
    return whole if is_scan_of(found, whole) else None


def _of_the_images(project: Project, scale: float) -> str:
    """Why camera and exposure of a scan without its project file are not the scanner's."""
    exposure, unit = project.sensor.exposure_time, Unit.of("s")
    return (
        f"Camera and exposure are those of the scan's images, at {scale:.3g} x: the exposure of "
        f"{unit.with_unit(exposure)} stands for {unit.with_unit(exposure / scale**2)} of the scanner"
    )


class FileActions(QObject):
    """Every change of the session's document as a whole goes through here, and asks before work is lost."""

    results_opened = Signal()
    """Those of a scan: they are shown as soon as they are read."""

    def __init__(
        self, window: QWidget, session: Session, preferences: PreferencesFile, autosave: Autosave | None = None
    ) -> None:
        super().__init__(window)
        self.window, self.session, self.preferences = window, session, preferences
        self.autosave = autosave or Autosave(recovery_folder())
        self.going: Callable[..., Going] = lambda *, quits=False: Going()
        """What goes with the document beside its changes."""
        self.others_may_go: Callable[..., bool] = lambda *, quits=False: True
        """Asks about work beside the document that has files of its own."""
        self._pristine: Project | None = session.project
        """As it came from a template or a file: closing it unchanged needs no question; None: it came unsaved."""
        self._rest = QTimer(self, singleShot=True, interval=round(1000 * AFTER_A_CHANGE))
        self._rest.timeout.connect(self.keep)
        self._regular = QTimer(self, interval=round(1000 * AT_LEAST_EVERY))
        self._regular.timeout.connect(self.keep)
        self._regular.start()
        self._keeps = True
        session.project_changed.connect(self._rest.start)
        session.save_asked.connect(self.save)
        session.results_asked.connect(lambda folder: self.open_results(folder))

    @property
    def unsaved(self) -> bool:
        """There is work that closing would lose; an untouched template is none."""
        return self.session.document.dirty and self.session.project != self._pristine

    def new(self) -> bool:
        dialog = TemplateDialog(self.window)
        if dialog.exec() != QDialog.DialogCode.Accepted or not dialog.chosen or not self.may_close():
            return False
        self.replace(template(dialog.chosen, self.autosave))
        return True

    def open_dialog(self) -> bool:
        name, _ = QFileDialog.getOpenFileName(self.window, "Open a project", str(self.session.place), FILTER)
        return bool(name) and self.open(Path(name))

    def open(self, path: Path, ask: bool = True) -> bool:
        """Open a project file, a folder with one, or the results of a scan; what is open stays when it cannot be."""
        scan = holds_scan(path)
        if scan is not None:
            return self.open_results(scan, ask)
        try:
            file = project_file(path)
            document = Document(Project.load(file), file)
            missing_files(document.project.scene, document.root)
        except (InputError, OSError, MemoryError) as error:
            self.preferences.forget_recent(path)
            self._tell(error, f"open {path.name}")
            return False
        try:
            wanted = may_open(self.window, document)
        except (InputError, OSError) as error:
            self._tell(error, f"open {path.name}")
            return False
        if not wanted or (ask and not self.may_close()):
            return False
        document = _as_saved(document, lambda: Document(Project.load(file), file))
        if not self._offer(find_of(self.autosave.folder, file)):
            self.replace(document)
        self.preferences.add_recent(file)
        return True

    def open_results_dialog(self) -> bool:
        name = QFileDialog.getExistingDirectory(self.window, "Open the results of a scan", str(self.session.place))
        if not name:
            return False
        self.session.chose(Path(name))
        return self.open_results(Path(name))

    def open_results(self, folder: Path, ask: bool = True) -> bool:
        """Look at a finished scan, with its own project where the open one is another."""
        session = self.session
        try:
            found = open_folder(folder)
            scale = image_scale_of(found)
            document = session.document if is_scan_of(found, session.project) else _scanned(found)
        except (InputError, OSError, MemoryError) as error:
            self.preferences.forget_recent(folder)
            self._tell(error, f"open {folder.name}")
            return False
        if document is not session.document:
            if ask and not self.may_close():
                return False
            document = _as_saved(document, lambda: _scanned(found))
            left = [] if document.path is None else find_of(self.autosave.folder, document.path)
            if not self._offer(left):
                self.replace(document)
                if document.path is None and _at_full_scale(found) is None:
                    self.session.message.emit("info", _of_the_images(document.project, scale))
        # recovered work may be of another scene: the figures are those of the project that was scanned
        whole, camera = _at_full_scale(found), document.project.scene.camera
        if is_scan_of(found, document.project):
            scan_steps(session).show(found, document.project, scale)
        elif whole is not None and whole.scene.camera == camera:  # measured in another way since
            scan_steps(session).show(found, whole, scale)
        else:
            scan_steps(session).show(found)
        self.preferences.add_recent(folder)
        self.results_opened.emit()
        return True

    def replace(self, document: Document, unsaved: bool = False) -> None:
        """Make another document the session's; unsaved: closing it would lose work from the start."""
        self._pristine = None if unsaved else document.project
        self.autosave.forget()
        self.session.replace_document(document)
        self.session.message.emit("info", f"Opened {document.project.name}")

    def save(self) -> bool:
        path = self.session.document.path
        if path is None:
            return self.save_as()
        answer = ask_changed_on_disk(self.window, path) if self.session.document.changed_on_disk else "over"
        return answer != "cancel" and (self.save_as() if answer == "elsewhere" else self._save(path))

    def save_as(self) -> bool:
        name = f"{self.session.project.name.replace('/', '-')}.json"
        start = str(self.session.document.path or self.session.place / name)
        chosen, _ = QFileDialog.getSaveFileName(self.window, "Save the project", start, FILTER)
        if not chosen:
            return False
        path = Path(chosen)
        return self._save(path if path.suffix else path.with_suffix(".json"))

    def may_close(self, *, quits: bool = False) -> bool:
        """Whether the document may be given up; asks where unsaved work, a render under way or what took long goes.

        quits: the window with it.
        """
        return self._document_may_go(quits) and self.others_may_go(quits=quits)

    def _document_may_go(self, quits: bool) -> bool:
        going = self.going(quits=quits)
        if not self.unsaved:
            if going.render:
                return ask_under_way(self.window, going.render)
            return not going.costly or ask_loss(self.window, going.costly)
        answer = ask_unsaved(self.window, self.session.project.name, going.told)
        return answer == "discard" or (answer == "save" and self.save())

    def count_as_saved(self, project: Project) -> None:
        """A project of which closing loses nothing."""
        self._pristine = project

    def keep(self) -> None:
        """Autosave, but not in the middle of a drag."""
        if self.session.dragging or not (self._keeps and self.unsaved):
            return
        try:
            self.autosave.keep(self.session.document)
        except InputError as error:
            self.session.message.emit("warning", f"Autosave: {error}")
            self._regular.stop()

    def keep_every(self, seconds: float | None) -> None:
        """At least so often, while edits never rest; None: nothing is kept, and what was is dropped."""
        self._keeps = seconds is not None
        if seconds is None:
            self._regular.stop()
            self.autosave.forget()
        else:
            self._regular.start(round(1000 * seconds))

    def recover(self) -> bool:
        """After a crash: offer what it left behind. True: it was opened."""
        sweep(self.autosave.folder)
        return self._offer(find(self.autosave.folder))

    def _offer(self, left: list[Recovery]) -> bool:
        """The latest of what crashes left behind, to open, to throw away or to leave. True: it was opened."""
        if not left:
            return False
        when = read_out(left[0].when)
        answer = ask_recovery(self.window, left[0].project.name, when, len(left))
        if answer != "open":
            if answer == "discard":
                left[0].discard()
            return False
        document = left[0].document()
        if left[0].is_draft:
            document.root = self.autosave.draft()
            carry(document.project, left[0].root, document.root)
        self.replace(document, unsaved=True)
        self.keep()
        left[0].discard()
        self.session.message.emit("info", f"Recovered the work of {when}; save it to keep it")
        return True

    def fill_recent(self, menu: QMenu) -> None:
        """The recent projects, latest first."""
        menu.clear()
        for number, text in enumerate(self.preferences.values.recent, 1):
            path = Path(text)
            action = menu.addAction(f"&{number % 10} {path.parent.name}/{path.name}")
            action.setToolTip(text)
            action.triggered.connect(lambda _checked=False, path=path: self.open(path))
        if not self.preferences.values.recent:
            menu.addAction("none yet").setEnabled(False)
            return
        menu.addSeparator()
        menu.addAction("Clear this list").triggered.connect(lambda: self.preferences.change(recent=()))

    def close(self) -> None:
        """The window closes in order."""
        self._rest.stop()
        self._regular.stop()
        self.autosave.close()

    def _save(self, path: Path) -> bool:
        document = self.session.document
        before = document.project.name
        try:
            carry(document.project, document.root, path.absolute().parent)
            document.save(path.absolute(), self._name_in(path))
        except (InputError, OSError, MemoryError) as error:
            self._tell(error, f"save {path.name}")
            return False
        self.autosave.forget()
        self.count_as_saved(document.project)
        self.preferences.add_recent(path)
        now = document.project.name
        called = "" if now == before else f"; the project is now called “{now}” after its file (it was “{before}”)"
        self.session.message.emit("info", f"Saved {path}{called}{not_saved(self.session)}")
        return True

    def _name_in(self, path: Path) -> str | None:
        """The project is called after its new file, unless somebody gave it a name."""
        document = self.session.document
        begun = self._pristine.name if self._pristine is not None else None
        came_with = begun if document.path is None else document.path.stem
        return path.stem[:MAX_NAME] if document.project.name == came_with and path != document.path else None

    def _tell(self, error: BaseException, doing: str) -> None:
        what = trouble(error, doing)
        self.session.message.emit("error", str(what))
        show_trouble(self.window, what)
