"""A curve through a lattice is found of few of its cells, and each column's interval holds it as often as it says."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np
import pytest

from analysis.study.boundary import Crossing, Lattice, Node, boundary, next_nodes

LATTICE = Lattice(33, 33, 1.0)
Curve = Callable[[float], float]
CURVES: dict[str, Curve] = {
    "level": lambda x: 0.43,
    "slope": lambda x: 0.1 + 0.8 * x,
    "arc": lambda x: 0.2 + 2.4 * x * (1.0 - x),
    "wave": lambda x: 0.5 + 0.3 * math.sin(5.0 * x),
    "hyperbola": lambda x: 0.1 / (0.12 + x),
}


def searched(lattice: Lattice, measure: Callable[[float, float], np.ndarray]) -> tuple[list[Crossing], int]:
    """What is found, and of how many cells. measure: of places from 0 to 1 along both parameters."""
    measured: dict[Node, np.ndarray] = {}
    while nodes := next_nodes(lattice, measured):
        assert not measured.keys() & set(nodes) and len(nodes) == len(set(nodes))
        across = max(lattice.columns - 1, 1)
        measured |= {(i, j): measure(i / across, j / (lattice.rows - 1)) for i, j in nodes}
    return boundary(lattice, measured), len(measured)


@pytest.mark.parametrize("name", CURVES)
def test_a_known_curve_without_noise_is_between_neighbours_in_every_column(name: str) -> None:
    found, cells = searched(LATTICE, lambda x, y: np.full(3, 1.0 + y - CURVES[name](x)))
    assert [one.column for one in found] == list(range(33))
    for one in found:
        exact = 32.0 * CURVES[name](one.column / 32.0)
        assert one.ending == "found" and one.high - one.low == 1.0 and one.low <= exact <= one.high
        assert one.row == pytest.approx(exact, abs=1e-9)  # the measure is linear along a column
    assert cells <= 33 * 33 / 5


def test_a_curve_that_leaves_the_window_is_told_column_by_column() -> None:
    """Over the top beyond x = 2/3, and a step to nothing at x = 0.2, as where a part comes into the light's way."""
    found, cells = searched(
        LATTICE, lambda x, y: np.full(3, math.nan if x < 0.2 else 1.0 + y - 1.5 * x if x < 0.9 else 0.0)
    )
    endings = [one.ending for one in found]
    assert endings == ["fails"] * 7 + ["found"] * 15 + ["holds"] * 11
    assert all(math.isnan(one.row) for one in found if one.ending != "found")
    assert cells <= 33 * 33 / 5


@pytest.mark.parametrize(("level", "ending"), [(0.0, "holds"), (2.0, "fails")])
def test_where_there_is_no_boundary_hardly_more_than_a_cell_a_column_says_so(level: float, ending: str) -> None:
    found, cells = searched(LATTICE, lambda x, y: np.full(3, level))
    assert {one.ending for one in found} == {ending} and cells <= 33 + 2


def test_a_measure_that_is_to_stay_above_its_limit_is_searched_alike() -> None:
    lattice = Lattice(9, 17, 0.95, above=False)
    found, _ = searched(lattice, lambda x, y: np.full(3, 1.0 if y < 0.3 + 0.5 * x else 0.5))
    assert all(one.low / 16.0 <= 0.3 + 0.5 * one.column / 8.0 <= one.high / 16.0 + 1e-9 for one in found)


@pytest.mark.parametrize("columns", [2, 3, 6])
def test_few_columns_are_all_searched(columns: int) -> None:
    found, _ = searched(Lattice(columns, 5, 0.5), lambda x, y: np.full(3, y))
    assert [one.column for one in found] == list(range(columns))


def test_with_noise_the_interval_holds_the_curve_in_95_percent_of_columns_or_more() -> None:
    random, held, wide = np.random.default_rng(3), [], []

    def measured(noise: float, curve: Curve) -> tuple[list[Crossing], int]:
        return searched(LATTICE, lambda x, y: 1.0 + y - curve(x) + noise * random.standard_normal(8))

    cells = []
    for noise, curve in [(noise, curve) for noise in (0.03, 0.1) for curve in CURVES.values()] * 2:
        found, count = measured(noise, curve)
        held += [one.low <= 32.0 * curve(one.column / 32.0) <= one.high for one in found if one.ending == "found"]
        wide += [one.high - one.low for one in found if one.ending == "found"]
        cells.append(count)
    # 660 columns: 3 standard deviations of a binomial are 2.5 %
    assert len(held) >= 650 and np.mean(held) >= 0.95 - 3.0 * math.sqrt(0.95 * 0.05 / len(held))
    assert np.mean(wide) < 6.0  # rows, where the noise of a mean is up to 1.1 rows
    assert np.max(cells) <= 33 * 33 / 5


def test_the_order_in_which_cells_are_measured_decides_nothing() -> None:
    def value(i: int, j: int) -> np.ndarray:
        noise = np.random.default_rng([i, j]).standard_normal(4)
        return 1.0 + j / 32.0 - CURVES["wave"](i / 32.0) + 0.05 * noise

    def run(choose: Callable[[list[Node]], list[Node]]) -> Mapping[Node, np.ndarray]:
        measured: dict[Node, np.ndarray] = {}
        while nodes := next_nodes(LATTICE, measured):
            measured |= {node: value(*node) for node in choose(nodes)}
        return measured

    at_once, one_by_one = run(lambda nodes: nodes), run(lambda nodes: nodes[-1:])
    assert at_once.keys() == one_by_one.keys()
    assert boundary(LATTICE, at_once) == boundary(LATTICE, one_by_one)
