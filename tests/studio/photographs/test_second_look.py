"""A line in a shadow among lit ground is found there, between the scan lines that have it, and nowhere else."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.line.detection.noise import NoiseModel
from analysis.line.extract import extract
from analysis.line.result import Flag
from analysis.line.selection.continuity import select_chain
from analysis.line.settings import ExtractionSettings
from studio.photographs.second_look import looked_at_again

COUNT, WIDTH, SHADOW = 120, 400, slice(56, 63)
NOISE = NoiseModel(gain=0.1, read_noise=10.0)


def image(lit: float, softer: float = 1.0) -> np.ndarray:
    """A line of 60 DN on ground of 100 DN, that falls to 30 DN about the line on the scan lines of the shadow; there it
    is `lit` times as bright and `softer` times as wide."""
    x, rows = np.arange(WIDTH), np.arange(COUNT)
    ground = np.full((COUNT, WIDTH), 100.0)
    ground[SHADOW, 170:260] = 30.0
    place = 200.0 + 0.2 * rows
    width = np.full((COUNT, 1), 1.5)
    width[SHADOW] *= softer
    line = 60.0 * np.exp(-0.5 * ((x - place[:, None]) / width) ** 2)
    line[SHADOW] *= lit
    noisy = ground + line + np.random.default_rng(4).normal(0.0, 1.0, ground.shape)
    return np.rint(noisy).astype(np.uint8)


@pytest.mark.parametrize("axis", ["rows", "columns"])
def test_what_the_ground_of_the_whole_image_hides_is_found(axis: str) -> None:
    taken = image(1.0)
    taken = taken if axis == "rows" else np.ascontiguousarray(taken.T)
    settings = ExtractionSettings(axis=axis, select="strongest", peaks=5)
    first = extract(taken, settings=settings, noise=NOISE)
    before = select_chain(first).valid[:, 0]
    assert before.sum() >= COUNT - 7 and not before[SHADOW].any()
    chain = select_chain(looked_at_again(first, taken, settings, NOISE, judged=False))
    assert chain.valid[:, 0].all()
    error = chain.u[SHADOW, 0] - (200.0 + 0.2 * np.arange(COUNT)[SHADOW])
    assert np.abs(error).max() < 5.0 * chain.sigma_u[SHADOW, 0].max() < 0.5


@pytest.mark.parametrize(("lit", "softer"), [(0.4, 1.0), (0.8, 2.2)])
def test_what_is_much_dimmer_or_softer_than_the_line_beside_is_none_of_it(lit: float, softer: float) -> None:
    taken = image(lit, softer)
    settings = ExtractionSettings(select="strongest", peaks=5)
    again = looked_at_again(extract(taken, settings=settings, noise=NOISE), taken, settings, NOISE, judged=False)
    assert (again.flag[SHADOW, -1] == Flag.REJECTED).all() and np.isnan(again.u[SHADOW, -1]).all()


def test_nothing_is_found_where_there_is_nothing_and_a_whole_line_stays_as_it_is() -> None:
    taken = image(0.0)
    settings = ExtractionSettings(select="strongest", peaks=5)
    first = extract(taken, settings=settings, noise=NOISE)
    again = looked_at_again(first, taken, settings, NOISE, judged=False)
    assert not select_chain(again).valid[SHADOW, 0].any()
    assert set(again.flag[SHADOW, -1]) <= {Flag.NO_PEAK, Flag.NOT_CONVERGED, Flag.TOO_WIDE, Flag.OUT_OF_WINDOW}
    bright = np.full((COUNT, WIDTH), 20.0) + 100.0 * np.exp(-0.5 * ((np.arange(WIDTH) - 200.0) / 2.0) ** 2)
    whole = extract(np.rint(bright).astype(np.uint8), settings=settings, noise=NOISE)
    assert looked_at_again(whole, bright, settings, NOISE, judged=False) is whole
