"""Candidates only where they are needed: the line chosen of them is that of all candidates."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.line.detection.noise import NoiseModel
from analysis.line.extract import extract
from analysis.line.selection.continuity import select_chain
from analysis.line.settings import ExtractionSettings
from studio.photographs.candidates import peaks_to_choose_from
from studio.photographs.evidence import _clear_pieces

ROWS, WIDTH = 160, 120
SETTINGS, NOISE = ExtractionSettings(select="continuous"), NoiseModel(read_noise=3.0)


def scene(spots: bool, rival: bool) -> NDArray[np.float32]:
    """A line of 1,000 e-; spots that are brighter on every fifth row; on a third of the rows a brighter, rough one."""
    rng = np.random.default_rng(8)
    x, rows = np.arange(WIDTH), np.arange(ROWS)
    image = 20.0 + 1000.0 * np.exp(-0.5 * ((x - 50.0 - 0.1 * rows[:, None]) / 1.5) ** 2)
    if spots:
        at = rng.uniform(90.0, 110.0, ROWS)
        image[::5] += 2000.0 * np.exp(-0.5 * ((x - at[::5, None]) / 1.5) ** 2)
    if rival:
        at = 95.0 + rng.uniform(-3.0, 3.0, ROWS)
        image[60:110] += 1500.0 * np.exp(-0.5 * ((x - at[60:110, None]) / 1.5) ** 2)
    return np.asarray(rng.poisson(image) + 3.0 * rng.normal(size=image.shape), np.float32)


@pytest.mark.parametrize(
    ("spots", "rival", "axis"), [(False, False, "rows"), (True, False, "columns"), (True, True, "rows")]
)
def test_the_line_is_that_of_all_candidates(spots: bool, rival: bool, axis: str) -> None:
    image = scene(spots, rival)
    settings = SETTINGS.model_copy(update={"axis": axis})
    image = image if axis == "rows" else np.ascontiguousarray(image.T)
    few = select_chain(peaks_to_choose_from(image, settings, NOISE, 1))
    every = select_chain(extract(image, settings=settings, select="strongest", peaks=5, noise=NOISE, threads=1))
    np.testing.assert_array_equal(few.u, every.u)
    np.testing.assert_array_equal(few.sigma_u, every.sigma_u)
    assert np.mean(np.abs(few.u[:, 0] - 50.0 - 0.1 * np.arange(ROWS)) < 1.0) > 0.99


def test_second_peaks_are_measured_only_where_the_strongest_are_not_the_line() -> None:
    line = peaks_to_choose_from(scene(True, False), SETTINGS, NOISE, 1)
    assert line.u.shape[1] > 1
    assert line.valid[::5, 1].all() and not line.valid[1::5, 1].any()
    assert peaks_to_choose_from(scene(False, False), SETTINGS, NOISE, 1).u.shape == (ROWS, 1)


def test_a_piece_of_the_chain_counts_that_is_clear_on_a_third_of_its_length() -> None:
    """A line on a broken, glowing surface beside rivals; and a piece that is hardly clear anywhere."""
    found, clear = np.full(60, 10.0), np.zeros(60)
    found[30:] = 50.0  # another piece
    clear[:12], clear[30:35] = 0.4, 0.4
    kept = _clear_pieces(found, clear)
    assert kept[:30].all() and not kept[30:].any()
