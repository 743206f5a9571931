"""Opening the report of a scan, which says so where it is older than what the project says of it by now."""

from __future__ import annotations

from pathlib import Path

from studio.project.project import READ_OFF
from studio.qt.core.open_file import open_file
from studio.qt.core.scan_steps import scan_steps
from studio.qt.core.session import Session

OLD = (
    "This report was written with the scan: measures, tolerances or its first page are others by now. File > Export "
    "writes one of the project as it is, Measure > Measure the scan again that of the folder"
)


def open_report(session: Session, page: Path) -> None:
    """Of a scan, whose folder it lies in."""
    open_file(session, page)
    scans = (one for one in session.renders if one.scan is not None and one.scan.found.folder == page.parent)
    render = next(scans, None)
    if render is None:
        return
    before = scan_steps(session).measured_as(render)
    now = before.read_as(render.developed_by(session.project))
    if any(getattr(before, name) != getattr(now, name) for name in READ_OFF):
        session.message.emit("warning", OLD)
