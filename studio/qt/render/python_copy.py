"""Copy as Python: the lines that give what the window shows, on the clipboard."""

from __future__ import annotations

from PySide6.QtWidgets import QApplication

from studio.qt.core.render import Render
from studio.qt.core.session import Session


def copy_shown(session: Session) -> None:
    """The render that is shown, or the project as it is now where the scene has changed since."""
    shown = session.shown
    if shown is not None and not shown.cell and shown.is_stale(session.project):
        copy_as_python(session, None, ": the project as it is now, which has changed since the render")
    else:
        copy_as_python(session, shown)


def copy_as_python(session: Session, render: Render | None, said: str = "") -> None:
    """render: None where nothing is rendered yet; the lines render the project as it is then. said: after the count."""
    from studio.notebook.python_lines import Work, python_lines, scan_lines

    document = session.document
    if render is not None and render.scan is not None:
        text = scan_lines(render.scan.found.folder, render.scan.found.root)
    else:
        work = Work(session.project.in_folder(document.root), document.saved, document.path, step=session.step)
        if render is not None:
            work = Work(
                work.project,
                work.saved,
                work.path,
                rendered=render.source or render.project,
                step=render.frame.step,
                image_scale=render.image_scale,
                final=render.final,
                methods=tuple(render.measurements),
                noise=render.noise,
                report=render.report,
            )
        text = python_lines(work)
    QApplication.clipboard().setText(text)
    told = f"Copied {len(text.splitlines())} lines of Python{said}"
    if document.files_may_go:
        session.message.emit(
            "warning", f"{told}. Its meshes and textures go with the window until it is saved: save it, then copy again"
        )
        return
    session.message.emit("info", told)
