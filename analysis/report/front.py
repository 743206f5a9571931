"""The three pages for a customer: who and what, verdict and measures; where the part deviates; how it was measured."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.deviation import (
    ABOVE,
    BELOW,
    FAR_OFF,
    UNDECIDED,
    WITHIN,
    far_off,
    sigma_of_deviation,
    tells_no_place,
    unsure_of_place,
    verdict_of,
    verdicts,
)
from analysis.distance import nearest_triangle
from analysis.report.deviation_figure import DeviationMap, draw
from analysis.report.gauge_table import MARKS, counts_text
from analysis.report.model import ReportInput
from analysis.report.style import png_uri
from analysis.report.total import total
from analysis.report.units import count, counted, degrees, micrometres, millimetres, milliwatts, percent
from analysis.triangulation_angle import triangulation_angles
from render.base.arrays import Float

VERDICTS = {
    "pass": "Within tolerance",
    "fail": "Out of tolerance",
    "undecided": "Not decided within the uncertainty",
    "none": "No tolerance was given",
}
SURFACE = "the surface"
DECIDED_BY = {"fail": "Out", "undecided": "Not decided"}
FAR_AND_FALSE = (
    "A point is far off by its distance from the surface alone; a false scan line carries a point although no line "
    "crosses its centre, at whatever distance."
)
RULE = (
    "By ISO 14253-1 with an expanded uncertainty of two sigma: within only what is proved to be within, "
    "out only what is proved to be out. A surface is out where a place of it is, by more than chance does to the worst "
    "of all its points."
)


def front(report: ReportInput) -> dict[str, Any] | None:
    """What `front.html` shows; None: the report is for nobody else."""
    told = report.delivery
    if told.is_empty:
        return None
    rows = report.record.chosen().rows
    rows = of_judged(report, rows[rows["valid"] & np.isfinite(rows["off_surface"])])
    surface = _surface(report, rows)
    gauges = [_gauge_verdict(row) for row in report.measures]
    wanted = [one for one in (surface["verdict"], *gauges) if one]
    verdict = next((one for one in ("fail", "undecided", "pass") if one in wanted), "none")
    return {
        "title": told.part or report.title,
        "logo": report.logo,
        "who": [(label, value) for label, value in _who(report) if value],
        "text": [line for line in told.text.splitlines() if line.strip()],
        "verdict": verdict,
        "verdict_text": VERDICTS[verdict],
        "judged": _judged(bool(surface["verdict"]), gauges, judged_objects(report), len(rows) > 0),
        "decided_by": _decided_by(
            verdict, [surface["verdict"], *gauges], [surface["name"], *(_named(row) for row in report.measures)]
        ),
        "part_of": report.part_of,
        "rule": RULE if verdict != "none" else "",
        "surface": surface,
        "banded": told.lower is not None and told.upper is not None,
        "map": _map(report, rows) if len(rows) else None,
        "how": _how(report, rows),
    }


def of_judged(report: ReportInput, rows: Any) -> Any:
    """The points of the object that the surface is judged on, by what is nearest to each; all where none is named."""
    wanted, names = report.delivery.surface_of, _names(report)
    if not wanted:
        return rows
    if wanted not in names or len(rows) == 0 or len(report.triangles) == 0:
        return rows[:0]
    nearest = nearest_triangle(rows["world"], report.vertices, report.triangles)
    return rows[report.object_id[nearest] == names.index(wanted)]


def judged_objects(report: ReportInput) -> str:
    """By name, whose points count."""
    wanted, names = report.delivery.surface_of, _names(report)
    if wanted:
        return wanted if wanted in names else f"{wanted}, which is none of: {', '.join(names)}"
    return ", ".join(names) if len(names) < 2 else f"all: {', '.join(names)}"


def _names(report: ReportInput) -> list[str]:
    return [item.name for item in report.scene.visible_objects]


def _who(report: ReportInput) -> list[tuple[str, str]]:
    told = report.delivery
    return [
        ("Customer", told.customer),
        ("Part", told.part),
        ("Part number", told.part_number),
        ("Order number", told.order_number),
        ("Author", told.author),
    ]


def _gauge_verdict(row: dict[str, Any]) -> str:
    """One that has a tolerance and could not be measured decides nothing."""
    if row["lower"] is None and row["upper"] is None:
        return ""
    return "undecided" if row["reason"] else str(row["verdict"] or "undecided")


def _named(row: dict[str, Any]) -> str:
    """A measure's name; of one of several steps that are not all alike, with how many came to what."""
    counts = row.get("verdicts") or {}
    return f"{row['name']} ({counts_text(counts)})" if len(counts) > 1 else str(row["name"])


def _judged(surface: bool, gauges: list[str], objects: str, compared: bool) -> str:
    """What the verdict is of: the surface, measures, and how many of these have a tolerance. compared: the report has
    the surface's deviation."""
    having = sum(bool(one) for one in gauges)
    of = [f"{SURFACE} ({objects})"] if surface else []
    if having:
        of.append(f"{count(having)} of {count(len(gauges))} measures" if len(gauges) > 1 else "the measure")
    if not of:
        return ""
    without = len(gauges) - having
    rest = ""
    if without and having:
        rest = "; the other has no tolerance" if without == 1 else "; the others have no tolerance"
    elif without:
        rest = "; the measure has no tolerance" if without == 1 else "; the measures have no tolerance"
    if compared and not surface:
        rest += "; the surface has no tolerance"
    return f"Of {' and '.join(of)}{rest}."


def _decided_by(verdict: str, each: list[str], names: list[str]) -> str:
    """What it is that is out, or is not decided; empty: nothing is."""
    if verdict not in DECIDED_BY:
        return ""
    judged = zip(names, each, strict=True)
    return f"{DECIDED_BY[verdict]}: {', '.join(name for name, one in judged if one == verdict)}."


def _surface(report: ReportInput, rows: Any) -> dict[str, Any]:
    """Verdict and table of the surface's deviation."""
    told, value = report.delivery, -rows["off_surface"]
    if len(value) == 0:
        table = [("Objects", judged_objects(report)), ("Points", "none")]
        verdict = "undecided" if told.has_tolerance else ""
        return {"verdict": verdict, "mark": "", "rows": table, "note": "", "name": SURFACE}
    far = far_off(value)
    kept = value[~far]
    table = [
        ("Objects", judged_objects(report)),
        ("Points", count(len(value))),
        (FAR_OFF.capitalize(), f"{count(int(far.sum()))} ({percent(float(far.mean()), 2)})"),
        ("Mean deviation, without them", micrometres(float(kept.mean()), 2)),
        ("95 % deviate less than, without them", micrometres(float(np.percentile(np.abs(kept), 95.0)))),
    ]
    note = FAR_AND_FALSE if far.any() and total(report.record.chosen()).false_rows else ""
    if not told.has_tolerance:
        return {"verdict": "", "mark": "", "rows": table, "note": note, "name": SURFACE}
    lower = -math.inf if told.lower is None else told.lower
    upper = math.inf if told.upper is None else told.upper
    judged = verdicts(rows["world"], value, _sigma(rows), lower, upper, _unsure(rows))
    shares = {key: float(np.mean(judged == key)) for key in (WITHIN, UNDECIDED, ABOVE, BELOW)}
    ends = ["none" if limit is None else f"{1e6 * limit:+.4g}" for limit in (told.lower, told.upper)]
    limits = f"{' / '.join(ends)}\u00a0µm"
    table += [
        ("Tolerance", limits),
        ("Proved within", percent(shares[WITHIN], 2)),
        ("Not decided", percent(shares[UNDECIDED], 2)),
        ("Proved outside (above)", percent(shares[ABOVE], 2)),
        ("Proved inside (below)", percent(shares[BELOW], 2)),
    ]
    verdict = verdict_of(judged)
    name = SURFACE
    if far.any() and (without := verdict_of(judged[~far])) != verdict:
        table.append(("Verdict without those far off", MARKS[without]))
        name = f"{SURFACE} by its {counted(int(far.sum()), 'point')} far off alone"
    return {"verdict": verdict, "mark": MARKS[verdict], "rows": table, "note": note, "name": name}


def _unsure(rows: Any) -> NDArray[np.bool_]:
    sigmas = rows["sigma_off_surface"], rows["sigma_depth"]
    return unsure_of_place(rows["world"], -rows["off_surface"], rows["index"], *sigmas)


def _sigma(rows: Any) -> Float:
    return sigma_of_deviation(rows["sigma_off_surface"], rows["systematic_off_surface"])


def _map(report: ReportInput, rows: Any) -> str:
    eye = report.scene.T_world_camera(report.record.steps[0].step)[:3, 3]
    told = report.delivery
    towards = eye - rows["world"].mean(axis=0)
    value = -rows["off_surface"]
    no_place = tells_no_place(value, _sigma(rows), _unsure(rows))
    return png_uri(draw(DeviationMap(rows["world"], value, towards, told.lower, told.upper, no_place)))


def _how(report: ReportInput, rows: Any) -> list[tuple[str, str]]:
    """The scanner in a few lines."""
    scene = report.scene
    camera = scene.camera
    lasers = ", ".join(f"{milliwatts(one.power)}, {one.wavelength_nm:g}\u00a0nm" for one in scene.lasers)
    found = [
        ("Frames", count(len(report.record.steps))),
        ("Camera", f"{camera.width} × {camera.height}\u00a0px"),  # noqa: RUF001
        ("Laser", lasers),
    ]
    if scene.lasers:
        origin = scene.T_camera_laser(0)[:3, 3]
        found.append(("Baseline", millimetres(float(np.linalg.norm(origin)))))
        curve = report.record.shown_frame().lasers[0].curve
        if len(curve.point):
            between = float(np.median(triangulation_angles(curve.point, origin)))
            found.append(("Triangulation angle (median)", degrees(between)))
    if len(rows):
        sigma = micrometres(2.0 * float(np.nanmedian(_sigma(rows))))
        of = f"{count(len(rows))} points ({judged_objects(report)})"
        found.append(("Uncertainty of a point, two sigma", f"{sigma} along the normal, median of {of}"))
    return found
