"""What a set of photographs says of itself: axis, colour, channel; white cores, room light, JPEG, masks and turns."""

from __future__ import annotations

import csv
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from click.testing import CliRunner, Result
from PIL import Image

import main
from studio.photographs.bands import course
from studio.photographs.evidence import AXES, DOUBTFUL, Chain, find_evidence, shrink
from studio.photographs.evidence_words import CONTROLS, OPTIONS, told_of, warnings_of
from studio.photographs.image_files import has_coarse_colour
from studio.photographs.photograph_set import NEARBY
from tests.studio.photographs.colour_photographs import HEIGHT, Scene, photograph, write

SCENES: dict[str, tuple[Scene, int | None]] = {
    "green in the dark": (Scene(), None),
    "red in room light": (Scene(colour=0, room=50.0), None),
    "blue in room light": (Scene(colour=2, peak=200.0, room=40.0), None),
    "green, white core": (Scene(peak=2500.0, room=30.0), None),
    "red, wide white core": (Scene(colour=0, peak=3000.0, sigma=5.0, room=30.0), None),
    "red, JPEG 70": (Scene(colour=0, peak=200.0, room=40.0), 70),
    "green, JPEG 85": (Scene(room=40.0), 85),
    "green, white core, JPEG 95": (Scene(peak=2500.0, room=30.0), 95),
    "upright": (Scene(colour=0, slope=0.0, bend=0.0, room=40.0), None),
}
WRONG = 1.0
"""px off the truth that makes a row false: far beyond sigma, and less than the line's half width."""


def extract(*arguments: object) -> Result:
    return CliRunner().invoke(main.cli, ["extract", *map(str, arguments), "--quiet", "--json"])


def answer(*arguments: object) -> dict[str, Any]:
    done = extract(*arguments)
    assert done.exit_code == 0, done.output
    return dict(json.loads(done.stdout))


def positions(path: Path, count: int = HEIGHT, across: str = "u") -> tuple[Any, Any]:
    """(count,) position and sigma of the first peak, NaN where there is none."""
    found = np.full((2, count), np.nan)
    with path.open() as file:
        for row in csv.DictReader(file):
            if row["rank"] == "0" and row[across]:
                first = row["row"] if "row" in row else row["column"]
                found[:, int(first)] = float(row[across]), float(row["sigma_u"])
    return found[0], found[1]


@pytest.mark.parametrize("axis", AXES)
def test_two_lines_that_are_alike_hide_neither_themselves_nor_which_way_they_run(axis: str) -> None:
    """Each is as strong as what is elsewhere, and on dark ground noise alone stands as clear on the other axis."""
    y, x = np.mgrid[0:360, 0:480].astype(np.float64)
    lines = sum(100.0 * np.exp(-0.5 * (x - at - 0.15 * y) ** 2) for at in (190.0, 310.0))
    for seed in range(5):
        image = np.rint(20.0 + lines + np.random.default_rng(seed).normal(size=x.shape)).astype(np.uint8)
        evidence = find_evidence([shrink(image if axis == "rows" else image.T, None)])
        assert (evidence.axis, evidence.lines) == (axis, 2) and not warnings_of(evidence)


def test_what_is_weak_elsewhere_says_nothing_of_two_lines_that_hide_each_other() -> None:
    """The edge of a bluish wall stands as clear of all else in its colour as two green lines do of each other."""
    _, x = np.mgrid[0:360, 0:480].astype(np.float64)
    lines = sum(np.exp(-0.5 * ((x - at) / 1.5) ** 2) for at in (190.0, 310.0))
    wall = 3.0 * np.exp(-0.5 * ((x - 420.0) / 2.0) ** 2)
    for seed in range(5):
        noise = np.random.default_rng(seed).normal(size=(*x.shape, 3))
        image = np.stack([30.0 + 20.0 * lines, 30.0 + 100.0 * lines, 30.0 + 40.0 * lines + wall], axis=2) + noise
        evidence = find_evidence([shrink(np.rint(image).astype(np.uint8), None)])
        assert (evidence.axis, evidence.lines, evidence.colour) == ("rows", 2, "green")
        told = dict(told_of(evidence))
        assert "as clear as that" in told["looked for in"] or told["looked for in"].startswith("green")


@pytest.mark.parametrize("name", SCENES)
def test_colour_and_axis_are_told_by_the_photograph_and_the_line_is_found(name: str, tmp_path: Path) -> None:
    scene, quality = SCENES[name]
    path = tmp_path / ("a.png" if quality is None else "a.jpg")
    write(path, photograph(scene, seed=len(name)), quality)
    told = answer(path)
    assert told["chosen"]["axis"] == "rows" and not told["chosen"]["warnings"]
    assert told["chosen"]["colour"] == ("red", "green", "blue")[scene.colour]
    u, _ = positions(tmp_path / "a_line.csv")
    error = np.abs(u - scene.centre)
    assert np.isfinite(u).mean() >= 0.98
    assert np.mean(error[np.isfinite(error)] > WRONG) <= 0.001
    assert np.nanmedian(error) < 0.25


@pytest.mark.parametrize("half", [100, 25, 15])
@pytest.mark.parametrize("colour", [0, 1])
def test_a_rectangle_about_the_line_says_its_colour_as_the_whole_photograph_does(half: int, colour: int) -> None:
    """Without rivals all channels together show it best, and half of its light may be in the others."""
    for scene in (Scene(colour=colour, crosstalk=0.55, room=20.0), Scene(colour=colour, peak=2500.0, room=30.0)):
        image = photograph(scene, seed=1)
        middle = int(scene.centre[100:160].mean())
        part = np.ascontiguousarray(image[100:160, middle - half : middle + half])
        whole, within = (find_evidence([shrink(one, None)]) for one in (image, part))
        assert whole.colour == within.colour == ("red", "green")[colour]
        assert within.combination.name == "mono" and within.light is not None
        told = dict(told_of(within))
        assert told["laser's colour"].startswith(f"{within.colour} (of the line's light ")
        assert told["looked for in"].startswith("mono, all channels together (")


@pytest.mark.parametrize("lamp", [(1.0, 1.0, 1.0), (1.0, 0.8, 0.6)])
def test_a_line_of_grey_or_lamp_light_has_no_colour_and_says_what_light_it_has(lamp: tuple[float, ...]) -> None:
    y, x = np.mgrid[0:200, 0:300].astype(np.float64)
    line = 150.0 * np.exp(-0.5 * ((x - 140.0 - 0.1 * y) / 2.0) ** 2)
    noise = np.random.default_rng(3).normal(size=(*x.shape, 3))
    image = np.clip(np.rint(10.0 + line[..., None] * lamp + noise), 0, 255).astype(np.uint8)
    evidence = find_evidence([shrink(image, None)])
    assert evidence.colour == "mono" and evidence.light is not None
    assert list(evidence.light.values()) == pytest.approx(np.divide(lamp, sum(lamp)), abs=0.005)
    assert "none has much more than the others" in dict(told_of(evidence))["laser's colour"]


def test_a_white_core_is_not_measured_in_the_difference_which_is_hollow(tmp_path: Path) -> None:
    scene = Scene(peak=2500.0, room=30.0)
    write(tmp_path / "a.png", photograph(scene, seed=1))
    told = answer(tmp_path / "a.png", "--no-smooth-along")["chosen"]  # each scan line by itself
    assert told["seen_in"] == "green less the others" and told["measured_in"] in ("red", "blue")
    chosen, _ = positions(tmp_path / "a_line.csv")
    good = np.isfinite(chosen)
    assert np.sqrt(np.mean((chosen - scene.centre)[good] ** 2)) < 0.1
    # held to the difference, the same photograph is measured worse or hardly at all
    answer(tmp_path / "a.png", "--channel", "difference", "--no-smooth-along", "--out", tmp_path / "hollow")
    hollow, _ = positions(tmp_path / "hollow" / "a_line.csv")
    rms = [np.sqrt(np.nanmean((u - scene.centre) ** 2)) for u in (chosen, hollow)]
    assert rms[0] < 0.9 * rms[1] or np.isfinite(hollow).mean() < 0.9


def test_nobody_s_wish_is_smoothed_over_few_scan_lines_and_a_wish_as_far_as_the_line_tells(tmp_path: Path) -> None:
    scene = Scene(peak=120.0, room=20.0, bend=0.0)
    write(tmp_path / "a.png", photograph(scene, seed=5))
    rms, reach = {}, {}
    for name, options in {"alone": ["--no-smooth-along"], "default": [], "far": ["--smooth-along"]}.items():
        told = answer(tmp_path / "a.png", *options, "--out", tmp_path / name)["images"][0]
        u, _ = positions(tmp_path / name / "a_line.csv")
        rms[name] = np.sqrt(np.nanmean((u - scene.centre) ** 2))
        found = re.search(r"over ([0-9.]+) scan lines", told["note"])
        reach[name] = float(found.group(1)) if found else 0.0
    assert reach["alone"] == 0.0 and 1.0 < reach["default"] <= NEARBY < reach["far"]
    assert rms["far"] < rms["default"] < rms["alone"]


def test_the_colours_of_a_jpeg_never_measure_alone(tmp_path: Path) -> None:
    write(tmp_path / "a.jpg", photograph(Scene(colour=0, room=50.0), seed=2), 90)
    told = answer(tmp_path / "a.jpg")["chosen"]
    assert told["seen_in"] == "red less the others" and told["measured_in"] != "difference"


def test_a_level_line_is_measured_by_columns_and_the_table_says_so(tmp_path: Path) -> None:
    scene = Scene(room=40.0)
    write(tmp_path / "a.png", np.ascontiguousarray(photograph(scene, seed=3).transpose(1, 0, 2)))
    assert answer(tmp_path / "a.png")["chosen"]["axis"] == "columns"
    assert (tmp_path / "a_line.csv").read_text().startswith("column,rank,u,v,")
    v, _ = positions(tmp_path / "a_line.csv", across="v")
    assert np.nanmedian(np.abs(v - scene.centre)) < 0.25
    forced = answer(tmp_path / "a.png", "--axis", "rows", "--out", tmp_path / "rows")
    assert "may run along the rows" in forced["chosen"]["warnings"][0]


def test_the_set_decides_where_one_photograph_cannot(tmp_path: Path) -> None:
    seen, weak = Scene(colour=0, room=40.0), Scene(colour=0, peak=2.0, room=40.0)
    for k, scene in enumerate((seen, seen, weak)):
        write(tmp_path / f"{k}.png", photograph(scene, seed=k))
    chosen = answer(*sorted(tmp_path.glob("*.png")))["chosen"]
    assert (chosen["axis"], chosen["colour"]) == ("rows", "red")


def test_a_photograph_without_a_line_is_told_as_one(tmp_path: Path) -> None:
    write(tmp_path / "a.png", photograph(Scene(), seed=4, laser=False))
    told = answer(tmp_path / "a.png")
    assert any("no line stands out" in text for text in told["chosen"]["warnings"])


def test_laser_off_images_go_by_name_in_order_or_one_for_all(tmp_path: Path) -> None:
    scene = Scene(colour=0, peak=60.0, room=60.0)
    for name in ("a", "b"):
        write(tmp_path / f"{name}.png", photograph(scene, seed=5))
        write(tmp_path / f"{name}_off.png", photograph(scene, seed=6, laser=False))
    images = tmp_path / "a.png", tmp_path / "b.png"
    offs = "--off", tmp_path / "b_off.png", "--off", tmp_path / "a_off.png"
    told = answer(*images, *offs)["chosen"]
    assert told["told"]["laser off"] == "one for each, by name"
    u, _ = positions(tmp_path / "a_line.csv")
    assert np.isfinite(u).mean() > 0.98 and np.nanmedian(np.abs(u - scene.centre)) < 0.3
    assert "one for all" in answer(*images, "--off", tmp_path / "a_off.png")["chosen"]["told"]["laser off"]
    write(tmp_path / "c.png", photograph(scene, seed=5))
    refused = extract(*images, tmp_path / "c.png", *offs)
    assert refused.exit_code == 2 and "one for all" in refused.stderr


def test_only_the_region_and_what_the_mask_leaves_is_looked_at(tmp_path: Path) -> None:
    left, right = Scene(peak=90.0, bend=0.0, slope=0.0), Scene(peak=200.0, bend=0.0, slope=0.0)
    image = np.hstack([photograph(left, seed=7), photograph(right, seed=8)])
    write(tmp_path / "a.png", image)
    whole, _ = (answer(tmp_path / "a.png"), positions(tmp_path / "a_line.csv"))[1]
    assert np.nanmedian(whole) == pytest.approx(570.0, abs=0.1)
    answer(tmp_path / "a.png", "--roi", "100,50,150,200", "--out", tmp_path / "roi")
    part, _ = positions(tmp_path / "roi" / "a_line.csv")
    assert np.nanmedian(part) == pytest.approx(170.0, abs=0.1)
    assert np.flatnonzero(np.isfinite(part)).tolist() == list(range(50, 250))
    mask = np.zeros(image.shape[:2], np.uint8)
    mask[:, 100:300] = 255
    cv2.imwrite(str(tmp_path / "mask.png"), mask)
    answer(tmp_path / "a.png", "--mask", tmp_path / "mask.png", "--out", tmp_path / "masked")
    masked, _ = positions(tmp_path / "masked" / "a_line.csv")
    assert np.nanmedian(masked) == pytest.approx(170.0, abs=0.1) and np.isfinite(masked).mean() > 0.98
    for option, value, text in (
        ("--roi", "700,0,200,100", "leaves the image"),
        ("--roi", "1,2", "not a region"),
        ("--mask", tmp_path / "a_line.png", "no such image"),
    ):
        refused = extract(tmp_path / "a.png", option, value)
        assert refused.exit_code == 2 and text in refused.stderr and "Traceback" not in refused.output


def test_two_lines_are_told_and_each_is_a_chain_of_its_own(tmp_path: Path) -> None:
    first, second = Scene(bend=0.0), Scene(bend=0.0, slope=0.12, peak=140.0)
    image = np.maximum(photograph(first, seed=9), np.roll(photograph(second, seed=10), 60, axis=1))
    write(tmp_path / "a.png", image)
    told = answer(tmp_path / "a.png")
    assert "second line" in told["chosen"]["told"]["lines"]
    with (tmp_path / "a_line.csv").open() as file:
        rows = list(csv.DictReader(file))
    found = [np.array([float(row["u"] or "nan") for row in rows if row["rank"] == rank]) for rank in ("0", "1")]
    near = sorted(found, key=lambda one: float(np.nanmedian(one)))
    for line, centre in zip(near, (first.centre, second.centre + 60.0), strict=True):
        assert np.isfinite(line).mean() > 0.98 and np.nanmax(np.abs(line - centre)) < WRONG


@pytest.mark.parametrize("orientation", [3, 6, 8])
def test_a_photograph_is_turned_as_exif_says(orientation: int, tmp_path: Path) -> None:
    image = photograph(Scene(), seed=11)
    stored = {3: image[::-1, ::-1], 6: np.rot90(image), 8: np.rot90(image, -1)}[orientation]
    exif = Image.Exif()
    exif[0x0112] = orientation
    Image.fromarray(np.ascontiguousarray(stored)).save(tmp_path / "a.jpg", quality=95, exif=exif)
    told = answer(tmp_path / "a.jpg")["chosen"]
    assert "as EXIF says" in told["told"]["upright"] and told["axis"] == "rows"
    u, _ = positions(tmp_path / "a_line.csv")
    assert np.nanmedian(np.abs(u - Scene().centre)) < 0.25


def test_no_position_is_less_certain_than_the_line_is_wide(tmp_path: Path) -> None:
    rng = np.random.default_rng(12)
    image = photograph(Scene(peak=7.0), seed=12).astype(float)
    image += rng.normal(scale=3.0, size=image.shape)
    write(tmp_path / "a.png", np.clip(np.round(image), 0, 255).astype(np.uint8))
    told = answer(tmp_path / "a.png", "--select", "strongest")["images"][0]
    with (tmp_path / "a_line.csv").open() as file:
        for row in csv.DictReader(file):
            assert not row["u"] or float(row["sigma_u"]) <= float(row["width"])
    assert sum(told["flags"].values()) == HEIGHT


def test_the_overlay_shows_points_on_the_line_and_marks_what_has_none(tmp_path: Path) -> None:
    image = photograph(Scene(bend=0.0, slope=0.0), seed=13)
    image[200:] = photograph(Scene(), seed=14, laser=False)[200:]
    write(tmp_path / "a.png", image)
    told = answer(tmp_path / "a.png", "--overlay")["images"][0]
    drawn = cv2.imread(told["overlay"])
    scale = 3
    green = (drawn[..., 1] > 200) & (drawn[..., 0] < 60) & (drawn[..., 2] < 60)
    rows, columns = np.nonzero(green[: scale * HEIGHT, : scale * 400])
    assert len(np.unique(rows)) == 200 and abs(np.median(columns) - scale * 170.5) < scale and rows.max() < scale * 201
    assert drawn[scale * 250, scale * 400 + 5].tolist() == [70, 70, 70]  # no line there
    assert answer(tmp_path / "a.png", "--overlay")["images"][0]["overlay"] == told["overlay"]  # its own file


def test_a_wider_view_of_the_same_wall_leaves_the_line_as_it_is(tmp_path: Path) -> None:
    scene, left = Scene(room=40.0), 300
    rng = np.random.default_rng(5)
    wide = np.clip(np.round(46.0 + 2.0 * rng.normal(size=(HEIGHT, 1440, 3))), 0, 255).astype(np.uint8)
    wide[:, 700:1100] = photograph(scene, seed=9)
    write(tmp_path / "wide.png", wide)
    write(tmp_path / "near.png", wide[:, left:])
    found = []
    for name in ("wide", "near"):
        answer(tmp_path / f"{name}.png")
        found.append(positions(tmp_path / f"{name}_line.csv"))
    assert np.isfinite(found[0][0]).mean() >= 0.98
    np.testing.assert_allclose(found[0][0] - left, found[1][0], atol=1e-6)
    np.testing.assert_allclose(found[0][1], found[1][1], rtol=1e-6)


@pytest.mark.parametrize(("quality", "coarse"), [(None, False), (95, True), (88, True)])
def test_colour_that_was_made_coarse_is_told_beside_a_bright_line_too(quality: int | None, coarse: bool) -> None:
    image = photograph(Scene(peak=2500.0, colour=2, sigma=5.0), seed=4)
    if quality is not None:
        options = [cv2.IMWRITE_JPEG_QUALITY, quality, cv2.IMWRITE_JPEG_SAMPLING_FACTOR, 0x221111]
        image = cv2.imdecode(cv2.imencode(".jpg", image, options)[1], cv2.IMREAD_COLOR)
    assert has_coarse_colour(np.ascontiguousarray(image)) is coarse


def test_a_channel_in_which_the_line_is_dark_does_not_measure_however_smooth_what_is_beside_it(tmp_path: Path) -> None:
    """A pure colour is dark in the others on a pale wall, as a colour matrix makes it; a seam beside it is not."""
    scene = Scene(peak=140.0, room=60.0)
    image = photograph(scene, seed=21).astype(np.float64)
    x = np.arange(image.shape[1])
    off = x - scene.centre[:, None]
    for k in (0, 2):
        image[..., k] += (
            60.0 - 100.0 * np.exp(-0.5 * (off / 4.0) ** 2) + 60.0 * np.exp(-0.5 * ((off - 25.0) / 3.0) ** 2)
        )
    write(tmp_path / "a.jpg", np.clip(np.rint(image), 0, 255).astype(np.uint8), 92)
    told = answer(tmp_path / "a.jpg")["chosen"]
    assert told["measured_in"] == "green"
    u, _ = positions(tmp_path / "a_line.csv")
    assert np.isfinite(u).mean() > 0.98 and np.nanmax(np.abs(u - scene.centre)) < WRONG


def test_where_a_line_jumps_the_band_holds_both_of_its_places() -> None:
    """A wall far behind a part: the part's first scan lines, which the shrunk image does not show, are not cut off."""
    u = np.where(np.arange(60) < 25, 20.0, 120.0)
    u[25:30] = np.nan
    low, high = course(Chain(u, np.full(60, 1.0), 1.0), 60, 200).band()
    inside = (low[25:30] <= 20) & (high[25:30] > 120)
    assert inside.all()
    assert high[10] < 60 and low[50] > 60


def test_what_is_taken_for_a_line_where_there_is_none_is_doubted() -> None:
    """In a rectangle beside the line, an edge of the part was told as a line without a word."""
    room = Scene(room=40.0)
    for seed in range(3):
        of_edges = find_evidence([shrink(photograph(room, seed, laser=False), None)])
        assert of_edges.score < DOUBTFUL and warnings_of(of_edges)
        of_line = find_evidence([shrink(photograph(room, seed), None)])
        assert of_line.score > 2.0 * DOUBTFUL and not warnings_of(of_line)
    weak = replace(of_line, scores={axis: dict.fromkeys(names, 0.23) for axis, names in of_line.scores.items()})
    assert any("evidence 0.23" in text and "may be an edge" in text for text in warnings_of(weak))


def test_the_other_axis_is_named_as_the_reader_chooses_it() -> None:
    across = find_evidence([shrink(photograph(Scene(room=40.0), 1), None)], axis="columns")
    by_options, by_controls = (warnings_of(across, words)[0] for words in (OPTIONS, CONTROLS))
    assert "give --axis rows" in by_options
    assert "choose Scan axis: rows" in by_controls and "--" not in by_controls
    assert by_controls.index("instead") < by_controls.index("Scan axis: rows") < by_controls.index("evidence")
