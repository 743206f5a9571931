"""What rendering may add to the depth: foretold before a scan, and what the points tell after it."""

from __future__ import annotations

import json
import math

import pytest

from render.scene.settings import DepthGoal
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.scan.depth_noise import foreseen_noise
from studio.scan.options import Listener
from studio.scan.stages import scaled
from tests.studio.small_scan import scan

SCALE = 0.1
GOAL = DepthGoal(depth=0.1)


def project_of(template: str, goal: DepthGoal | None = GOAL) -> Project:
    found = scaled(Project.load(template_folder(template) / "project.json"), SCALE)
    render = found.render.model_copy(update={"goal": goal, "transport": "direct"})
    return found.model_copy(update={"render": render})


def test_what_is_foretold_is_what_the_points_tell(tmp_path) -> None:
    """Of the same share two ways: photons and read noise in closed form, and the sigma that line extraction tells.

    Of a line that its pixels resolve; that of a narrower one is larger than the Cramer-Rao bound.
    """
    heard, folder = [], template_folder("step_block")
    sheet = project_of("step_block").scene.lasers[0].sheet
    project = project_of("step_block").replaced({"scene.rig.lasers[0].sheet.full_angle": 8.0 * sheet.full_angle})
    done = scan(
        folder / "project.json",
        tmp_path / "out",
        Listener(foreseen=lambda noise: heard.append(noise)),
        project=project,
        source=None,
        at_scale=True,
        image_scale=SCALE,
    )
    found = json.loads((tmp_path / "out" / "scan.json").read_text())["depth_noise"]
    assert found == done.manifest["depth_noise"]
    assert [one["group"] for one in found] == [one.group for one in heard[0]] == ["direct", "ambient"]
    groups = {one["group"]: one for one in done.manifest["light"][0]["groups"]}
    for one, before in zip(found, heard[0], strict=True):
        assert one["allowed"] == pytest.approx(before.allowed) == pytest.approx(groups[one["group"]]["target"])
        assert one["reached"] == groups[one["group"]]["error"] and one["seconds"] > 0.0
        foretold, told = before.foreseen_m / before.allowed, one["reached_m"] / one["reached"]
        assert foretold == pytest.approx(told, rel=0.2)


def test_the_lights_share_the_goal_by_their_variances() -> None:
    project = project_of("v_groove")
    for transport, groups in (("direct", 2), ("auto", 3)):
        render = project.render.model_copy(update={"transport": transport})
        found = foreseen_noise(project.model_copy(update={"render": render}), template_folder("v_groove"))
        assert len(found) == groups
        assert math.hypot(*(one.allowed for one in found)) == pytest.approx(0.1)


def test_where_the_image_is_the_goal_nothing_is_foretold() -> None:
    assert foreseen_noise(project_of("v_groove", None), template_folder("v_groove")) == ()
