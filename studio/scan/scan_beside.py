"""The scan of a project that lies beside its file, for whoever opens the project again. Qt-free."""

from __future__ import annotations

from pathlib import Path

from render.base.errors import InputError
from studio.project.project import Project
from studio.scan.scan_folder import MANIFEST, ScanFolder, open_folder
from studio.scan.scan_results import is_scan_of

MOST = 20
"""Folders that are looked into: each frame's record is read of those."""


def scan_beside(project: Project, place: Path) -> ScanFolder | None:
    """The newest finished scan of the project in a folder directly below a place; None: there is none."""
    try:
        there = [(file.stat().st_mtime, file.parent) for file in place.glob(f"*/{MANIFEST}")]
    except OSError:
        return None
    for _, folder in sorted(there, reverse=True)[:MOST]:
        try:
            found = open_folder(folder)
            if found.frames and is_scan_of(found, project):
                return found
        except (InputError, OSError):
            continue
    return None
