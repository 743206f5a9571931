"""Two renders against each other, one light group at a time."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from render.frame import Frame
from studio.scan.compare import compare, quantities

DIRECT = np.full((2, 3), 4.0, np.float32)
REFLECTED = np.full((2, 3), 1.0, np.float32)
PLAIN = Frame(0, (DIRECT,), None, (), None, "")
SHINY = dataclasses.replace(PLAIN, laser_indirect=(REFLECTED,))


def test_reflected_light_can_be_compared_only_where_it_was_traced() -> None:
    assert quantities(PLAIN) == ["image", "laser"]
    assert quantities(SHINY) == ["image", "laser", "reflected"]
    assert compare("reflected", (SHINY, []), (PLAIN, [])) is None


def test_a_lasers_light_counts_direct_and_reflected_light() -> None:
    found = compare("laser", (PLAIN, []), (SHINY, []))
    assert found is not None
    assert np.array_equal(found.difference, REFLECTED)


def test_the_reflected_lights_of_all_lasers_are_summed() -> None:
    twice = dataclasses.replace(PLAIN, laser_direct=(DIRECT, DIRECT), laser_indirect=(REFLECTED, 3 * REFLECTED))
    found = compare("reflected", (SHINY, []), (twice, []))
    assert found is not None
    assert found.rms == pytest.approx(3.0)
