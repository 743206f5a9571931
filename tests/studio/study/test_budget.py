"""An error budget of a small scan: its effects are switched as told, and what they make adds up to the error."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import main
import studio as blazer
from analysis.study.budget import budget
from render.base.errors import InputError
from render.material.material import Lambertian, Subsurface
from studio.notebook.frame import render
from studio.notebook.measuring import develop
from studio.project.project import Project
from studio.runtime.workers import Engine
from studio.study.answers import ErrorBudget, answers
from studio.study.budget_table import sentences_of
from studio.study.effects import EFFECTS, STATES, effects_of, in_state
from studio.study.measuring import as_if
from studio.study.runner import run_study
from studio.study.store import Store, described
from studio.study.study import Study
from tests.studio.small_scan import small_project

DATA: dict[str, Any] = {
    "base": "plane",
    "image_scale": 0.12,
    "repeats": 4,
    "set": {"render.laser_error": 0.02, "render.ambient_samples": 1, "render.goal": None},
    "sweeps": [{"name": "budget", "sampling": "effects"}],
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    where = tmp_path_factory.mktemp("budget")
    study = Study.model_validate(DATA)
    bases = study.bases(where)
    with Store(where, study.digest(bases)) as store:
        store.describe(study, bases)
        run_study(study, bases, store, engine=Engine(workers=1))
    return where


def test_terms_and_their_interaction_make_the_total(folder: Path) -> None:
    study, bases = described(folder)
    with Store(folder, None) as store:
        (answer,) = answers(study, bases, store.rows())
        # effects that the project does not have share the runs of the states that they leave as they are
        assert store.count() < len(STATES) * study.repeats
    (found,) = answer.budgets
    assert {term.effect for term in found.bias.terms} == set(effects_of(bases["plane"]))
    assert found.variance.adds_up and found.bias.adds_up
    shares = {term.effect: term.share for term in found.variance.terms}
    assert shares["shot noise"].low > 0.0
    # the light of a plane goes by way of it alone
    assert shares["interreflection"].mean == pytest.approx(0.0, abs=1e-6 * found.variance.total.mean)


def test_show_writes_the_waterfall_and_the_same_numbers_as_csv_and_json(folder: Path) -> None:
    done = CliRunner().invoke(main.cli, ["study", "show", str(folder), "--json"])
    assert done.exit_code == 0, done.output
    said = " ".join(json.loads(done.stdout)["findings"]["budget"])
    assert "The simulation itself" in said and "Effects that meet" in said
    assert (folder / "chart_1.png").stat().st_size > 10_000
    rows = list(csv.DictReader((folder / "budget_1.csv").open()))
    data = json.loads((folder / "budget_1.json").read_text())["budget"]
    assert [row["effect"] for row in rows] == [row["effect"] for row in data]
    assert all(float(row["share"]) == one["share"] for row, one in zip(rows, data, strict=True))


def test_shot_noise_is_off_where_the_image_stays_as_bright() -> None:
    project = Project.load("plane")
    quiet = in_state(project, "without shot noise")
    frame = render(project.replaced({"render.laser_error": 0.05}), image_scale=0.1)
    images = [develop(frame, sensor=one.sensor, seed=seed).pixels.astype(float) for one in (project, quiet)
              for seed in (1, 2)]  # fmt: skip
    noisy, still = images[0] - images[1], images[2] - images[3]
    bright = images[2] > 500.0
    assert np.mean(images[2][bright]) == pytest.approx(np.mean(images[0][bright]), rel=0.02)
    # what is left of shot noise is a hundredth; read noise and rounding stay, about 1 DN
    assert np.std(still[bright]) < 0.25 * np.std(noisy[bright])


def test_every_effect_is_off_after_it_was_switched_off() -> None:
    project = Project.load("weld_seam").replaced({"sensor.speckle": "polarised", "sensor.blur_sigma": 1e-6})
    assert {"speckle", "texture", "defocus and blur", "facets"} <= set(effects_of(project))
    bare = in_state(project, "none")
    again = {name for name in effects_of(bare) if name not in ("shot noise", "facets", "render noise")}
    assert again == set()
    assert in_state(project, "total") == project
    for name in EFFECTS:
        Project.from_text(in_state(project, f"without {name}").to_text())  # within every limit


def test_images_give_way_to_their_mean(tmp_path: Path) -> None:
    project = Project.load(small_project(tmp_path))
    material = in_state(project, "without texture").scene.objects[0].material
    assert isinstance(material, Lambertian) and isinstance(material.albedo, tuple)
    # sRGB codes of 100 to 200 are reflectances of 0.13 to 0.58
    assert all(0.13 < value < 0.58 for value in material.albedo)


def test_a_body_that_light_enters_becomes_a_surface_and_keeps_its_interreflection() -> None:
    project = Project.load("plane").replaced({"scene.objects[0].material": Subsurface()})
    assert "subsurface" in effects_of(project) and "interreflection" not in effects_of(project)
    assert isinstance(in_state(project, "without subsurface").scene.objects[0].material, Lambertian)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"repeats": 2}, "repeats of at least 3"),
        ({"sweeps": [{"name": "b", "chart": "budget", "vary": [{"field": "seed", "values": [1]}]}]}, "budget"),
        ({"sweeps": [{"name": "b", "sampling": "effects", "vary": [{"field": "seed", "values": [1]}]}]}, "no vary"),
    ],
)
def test_a_budget_that_cannot_be_is_refused(tmp_path: Path, change: dict[str, Any], words: str) -> None:
    file = tmp_path / "study.json"
    file.write_text(json.dumps({**DATA, **change}))
    with pytest.raises(InputError, match=words):
        Study.load(file)


def test_a_laser_that_is_not_there_is_told(tmp_path: Path) -> None:
    done = CliRunner().invoke(main.cli, ["budget", "assets/projects/plane", "--laser", "3", "--out", str(tmp_path)])
    assert done.exit_code == 2 and "--laser" in done.stderr and "allowed: 0" in done.stderr.lower()


def test_line_extraction_takes_the_sensor_to_be_what_it_is_whatever_is_off() -> None:
    """Electrons, read noise and pattern are those of the sensor; what the other sensor drew stays in the numbers."""
    project = Project.load("plane")
    frame = blazer.render(project.replaced(DATA["set"]), image_scale=0.05)
    quiet = in_state(project, "without shot noise")
    quiet = in_state(quiet, "without quantisation")
    plain = blazer.develop(frame, sensor=project.sensor, noise=False)
    seen = as_if(blazer.develop(frame, sensor=quiet.sensor, noise=False), project.sensor)
    assert seen.bits == 16 and seen.read_noise == plain.read_noise == project.sensor.read_noise
    assert seen.project.sensor == plain.project.sensor
    # half a number of 12 bits and one of 16, of rounding
    assert np.max(np.abs(seen.electrons - plain.electrons)) <= 0.501 / plain.gain + 0.5 / seen.gain


def test_a_row_that_takes_a_ghost_for_the_line_is_counted_and_makes_no_budget() -> None:
    small = {"shot noise": np.full(4, 1e-10)}
    found = budget(np.full(4, 2e-10), np.full(4, 1e-10), small, {"shot noise": np.full(4, 2e-10)})
    said = sentences_of([ErrorBudget("likelihood", found, found, wrong_rows=0.004)])
    assert any("0.40% of the rows are measured wrong" in one for one in said)
    assert not any("measured wrong" in one for one in sentences_of([ErrorBudget("likelihood", found, found)]))


@pytest.mark.parametrize(
    ("facets", "verdict"),
    [
        ([0.00, 0.01, 0.02, 0.01], "below a tenth"),
        ([0.20, 0.21, 0.22, 0.21], "more than a tenth"),
        ([-0.1, 0.05, 0.2, 0.1], "too few repeats to tell"),
    ],
)
def test_the_simulation_s_share_has_a_verdict_where_the_repeats_allow_one(facets: list[float], verdict: str) -> None:
    total, own = np.full(4, 1e-10), 1e-10 * np.array(facets)
    found = budget(total, 0.0 * own, {"facets": total - own}, {"facets": own}, ("facets",))
    (said,) = (one for one in sentences_of([ErrorBudget("likelihood", found, found)]) if "simulation itself" in one)
    assert verdict in said
