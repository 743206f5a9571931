"""Photographs that are mirrored or of another focus are left out by name, and the calibration is that of the others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.calibration.calibrate import Calibrated, Request, calibrate
from analysis.calibration.observations import View
from analysis.calibration.virtual import noisy
from tests.analysis.calibration.boards import SIZE, target, truth, views_of

COUNT = 10


def drawn(seed: int, focal: float = 1.0) -> list[View]:
    """Of a lens whose focal length is so many times as long."""
    there = truth(seed, COUNT, terms=4)
    there = replace(there, intrinsics=there.intrinsics * [focal, focal, 1.0, 1.0])
    return noisy(views_of(there, laser_step=96), np.random.default_rng(seed))


def mirrored(view: View) -> View:
    """As the program finds it in a photograph whose left and right are changed: the board's own are changed as well."""
    flip, edge = np.array([-1.0, 1.0]), np.array([SIZE[0] - 1.0, 0.0])
    return replace(
        view,
        pixel=view.pixel * flip + edge,
        covariance=view.covariance * np.outer(flip, flip),
        target=view.target * flip,
        stripes=tuple(replace(one, pixel=one.pixel * flip + edge) for one in view.stripes),
    )


def found(views: list[View]) -> Calibrated:
    return calibrate(views, target(), Request(SIZE, 1, 4))


def without(views: list[View], *numbers: int) -> np.ndarray:
    return found([view for i, view in enumerate(views) if i not in numbers]).estimate.shared


def test_mirrored_photographs_are_named_and_have_no_part_in_it() -> None:
    views = drawn(0)
    for number in (2, 7):
        views[number] = mirrored(views[number])
    result = found(views)
    assert [text.split(";")[0] for text in result.adjusted.left_out] == [
        f"view {i}: a mirrored photograph: its line is where it should be once left and right are changed"
        for i in (2, 7)
    ]
    np.testing.assert_allclose(result.estimate.shared, without(views, 2, 7), rtol=1e-7)


def test_a_line_of_a_reflection_is_no_mirrored_photograph() -> None:
    views = drawn(0)
    stripe = views[3].stripes[0]
    views[3] = replace(views[3], stripes=(replace(stripe, pixel=stripe.pixel + np.array([6.0, 0.0])),))
    told = found(views).adjusted.left_out
    assert len(told) == 1 and told[0].startswith("view 3: the line of laser 0 is")


@pytest.mark.parametrize("odd", [(4,), (7, 8, 9)])
def test_photographs_of_another_focus_are_named_and_have_no_part_in_it(odd: tuple[int, ...]) -> None:
    """By 0.4 %, what a lens of 12 mm does between a focus of 1 m and one of 0.75 m."""
    views, others = drawn(1), drawn(1, 1.004)
    mixed = [others[i] if i in odd else view for i, view in enumerate(views)]
    result = found(mixed)
    named = {text.split(":")[0] for text in result.adjusted.left_out if "focal length is longer" in text}
    assert named == {f"view {i}" for i in odd}
    np.testing.assert_allclose(result.estimate.shared, without(mixed, *odd), rtol=1e-7)
