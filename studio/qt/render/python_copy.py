"""Copy as Python: the lines that give what the window shows, on the clipboard."""

from __future__ import annotations

from PySide6.QtWidgets import QApplication

from studio.qt.core.session import Render, Session


def copy_as_python(session: Session, render: Render | None) -> None:
    """render: None where nothing is rendered yet; the lines render the project as it is then."""
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
    session.message.emit("info", f"Copied {len(text.splitlines())} lines of Python")
