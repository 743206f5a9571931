"""Renders side by side: what differs stands in a row, what is alike does not, and figures carry their difference."""

from __future__ import annotations

import csv
import math
from dataclasses import replace
from pathlib import Path

from analysis.gauges.gauge import Gauge
from analysis.gauges.read import Reading
from studio.project.project import Project
from studio.scan.kept_renders import Kept
from studio.scan.stages import scaled
from studio.study.side_by_side import side_by_side, write_table


def renders() -> list[Kept]:
    one = Project.load("plane")
    two = one.replaced({"sensor.bits": 10, "scene.rig.lasers[0].power": 0.05})
    three = one.replaced({"scene.rig.lasers[0].power": 0.01, "name": "renamed"})
    figures = ({"Depth RMSE": 20.0}, {"Depth RMSE": 15.5, "Line RMSE": 0.1}, {})
    return [
        Kept(str(i), "", each, 1.0, shown)
        for i, (each, shown) in enumerate(zip((one, two, three), figures, strict=True))
    ]


def test_figures_have_their_difference_and_only_settings_that_differ_a_row() -> None:
    rows = side_by_side(renders())
    by_label = {row.label: row.cells for row in rows}
    assert by_label["Depth RMSE / µm"] == ("20.0", "15.5 (-4.5)", "-")
    assert by_label["Line RMSE / px"] == ("-", "0.100", "-")
    bits = next(cells for label, cells in by_label.items() if label.startswith("Sensor") and "10" in cells)
    assert bits[0] == bits[2] != bits[1]
    (power,) = [cells for label, cells in by_label.items() if label.endswith(": Power")]
    assert power == ("20 mW", "50 mW", "10 mW")
    assert [row.measured for row in rows] == [True, True, False, False]
    assert not any(row.label == "Name" for row in rows)


def test_alike_renders_have_figures_alone_and_none_have_none() -> None:
    one = renders()[0]
    assert [row.measured for row in side_by_side([one, one])] == [True]
    assert side_by_side([]) == []


def test_renders_of_another_scale_say_so(tmp_path: Path) -> None:
    one, *_ = renders()
    small = Kept("small", "", one.project, 0.25, {"Depth RMSE": math.nan})
    rows = side_by_side([one, small])
    assert rows[0].label == "Image scale" and rows[0].cells == ("1", "0.25")
    write_table(tmp_path / "t.csv", [one, small], rows)
    with open(tmp_path / "t.csv", newline="", encoding="utf-8") as file:
        assert list(csv.reader(file))[:2] == [["", "0", "small"], ["Image scale", "1", "0.25"]]


def test_pixels_of_another_size_have_no_difference() -> None:
    """Line RMSE of 4.15 at a quarter of the size was told to be 1.5 less than 5.67 at full size."""
    one, *_ = renders()
    figures = ({"Line RMSE": 5.67, "Depth RMSE": 20.0}, {"Line RMSE": 4.15, "Depth RMSE": 30.0})
    of_both = [replace(one, figures=shown, image_scale=k) for shown, k in zip(figures, (1.0, 0.25), strict=True)]
    rows = {row.label: row.cells for row in side_by_side(of_both)}
    assert rows["Line RMSE / px of its own image"] == ("5.67", "4.15")
    assert rows["Depth RMSE / µm"] == ("20.0", "30.0 (+10)")
    alike = side_by_side([replace(each, image_scale=0.25) for each in of_both])
    assert {row.label: row.cells for row in alike}["Line RMSE / px"] == ("5.67", "4.15 (-1.5)")


def test_measures_of_the_part_are_read_of_every_render() -> None:
    """Those that one render's project had and another's had not were told as settings: there, not there."""
    gauge = Gauge(name="rise", kind="step", regions=((-0.1, 0.0), (0.0, 0.1)))
    plain = Project.load("plane")
    with_one = plain.model_copy(update={"measures": (gauge,)})
    values = (0.0211664, 0.0211714)
    renders = [
        Kept(name, "", project, 1.0, {}, readings=(Reading(gauge, 0, value, sigma_random=4e-6),))
        for name, project, value in zip("ab", (plain, with_one), values, strict=True)
    ]
    (row,) = side_by_side(renders)
    assert row.label == "rise / mm" and row.cells == ("21.1664\u00a0mm", "21.1714\u00a0mm (+5.00\u00a0µm)")


def test_a_difference_that_is_the_parts_own_says_so_and_has_the_unit_of_its_values() -> None:
    """A step of 78 mm less was told as -78235 um, without a word on regions that lay beside it."""
    gauge = Gauge(name="rise", kind="step", regions=((-0.1, 0.0), (0.0, 0.1)))
    project = Project.load("plane").model_copy(update={"measures": (gauge,)})

    def of(name: str, value: float, truth: float, **more: str) -> Kept:
        reading = Reading(gauge, 0, value, sigma_random=4e-6, truth=truth, **more)
        return Kept(name, "", project, 1.0, {}, readings=(reading,))

    nothing = of("d", math.nan, math.nan, reason="no points in its first region")
    (row,) = side_by_side([of("a", 0.0791, 0.0791), of("b", 0.000865, 0.00086), of("c", 0.07915, 0.0791), nothing])
    assert row.cells[1].endswith("(-78.2350\u00a0mm)") and row.cells[2].endswith("(+50.0\u00a0µm)")
    told = "exact here 0.8600\u00a0mm, in a 79.1000\u00a0mm: the part in these regions is another"
    assert row.notes == ("", told, "", "no points in its first region")


def test_a_smaller_render_has_the_exposure_of_the_scanner_and_what_is_unfinished_says_so(tmp_path: Path) -> None:
    one, *_ = renders()
    short = one.project.replaced({"sensor.exposure_time": 0.001})
    small = [
        Kept(name, "", scaled(each, 0.25), 0.25, {"Depth RMSE": 20.0})
        for name, each in (("a", one.project), ("b", short))
    ]
    small[1] = replace(small[1], stopped=True, figures={"Depth RMSE": 15.5123456})
    rows = {row.label: row.cells for row in side_by_side(small)}
    assert rows["Image scale"] == ("0.25", "0.25") and rows["Finished"] == ("yes", "stopped early")
    (exposure,) = [cells for label, cells in rows.items() if "xposure" in label]
    assert exposure[1] == "1 ms"
    write_table(tmp_path / "t.csv", small, side_by_side(small))
    with open(tmp_path / "t.csv", newline="", encoding="utf-8") as file:
        assert ["Depth RMSE / µm", "20", "15.5123456"] in list(csv.reader(file))
