"""Mesh files chosen or dropped by a person become part of the project, read on a thread so that the window lives on."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QCoreApplication, QThread, Signal
from PySide6.QtWidgets import QFileDialog, QMessageBox, QWidget

from render.base.errors import InputError
from render.laser.laser import LineLaser
from render.material.spectrum import at_wavelength
from studio.editing.placement import field_of_view
from studio.editing.scene_edits import add_mesh, add_parts
from studio.preview.readouts import facet_chord, readouts
from studio.project.mesh_import import ImportedMesh, folder_of_parts, import_mesh, import_step, needs_copy
from studio.project.step_file import LARGEST_CHORD, LEAST_CHORD, is_step
from studio.qt.core.dialogs import choose_file, show_trouble
from studio.qt.core.live_preview import live
from studio.qt.core.session import Session
from studio.runtime.error_messages import trouble

MESH_FILES = "Meshes and STEP (*.stl *.ply *.obj *.glb *.gltf *.off *.step *.stp);;All files (*)"
DARK = 0.1
"""Share of the laser's light below which a part is told to reflect little of it."""
Take = Callable[[ImportedMesh], None]


class ImportThread(QThread):
    """Reads one file after the other."""

    imported = Signal(object)
    """A list: the meshes of one file, several of them where it is an assembly."""
    failed = Signal(object, object)
    """The file and the exception."""

    def __init__(self, files: list[Path], root: Path, view: float, chord: float) -> None:
        """chord: how far the facets of a STEP file may be off its surfaces, m."""
        super().__init__()
        self.files, self.root, self.view, self.chord = files, root, view, chord

    def run(self) -> None:
        for file in self.files:
            if self.isInterruptionRequested():
                return
            try:
                self.imported.emit(
                    import_step(file, self.root, self.chord)
                    if is_step(file)
                    else [import_mesh(file, self.root, self.view)]
                )
            except (InputError, OSError, MemoryError) as error:
                self.failed.emit(file, error)


running: set[ImportThread] = set()
"""Imports under way."""


def choose_mesh(session: Session, parent: QWidget) -> Path | None:
    return choose_file(session, parent, "Mesh file", MESH_FILES)


def choose_meshes(session: Session, parent: QWidget) -> None:
    """Import what a person picks in the desktop's dialog."""
    names, _ = QFileDialog.getOpenFileNames(parent, "Import meshes", str(session.place), MESH_FILES)
    if names:
        session.chose(Path(names[0]))
    import_meshes(session, [Path(name) for name in names], parent)


def may_copy(parent: QWidget, files: list[Path], root: Path) -> bool:
    """Nothing has to be copied into the project's folder, or the person agrees to it."""
    outside = [file for file in files if needs_copy(file, root)]
    if not outside:
        return True
    names = outside[0].name if len(outside) == 1 else f"{len(outside)} files"
    title, verb, asked, place = "Copy into the project", "Copy", f"Copy {names} into the project's folder?", root
    how = "A project uses only files in its own folder, so that it can be moved"
    if len(outside) == 1 and is_step(outside[0]):
        title, verb, asked = "Write into the project", "Write", f"Write the parts of {names} into the project's folder?"
        how, place = f"{how}: the parts are written as PLY files into", folder_of_parts(outside[0], root)
    elif any(map(is_step, outside)):
        how = f"{how}. Of a STEP file the parts are written, as PLY files"
    box = QMessageBox(QMessageBox.Icon.Question, title, asked)
    box.setInformativeText(f"{how}:\n{place}")
    copy = box.addButton(verb, QMessageBox.ButtonRole.AcceptRole)
    box.addButton(QMessageBox.StandardButton.Cancel)
    box.setDefaultButton(copy)
    box.exec()
    return box.clickedButton() is copy


def import_meshes(session: Session, files: list[Path], parent: QWidget, take: Take | None = None) -> None:
    """Import files, each as a new object (or as `take` says); the person is asked before anything is copied."""
    document = session.document
    # a project that was never saved has no folder of the person's yet
    if not files or (document.path is not None and not may_copy(parent, files, document.root)):
        return

    def done(meshes: list[ImportedMesh]) -> None:
        if session.document is not document:
            return  # another project was opened meanwhile
        if take is not None and len(meshes) > 1:
            session.message.emit("error", f"an assembly of {len(meshes)} parts is not one mesh; import it instead")
            return
        told = _told(meshes, chord, wanted)
        if take is not None:
            session.message.emit("info", told)
            take(meshes[0])
            return
        _add(session, meshes)
        level, colours = colour_told(meshes, session.project.scene.lasers)
        # one message, as the next would hide it
        session.message.emit(level, ". ".join(filter(None, (told, colours))))

    def failed(file: Path, error: BaseException) -> None:
        what = trouble(error, f"import {file.name}")
        session.message.emit("error", f"{file.name}: {error}")
        show_trouble(parent, what)

    scene = session.project.scene
    look = live(session).look if any(is_step(file) for file in files) else None
    wanted = facet_chord([] if look is None else [readouts(look, i) for i in range(len(look.scene.lasers))])
    chord = min(max(wanted, LEAST_CHORD), LARGEST_CHORD)
    thread = ImportThread(files, document.root, field_of_view(scene), chord)
    thread.imported.connect(done)
    thread.failed.connect(failed)
    thread.finished.connect(lambda: running.discard(thread))
    running.add(thread)
    application = QCoreApplication.instance()
    if application is not None:
        application.aboutToQuit.connect(thread.requestInterruption)
        application.aboutToQuit.connect(thread.wait)
    session.message.emit("info", f"reading {', '.join(file.name for file in files[:3])}")
    thread.start()


def _told(meshes: list[ImportedMesh], chord: float, wanted: float) -> str:
    """What was imported, in words. chord, wanted: how far facets are off, and a tenth of the depth's sigma, m."""
    first = meshes[0]
    size = " x ".join(f"{1e3 * side:.4g}" for side in first.size)
    triangles = sum(mesh.triangles for mesh in meshes)
    if first.closed is None:
        return f"{Path(first.path).name}: {size} mm, {triangles} triangles, read as {first.unit}"
    parts = "1 part" if len(meshes) == 1 else f"{len(meshes)} parts"
    gaps = [mesh.name for mesh in meshes if not mesh.closed]
    closed = f"; not closed: {', '.join(gaps[:3])}" if gaps else ", closed"
    tenth = "a tenth of the predicted depth sigma"
    why = tenth if chord == wanted else f"{tenth} is {1e6 * wanted:.2g} µm"
    facets = f"facets at most {1e6 * chord:.2g} µm off ({why})"
    return f"{parts} in {Path(first.path).parent.as_posix()}, {size} mm, {triangles} triangles{closed}; {facets}"


def colour_told(meshes: list[ImportedMesh], lasers: tuple[LineLaser, ...]) -> tuple[str, str]:
    """Level and text of what the colours that a file brings are to the lasers; no text: it brings none.

    They were chosen for a screen, and are the part's reflectance from now on.
    """
    found = [
        (at_wavelength(mesh.colour, laser.wavelength_nm), laser.wavelength_nm, mesh.name)
        for mesh in meshes
        if mesh.colour is not None
        for laser in lasers
    ]
    if not found:
        return "info", ""
    least, wavelength, name = min(found)
    others = sum(share < DARK for share, _, _ in found) - 1
    more = f", and {others} more as little" if others > 0 else ""
    dark = " and is nearly black to it" if least < DARK else ", the least of all" if len(found) > 1 else ""
    reflects = f"{name} reflects {least:.0%} of the laser's light of {wavelength:g} nm{dark}{more}"
    told = f"Colours are those that the file has for the screen: {reflects}. Material, Albedo changes it"
    return "warning" if least < DARK else "info", told


def _add(session: Session, meshes: list[ImportedMesh]) -> None:
    first = meshes[0]
    if first.closed is None:
        project, path = add_mesh(session.project, first.path, first.unit, first.bounds)
    else:
        project, path = add_parts(session.project, meshes)
    session.document.apply(f"import {Path(first.path).name}", project)
    session.select(path)
