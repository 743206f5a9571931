"""The slab of a section that nobody has typed meets every height, and a thinner one says what it leaves out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from analysis.cloud import Cloud
from analysis.section import Plane
from render.scene.motion import LinearStage, Motion, Turntable
from studio.scan.section import Scanned, from_scanned, slab_for
from tests.studio.scan_of_steps import small_project

STEP = 3.1579e-3
LEAN = np.tan(np.radians(13.0))
HEIGHTS = np.arange(6) * 1e-2
ACROSS_X, ACROSS_Y = Plane((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), Plane((0.0, 0.0, 0.0), (0.0, 2.0, 0.0))


def scanned_by(motion: Motion, points: Cloud) -> Scanned:
    return Scanned.of(small_project().scene.model_copy(update={"motion": motion}), Path(), [points])


def stage(moves: str = "objects", steps: int = 20) -> Scanned:
    """Six heights, each met by the leaning sheet elsewhere along x."""
    step, height = (grid.ravel() for grid in np.meshgrid(np.arange(steps), HEIGHTS))
    x = (step - 9.7) * STEP + height * LEAN
    points = {"x": x, "y": np.zeros_like(x), "z": height, "step": step}
    motion = LinearStage.model_validate({"moves": moves, "step": (-STEP, 0.0, 0.0), "steps": 20})
    return scanned_by(motion, points)


@pytest.mark.parametrize("moves", ["objects", "rig"])
def test_every_height_has_points_in_it(moves: str) -> None:
    """Of a millimetre, those of the table and of one step alone were within."""
    scanned = stage(moves)
    for at in np.linspace(-5e-3, 5e-3, 23):
        made = from_scanned(scanned, Plane((at, 0.0, 0.0), (1.0, 0.0, 0.0)), None)
        assert set(np.round(made.measured[:, 1], 6)) == set(np.round(HEIGHTS, 6))
    assert made.thickness == pytest.approx(3.2e-3) and made.remark == ""


def test_a_thinner_one_says_so() -> None:
    told = "thinner than the scan's step, 3.2\u00a0mm: some heights have no points"
    assert from_scanned(stage(), ACROSS_X, 1e-3).remark == told
    assert from_scanned(stage(), ACROSS_X, 3.2e-3).remark == ""


def test_along_the_profiles_and_of_one_of_them_it_is_a_millimetre() -> None:
    for scanned, plane in ((stage(), ACROSS_Y), (stage(steps=1), ACROSS_X)):
        made = from_scanned(scanned, plane, None)
        assert made.thickness == 1e-3 and made.remark == ""


def test_on_a_turntable_the_profiles_are_farthest_apart_at_the_rim() -> None:
    rim = {"x": np.array([-0.1, 0.1, 0.0, 0.0]), "y": np.array([0.0, 0.0, -0.1, 0.1]), "z": np.zeros(4)}
    motion = Turntable(angle_step=float(np.radians(2.0)), steps=3)
    scanned = scanned_by(motion, rim | {"step": np.array([0, 1, 2, 2])})
    assert scanned.apart(ACROSS_X) == pytest.approx(0.1 * np.sin(np.radians(2.0)), rel=0.05)


@pytest.mark.parametrize(
    ("apart", "slab"), [(0.0, 1e-3), (1e-3, 1e-3), (STEP, 3.2e-3), (3.2e-3, 3.2e-3), (0.0101, 0.011), (5.0, 1.0)]
)
def test_it_is_told_in_two_digits_and_never_less(apart: float, slab: float) -> None:
    assert slab_for(apart) == pytest.approx(slab, rel=1e-9)
