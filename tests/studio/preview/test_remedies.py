"""What is proposed for a read-out brings it back, by what it says; where nothing is wrong nothing is proposed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from studio.preview.preview import Preview
from studio.preview.readouts import Readouts, readouts
from studio.preview.remedies import FILLED, Remedy, remedies
from studio.project.document import replaced, value_at
from studio.project.project import Project

ROOT = Path(__file__).parents[3] / "assets/projects/plane"
LASER = ("scene", "rig", "lasers", 0)
LENS = ("scene", "rig", "camera", "lens")
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
    assert "mrad" in remedy.label and remedy.gain.endswith("µm")


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


def test_a_lens_out_of_focus_is_focused_before_it_is_stopped_down() -> None:
    _, found = found_for({(*LENS, "focus_distance"): 0.2})
    remedy = next(one for one in found if one.key == "blur")
    assert remedy.label.startswith("focus 200 →")
    assert value_at(remedy.project, (*LENS, "f_number")) == value_at(found_for({})[0], (*LENS, "f_number"))


def test_a_proposal_puts_no_other_read_out_out_of_range() -> None:
    """Of a sheet a hundredth as wide and a wide open lens everything may be wrong at once."""
    project, found = found_for({(*LASER, "sheet", "full_angle"): 1e-4, (*LENS, "f_number"): 0.5})
    assert len({one.key for one in found}) == len(found) > 0
    for remedy in found:
        before, after = read(project), read(remedy.project)
        assert after.scan_lines_hit == before.scan_lines_hit
