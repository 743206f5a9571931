"""Mesh files chosen or dropped by a person become part of the project, read on a thread so that the window lives on."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QCoreApplication, QThread, Signal
from PySide6.QtWidgets import QFileDialog, QMessageBox, QWidget

from render.base.errors import InputError
from studio.editing.placement import field_of_view
from studio.editing.scene_edits import add_mesh
from studio.project.mesh_import import ImportedMesh, import_mesh, needs_copy
from studio.qt.core.dialogs import show_trouble
from studio.qt.core.session import Session
from studio.runtime.error_messages import trouble

MESH_FILES = "Meshes (*.stl *.ply *.obj *.glb *.gltf *.off);;All files (*)"
Take = Callable[[ImportedMesh], None]


class ImportThread(QThread):
    """Reads one file after the other."""

    imported = Signal(object)
    failed = Signal(object, object)
    """The file and the exception."""

    def __init__(self, files: list[Path], root: Path, view: float) -> None:
        super().__init__()
        self.files, self.root, self.view = files, root, view

    def run(self) -> None:
        for file in self.files:
            if self.isInterruptionRequested():
                return
            try:
                self.imported.emit(import_mesh(file, self.root, self.view))
            except (InputError, OSError, MemoryError) as error:
                self.failed.emit(file, error)


running: set[ImportThread] = set()
"""Imports under way."""


def choose_file(parent: QWidget, title: str, kinds: str) -> Path | None:
    """A file by the desktop's dialog, or None."""
    name, _ = QFileDialog.getOpenFileName(parent, title, "", kinds)
    return Path(name) if name else None


def choose_mesh(parent: QWidget) -> Path | None:
    return choose_file(parent, "Mesh file", MESH_FILES)


def choose_meshes(session: Session, parent: QWidget) -> None:
    """Import what a person picks in the desktop's dialog."""
    names, _ = QFileDialog.getOpenFileNames(parent, "Import meshes", "", MESH_FILES)
    import_meshes(session, [Path(name) for name in names], parent)


def may_copy(parent: QWidget, files: list[Path], root: Path) -> bool:
    """Nothing has to be copied into the project's folder, or the person agrees to it."""
    outside = [file for file in files if needs_copy(file, root)]
    if not outside:
        return True
    names = outside[0].name if len(outside) == 1 else f"{len(outside)} files"
    box = QMessageBox(QMessageBox.Icon.Question, "Copy into the project", f"Copy {names} into the project's folder?")
    box.setInformativeText(f"A project uses only files in its own folder, so that it can be moved:\n{root}")
    copy = box.addButton("Copy", QMessageBox.ButtonRole.AcceptRole)
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

    def done(mesh: ImportedMesh) -> None:
        if session.document is not document:
            return  # another project was opened meanwhile
        (take or (lambda made: _add(session, made)))(mesh)
        size = " x ".join(f"{1e3 * side:.4g}" for side in mesh.size)
        text = f"{Path(mesh.path).name}: {size} mm, {mesh.triangles} triangles, read as {mesh.unit}"
        session.message.emit("info", text)

    def failed(file: Path, error: BaseException) -> None:
        what = trouble(error, f"import {file.name}")
        session.message.emit("error", f"{file.name}: {error}")
        show_trouble(parent, what)

    thread = ImportThread(files, document.root, field_of_view(session.project.scene))
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


def _add(session: Session, mesh: ImportedMesh) -> None:
    project, path = add_mesh(session.project, mesh.path, mesh.unit, mesh.bounds)
    session.document.apply(f"import {Path(mesh.path).name}", project)
    session.select(path)
