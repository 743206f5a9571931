"""Sentences follow from the fields of plan and quality, and each says what its field says."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import get_args

import pytest

from analysis.report.light_text import plan_lines, quality_lines, quality_text, sentences, stage_note
from render.plan import GroupQuality, Plan, Reason, ThinLens, TransportStep, line_noise
from render.products import expected_plan
from render.scene.lights import Environment
from render.scene.settings import RenderSettings
from tests.render.scenes import paper_camera, paper_laser, scene_of

SKY = Environment(radiance=(0.1, 0.1, 0.1))
DIRECT = GroupQuality("direct", "red", 0.0021, 0.003, 1e5, "samples", lit_pixels=100)
INDIRECT = GroupQuality("indirect", "red", 0.081, 0.1, 2e6, "light paths", 8e6, share=0.125)
AMBIENT = GroupQuality("ambient", None, math.nan, 0.01, 1.0, "samples a pixel", 1.0)


def step(reason, computed, share=None, error=None, name="caustic", group="indirect"):
    return TransportStep(group, name, computed, reason, share, error)


@pytest.mark.parametrize(
    ("one", "said"),
    [
        (step("pilot", True, 0.05, 0.01), "caustic: laser light through clear glass or off mirrors, connected"),
        (step("pilot", True, 0.05, 0.01), "a pilot puts it at 5.00% +- 1.00% of the direct light in the image"),
        (step("pilot", True, math.inf, 0.0), "there is no direct light in the image to compare it with"),
        (step("requested", True, 0.05, 0.01), "requested; a pilot puts it at 5.00%"),
        (step("negligible", False, 0.01, 0.001), "left out: laser light through clear glass"),
        (step("negligible", False, 0.01, 0.001), "(caustic) - a pilot puts it at 1.00% +- 0.10%"),
        (step("negligible", False, 0.01, 0.001), "below the negligible 2.00%"),
        (step("not requested", False, 0.01, 0.001), "in the image, not requested"),
        (step("switched off", False, name="indirect"), "switched off, its share was not measured"),
        (step("pilot", None, name="indirect"), "a pilot decides kind by kind, and leaves out what is below 2.00%"),
        (step("absent", False, name="ambient", group="ambient"), "ambient: none"),
        (step("pilot", True, 0.2, 0.0, "interreflection", "ambient"), "20.00% +- 0.00% of what one surface reflects"),
        (step("pilot", True, math.inf, 0.0, "interreflection", "ambient"), "nothing that is seen is lit otherwise"),
        (step("unreachable", False, name="lamps", group="ambient"), "no path from the camera meets a point"),
        (step("pinhole", False, name="defocus", group="lens"), "left out: the lens's blur (defocus, diffraction)"),
        (step("sensor", False, name="diffraction", group="lens"), "the sensor's lens blur stands for it"),
        (step("switched off", False, name="pixels", group="truth"), "left out: truth at every pixel"),
    ],
)
def test_a_step_is_said_with_its_reason_and_its_share(one, said):
    (line,) = plan_lines(Plan((one,), negligible=0.02))
    assert said in line and "None" not in line and "inf" not in line
    done, left_out = sentences(Plan((one,), negligible=0.02))
    assert len(done) == (not line.startswith("left out: ")) and [*done, *left_out] == [line.removeprefix("left out: ")]


def test_ambient_light_for_the_line_is_not_said_to_be_as_well_known_as_an_image():
    """A report said that it went to 1.0 %, beside an error of 5.84 % at 0.119 samples a pixel."""
    light = (step("always", True, name="ambient", group="ambient"),)
    plan = Plan(light, ambient_error=0.01, ambient_samples=4, image_size=(612, 512))
    assert plan_lines(plan)[0].endswith("on 612 x 512 pixels, to 1.0% or 4 samples a pixel")
    told = plan_lines(replace(plan, goal=0.1))[-1]
    assert "about the line as well as the goal needs" in told and "1.0%" not in told
    assert plan_lines(replace(plan, goal=0.1, ambient_samples=3))[-1].endswith("to 1.0% or 3 samples a pixel")


def test_what_comes_with_another_step_names_that_one():
    steps = step("implied", True, 0.01, 0.0), step("pilot", True, 0.1, 0.0, "specular-chain")
    assert "comes with specular-chain" in plan_lines(Plan(steps))[0]


def test_what_nothing_in_the_scene_makes_is_not_worth_a_sentence():
    assert plan_lines(Plan((step("absent", False, 0.0, 0.0),))) == []


def test_a_clamp_is_said_once_and_only_of_light_that_is_computed():
    steps = step("pilot", True, 0.1, 0.0, "interreflection"), step("pilot", True, 0.1, 0.0)
    lines = plan_lines(Plan(steps, laser_clamp=0.5))
    assert sum("puts more than 0.5 W/(m^2 sr) into a pixel - biased" in line for line in lines) == 1
    assert not any(
        "clamp" in line for line in plan_lines(Plan((step("negligible", False, 0.0, 0.1),), laser_clamp=0.5))
    )


def test_a_thin_lens_and_the_pilots_of_a_scan_are_said_with_their_numbers():
    lens = ThinLens(2.8, 0.8, 0.00422, math.radians(3), 0.52)
    plan = Plan((step("always", True, name="defocus", group="lens"),), lens=lens, pilot_steps=(0, 4), frame_count=5)
    first, last = plan_lines(plan)
    assert "f/2.8 focused at 0.8 m, 4.22 mm of aperture sampled, plane of focus tilted by 3 deg" in first
    assert "in 52% of the image no depth is in focus" in first
    assert last == "the same for all frames: pilots on steps 1, 5 of 5, of which the largest share counts"
    assert "far away" in plan_lines(replace(plan, lens=replace(lens, focus_distance=None)))[0]


@pytest.mark.parametrize("transport", ["auto", "direct", "interreflection", "caustic", "specular-chain", "subsurface"])
@pytest.mark.parametrize("sky", [SKY, Environment()])
def test_every_plan_before_a_render_is_said_without_a_gap(transport, sky):
    scene = scene_of(paper_camera(0.05), paper_laser(), environment=sky)
    plan = expected_plan(scene, RenderSettings(transport=transport))
    assert {one.reason for one in plan.steps} <= set(get_args(Reason))
    lines = plan_lines(plan)
    assert len(lines) >= 4 and not any("None" in line or "nan" in line for line in lines)
    assert any(line.startswith("left out: ") for line in lines)


def test_the_sentences_of_an_older_frame_stay_as_they_are():
    assert plan_lines(Plan(text=("direct: so it was", "left out: that"))) == ["direct: so it was", "left out: that"]


def test_quality_says_error_work_and_losses():
    assert quality_text(DIRECT) == "error 0.21%, target 0.30%"
    assert quality_text(INDIRECT) == "error 8.1%, target 10.0%, 2 million light paths, 12.50% of the direct light"
    assert quality_text(AMBIENT) == "1 of 1 samples"
    lossy = replace(DIRECT, invalid=3.0, clamped=4.0)
    assert quality_text(lossy).endswith("clamped 4 times (biased), 3 contributions were no number, and were left out")
    names = [name for name, _ in quality_lines((DIRECT, INDIRECT, AMBIENT))]
    assert names == ["red, direct", "red, reflected on", "ambient"]
    assert stage_note("reflected laser light", (DIRECT, INDIRECT)) == quality_text(INDIRECT)
    assert stage_note("truth images", (DIRECT, INDIRECT)) == ""


def test_light_for_what_is_measured_tells_scan_lines_and_what_is_interpolated():
    measured = replace(AMBIENT, of="line", error=0.083, target=0.1, work=0.21, most=16, coarse_error=0.041)
    told = "noise moves the line by 0.083 sigma, goal 0.1, elsewhere interpolated to 4.1%"
    assert quality_text(measured) == f"{told}, 0.2 of 16 samples"
    assert quality_text(replace(measured, error=math.nan)).startswith("line not known, goal 0.1, elsewhere")


def test_rows_that_are_not_known_to_the_goal_are_told() -> None:
    direct = replace(DIRECT, of="line", error=0.02, target=0.03, lines=900, unknown=0)
    reflected = replace(INDIRECT, of="line", error=0.05, target=0.07, lines=900, unknown=31)
    told = dict(quality_lines((replace(direct, undecided=7), reflected)))
    assert "31 of 900 rows by more" in told["red, reflected on"] and "rows by more" not in told["red, direct"]
    assert told["red, noise of all light"].endswith("7 rows hang on less than that, and may come out another way")
    assert "hang" not in str(quality_lines((direct, reflected)))


def test_what_all_light_does_to_the_line_is_told_by_the_root_of_the_sum_of_squares() -> None:
    lines = [replace(one, of="line", error=error) for one, error in ((DIRECT, 0.03), (INDIRECT, 0.04), (AMBIENT, 0.12))]
    assert line_noise(tuple(lines)) == {"red": pytest.approx(0.13)}
    assert quality_lines(tuple(lines))[-1] == ("red, noise of all light", "moves 95% of the rows by at most 0.13 sigma")
    # of light whose goal was given up for that of its image nobody knows
    assert "not known" in quality_lines((*lines[:2], AMBIENT))[-1][1]
    assert line_noise((DIRECT, INDIRECT, AMBIENT)) == {}


def test_an_image_of_which_nothing_is_known_is_given_no_figure():
    one = GroupQuality("indirect", "red", 0.08, 0.1, 2e6, "light paths", of="line", image_target=0.1)
    assert "image error 42% (not needed; 10% would end it too)" in quality_text(replace(one, image_error=0.42))
    assert "image error over 100% (not needed" in quality_text(replace(one, image_error=8.99))


def test_light_that_was_spread_is_told_with_its_share() -> None:
    one = GroupQuality("indirect", "red", 0.01, 0.07, 4e3, "light paths", of="line", share=0.0182)
    assert quality_text(one).endswith("1.82% of the direct light")
    assert quality_text(replace(one, spread=0.0)) == quality_text(one)
    assert (
        quality_text(replace(one, spread=0.15))
        == f"{quality_text(one)}, 15% of it spread, as one path alone made a peak"
    )
