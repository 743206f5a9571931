"""Advice takes what depth does not need, proves it on seeds of its own, and gives nothing that it could not prove."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result

import main
from analysis.study.intervals import Interval
from render.base.errors import InputError
from studio.commands.advise import _sentence
from studio.project.project import Project
from studio.study import advice
from studio.study.advice import MOST_PROOFS, SCREENED, Question, advise, parts_of
from studio.study.cells import next_cells
from studio.study.measures import MEASURES
from studio.study.store import Store
from studio.study.study import Study
from tests.studio.small_scan import small_project

PLANE = Project.load("plane")
Sigma = Callable[[Project], float]
"""Of a project's depth, over the original's."""


def call(*arguments: object) -> Result:
    return CliRunner().invoke(main.cli, [str(argument) for argument in arguments])


@pytest.fixture
def as_if(monkeypatch: pytest.MonkeyPatch) -> Callable[[Sigma], list[int]]:
    """Measures nothing, but says what a rule says of each project, with noise that seeds decide; gives seeds seen."""

    def follow(sigma: Sigma) -> list[int]:
        seen: list[int] = []

        def run_study(study: Study, bases: dict[str, Project], store: Store, **_: Any) -> None:
            for cell in next_cells(study, bases, {}):
                seen.append(cell.project.seed)
                # most of the noise is the sensor's, which all projects share
                common = np.random.default_rng(cell.project.seed).normal(0.0, 0.02)
                own = np.random.default_rng([cell.project.seed, int(cell.key, 16)]).normal(0.0, 0.003)
                row = dict.fromkeys(MEASURES, 1.0)
                spread = 1e-4 * (sigma(cell.project) + common + own)
                row |= {"depth_sigma": spread, "depth_rmse": spread, "depth_bias": 1e-5 * (1.0 + common)}
                render = cell.project.render
                seconds = 1.0 + 2.0 * (render.laser_error < 0.005) + 4.0 * (render.transport != "direct")
                seconds += 8.0 * (render.goal is None)
                store.add([(cell.key, {**row, "reason": ""}, {"seconds_render": seconds, "seconds_develop": 0.0,
                                                              "seconds_extract": 0.0})])  # fmt: skip

        monkeypatch.setattr(advice, "run_study", run_study)
        return seen

    return follow


def test_what_costs_and_changes_nothing_is_left_out_and_proved_on_fresh_seeds(
    as_if: Callable[[Sigma], list[int]], tmp_path: Path
) -> None:
    seen = as_if(lambda project: 1.1 if project.render.laser_error > 0.02 else 1.0)
    found = advise(PLANE, Question(), tmp_path)
    assert found.proved is not None and len(found.proofs) == 1
    cheaper = found.project(PLANE)
    assert cheaper.render.transport == "direct"
    assert cheaper.render.laser_error == pytest.approx(0.009)  # ten times is too much, three times is not
    assert cheaper.replaced({"render": PLANE.render}) == PLANE
    assert found.proved.found.seconds == 1.0 and found.proved.found.seconds_before == 7.0
    first = set(range(PLANE.seed, PLANE.seed + SCREENED))
    assert first.isdisjoint(found.proved.seeds) and set(seen) == first | set(found.proved.seeds)


@pytest.mark.parametrize("harmless", [True, False])
def test_a_goal_comes_first_and_where_it_is_taken_the_rest_is_tried_with_it(
    as_if: Callable[[Sigma], list[int]], tmp_path: Path, harmless: bool
) -> None:
    asked: list[Project] = []

    def sigma(project: Project) -> float:
        asked.append(project)
        return 1.0 if harmless or project.render.goal is None else 1.1

    as_if(sigma)
    whole = PLANE.replaced({"render.goal": None, "render.transport": "subsurface"})
    found = advise(whole, Question(), tmp_path)
    goal, *others = found.tried
    assert goal.part.name == "goal" and goal.taken == harmless
    assert {one.part.change for one in others} >= {"what a pilot finds", "no caustics", "one surface only"}
    assert found.proved is not None
    assert (found.project(whole).render.goal is not None) == harmless
    assert found.proved.found.seconds_before == 15.0
    if harmless:
        assert goal.found.seconds == 7.0 and all(one.found.seconds_before == 7.0 for one in others)
        # what costs most is measured for the choice and for the proof, and beside no part
        assert sum(one.render.goal is None for one in asked) == SCREENED + Question().seeds
    else:
        assert all(one.found.seconds_before == 15.0 for one in others)


def test_parts_that_only_do_harm_together_are_found_by_the_proof_and_one_is_given_up(
    as_if: Callable[[Sigma], list[int]], tmp_path: Path
) -> None:
    def sigma(project: Project) -> float:
        render = project.render
        own = 0.012 * (render.laser_error > 0.005)
        return 1.0 + own + 0.05 * (render.transport == "direct" and render.laser_error > 0.005)

    as_if(sigma)
    found = advise(PLANE, Question(), tmp_path)
    assert [proof.holds for proof in found.proofs] == [False, True]
    assert set(found.proofs[0].seeds).isdisjoint(found.proofs[1].seeds)
    cheaper = found.project(PLANE).render
    assert cheaper.transport == "direct" and cheaper.laser_error == PLANE.render.laser_error


def test_nothing_is_written_that_is_not_proved(as_if: Callable[[Sigma], list[int]], tmp_path: Path) -> None:
    # by itself every part seems harmless; the seeds of the proof tell another story
    as_if(lambda project: 1.0 + 0.2 * (project.seed >= PLANE.seed + SCREENED and project.render != PLANE.render))
    out = tmp_path / "cheaper.json"
    done = call("advise", "assets/projects/plane", "--out", out, "--quiet")
    assert done.exit_code == 0 and not out.exists()
    assert "No cheaper project is known" in done.stdout and f"nothing was written to {out}" in done.stdout
    assert done.stdout.count("not shown to be within 3 %") in range(1, MOST_PROOFS + 1)
    told = json.loads(call("advise", "assets/projects/plane", "--out", out, "--json").stdout)
    assert told["written"] is None and not told["proved"] and not any(proof["holds"] for proof in told["proofs"])


def test_a_proof_is_one_of_every_seed(as_if: Callable[[Sigma], list[int]], tmp_path: Path) -> None:
    def sigma(project: Project) -> float:
        last = project.seed == PLANE.seed + SCREENED + 7
        return float("nan") if last and project.render != PLANE.render else 1.0

    as_if(sigma)
    assert not advise(PLANE, Question(), tmp_path).proofs[0].holds


def test_every_part_makes_a_project_that_is_allowed() -> None:
    for name in ("weld_seam", "glass_ball", "plane"):
        project = Project.load(name)
        for part in parts_of(project):
            assert project.replaced(part.values) != project
    cheapest = PLANE.replaced({"render.transport": "direct", "render.laser_error": 1.0, "render.indirect_error": 1.0,
                               "render.ambient_error": 1.0, "render.ambient_samples": 1, "render.max_bounces": 1,
                               "render.light_paths": 1 << 20, "render.truth_images": False,
                               "render.goal": {"depth": 1.0}})  # fmt: skip
    assert parts_of(cheapest) == []


def test_light_below_surfaces_and_truth_images_are_offered_where_there_are_some() -> None:
    wax = {"kind": "subsurface", "scattering_albedo": 0.99, "mean_free_path": 1e-3}
    project = PLANE.replaced({"scene.objects[0].material": wax})
    parts = {part.name: part for part in parts_of(project)}
    cheaper = project.replaced({**parts["light below surfaces"].values, **parts["per-pixel truth"].values})
    assert cheaper.scene.objects[0].material.kind == "lambertian" and not cheaper.render.truth_images
    assert "light below surfaces" not in {part.name for part in parts_of(PLANE)}


def test_an_interval_that_is_wider_than_what_was_asked_is_told_to_decide_nothing() -> None:
    def change(half: float, mean: float = 0.0) -> advice.Change:
        one = Interval(mean, mean - half, mean + half, 8)
        return advice.Change(one, one, one, seconds=1.0, seconds_before=4.0)

    narrow, moved, wide = change(0.01), change(0.01, 0.05), change(0.05)
    assert narrow.within(0.03) and not narrow.undecided(0.03)
    assert not moved.within(0.03) and not moved.undecided(0.03)
    assert not wide.within(0.03) and wide.undecided(0.03)
    for found, told in ((moved, False), (wide, True)):
        assert ("more --seeds" in _sentence(advice.Proof((), found, (1, 2), False), 0.03)) == told


def test_a_small_project_becomes_cheaper_in_truth_and_takes_its_files_along(tmp_path: Path) -> None:
    file = small_project(tmp_path / "project")
    out = tmp_path / "other" / "cheaper.json"
    done = call("advise", file, "--out", out, "--scale", 0.05, "--seeds", 3, "--within", 50, "--workers", 1, "--json")
    assert done.exit_code == 0, done.output
    told = json.loads(done.stdout)
    assert len(told["parts"]) >= 5 and all(len(part["sigma"]) == 3 for part in told["parts"])
    if told["proved"]:  # seconds decide what pays
        assert Project.load(out).render != Project.load(file).render
        assert (out.parent / "plate.obj").read_bytes() == (file.parent / "plate.obj").read_bytes()
    assert told["proved"] == out.exists()


def test_bad_input_is_told_before_anything_runs(tmp_path: Path) -> None:
    file = small_project(tmp_path / "project")
    for options, words in (
        (("--out", file), "a file that is there"),
        (("--laser", 4), "no such laser"),
        (("--within", "nan"), "finite"),
        (("--seeds", 2), "--seeds"),
    ):
        done = call("advise", file, *options)
        assert done.exit_code == 2 and words in done.stderr and done.stderr.count("error: ") == 1
    dark = PLANE.replaced({"scene.rig.lasers[0].power": 0.0})
    with pytest.raises(InputError, match="measures nothing"):
        advise(dark, Question(image_scale=0.05, engine=advice.Engine(1)), tmp_path / "dark")
