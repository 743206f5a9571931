"""Direct light is rendered until the lines are known, and what is told of them is what its pixels' errors do."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from render.importance import Importance
from render.laser_direct import light_group
from render.laser_direct.integrator import DirectImage
from render.laser_direct.light_group import known_lines, line_deviation
from render.run import Run

LINES, WIDTH = 40, 8


def image_of(target: float, samples: int = 100) -> DirectImage:
    """Of radiance 1, known in each pixel to the target."""
    ones = np.ones((LINES, WIDTH), np.float32)
    return DirectImage(
        ones, target, ones.size, samples, 0, np.arange(ones.size, dtype=np.int32), np.full(ones.size, target)
    )


@pytest.mark.parametrize("axis", ["rows", "columns"])
def test_a_line_is_off_by_the_root_of_the_sum_of_squares_of_its_pixels(axis: Any) -> None:
    weight = np.zeros((LINES, WIDTH), np.float32)
    weight[:, 2:6] = (3.0, -4.0, 4.0, -3.0)
    image = image_of(0.01)
    if axis == "columns":
        weight, image = np.ascontiguousarray(weight.T), image_of(0.01)
        image = DirectImage(image.radiance.T, 0.01, 1, 1, 0, image.reached, image.standard_error)
    found = Importance((weight,), weight, axis, allowed=0.05, direct=0.03)
    assert line_deviation(image, found, 0) == pytest.approx(0.05 * np.sqrt(50.0) * 0.01)


def test_it_is_rendered_finer_until_the_lines_are_known(monkeypatch: pytest.MonkeyPatch) -> None:
    targets: list[float] = []

    def direct_image(*placed: object, target: float, run: Run) -> DirectImage:
        targets.append(target)
        return image_of(target, samples=100 * len(targets))

    monkeypatch.setattr(light_group, "direct_image", direct_image)
    weight = np.full((LINES, WIDTH), 100.0, np.float32)
    found = Importance((weight,), weight, allowed=1.0, direct=0.1)
    placed: Any = (None, None, None, np.eye(4), np.eye(4))
    image = known_lines(placed, 0.003, found, 0, Run())
    assert line_deviation(image, found, 0) <= found.direct and 1 < len(targets) <= 4
    # a line that is known asks for nothing
    targets.clear()
    slight = Importance((0.01 * weight,), weight, direct=0.1)
    assert known_lines(placed, 0.003, slight, 0, Run()).error == 0.003 and targets == [0.003]
