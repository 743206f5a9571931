"""The pages for a customer: who, what, the verdict that follows from tolerances, and nothing where nobody is named."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from analysis.report.delivery import Delivery
from analysis.report.front import FAR_AND_FALSE, _surface, front
from analysis.report.gauge_table import MARKS
from analysis.report.model import ReportInput
from analysis.report.total import total
from analysis.report.write import render_page
from tests.analysis.report.test_report import make_report

pytestmark = pytest.mark.usefixtures("quick_reports")


def handed(**fields: Any) -> ReportInput:
    return replace(make_report(), delivery=Delivery(**fields))


def told(report: ReportInput) -> dict[str, Any]:
    found = front(report)
    assert found is not None
    return found


def gauge(verdict: str | None, reason: str = "") -> dict[str, Any]:
    numbers = dict.fromkeys(("value", "sigma", "error", "error_in_sigmas"), 1e-3)
    tolerance = {"nominal": 1e-3, "lower": -1e-4, "upper": 1e-4}
    return {
        "name": "Height", "kind": "step", "unit": "m", "step": 0, "readings": 1, "verdict": verdict, "reason": reason,
        **numbers, **tolerance,
    }  # fmt: skip


def test_a_report_for_nobody_has_no_such_pages() -> None:
    assert front(make_report()) is None
    page = render_page(make_report())
    assert "Measurement report" not in page and "Annex" not in page


def test_the_pages_hold_what_was_said_once_and_as_text() -> None:
    said = {"customer": "Ada <b> & Sons", "author": "B. Maker", "part_number": "P-17", "order_number": "4711"}
    page = render_page(handed(**said, text="First line.\nSecond line."))
    body = re.sub(r'src="data:[^"]*"', "", page)
    for value in ("Ada &lt;b&gt; &amp; Sons", "B. Maker", "P-17", "4711", "First line.", "Second line."):
        assert body.count(value) == 1, value
    assert body.index("Measurement report") < body.index("Where the part deviates") < body.index("How it was measured")
    assert body.index("How it was measured") < body.index("Annex: reconstruction report")
    assert body.count("Worth noticing") == 1
    # without a tolerance there is no verdict to be found
    assert "No tolerance was given" in body


def test_the_pages_are_headed_by_the_part_and_by_the_project_where_it_has_no_name() -> None:
    assert told(handed(part="Bracket"))["title"] == "Bracket"
    nameless = told(handed(author="Ada"))
    assert nameless["title"] == make_report().title and "Part" not in dict(nameless["who"])


@pytest.mark.parametrize(
    ("limits", "verdict"),
    [
        ((-0.2, 0.2), "pass"),
        ((-1e-3, 1e-3), "undecided"),
        ((0.2, 0.4), "fail"),
        ((-0.2, None), "pass"),
        ((None, -0.2), "fail"),
    ],
)
def test_the_surface_s_tolerance_decides(limits: tuple[float | None, float | None], verdict: str) -> None:
    """By two sigma, millimetres here: within 200 mm all points are proved, of 1 mm none is, nor out of it."""
    found = told(handed(lower=limits[0], upper=limits[1]))
    assert found["verdict"] == verdict
    assert found["rule"]


def test_the_worst_measure_decides() -> None:
    report = handed(customer="Ada")
    for verdicts, expected in (
        (("pass", "pass"), "pass"),
        (("pass", "undecided"), "undecided"),
        (("undecided", "fail"), "fail"),
        ((None, "pass"), "undecided"),
    ):
        rows = tuple(gauge(one, "" if one else "no points") for one in verdicts)
        found = told(replace(report, measures=rows))
        assert found["verdict"] == expected
        deciding = [one for one in rows if (one["verdict"] or "undecided") == expected != "pass"]
        assert found["decided_by"].count("Height") == len(deciding)


def test_what_is_not_decided_says_how_many_steps_are() -> None:
    """ "Not decided: Step height." hid that all steps of the part pass, and that the others were not measured."""
    steps = {**gauge("undecided"), "name": "Step", "readings": 20, "verdicts": {"none": 5, "pass": 14, "undecided": 1}}
    alike = {**gauge("undecided"), "name": "V", "readings": 20, "verdicts": {"undecided": 20}}
    found = told(replace(handed(customer="Ada"), measures=(steps, alike)))
    assert found["decided_by"] == "Not decided: Step (14 pass, 1 undecided, 5 not measured), V."


def test_the_steps_of_a_measure_are_told_beside_its_worst_one() -> None:
    """One step of twenty was printed, and nothing of the nineteen others."""
    over = {"measured": 14, "median": 0.012004, "least": 0.01198, "largest": 0.01206, "sigma": 2e-5}
    row = {**gauge("pass"), "readings": 20, "verdicts": {"pass": 14, "none": 6}, "over_steps": over}
    for report in (make_report(), handed(customer="Ada")):
        page = render_page(replace(report, measures=(row,)))
        told_of = (
            "Height: median 12.004\u00a0mm, from 11.980 to 12.060\u00a0mm, over the 14 of 20 steps that were measured."
        )
        assert page.count(told_of) == 1
        assert "over the" not in render_page(replace(report, measures=(gauge("pass"),)))


def test_a_tolerance_has_its_limits_in_order_and_one_alone_is_one() -> None:
    with pytest.raises(ValidationError, match="lower is 1 mm and upper -1 mm"):
        Delivery(lower=1e-3, upper=-1e-3)
    page = render_page(handed(customer="Ada", lower=-1e-3))
    assert "-1000 / none" in page


def test_a_scan_without_points_is_told_of_as_well() -> None:
    report = replace(make_report(found=False), delivery=Delivery(customer="Ada", lower=-1e-3, upper=1e-3))
    assert told(report)["verdict"] == "undecided" and "Ada" in render_page(report)


def test_a_verdict_says_how_many_measures_it_is_of() -> None:
    rows = (gauge("pass"), {**gauge(None), "lower": None, "upper": None}, {**gauge(None), "lower": None, "upper": None})
    report = replace(handed(customer="Ada", lower=-0.2, upper=0.2), measures=rows)
    found = told(report)
    assert found["verdict"] == "pass"
    assert found["judged"] == "Of the surface (laser) and 1 of 3 measures; the others have no tolerance."
    assert found["judged"] in render_page(report)
    none = replace(report, measures=rows[1:])
    assert told(none)["judged"] == "Of the surface (laser); the measures have no tolerance."
    bare = replace(handed(customer="Ada"), measures=rows[:1])
    assert told(bare)["judged"] == "Of the measure; the surface has no tolerance."
    assert "Green lies within" in render_page(report) and "Green lies within" not in render_page(bare)


def test_a_flatness_and_a_bow_are_defined_where_they_appear_and_only_there() -> None:
    """A form of second degree from peak to valley is not what a drawing calls flatness."""
    flat = {**gauge("pass"), "kind": "flatness"}
    bow = {**gauge("pass"), "kind": "straightness"}
    texts = {"flatness": "Flatness here is the form of second degree", "straightness": "Straightness here is the bow"}
    for report in (make_report(), handed(customer="Ada")):
        for rows in ((gauge("pass"),), (flat, flat), (bow, gauge("pass")), (flat, bow)):
            page = render_page(replace(report, measures=rows))
            for kind, text in texts.items():
                assert page.count(text) == any(row["kind"] == kind for row in rows), (kind, len(rows))


def test_the_mean_deviation_is_of_the_surface_and_far_off_are_counted() -> None:
    report = handed(customer="Ada")
    rows = report.record.chosen().rows
    rows = rows[rows["valid"] & np.isfinite(rows["off_surface"])].copy()
    false = rows.copy()
    false["off_surface"][:3] = 0.05
    clean, told_of = (_surface(report, one)["rows"] for one in (rows, false))
    assert [row[0] for row in clean][2:4] == ["Far off: beyond 6 robust sigma of all", "Mean deviation, without them"]
    assert clean[2][1].startswith("0 (") and told_of[2][1].startswith("3 (")
    assert abs(float(told_of[3][1].split()[0])) < 1e6 * 0.05 / len(rows)
    decided = _surface(handed(customer="Ada", lower=-0.04, upper=0.04), false)
    assert decided["verdict"] == "fail" and decided["rows"][-1] == ("Verdict without those far off", MARKS["pass"])
    assert decided["name"] == "the surface by its 3 points far off alone", "the headline does not blame the part"
    assert _surface(handed(customer="Ada", lower=-0.04, upper=0.04), rows)["name"] == "the surface"


def test_the_triangulation_angle_is_that_at_the_part() -> None:
    """By the law of cosines, for the middle of the line; the laser's tilt to the optical axis is another angle."""
    report = handed(customer="Ada")
    origin = report.scene.T_camera_laser(0)[:3, 3]
    points = report.record.shown_frame().lasers[0].curve.point
    far, beside, between = (np.linalg.norm(one, axis=-1) for one in (points, points - origin, origin))
    closed = np.median(np.degrees(np.arccos((far**2 + beside**2 - between**2) / (2.0 * far * beside))))
    shown = dict(told(report)["how"])["Triangulation angle (median)"]
    assert float(shown.rstrip("°")) == pytest.approx(closed, rel=1e-3)


def test_the_surface_is_judged_on_the_object_that_is_named_and_the_page_says_on_which() -> None:
    """A table beneath a part has points as well: its deviation decided the part's verdict."""
    report = handed(customer="Ada", lower=-0.2, upper=0.2)
    (wall,) = report.scene.objects
    both = tuple(wall.model_copy(update={"name": name}) for name in ("part", "table"))
    scene = report.scene.model_copy(update={"objects": both})
    report = replace(report, scene=scene, object_id=np.array([0, 1]))
    rows = report.record.chosen().rows
    rows = rows[rows["valid"] & np.isfinite(rows["off_surface"])]
    # the wall's two triangles meet where y = x
    of_part = int(np.count_nonzero(rows["world"][:, 1] < rows["world"][:, 0]))
    assert 0 < of_part < len(rows)
    counts = {}
    for name, judged in (
        ("", "all: part, table"),
        ("part", "part"),
        ("table", "table"),
        ("gone", "gone, which is none of"),
    ):
        told_to = report.delivery.model_copy(update={"surface_of": name})
        found = told(replace(report, delivery=told_to))
        assert found["surface"]["rows"][0][0] == "Objects" and found["surface"]["rows"][0][1].startswith(judged)
        assert judged in found["judged"] and found["verdict"] == ("undecided" if name == "gone" else "pass")
        counts[name] = int(found["surface"]["rows"][1][1].replace("none", "0"))
    assert counts[""] == len(rows) == counts["part"] + counts["table"] and counts["gone"] == 0
    assert of_part in (counts["part"], counts["table"])
    only = report.delivery.model_copy(update={"surface_of": "part"})
    assert "Of the surface (part)" in render_page(replace(report, delivery=only))


def test_far_off_and_false_are_told_apart_where_both_appear(monkeypatch: pytest.MonkeyPatch) -> None:
    """One word for both had a reader take points far off the surface for those of scan lines without a line."""
    report = handed(customer="Ada")
    rows = report.record.chosen().rows
    rows = rows[rows["valid"] & np.isfinite(rows["off_surface"])].copy()
    assert _surface(report, rows)["note"] == ""
    rows["off_surface"][:3] = 0.05
    assert _surface(report, rows)["note"] == "", "there is no false scan line"
    found = replace(total(report.record.chosen()), false_rows=2)
    monkeypatch.setattr("analysis.report.front.total", lambda _: found)
    assert _surface(report, rows)["note"] == FAR_AND_FALSE
    assert not any("false" in label.lower() for label, _ in _surface(report, rows)["rows"])
