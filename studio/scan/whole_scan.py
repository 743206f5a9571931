"""A whole scan for others: its points in any format, its report by the project of now, and both measured anew."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

from analysis.cloud import read_ply, write_csv, write_ply
from analysis.cloud_formats import write_points
from render.base.files import atomic_write
from studio.project.project import Project
from studio.scan.height_map import points_of
from studio.scan.reconstruct import reconstruct_folder
from studio.scan.scan_folder import open_folder
from studio.scan.scan_results import ScanResults
from studio.scan.stages import Clock


def convert_points(source: Path, path: Path) -> int:
    """The points of a PLY as .ply, .csv or a format of `cloud_formats`, by the suffix; how many. InputError: it is none
    of them, or the file cannot be written."""
    points = read_ply(source)
    {".ply": write_ply, ".csv": write_csv}.get(path.suffix.lower(), write_points)(path, points)
    return len(points["x"])


def export_scan_points(scan: ScanResults, path: Path, _: object = None) -> list[Path]:
    """Of all steps, as they were measured last. InputError: as `points_of` and `convert_points`."""
    convert_points(points_of(scan.found.folder), path)
    return [path]


def export_scan_report(
    scan: ScanResults, project: Project, logo_folder: Path, clock: Clock, path: Path, _: object = None
) -> list[Path]:
    """One .html or .pdf of all steps, measured as a project at the scan's image scale asks; the scan's own stays.

    InputError: as `reconstruct_folder`.
    """
    with tempfile.TemporaryDirectory() as folder:
        reconstruct_folder(
            scan.found, project, scan.found.root, Path(folder), clock, report=True, logo_folder=logo_folder
        )
        with atomic_write(path) as temporary:
            shutil.copyfile(Path(folder) / f"report{path.suffix.lower()}", temporary)
    return [path]


def measure_scan_again(scan: ScanResults, project: Project, logo_folder: Path, clock: Clock) -> None:
    """Points, measures and report in its folder by a project at the scan's image scale; the frames stay.

    InputError: as `reconstruct_folder`.
    """
    found = open_folder(scan.found.folder)  # it may have been measured since it was opened
    report = scan.report is not None
    reconstruct_folder(found, project, found.root, found.folder, clock, report=report, logo_folder=logo_folder)
