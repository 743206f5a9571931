"""What is proposed for a read-out brings it back, by what it says; where nothing is wrong nothing is proposed."""

from __future__ import annotations

import math
import re
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from render.base.arrays import Float
from render.laser.laser import Waist
from studio.editing.presets import CAMERA, preset_named, with_preset
from studio.preview.preview import Look, Preview
from studio.preview.readout_rows import rows
from studio.preview.readouts import Readouts, readouts
from studio.preview.remedies import RANK, Remedy, remedies
from studio.preview.remedy_changes import FILLED, lit_point
from studio.project.document import replaced, value_at
from studio.project.project import Project
from studio.project.templates import template_folder

ROOT = Path(__file__).parents[3] / "assets/projects/plane"
LASER = ("scene", "rig", "lasers", 0)
LENS = ("scene", "rig", "camera", "lens")
SPOILT = 0.65
"""m, a focus that blurs a warning's worth."""
AMBIENT = ("scene", "environment", "radiance")
PREVIEW = Preview(1)


def found_for(changes: dict[tuple[Any, ...], Any]) -> tuple[Project, tuple[Remedy, ...]]:
    project = Project.load(ROOT / "project.json")
    for path, value in changes.items():
        project = replaced(project, path, value)
    look = PREVIEW.look(project, ROOT)
    return project, remedies(look, 0, lambda changed: PREVIEW.look(changed, ROOT))


def read(project: Project) -> Readouts:
    return readouts(PREVIEW.look(project, ROOT), 0)


def test_where_nothing_is_out_of_range_nothing_is_proposed() -> None:
    assert found_for({})[1] == ()


@pytest.mark.parametrize(("time", "key"), [(0.5, "saturated"), (1e-6, "peak")])
def test_the_exposure_is_set_to_fill_a_share_of_the_full_well(time: float, key: str) -> None:
    _, (remedy,) = found_for({("sensor", "exposure_time"): time})
    peak = read(remedy.project).peak_electrons
    assert remedy.key == key and peak is not None
    # an exposure has three digits
    assert peak.high == pytest.approx(FILLED * remedy.project.sensor.full_well, rel=5e-3)


def test_a_line_that_is_too_dim_is_exposed_longer_or_lit_by_more_power() -> None:
    """On the light beneath it no exposure makes a line of a hundredth of a milliwatt one that is found."""
    for power, field in ((1e-4, "exposure"), (1e-5, "power")):
        _, (remedy,) = found_for({(*LASER, "power"): power})
        after = read(remedy.project)
        assert remedy.key == "peak" and remedy.label.startswith(f"{field} ")
        assert after.detected is not None and after.detected > 1.0


def test_an_exposure_leaves_room_for_speckle() -> None:
    project, (remedy,) = found_for({("sensor", "exposure_time"): 0.5, ("sensor", "speckle"): "polarised"})
    smooth = found_for({("sensor", "exposure_time"): 0.5})[1][0].project.sensor.exposure_time
    assert remedy.project.sensor.exposure_time < 0.7 * smooth
    kept = read(replaced(project, ("sensor", "exposure_time"), smooth)).saturated
    found = read(remedy.project).saturated
    assert kept is not None and found is not None
    assert found < 0.005 < 0.02 < kept, "what is right without speckle is too long with it"


@pytest.mark.parametrize(("angle", "width"), [(2e-2, 3.0), (1e-4, 1.0)])
def test_a_sheet_is_brought_to_a_width_that_measures_well(angle: float, width: float) -> None:
    _, found = found_for({(*LASER, "sheet", "full_angle"): angle})
    remedy = next(one for one in found if one.key == "width")
    seen = read(remedy.project).width_px
    assert seen is not None and seen.middle == pytest.approx(width, rel=0.01)
    assert "mrad" in remedy.label and remedy.gain.startswith("line width, sigma from ")


def test_a_laser_beside_the_camera_is_turned_away_about_the_line() -> None:
    project, found = found_for(
        {(*LASER, "T_rig_laser"): {"translation": (0.02, 0.0, 0.0), "rotation": (0.0, 0.0, 0.0)}}
    )
    remedy = next(one for one in found if one.key == "angle")
    before, after = read(project), read(remedy.project)
    assert before.triangulation_angle is not None and after.triangulation_angle is not None
    assert before.distance is not None and after.distance is not None
    assert 28.0 < after.triangulation_angle.middle * 57.29578 < 32.0
    assert after.distance.middle == pytest.approx(before.distance.middle, rel=0.01)


@pytest.mark.parametrize("name", ["weld_seam", "sphere", "step_block", "glass_ball"])
def test_the_line_stays_on_the_part_where_the_laser_is_turned_about_it(name: str) -> None:
    """About the middle of all that is lit, which is the plate or the table, it left a weld by 114 px."""
    root = template_folder(name)
    beside = {"translation": (0.02, 0.0, 0.0), "rotation": (0.0, 0.0, 0.0)}
    project = replaced(Project.load(root / "project.json"), (*LASER, "T_rig_laser"), beside)
    look = PREVIEW.look(project, root)
    remedy = next(one for one in remedies(look, 0, partial(PREVIEW.look, root=root)) if one.key == "angle")
    turned = PREVIEW.look(remedy.project, root)
    camera = project.scene.camera.T_rig_camera.matrix
    middle = camera[:3, :3].T @ (lit_point(look, 0) - camera[:3, 3])
    assert off(look, middle) < 1e-3, "it is a point of the line"
    assert off(turned, middle) < 1e-3
    angle = readouts(turned, 0).triangulation_angle
    told = re.search(r"→ ([\d.]+) deg", remedy.label)
    assert angle is not None and told is not None
    assert math.degrees(angle.middle) == pytest.approx(float(told[1]), abs=0.06), "what is told is what is read"


def off(look: Look, point: Float) -> float:
    """m from the lit line, whose points stand at the scan lines."""
    return float(np.linalg.norm(look.lit(0).curve.point - point, axis=1).min())


def test_a_lens_is_focused_as_by_its_ring() -> None:
    """Its image distance was kept, so that one of 16 mm became one of 15.79 mm."""
    project, found = found_for({(*LENS, "focus_distance"): 0.2})
    remedy = next(one for one in found if one.key == "blur")
    before, after = project.scene.camera, remedy.project.scene.camera
    assert after.focal_length == pytest.approx(before.focal_length, rel=1e-12)
    assert after.fx < before.fx and after.fy / after.fx == pytest.approx(before.fy / before.fx)
    assert remedy.label.endswith("focal length kept")


def test_a_lens_out_of_focus_is_focused_before_it_is_stopped_down() -> None:
    _, found = found_for({(*LENS, "focus_distance"): 0.2})
    remedy = next(one for one in found if one.key == "blur")
    assert remedy.label.startswith("focus 200 →")
    assert value_at(remedy.project, (*LENS, "f_number")) == value_at(found_for({})[0], (*LENS, "f_number"))


NAMES = {
    "sensor.exposure_time": "exposure ",
    "scene.rig.camera.lens.focus_distance": "focus ",
    "scene.rig.camera.fx": "focal length kept",
    "scene.rig.camera.fy": "focal length kept",
    "scene.rig.camera.lens.f_number": "f/",
    "scene.rig.lasers.0.power": "power ",
    "scene.rig.lasers.0.sheet.full_angle": "the sheet's divergence ",
    "scene.rig.lasers.0.sheet.focus_distance": "the laser's focus ",
    "scene.rig.lasers.0.sheet.radius": "the laser's waist ",
    "sensor.band_pass": "a band-pass filter ",
    "scene.rig.lasers.0.T_rig_laser": ("move the laser", "aim the laser"),
}
"""What each field that a proposal may change is called in its text."""
WRONG: tuple[tuple[str, dict[tuple[Any, ...], Any]], ...] = (
    ("weld_seam", {}),
    ("weld_seam", {(*LENS, "f_number"): 5.6}),
    ("weld_seam", {(*LENS, "f_number"): 5.6, (*LENS, "focus_distance"): 0.7747}),
    ("weld_seam", {(*LENS, "f_number"): 2.0}),
    ("plane", {("sensor", "exposure_time"): 0.5}),
    ("plane", {("sensor", "exposure_time"): 1e-6}),
    ("plane", {(*LASER, "power"): 1e-6}),
    ("plane", {(*LASER, "sheet", "full_angle"): 2e-2}),
    ("plane", {(*LASER, "sheet"): Waist(radius=1e-6, focus_distance=0.3)}),
    ("plane", {(*LASER, "T_rig_laser"): {"translation": (0.02, 0.0, 0.0), "rotation": (0.0, 0.0, 0.0)}}),
    ("plane", {(*LASER, "T_rig_laser"): {"translation": (0.2, 0.0, 0.0), "rotation": (0.0, 0.9, 0.0)}}),
    ("plane", {(*LENS, "focus_distance"): 0.2}),
    ("plane", {(*LENS, "focus_distance"): None}),
    ("plane", {(*LASER, "sheet"): Waist(radius=1e-2, focus_distance=0.8)}),
    ("plane", {AMBIENT: (100.0, 100.0, 100.0)}),
    ("glass_ball", {(*LASER, "T_rig_laser"): {"translation": (0.02, 0.0, 0.0), "rotation": (0.0, 0.0, 0.0)}}),
    ("v_groove", {(*LENS, "f_number"): 1.4}),
    ("sphere", {(*LENS, "f_number"): 1.4, (*LENS, "focus_distance"): 0.8161}),
    *((name, {}) for name in sorted(path.name for path in ROOT.parent.iterdir() if (path / "project.json").is_file())),
)  # fmt: skip


@pytest.fixture(scope="module")
def proposed() -> list[tuple[Project, Remedy]]:
    """What is proposed for every kind of wrong, beside the project as it was."""
    found = []
    for name, changes in WRONG:
        root = template_folder(name)
        project = Project.load(root / "project.json")
        for path, value in changes.items():
            project = replaced(project, path, value)
        look = PREVIEW.look(project, root)
        found += [(project, one) for one in remedies(look, 0, partial(PREVIEW.look, root=root))]
    return found


def test_every_field_that_a_proposal_changes_is_named_in_its_text(proposed: list[tuple[Project, Remedy]]) -> None:
    """Of a smaller aperture the focus moved as well, without a word."""
    seen: set[str] = set()
    for project, remedy in proposed:
        before, after = (fields(one.model_dump(mode="json")) for one in (project, remedy.project))
        changed = {path for path in before | after if before.get(path) != after.get(path)}
        words = remedy.label.split(", ")
        named = {path for path, name in NAMES.items() if any(word.startswith(name) for word in words)}
        assert changed == named, remedy.label
        seen |= changed
    assert seen == set(NAMES), "every kind is among them"


def fields(value: Any, path: str = "") -> dict[str, Any]:
    """Leaves of a project's JSON by their paths; a pose is one, and a filter."""
    if path.endswith(("T_rig_laser", "band_pass")) or not isinstance(value, dict | list):
        return {path: value}
    items = value.items() if isinstance(value, dict) else enumerate(value)
    return {key: leaf for name, one in items for key, leaf in fields(one, f"{path}.{name}".lstrip(".")).items()}


def test_a_gain_reads_from_what_it_is_to_what_it_will_be(proposed: list[tuple[Project, Remedy]]) -> None:
    """The old value, beside an arrow that was cut off, read as the result."""
    for _, remedy in proposed:
        assert re.search(r" from \S.* to \S", remedy.gain) and "→" not in remedy.gain
    _, (remedy,) = found_for({("sensor", "exposure_time"): 0.5})
    assert remedy.gain == "saturated from 100% to 0% of the scan lines", "of what saturates no noise is known"
    _, found = found_for({(*LENS, "focus_distance"): 0.2})
    assert re.match(r"defocus blur from \d+\.\d to \d+\.\d px", found[0].gain)


def test_what_is_told_as_a_gain_is_better_and_what_is_worse_is_the_price(
    proposed: list[tuple[Project, Remedy]],
) -> None:
    """A smaller aperture told of more noise by speckle as if it gained by that."""
    priced = [remedy.price for _, remedy in proposed if remedy.price]
    assert any(re.fullmatch(r"depth noise with speckle from 245 to 311 µm", price) for price in priced)
    for _, remedy in proposed:
        gains = [part for part in remedy.gain.split(", ")[1:] if not part.startswith("sigma from")]
        for better, parts in ((True, gains), (False, remedy.price.split(", ") if remedy.price else [])):
            for part in parts:
                told = re.search(r" from ([\d.]+)\S*(?: \S+)? to ([\d.]+)", part.replace("\u202f", ""))
                assert told is not None, part
                was, will = map(float, told.groups())
                assert will != was and (will < was) == better, f"{remedy.label}: {part}"


def test_no_proposal_leaves_the_line_saturated_by_its_own_exposure() -> None:
    """f/1.4 -> f/4 went with an exposure eight times as long, of a line at 14 times the full well."""
    root = template_folder("sphere")
    for speckled in ("off", "polarised"):
        project = Project.load(root / "project.json")
        for path, value in (
            ((*LENS, "f_number"), 1.4),
            ((*LENS, "focus_distance"), 0.8161),
            (("sensor", "speckle"), speckled),
        ):
            project = replaced(project, path, value)
        found = remedies(PREVIEW.look(project, root), 0, partial(PREVIEW.look, root=root))
        assert {"saturated", "blur"} <= {one.key for one in found}
        for one in found:
            if one.project.sensor.exposure_time != project.sensor.exposure_time:
                after = readouts(PREVIEW.look(one.project, root), 0)
                assert after.saturated is not None and after.saturated < 0.01, one.label


def test_a_proposal_puts_no_other_read_out_out_of_range() -> None:
    """Of a sheet a hundredth as wide and a wide open lens everything may be wrong at once."""
    project, found = found_for({(*LASER, "sheet", "full_angle"): 1e-4, (*LENS, "f_number"): 0.5})
    assert len({one.key for one in found}) == len(found) > 0
    for remedy in found:
        before, after = read(project), read(remedy.project)
        kept = remedy.project.scene.camera.fx / project.scene.camera.fx
        assert after.scan_lines_hit == pytest.approx(before.scan_lines_hit * min(kept, 1.0), abs=4), "by its view alone"
        levels = {row.key: RANK[row.level] for row in rows(before)}
        assert all(RANK[row.level] <= levels[row.key] for row in rows(after)), remedy.label


LEFT_RED: tuple[tuple[str, str, dict[tuple[Any, ...], Any]], ...] = (
    ("blur", "weld_seam", {(*LENS, "f_number"): 1.4, (*LENS, "focus_distance"): None}),
    ("width", "plane", {(*LASER, "sheet"): Waist(radius=1e-5, focus_distance=0.5)}),
    ("width", "plane", {(*LASER, "sheet"): Waist(radius=1e-2, focus_distance=0.8)}),
    ("peak", "weld_seam", {(*LASER, "power"): 1e-5}),
    ("working", "weld_seam", {(*LASER, "T_rig_laser"): {"translation": (0.2, 0.0, 0.0), "rotation": (0.0, 0.9, 0.0)}}),
    ("saturated", "plane", {AMBIENT: (100.0, 100.0, 100.0)}),
    ("angle", "glass_ball", {(*LASER, "T_rig_laser"): {"translation": (0.02, 0.0, 0.0), "rotation": (0.0, 0.0, 0.0)}}),
)
"""Out of range, and left without a proposal: none brought it into its range with all others where they were."""


@pytest.mark.parametrize(("key", "name", "wrong"), LEFT_RED, ids=[f"{key} {name}" for key, name, _ in LEFT_RED])
def test_what_is_red_is_made_better_click_by_click(key: str, name: str, wrong: dict[tuple[Any, ...], Any]) -> None:
    root = template_folder(name)
    project = Project.load(root / "project.json")
    if name != "glass_ball":
        project = with_preset(project, CAMERA, preset_named("cameras", "12 megapixels", ""))
    for path, value in wrong.items():
        project = replaced(project, path, value)
    levels, was = [], ""
    for _ in range(5):
        look = PREVIEW.look(project, root)
        row = next(one for one in rows(readouts(look, 0)) if one.key == key)
        assert not was or row.value == was, "what was told is what is read"
        levels.append(row.level)
        found = [one for one in remedies(look, 0, partial(PREVIEW.look, root=root)) if one.key == key]
        if not found:
            break
        project, was = found[0].project, str(found[0].gain.split(", ")[0]).partition(" to ")[2]
        was = was.removesuffix(" of the scan lines")
    assert levels[0] == "error"
    assert levels[-1] != "error", levels


def test_a_lens_that_is_far_out_of_focus_is_focused_before_anything_else() -> None:
    """Focus alone leaves it red, and no smaller aperture is needed to see most of the blur go."""
    root = template_folder("weld_seam")
    project = with_preset(Project.load(root / "project.json"), CAMERA, preset_named("cameras", "12 megapixels", ""))
    project = replaced(project, (*LENS, "f_number"), 2.8)
    found = remedies(PREVIEW.look(project, root), 0, partial(PREVIEW.look, root=root))
    remedy = next(one for one in found if one.key == "blur")
    assert remedy.label == "focus far away → 790.6 mm, focal length kept"
    assert re.match(r"defocus blur from 89\.1 to 7\.5 px", remedy.gain), "and it is red yet"


def test_what_is_put_out_of_range_is_in_the_price() -> None:
    """Every change is read with a lens that is somewhat out of focus, so that there is none without a price."""
    project = replaced(
        Project.load(ROOT / "project.json"),
        (*LASER, "T_rig_laser"),
        {"translation": (0.02, 0.0, 0.0), "rotation": (0.0, 0.0, 0.0)},
    )

    def spoilt(changed: Project) -> Look:
        return PREVIEW.look(replaced(changed, (*LENS, "focus_distance"), SPOILT), ROOT)

    look = PREVIEW.look(project, ROOT)
    remedy = next(one for one in remedies(look, 0, spoilt) if one.key == "angle")
    before, after = ({row.key: row for row in rows(readouts(one, 0))} for one in (look, spoilt(remedy.project)))
    spoiled = [row for row in after.values() if row.level and not before[row.key].level]
    assert [row.level for row in spoiled] == ["warning"], "an error is never traded for another"
    was = before[spoiled[0].key].value.removesuffix(" px")
    assert f"{spoiled[0].label.lower()} from {was} to {spoiled[0].value}" in remedy.price
