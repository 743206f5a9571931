"""Recipes: what they draw, and what they refuse."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats

from render.base.errors import InputError
from studio.dataset.recipe import Draw, Recipe, base_of, ready_made
from studio.dataset.scenes import place

COUNT = 4000


def drawn(**said: Any) -> np.ndarray:
    one = Draw(field="x", **said)
    return np.array([one.at(place(7, k, "x")) for k in range(COUNT)])


def test_places_are_uniform_and_independent_of_their_neighbours() -> None:
    found = np.array([place(3, k, "field") for k in range(COUNT)])
    assert stats.kstest(found, "uniform").pvalue > 1e-3
    assert abs(np.corrcoef(found[1:], found[:-1])[0, 1]) < 4 / COUNT**0.5


@pytest.mark.parametrize(
    "said, distribution",
    [
        ({"low": -2.0, "high": 5.0}, stats.uniform(-2.0, 7.0)),
        ({"kind": "logarithmic", "low": 0.1, "high": 100.0}, stats.loguniform(0.1, 100.0)),
        (
            {"kind": "normal", "mean": 1.0, "sigma": 2.0, "low": 0.0, "high": 4.0},
            stats.truncnorm(-0.5, 1.5, loc=1.0, scale=2.0),
        ),
    ],
)
def test_values_follow_their_distribution(said: dict[str, Any], distribution: Any) -> None:
    assert stats.kstest(drawn(**said), distribution.cdf).pvalue > 1e-3


def test_integers_and_choices_are_each_as_likely() -> None:
    integers = np.bincount(drawn(kind="integer", low=0, high=4).astype(int))
    choices = np.unique(drawn(kind="choice", values=("a", "b", "c")), return_counts=True)[1]
    assert len(integers) == 5 and stats.chisquare(integers).pvalue > 1e-3
    assert len(choices) == 3 and stats.chisquare(choices).pvalue > 1e-3


@pytest.mark.parametrize(
    "said, told",
    [
        ({"draw": [{"field": "a", "low": 2.0, "high": 1.0}]}, "low below high"),
        ({"draw": [{"field": "a", "kind": "logarithmic", "low": 0.0, "high": 1.0}]}, "low above 0"),
        ({"draw": [{"field": "a", "kind": "choice"}]}, "nothing to choose from"),
        ({"draw": [{"field": "a", "kind": "mesh"}]}, "a folder of meshes"),
        ({"draw": [{"field": "a", "kind": "integer", "low": 0.5, "high": 2.0}]}, "whole numbers"),
        ({"draw": [{"field": "a", "kind": "normal", "low": 0.0, "high": 1.0}]}, "no mean or sigma"),
        ({"split": [0.5, 0.5, 0.5]}, "do not add up"),
        ({"set": {"seed": 1}, "draw": [{"field": "seed", "kind": "integer", "low": 0, "high": 2}]}, "there twice"),
        ({"colour": 1}, "colour"),
    ],
)
def test_what_does_not_fit_is_told_with_what_is_allowed(tmp_path: Path, said: dict[str, Any], told: str) -> None:
    file = tmp_path / "recipe.json"
    file.write_text(json.dumps({"base": "plane", **said}))
    with pytest.raises(InputError, match=told):
        Recipe.load(file)


def test_a_base_outside_the_recipe_s_folder_and_an_unknown_field_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="leaves the project folder"):
        base_of(Recipe(base="../other.json"), tmp_path)
    with pytest.raises(InputError, match="no such place"):
        base_of(Recipe(base="plane", set={"sensor.color": 1}), tmp_path)


@pytest.mark.parametrize("name", ready_made())
def test_ready_made_recipes_are_valid(name: str) -> None:
    recipe, root = Recipe.load(name)
    assert base_of(recipe, root).render.goal is None and recipe.about


def test_a_folder_of_its_name_does_not_hide_a_ready_made_recipe(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "groove").mkdir()
    (tmp_path / "plane").write_text('{"base": "sphere"}')
    monkeypatch.chdir(tmp_path)
    assert Recipe.load("groove")[0].base == "v_groove"
    assert Recipe.load("plane")[0].base == "sphere"
    with pytest.raises(InputError, match="no such recipe"):
        Recipe.load("grove")
