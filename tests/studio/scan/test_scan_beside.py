"""A project that is opened again finds the newest of its own finished scans."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

from studio.project.document import replaced
from studio.project.project import Project
from studio.scan.scan_beside import scan_beside
from studio.scan.scan_folder import MANIFEST
from tests.studio.scan_of_steps import small_scan


def test_the_newest_finished_scan_of_the_project_is_found(tmp_path: Path) -> None:
    file, folder = small_scan(tmp_path)
    project, place = Project.load(file), file.parent
    assert scan_beside(project, place) is None, "it lies elsewhere"
    older, newer, unfinished = (place / name for name in ("older", "newer", "unfinished"))
    for i, copy in enumerate((older, newer, unfinished)):
        shutil.copytree(folder, copy)
        os.utime(copy / MANIFEST, (1e9 + i, 1e9 + i))
    (unfinished / MANIFEST).unlink()
    found = scan_beside(project, place)
    assert found is not None and found.folder == newer
    (newer / MANIFEST).write_text("{}")
    found = scan_beside(project, place)
    assert found is not None and found.folder == older, "one that is damaged is left out"
    shorter = replaced(project, ("scene", "motion", "steps"), 2)
    assert scan_beside(shorter, place) is None, "of another project"
