"""What `inspect` warns of, a scan says as well; what was hardly found, or found at another scale, it says first."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from render.base.errors import InputError
from render.base.pose import Pose
from render.laser.laser import Divergence
from render.output.frame_files import read_frame
from render.scene.lights import Environment
from render.scene.motion import LinearStage
from render.scene.scene import SceneObject
from render.scene.settings import DepthGoal
from render.scene.shape import Plane
from render.sensor.sensor import BandPass
from studio.preview.inspection import inspect
from studio.project.document import FieldPath, replaced
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.scan import scan_folder
from studio.scan.options import ScanOptions
from studio.scan.reconstruct import reconstruct_folder
from studio.scan.scan import run_scan
from studio.scan.stages import Clock, develop_step, scaled

ROOT = template_folder("plane")
LASER: FieldPath = ("scene", "rig", "lasers", 0)
SMALL = 0.25
TILE = Plane(width=0.02, height=0.02)
BESIDE = SceneObject(name="tile", shape=TILE, T_world_object=Pose(translation=(0.1, 0.0, 0.0)))


@pytest.fixture(scope="module")
def plane() -> Project:
    """The plane's template in a quarter of its pixels a side, its line as wide, with light too dim for stray peaks."""
    project = scaled(Project.load(ROOT / "project.json"), SMALL)
    project = replaced(project, ("scene", "environment"), Environment(radiance=(1e-4, 1e-4, 1e-4)))
    project = replaced(project, (*LASER, "sheet"), Divergence(full_angle=3e-3))
    render = project.render.model_copy(update={"truth_images": False, "ambient_samples": 1, "transport": "direct"})
    return replaced(replaced(project, ("scene", "lights"), ()), ("render",), render)


def changed(path: FieldPath, value: object) -> Callable[[Project], Project]:
    return lambda project: replaced(project, path, value)


KINDS = {
    "power 0": (changed((*LASER, "power"), 0.0), "power is 0 W"),
    "nothing through the lens": (changed(("scene", "rig", "camera", "lens", "transmission"), 0.0), "transmission is 0"),
    "light outside the filter": (changed(("sensor", "band_pass"), BandPass(centre_nm=650.0)), "nothing of 450 nm"),
    "light outside the sensor's band": (changed((*LASER, "wavelength_nm"), 1900.0), "nothing of 1900 nm"),
    "too short an exposure": (changed(("sensor", "exposure_time"), 1e-7), "the line is dim"),
    "all saturated": (changed(("sensor", "exposure_time"), 10.0), "on 100% of the scan lines the brightest"),
    "too small a scale": (lambda project: scaled(project, 0.2), "the line's sigma is about 0."),
    "sheet beside the part": (
        changed((*LASER, "T_rig_laser"), Pose(translation=(0.2, 0.0, 0.0), rotation=(0.0, 0.5, 0.0))),
        "no part of the line is both lit and seen",
    ),
    "part hidden from the sheet": (
        changed(("scene", "objects"), (BESIDE,)),
        "no part of the line is both lit and seen",
    ),
}  # fmt: skip
FOUND_LITTLE = ("power 0", "nothing through the lens", "light outside the filter", "light outside the sensor's band",
                "too short an exposure", "sheet beside the part", "part hidden from the sheet")  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
def test_what_inspect_warns_of_is_among_the_notes_of_a_scan_and_of_its_report(
    kind: str, plane: Project, tmp_path: Path
) -> None:
    change, words = KINDS[kind]
    project = change(plane)
    warnings = inspect(project, ROOT).warnings
    assert any(words in text for text in warnings), warnings
    done = run_scan(project, ROOT, out=tmp_path, options=ScanOptions(report=False))
    assert set(warnings) <= set(done.manifest["notes"]), done.manifest["notes"]
    again = scan_folder.open_folder(tmp_path)
    clock = Clock(lambda stage, done: None, lambda: False)
    told = reconstruct_folder(again, again.project, ROOT, tmp_path / "again", clock, report=False)
    assert told["notes"] == done.manifest["notes"]
    if kind in FOUND_LITTLE:
        assert "nothing" in done.manifest["notes"][0].lower() or "Only" in done.manifest["notes"][0]
        assert not done.manifest["results"][0]["completeness"]


def test_a_scan_that_finds_its_line_has_nothing_to_say(plane: Project, tmp_path: Path) -> None:
    done = run_scan(plane, ROOT, out=tmp_path, options=ScanOptions(report=False))
    assert done.manifest["notes"] == []
    assert done.manifest["results"][0]["completeness"] > 0.95


def test_figures_at_another_image_scale_are_said_not_to_be_the_scanners(plane: Project, tmp_path: Path) -> None:
    done = run_scan(plane, ROOT, out=tmp_path, options=ScanOptions(image_scale=0.75, report=False))
    assert done.manifest["image_scale"] == 0.75
    first = done.manifest["notes"][0]
    assert "image scale 0.75" in first and "not the scanner's" in first
    assert json.loads((tmp_path / "scan.json").read_text())["notes"] == done.manifest["notes"]


def test_frames_in_which_the_sheet_has_left_the_part_are_counted(plane: Project, tmp_path: Path) -> None:
    motion = LinearStage(moves="objects", step=(0.27, 0.0, 0.0), steps=2)
    done = run_scan(replaced(plane, ("scene", "motion"), motion), ROOT, out=tmp_path, options=ScanOptions(report=False))
    assert any("in 1 of 2 frames no part of the line" in text for text in done.manifest["notes"])


def test_light_that_was_rendered_for_another_measurement_is_told(plane: Project, tmp_path: Path) -> None:
    """By what differs; not where no goal in depth says what the light is for."""
    clock = Clock(lambda stage, done: None, lambda: False)
    dim = replaced(plane, ("sensor", "exposure_time"), 0.5 * plane.sensor.exposure_time)
    for goal, told in ((DepthGoal(), 1), (None, 0)):
        out = tmp_path / str(told)
        # four samples a pixel leave room for a look at the lines
        lit = replaced(replaced(plane, ("render", "ambient_samples"), 4), ("render", "goal"), goal)
        run_scan(lit, ROOT, out=out, options=ScanOptions(report=False))
        found = scan_folder.open_folder(out)
        other = replaced(lit, ("sensor",), dim.sensor)
        notes = reconstruct_folder(found, other, ROOT, out / "again", clock, report=False)["notes"]
        named = [note for note in notes if "another measurement (other: sensor.exposure_time)" in note]
        assert len(named) == told
        same = reconstruct_folder(found, lit, ROOT, out / "same", clock, report=False)["notes"]
        assert not any("another measurement" in note for note in same)


@pytest.mark.parametrize("scale", ["x", 0, -1.0, None, [1]])
def test_an_image_scale_that_is_none_is_refused(scale: object, plane: Project, tmp_path: Path) -> None:
    found = scan_folder.ScanFolder(tmp_path, plane, ROOT, (), {}, {"image_scale": scale})
    clock = Clock(lambda stage, done: None, lambda: False)
    with pytest.raises(InputError, match=r"scan\.json: image_scale"):
        reconstruct_folder(found, plane, ROOT, tmp_path, clock, report=False)


def test_what_saturates_is_counted_in_the_images_of_all_frames_and_told_once(plane: Project, tmp_path: Path) -> None:
    """Of one scan 14 % of the scan lines were told, as was expected of its light, and 15.8 % of the peaks below it."""
    motion = LinearStage(moves="objects", step=(0.0, 0.0, 0.02), steps=2)
    rough = plane.sensor.model_copy(update={"speckle": "polarised", "exposure_time": 3.0 * plane.sensor.exposure_time})
    lit = replaced(replaced(plane, ("scene", "motion"), motion), ("sensor",), rough)
    done = run_scan(lit, ROOT, out=tmp_path, options=ScanOptions(report=False))
    clock, full, seen = Clock(lambda stage, done: None, lambda: False), 0, 0
    for path in scan_folder.open_folder(tmp_path).frames:
        frame = read_frame(path)
        (image,) = develop_step(lit, frame, clock, None)
        hit = np.unique(frame.curves[0].index)
        full += np.count_nonzero(image.pixels[hit].max(axis=1) >= image.saturation)
        seen += len(hit)
    assert 0.05 < full / seen < 0.6
    said = [text for text in (*done.manifest["notes"], *done.manifest["remarks"]) if "saturat" in text.lower()]
    assert said[0].startswith(f"laser: on {full / seen:.0%} of the scan lines the brightest pixel saturates")
    assert [text for text in said if "%" in text] == said[:1], "no other share stands beside it"
