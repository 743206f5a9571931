"""Advice takes what depth does not need, proves it on seeds of its own, and gives nothing that it could not prove."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result

import main
from analysis.study.intervals import Interval
from render.base.errors import InputError
from studio.commands.advise import _sentence
from studio.project.project import Project
from studio.runtime.workers import Engine
from studio.study import advice
from studio.study.advice import MOST_PROOFS, SCREENED, Proof, Question, advise
from studio.study.alike import Change, Run, change
from studio.study.cheaper_parts import AMBIENT, DIRECT, REFLECTED, TRUTH, parts_of
from studio.study.kept import on_the_line
from studio.study.tasks import Task
from tests.studio.small_scan import small_project

PLANE = Project.load("plane")
QUESTION = Question(engine=Engine(1))
ROWS = 100
Sigma = Callable[[Project], float]
"""Of a project's depth, over the original's."""
AsIf = Callable[..., list[Project]]


def call(*arguments: object) -> Result:
    return CliRunner().invoke(main.cli, [str(argument) for argument in arguments])


@pytest.fixture
def as_if(monkeypatch: pytest.MonkeyPatch) -> AsIf:
    """Measures nothing, but says what a rule says of each project, with noise that seeds decide; gives what was asked.

    wrong: rows, of a hundred, whose point is a metre off.
    """

    def follow(sigma: Sigma, wrong: Callable[[Project], int] = lambda project: 0) -> list[Project]:
        seen: list[Project] = []

        def measure_task(task: Task, cancelled: Callable[[], bool] = lambda: False) -> list[Any]:
            (cell,) = task.cells
            project = Project.from_text(cell.project)
            seen.append(project)
            # most of the noise is the sensor's, which all projects share
            common = np.random.default_rng(project.seed).normal(0.0, 1e-4, ROWS)
            own = np.random.default_rng([project.seed, len(seen)]).normal(0.0, 1e-6, ROWS)
            error = sigma(project) * common + own
            off = wrong(project)
            render = project.render
            seconds = 1.0 + 2.0 * (render.laser_error < 0.005) + 4.0 * (render.transport != "direct")
            seconds += 8.0 * (render.goal is None)
            share = {DIRECT: 0.3, REFLECTED: 0.3, AMBIENT: 0.3, TRUTH: 0.01}
            kept = {"crossing": list(range(off, ROWS)), "error": error[off:].tolist(), "stages": share}
            kept |= {"wrong": off / ROWS, "complete": 1.0 - off / ROWS}
            row = {"kept": kept, "reason": ""}
            if not np.isfinite(error).all():
                row = {"reason": "all is dark"}
            return [(cell.key, row, {"seconds_render": seconds, "seconds_develop": 0.0, "seconds_extract": 0.0})]

        monkeypatch.setattr(advice, "measure_task", measure_task)
        monkeypatch.setattr(advice, "warm_up", lambda project: None)
        return seen

    return follow


def test_what_costs_and_changes_nothing_is_left_out_and_proved_on_fresh_seeds(as_if: AsIf) -> None:
    seen = as_if(lambda project: 1.1 if project.render.laser_error > 0.02 else 1.0)
    found = advise(PLANE, QUESTION)
    assert found.proved is not None and len(found.proofs) == 1
    cheaper = found.project(PLANE)
    assert cheaper.render.transport == "direct"
    assert cheaper.render.laser_error == pytest.approx(0.009)  # ten times is too much, three times is not
    assert cheaper.replaced({"render": PLANE.render}) == PLANE
    assert found.proved.found.seconds == 1.0 and found.proved.found.seconds_before == 7.0
    first = set(range(PLANE.seed, PLANE.seed + SCREENED))
    assert first.isdisjoint(found.proved.seeds)
    assert {one.seed for one in seen} == first | set(found.proved.seeds) and len(found.proved.seeds) == 8


def test_parts_that_cannot_pay_are_not_looked_at_and_one_that_does_harm_only_once(as_if: AsIf) -> None:
    seen = as_if(lambda project: 1.1 if project.render.laser_error > 0.005 else 1.0)
    found = advise(PLANE, QUESTION)
    assert "per-pixel truth" in found.untried  # of which a hundredth of the seconds is
    assert all(one.render.truth_images for one in seen)
    assert sum(one.render.laser_error > 0.02 for one in seen) == 1
    # fewer samples saved nothing, so that more of them are not asked
    assert {one.render.ambient_samples for one in seen} == {PLANE.render.ambient_samples, 1}


@pytest.mark.parametrize("harmless", [True, False])
def test_a_goal_comes_first_and_where_it_is_taken_the_rest_is_tried_with_it(as_if: AsIf, harmless: bool) -> None:
    seen = as_if(lambda project: 1.0 if harmless or project.render.goal is None else 1.1)
    whole = PLANE.replaced({"render.goal": None, "render.transport": "subsurface"})
    found = advise(whole, QUESTION)
    goal, transport, *_ = found.tried
    assert goal.part.name == "goal" and goal.taken == harmless
    assert transport.part.change == "one surface only" and transport.taken
    assert found.proved is not None
    assert (found.project(whole).render.goal is not None) == harmless
    assert found.proved.found.seconds_before == 15.0
    if harmless:
        assert goal.found.seconds == 7.0 and transport.found.seconds_before == 7.0
        # what costs most is measured for the choice and for the proof, and beside no part
        assert sum(one.render.goal is None for one in seen) == SCREENED + QUESTION.seeds
    else:
        assert transport.found.seconds_before == 15.0


def test_parts_that_only_do_harm_together_are_found_by_the_proof_and_some_are_given_up(as_if: AsIf) -> None:
    def sigma(project: Project) -> float:
        render = project.render
        finer = render.laser_error < 0.005
        return 1.0 + 0.05 * (render.transport == "direct" and not finer and project.seed >= PLANE.seed + SCREENED)

    seen = as_if(sigma)
    whole = PLANE.replaced({"render.goal": None, "render.transport": "subsurface"})
    found = advise(whole, QUESTION)
    assert [proof.holds for proof in found.proofs] == [False, True]
    first, second = found.proofs
    assert len(first.seeds) == 4 and not first.alike  # half of the seeds refute it
    assert second.seeds[:4] == first.seeds and len(second.seeds) == 8
    # goal and transport are given up last
    cheaper = found.project(whole).render
    assert cheaper.goal is not None and cheaper.transport == "direct"
    assert cheaper.laser_error == PLANE.render.laser_error
    # both are held against the same originals
    assert sum(one.render == whole.render for one in seen) == SCREENED + QUESTION.seeds


def test_wrong_rows_decide_no_sigma_and_are_a_change_of_their_own(as_if: AsIf) -> None:
    as_if(lambda project: 1.0, lambda project: project.seed % 3)  # whichever project: chance
    found = advise(PLANE, QUESTION).proofs[0]
    assert found.holds and abs(found.found.sigma.mean) < 0.005 and found.found.wrong_before > 0.0

    as_if(lambda project: 1.0, lambda project: 8 * (project.render.transport == "direct"))
    tried = {one.part.change: one for one in advise(PLANE, QUESTION).tried}
    direct = tried["one surface only"]
    assert direct.found.wrong.mean == pytest.approx(0.08) and abs(direct.found.sigma.mean) < 0.005
    assert not direct.taken and tried["no caustics"].part.values == {"render.transport": "interreflection"}


@pytest.mark.parametrize("unsure", [19.0, 0.11])  # more than a pixel, and ten times what is usual
def test_a_point_that_says_to_be_anywhere_is_wrong_wherever_it_lies(unsure: float) -> None:
    index = np.array([0, 1, 2, 3, 4, 9])
    sigma = np.array([0.01, 0.02, unsure, 0.01, np.nan, 0.01])
    depth = np.array([1e-5, 2e-5, 1e-5, 0.3, 3e-5, np.nan])  # the last is on a row without a line
    outlier = np.array([False, False, False, True, False, False])
    points: Any = SimpleNamespace(sigma_pixel=sigma, index=index)
    errors: Any = SimpleNamespace(
        depth=depth, outlier=outlier, truth=np.array([0, 1, 2, 3, 4, -1]), truth_rows=8, false_rows=1
    )
    found = on_the_line(points, errors, {DIRECT: 2.0})
    assert found["crossing"] == [0, 1, 4] and found["error"] == [1e-5, 2e-5, 3e-5]
    assert found["wrong"] == 3 / 8 and found["complete"] == 3 / 8


def test_one_seed_tells_how_well_it_knows_a_change() -> None:
    """95 % intervals of one seed hold what no project changes: a second render of the same, with noise of its own."""
    random, held = np.random.default_rng(5), 0
    for _ in range(400):
        common = random.normal(0.0, 1e-4, ROWS)
        runs = [Run(np.arange(ROWS), common + random.normal(0.0, 2e-5, ROWS), 0.0, 1.0, 2.0, {}) for _ in range(2)]
        found = change(runs[:1], runs[1:])
        held += found.bias.low <= 0.0 <= found.bias.high and found.sigma.low <= 0.0 <= found.sigma.high
    # both at once in 0.95**2 of cases, give or take four standard deviations and the jackknife's own 2 %
    assert 0.82 <= held / 400 <= 0.96


def test_a_change_is_of_the_points_that_both_have() -> None:
    error = np.random.default_rng(4).normal(0.0, 1e-4, 60)

    def run(rows: slice, factor: float = 1.0, more: float = 0.0) -> Run:
        return Run(np.arange(60)[rows], factor * error[rows] + more, 0.0, 1.0, 2.0, {})

    # one has the last points, whose errors are of another size, and the other the first
    error[:5], error[-5:] = 1.0, -1.0
    same = change([run(slice(0, 55))] * 3, [run(slice(5, 60))] * 3)
    assert same.bias.mean == 0.0 and same.sigma.mean == 0.0
    inner = error[5:55]
    wider = change([run(slice(0, 55))] * 3, [run(slice(5, 60), 1.02, 1e-6)] * 3)
    assert wider.sigma.mean == pytest.approx(0.02)
    moved = (0.02 * inner.mean() + 1e-6) / np.sqrt(np.mean(inner**2))
    assert wider.bias.mean == pytest.approx(moved)
    assert not np.isfinite(change([run(slice(0, 5))] * 3, [run(slice(4, 60))] * 3).size())  # too few in common


def test_nothing_is_written_that_is_not_proved(as_if: AsIf, tmp_path: Path) -> None:
    # by itself every part seems harmless; the seeds of the proof tell another story
    as_if(lambda project: 1.0 + 0.2 * (project.seed >= PLANE.seed + SCREENED and project.render != PLANE.render))
    out = tmp_path / "cheaper.json"
    done = call("advise", "assets/projects/plane", "--out", out, "--quiet", "--workers", 1)
    assert done.exit_code == 0 and not out.exists()
    assert "No cheaper project is known" in done.stdout and f"nothing was written to {out}" in done.stdout
    assert done.stdout.count("not shown to be within 3 %") in range(1, MOST_PROOFS + 1)
    told = json.loads(call("advise", "assets/projects/plane", "--out", out, "--json", "--workers", 1).stdout)
    assert told["written"] is None and not told["proved"] and not any(proof["holds"] for proof in told["proofs"])


def test_a_proof_is_one_of_every_seed(as_if: AsIf) -> None:
    def sigma(project: Project) -> float:
        last = project.seed == PLANE.seed + SCREENED + 7
        return float("nan") if last and project.render != PLANE.render else 1.0

    as_if(sigma)
    assert not advise(PLANE, QUESTION).proofs[0].holds


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
    def found(half: float, mean: float = 0.0) -> Change:
        one = Interval(mean, mean - half, mean + half, 8)
        return Change(one, one, one, one, 0.0, 0.0, seconds=1.0, seconds_before=4.0)

    narrow, moved, wide = found(0.01), found(0.01, 0.05), found(0.05)
    assert narrow.within(0.03) and not narrow.undecided(0.03)
    assert not moved.within(0.03) and not moved.undecided(0.03) and moved.beyond(0.03)
    assert not wide.within(0.03) and wide.undecided(0.03) and not wide.beyond(0.03)
    for one, told in ((moved, False), (wide, True)):
        assert ("more --seeds" in _sentence(Proof((), one, (1, 2), False), 0.03)) == told


def test_a_small_project_becomes_cheaper_in_truth_and_takes_its_files_along(tmp_path: Path) -> None:
    file = small_project(tmp_path / "project")
    out = tmp_path / "other" / "cheaper.json"
    done = call("advise", file, "--out", out, "--scale", 0.05, "--seeds", 3, "--within", 50, "--workers", 1, "--json")
    assert done.exit_code == 0, done.output
    told = json.loads(done.stdout)
    assert told["parts"] and all(len(part["sigma"]) == 3 for part in told["parts"])
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
        advise(dark, Question(image_scale=0.05, engine=Engine(1)))
