"""Beyond one image at a time: exposures, geometry, ridges, sweeps, and points from photographs, by the command line."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from click.testing import CliRunner, Result

import main
from render.scene.motion import LinearStage
from render.world.world import build_world
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.scan.stages import Clock, develop_step, render_step, scaled
from tests.analysis.line.line_images import expected, exposed

ROWS, WIDTH = 160, 240
CENTRE = 90 + 0.2 * np.arange(ROWS)
CLOCK = Clock(lambda stage, done: None, lambda: False)


def call(command: str, *arguments: object) -> Result:
    return CliRunner().invoke(main.cli, [command, *map(str, arguments), "--quiet", "--json"])


def table(path: Path) -> dict[str, Any]:
    with path.open() as file:
        rows = list(csv.DictReader(file))
    return {name: np.array([float(row[name] or "nan") for row in rows]) for name in ("u", "v", "sigma_u") if rows} | {
        "flag": [row["flag"] for row in rows]
    }


def test_exposures_are_fused_into_one_line_with_an_honest_sigma(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    unit = expected(WIDTH, CENTRE, 1.0, 1.5, 0.0) * np.geomspace(100, 6000, ROWS)[:, None] + 8.0
    for name, time in (("long", 16.0), ("middle", 4.0), ("short", 1.0)):
        counts = np.minimum(exposed(unit * time, 3, rng), 10000) * 0.4
        cv2.imwrite(str(tmp_path / f"{name}.png"), np.clip(np.round(counts), 0, 4095).astype(np.uint16))
    files = [tmp_path / f"{name}.png" for name in ("long", "middle", "short")]
    done = call("extract", *files, "--hdr", "16,4,1")
    assert done.exit_code == 0, done.output
    assert "3 exposures fused" in json.loads(done.stdout)["images"][0]["note"]
    found = table(tmp_path / "long_line.csv")
    z = (found["u"] - CENTRE) / found["sigma_u"]
    assert np.isfinite(z).mean() > 0.97
    assert np.std(z[np.isfinite(z)]) == pytest.approx(1.0, abs=4 / np.sqrt(2 * ROWS))
    alone = call("extract", files[0], "--no-smooth-along", "--out", tmp_path / "alone")
    assert alone.exit_code == 0
    off = table(tmp_path / "alone" / "long_line.csv")["u"] - CENTRE
    assert np.sqrt(np.nanmean((found["u"] - CENTRE) ** 2)) < np.sqrt(np.nanmean(off**2))


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["a.png", "b.png", "--hdr", "4"], "its time"),
        (["a.png", "b.png", "--hdr", "4,x"], "not a list of numbers"),
        (["a.png", "b.png", "--hdr", "4,-1"], "out of range"),
        (["a.png", "deep.png", "--hdr", "4,1"], "not of one type"),
        (["a.png", "small.png", "--hdr", "4,1"], "not of one shape"),
        (["a.png", "--geometry"], "give --project"),
        (["a.png", "--geometry", "--nearest", "2", "--farthest", "1"], "nearest < farthest"),
        (["a.png", "b.png", "--spacetime"], "more frames"),
        (["a.png", "--spacetime", "--ridges"], "only one of these"),
        (["a.png", "--ridges", "--smooth-along"], "to be smoothed along"),
        (["a.png", "--off", "b.png", "--off", "b.png", "--off", "b.png"], "one for each"),
    ],
)
def test_what_does_not_go_together_is_named(arguments: list[str], text: str, tmp_path: Path) -> None:
    image = np.round(exposed(expected(WIDTH, CENTRE, 2000, 1.5, 10.0), 3, np.random.default_rng(2)) * 0.07)
    for name, pixels in (("a", image), ("b", image), ("small", image[:50])):
        cv2.imwrite(str(tmp_path / f"{name}.png"), pixels.clip(0, 255).astype(np.uint8))
    cv2.imwrite(str(tmp_path / "deep.png"), image.clip(0, 255).astype(np.uint16))
    done = call("extract", *(tmp_path / word if word.endswith(".png") else word for word in arguments))
    assert done.exit_code == 2 and text in done.stderr and "Traceback" not in done.output
    assert not list(tmp_path.glob("*.csv"))


def test_ridges_need_no_axis(tmp_path: Path) -> None:
    # along the rows: no scan line crosses it
    image = exposed(expected(WIDTH, 80 + 0.05 * np.arange(WIDTH), 2000, 1.5, 10.0), 3, np.random.default_rng(3)).T
    cv2.imwrite(str(tmp_path / "level.png"), np.round(image * 0.07).clip(0, 255).astype(np.uint8))
    done = call("extract", tmp_path / "level.png", "--ridges")
    assert done.exit_code == 0, done.output
    answer = json.loads(done.stdout)["images"][0]
    assert answer["lines"] == 1 and answer["points"] > 200
    found = list(csv.DictReader((tmp_path / "level_ridges.csv").open()))
    off = [float(row["v"]) - 80 - 0.05 * float(row["u"]) for row in found]
    assert np.sqrt(np.mean(np.square(off))) < 0.03


def test_a_sweep_tells_when_the_sheet_passes_each_pixel(tmp_path: Path) -> None:
    import OpenEXR

    rng = np.random.default_rng(4)
    for t in range(24):
        image = exposed(expected(60, np.full(20, 10 + 1.5 * t), 3000, 3.0, 20.0), 3, rng)
        cv2.imwrite(str(tmp_path / f"sweep{t:02d}.png"), np.round(image * 10).clip(0, 65535).astype(np.uint16))
    done = call("extract", *sorted(tmp_path.glob("sweep*.png")), "--spacetime")
    assert done.exit_code == 0, done.output
    layers = OpenEXR.File(str(tmp_path / "sweep00_passage.exr"), separate_channels=True).channels()
    time = np.asarray(layers["time"].pixels)
    truth = (np.arange(60) - 10) / 1.5
    inside = slice(18, 38)
    assert np.sqrt(np.mean((time[:, inside] - truth[inside]) ** 2)) < 0.05


@pytest.mark.validation
def test_photographs_of_a_rig_with_its_geometry_and_exposures_and_along_time(tmp_path: Path) -> None:
    root = template_folder("plane")
    project = scaled(Project.load(root / "project.json"), 0.25)
    motion = LinearStage(moves="rig", step=(0.0004, 0.0, 0.0), steps=15)
    update = {"scene": project.scene.model_copy(update={"motion": motion, "lights": ()})}
    project = project.model_copy(update=update)
    project.save(tmp_path / "rig.json")
    world = build_world(project.scene, root, 0)
    frame = render_step(project, world, 0, CLOCK)
    names = []
    for step in range(15):  # a plane shifted along itself: every frame shows the same
        shot = project.model_copy(update={"seed": step})
        names.append(tmp_path / f"shot{step:02d}.png")
        cv2.imwrite(str(names[-1]), develop_step(shot, frame, CLOCK, None)[0].pixels)
    depth = float(frame.curves[0].depth_z.mean())

    def points(*arguments: object) -> dict[str, Any]:
        done = call("reconstruct", *arguments, "--project", tmp_path / "rig.json", "--out", tmp_path / "out")
        assert done.exit_code == 0, done.output
        answer: dict[str, Any] = json.loads(done.stdout)
        return answer

    whole = points(names[0])["points"]
    assert whole > 400
    beyond = ("--geometry", "--select", "continuous", "--farthest", depth - 0.05)
    assert points(names[0], *beyond)["points"] == 0
    near = points(names[0], "--geometry", "--nearest", depth - 0.01, "--farthest", depth + 0.01)
    assert near["points"] == pytest.approx(whole, rel=0.02) and "fan" in near["extraction"][0]
    checked = call("extract", names[0], *beyond, "--project", tmp_path / "rig.json")
    assert json.loads(checked.stdout)["images"][0]["found"] == 0
    timed = points(*names, "--spacetime")
    assert timed["extraction"] == ["the smoothest chain of peaks; measured along time"] and timed["points"] > 0
    too_many = call("reconstruct", *names, names[0], "--project", tmp_path / "rig.json")
    assert too_many.exit_code == 2 and "more images than steps" in too_many.stderr
