"""The middle between half heights: where a line is clipped beyond any fit."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from analysis.line.result import Flag, Line
from studio.photographs.half_height import half_heights, with_half_heights
from tests.studio.photographs.test_evidence import answer, positions

ROWS, COLUMNS = 120, 160
SIGMA = 3.0
STRAIGHT = 0.08
"""px that a straight line between two pixels may err by on these flanks: f'' / 8 f' = 0.07."""


def lines(peak: float, ground: float = 40.0) -> tuple[np.ndarray, np.ndarray]:
    """(n, w) clipped at 255 and (n,) centres."""
    centre = 60.0 + 0.23 * np.arange(ROWS)
    x = np.arange(COLUMNS)
    return np.minimum(ground + peak * np.exp(-0.5 * ((x - centre[:, None]) / SIGMA) ** 2), 255.0), centre


@pytest.mark.parametrize("axis", ["rows", "columns"])
def test_of_a_clipped_gaussian_middle_and_width_are_as_by_closed_form(axis: str) -> None:
    light, centre = lines(1000.0)
    u, width, height = half_heights(light if axis == "rows" else light.T, axis)
    assert u == pytest.approx(centre, abs=STRAIGHT)
    # it crosses half of what is left of it, (255 - 40) / 2, at sigma sqrt(2 ln(1000 / 107.5)) to either side
    assert width == pytest.approx(SIGMA * np.sqrt(2.0 * np.log(1000.0 / 107.5)) / np.sqrt(2.0 * np.log(2.0)), rel=0.02)
    assert height == pytest.approx(215.0)


def test_the_brightest_stretch_is_taken_and_none_at_an_edge_or_on_level_ground() -> None:
    light, centre = lines(150.0)
    light[:, 10:12] += 90.0
    assert half_heights(light, "rows")[0] == pytest.approx(centre, abs=0.05)
    light[0], light[1] = 7.0, np.nan
    light[2], light[3] = 20.0, 20.0
    light[3, :9] = 200.0
    assert np.isnan(half_heights(light, "rows")[0][:4]).all()


def test_only_scan_lines_without_a_centre_get_one_and_its_sigma_is_how_far_such_lie_from_fits() -> None:
    light, centre = lines(1000.0)
    flag = np.zeros((ROWS, 1), np.uint8)
    flag[50:70], flag[90] = Flag.NOT_CONVERGED, Flag.NO_PEAK
    off = np.where(np.arange(ROWS) % 2, 0.3, -0.3)  # of the fits
    u = np.where(flag[:, 0] == 0, centre + off, np.nan)[:, None]
    one = np.where(flag == 0, 1.0, np.nan)
    line = Line("rows", "likelihood", u, 0.1 * one, 5.0 * one, one, one, one, flag)
    given = with_half_heights(line, line, light, gain=0.5)
    assert given.valid[50:70].all() and not given.valid[90]
    assert given.u[50:70, 0] == pytest.approx(centre[50:70], abs=STRAIGHT)
    assert given.sigma_u[50:70, 0] == pytest.approx(1.4826 * 0.3, abs=1.4826 * STRAIGHT)
    assert np.array_equal(given.u[:50], line.u[:50]) and given.amplitude[55, 0] == pytest.approx(430.0)


def test_a_white_lid_with_a_glow_on_one_side_is_found_all_along(tmp_path: Path) -> None:
    """A core of growing width in a glow over pale ground: no Gaussian, and as plain to see as a line can be."""
    rng = np.random.default_rng(5)
    x, rows = np.arange(240), np.arange(256)
    centre = 110.0 + 0.05 * rows
    half = 2.0 + 5.0 * rows / 255.0
    off = np.abs(x - centre[:, None])
    core = 1.0 / (1.0 + np.exp((off - half[:, None]) / 0.7))
    glow = np.exp(-off / 25.0) * (1.0 + 0.4 * np.sign(x - centre[:, None]))
    green = 150.0 + 40.0 * glow + 300.0 * core
    others = 140.0 - 20.0 * glow + 60.0 * core
    image = np.stack([others, green, others], axis=2) + rng.normal(0.0, 2.0, (256, 240, 3))
    cv2.imwrite(str(tmp_path / "lid.jpg"), np.clip(np.rint(image), 0, 255).astype(np.uint8)[..., ::-1])
    told = answer(tmp_path / "lid.jpg")
    assert told["chosen"]["colour"] == "green" and told["images"][0]["amplitude_e"] < 1e9
    u, _ = positions(tmp_path / "lid_line.csv", 256)
    assert np.isfinite(u).mean() > 0.95
    assert np.nanmax(np.abs(u - centre) - half) < 1.0, "outside of the white core"
