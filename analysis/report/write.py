"""Writes the report: one self-contained HTML file, and the same as PDF."""

from __future__ import annotations

import datetime
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from analysis.report import calibration, gauge_table, plain_picture
from analysis.report.colour import method_colour, method_name
from analysis.report.columns import columns, sentence_height, table_height
from analysis.report.error_figures import error_limit, error_map_figure, methods_figure, scene_figure, steps_figure
from analysis.report.frame_result import FrameResult
from analysis.report.front import front
from analysis.report.glossary import GLOSSARY
from analysis.report.light_text import sentences
from analysis.report.line_figures import camera_figure, profile_figure, three_panel_figure, zoom_figure
from analysis.report.model import ReportInput
from analysis.report.page import page_of
from analysis.report.picture import Drawing
from analysis.report.style import plain
from analysis.report.summary import headline, remarks, sample_note, tiles
from analysis.report.tables import (
    MEASURE_COLUMNS,
    counts,
    laser_chips,
    measure_tables,
    scene_tables,
    step_table,
    timing,
)
from analysis.report.terms import TERM_COLUMNS, term_tables
from analysis.report.total import total
from analysis.report.units import count
from analysis.report.view import cloud_view, placed_vertices, scene_view
from render.base.files import atomic_write

MOST_DETAILS = 4
"""Largest number of lasers shown in detail."""
PLAIN_NOTE = "Drawn in a simple way, because this machine has no library to draw 3D pictures off-screen."


def write_report(folder: Path | str, report: ReportInput, drawing: Drawing | None = None) -> tuple[Path, Path]:
    """Write `report.html` and `report.pdf` into a folder (made if missing); returns their paths.

    drawing: begun before, for this report alone.
    The HTML holds all its pictures and refers to nothing outside itself. InputError: a file cannot be written.
    """
    with Drawing() if drawing is None else drawing as process:
        page = _page(report, process, meanwhile=prepare_report)
    html, pdf = Path(folder) / "report.html", Path(folder) / "report.pdf"
    with atomic_write(html) as temporary:
        temporary.write_text(page, encoding="utf-8")
    with atomic_write(pdf) as temporary:
        write_pdf(page, temporary)
    return html, pdf


def render_page(report: ReportInput) -> str:
    """The report as one HTML page."""
    with Drawing() as process:
        return _page(report, process)


def _page(report: ReportInput, process: Drawing, meanwhile: Callable[[], None] = lambda: None) -> str:
    return page_of(Path(__file__).parent / "template.html", _content(report, process, meanwhile))


def _content(report: ReportInput, process: Drawing, meanwhile: Callable[[], None]) -> dict[str, Any]:
    record = report.record
    frame, found = record.shown_frame(), total(record.chosen())
    view, cloud, error = cloud_view(report)
    limit = error_limit(error)
    scene = scene_view(report, frame)
    vertices = placed_vertices(report, frame.step)
    header, rows, cut = step_table(report)
    computed, left_out = sentences(frame.plan)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        drawing = (vertices, report.triangles, scene, cloud, error, view, limit)
        process.start(folder, *drawing)
        # the other figures, while VTK draws
        details = [_detail(report, frame, i) for i in range(min(MOST_DETAILS, len(frame.lasers)))]
        steps = steps_figure(report, frame.step) if len(record.steps) > 1 else None
        meanwhile()
        drawn = process.finish(folder)
        note = "" if drawn is not None else PLAIN_NOTE
        scene_png, cloud_png = drawn if drawn is not None else plain_picture.draw(folder, *drawing)
        pictures = {
            "scene_picture": scene_figure(scene_png),
            "map_picture": error_map_figure(cloud_png, error, limit, found.surface.robust_sigma)
            if len(cloud)
            else None,
        }
    settings = [(name, list(rows.items())) for name, rows in scene_tables(report).items()]
    calibrations = _calibrations(report, frame)
    more = len(frame.lasers) - MOST_DETAILS
    spent, spent_in_all = timing(report)
    return pictures | {
        "title": report.title,
        "front": front(report),
        "facts": _facts(report),
        "chips": laser_chips(report),
        "headline": headline(report),
        "tiles": tiles(found),
        "remarks": [
            *dict.fromkeys((*report.notes, *remarks(found, report.image_scale))),
            *filter(None, [sample_note(found)]),
        ],
        "several": len(record.steps) > 1,
        "shown_step": frame.step + 1,
        "frame_count": len(record.steps),
        "picture_note": note,
        "steps_picture": steps,
        "step_header": header,
        "step_rows": rows,
        "steps_cut": cut,
        "details": details,
        "details_left_out": f"{more} more lasers are in the tables below." if more > 0 else "",
        "gauge_columns": gauge_table.COLUMNS,
        "gauge_rows": [(_of_laser(report, row), gauge_table.cells(row)) for row in report.measures],
        "gauge_definitions": gauge_table.definitions(list(report.measures)),
        "gauge_note": report.measures_note,
        "gauge_steps": gauge_table.over_steps(list(report.measures)),
        "gauge_reasons": gauge_table.reasons(list(report.measures)),
        "calibrations": calibrations,
        "calibration_columns": calibration.COLUMNS,
        "motion_found": _motion(report),
        "measure_tables": measure_tables(report),
        "measure_columns": MEASURE_COLUMNS,
        "term_tables": term_tables(report),
        "term_columns": TERM_COLUMNS,
        "sample_note": sample_note(found),
        "cloud_points": count(len(cloud)),
        "point_count": count(found.points),
        "cloud_is_part": len(cloud) < found.points,
        "plan_done": computed,
        "plan_left_out": left_out,
        "settings": columns(settings, [table_height(rows) for _, rows in settings]),
        "timing": spent,
        "time_total": spent_in_all,
        "counts": counts(report),
        "repeat": _repeat(report),
        "glossary": columns(GLOSSARY, [sentence_height(*entry) for entry in GLOSSARY]),
        "run": report.run,
    }


def _detail(report: ReportInput, frame: FrameResult, i: int) -> dict[str, Any]:
    """Figures and names of one laser in the shown frame."""
    laser = frame.lasers[i]
    first = laser.extractions[0]
    title = "The line and its profile"
    if len(report.scene.lasers) > 1:
        title += f": {plain(report.scene.lasers[i].name)}"
    if len(report.record.steps) > 1:
        title += f", step {frame.step + 1}"
    white = report.display_max
    if white is None:
        white = float(np.max(laser.image)) if laser.image is not None else 1.0
    seen = len(laser.curve.index) > 0 or bool(np.any(first.points.valid))
    return {
        "title": title,
        "method": method_name(first.line.method),
        "colour": method_colour(first.line.method),
        "camera": camera_figure(laser, max(white, 1e-9)) if laser.image is not None else None,
        "zoom": zoom_figure(laser, max(white, 1e-9)) if laser.image is not None else None,
        "three": three_panel_figure(laser) if seen else None,
        "profile": profile_figure(laser, report.scene.T_camera_laser(i)) if seen else None,
        "methods": methods_figure(frame, i) if len(laser.extractions) > 1 else None,
    }


def _facts(report: ReportInput) -> str:
    camera = report.scene.camera
    frames = "1 frame" if len(report.record.steps) == 1 else f"{len(report.record.steps)} frames"
    made = f"{_when(report.created)} · " if report.created else ""
    scale = "" if report.image_scale == 1.0 else f", image scale {report.image_scale:g}: not the scanner's figures"
    return f"{made}{frames} · camera {camera.width} × {camera.height} px{scale}"  # noqa: RUF001


def _when(created: str) -> str:
    """As clocks showed it where the scan was made: 22 November 2026, 19:03. What is no time stays."""
    try:
        at = datetime.datetime.strptime(created[:19], "%Y-%m-%d %H:%M:%S")
    except ValueError:
        return created
    return f"{at.day} {at:%B %Y, %H:%M}"


def _repeat(report: ReportInput) -> list[tuple[str, str]]:
    seed = [("seed", str(report.seed))] if report.seed is not None else []
    return [*seed, *report.versions.items()]


def prepare_report() -> None:
    """What takes long to load, which it does while something else is waited for."""
    import matplotlib.backends.backend_agg  # noqa: F401
    import weasyprint  # noqa: F401


def write_pdf(page: str, path: Path) -> None:
    """A page, whole in itself, as PDF."""
    import logging

    from weasyprint import HTML
    from weasyprint.urls import URLFetcher

    logging.getLogger("weasyprint").setLevel(logging.ERROR)
    # the page refers to nothing outside itself; if it ever did, nothing would be fetched
    HTML(string=page, url_fetcher=URLFetcher(allowed_protocols=("data",))).write_pdf(path)


def _of_laser(report: ReportInput, row: Mapping[str, Any]) -> str:
    """A measure's name, with its laser's where there are several."""
    lasers = report.scene.lasers
    return f"{row['name']} ({lasers[row['laser']].name})" if len(lasers) > 1 else str(row["name"])


def _motion(report: ReportInput) -> dict[str, Any] | None:
    """What carried the objects, where a calibration found it."""
    found = None if report.calibration is None else report.calibration.motion
    return None if found is None else {"name": calibration.CARRIED[found.kind], "rows": calibration.motion_rows(found)}


def _calibrations(report: ReportInput, frame: FrameResult) -> list[dict[str, Any]]:
    """Of each laser, if points were made with a calibration: its table, its map and what that says."""
    found, out = report.calibration, list[dict[str, Any]]()
    for i, laser in enumerate(report.scene.lasers if found is not None else ()):
        assert found is not None
        points = [one.points for one in frame.lasers[i].extractions[:1]] if i < len(frame.lasers) else []
        depths = np.concatenate([np.zeros(0), *(one.depth_z[one.valid] for one in points)])
        drawn = calibration.depth_map(found, report.scene, i, depths) if i < MOST_DETAILS else None
        out.append(
            {
                "name": laser.name,
                "rows": calibration.parameter_rows(found, report.scene, i),
                "picture": None if drawn is None else calibration.map_figure(drawn),
                "sentence": "" if drawn is None else calibration.sentence(drawn),
            }
        )
    return out
