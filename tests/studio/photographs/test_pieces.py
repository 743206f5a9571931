"""A photograph without a line has none, and a line in pieces is one."""

from __future__ import annotations

import math

import numpy as np

from analysis.line.detection.matched_filter import FILTER_SIGMA, NOISE_GAIN
from analysis.line.detection.noise import NoiseModel
from analysis.line.result import Flag
from studio.photographs.pieces import above_noise, lines_only
from tests.studio.photographs.test_line_ends import COUNT, line_of


def test_short_pieces_that_go_on_nowhere_are_no_line() -> None:
    rng = np.random.default_rng(9)
    there = np.arange(COUNT) % 14 < 11
    u = np.repeat(rng.uniform(0.0, 500.0, -(-COUNT // 14)), 14)[:COUNT]
    assert not lines_only(line_of(np.where(there, 100.0, 0.0), u)).valid.any()


def test_a_line_with_gaps_and_steps_stays_whole() -> None:
    rows = np.arange(COUNT)
    u = 50.0 + 0.4 * rows + 30.0 * (rows // 40)
    line = line_of(np.where(rows % 40 < 34, 100.0, 0.0), u)
    assert (lines_only(line).valid == line.valid).all()


THRESHOLD, READ = 5.2, 10.0


def amplitude_of(response: float) -> float:
    """e- of a line of 2 px, by its response in standard deviations of what white noise makes of it."""
    return response * math.sqrt(NOISE_GAIN) * READ * math.hypot(1.0, FILTER_SIGMA / 2.0)


def test_a_piece_no_higher_than_the_noise_that_pixels_share_is_none_and_faint_rows_of_the_line_stay() -> None:
    """The line is bright but on every fourth scan line, which is as faint as a piece of noise far beside it."""
    rows, faint = np.arange(COUNT), amplitude_of(1.5 * THRESHOLD)
    light = np.where(rows % 4 == 0, faint, 20.0 * faint)
    light[:60], light[:24] = 0.0, faint
    line = line_of(light, np.where(rows < 40, 120.0, 50.0))
    noise = NoiseModel(gain=1.0, read_noise=READ, step=0.0)
    assert (above_noise(line, noise, THRESHOLD).valid == line.valid).all()
    kept = above_noise(line, noise.model_copy(update={"spread": 2.0}), THRESHOLD)
    assert np.flatnonzero(kept.valid[:, 0]).tolist() == list(range(60, COUNT))
    assert set(kept.flag[:24, 0]) == {Flag.REJECTED} and np.isnan(kept.u[:24]).all()
    kept = above_noise(line, noise.model_copy(update={"spread": 1.4}), THRESHOLD)
    assert (kept.valid == line.valid).all()
