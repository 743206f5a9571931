"""A scan line's result depends on nothing but its own pixels, and of a narrow line on the width that its neighbours on
either side have: not on the order of the rows, nor on what memory held."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest

from analysis.line.detection.noise import NoiseModel
from analysis.line.extract import extract
from analysis.line.measure import METHODS
from analysis.line.result import Line
from analysis.line.settings import Method
from tests.analysis.line.line_images import electrons, expected, exposed

FIELDS = ("u", "sigma_u", "width", "amplitude", "background", "chi2", "flag", "correlation_length")
ROW_LOCAL = [method for method in get_args(Method) if method in METHODS and METHODS[method].halo == 0]


def troubled(rows: int = 192) -> np.ndarray:
    """Lines of all widths, neighbours, blobs, saturated and starved ones: every branch of the fits."""
    rng = np.random.default_rng(8)
    centre = rng.uniform(30.0, 90.0, rows)
    image = np.full((rows, 120), 10.0)
    for row in range(rows):
        width, peak = rng.choice([0.2, 0.5, 1.5, 6.0]), rng.choice([30.0, 300.0, 5000.0, 40000.0])
        image[row] += expected(120, centre[row : row + 1], peak, width, 0.0)[0]
        if row % 3 == 0:
            apart = rng.uniform(1.0, 5.0) * max(width, 0.8)
            image[row] += expected(120, centre[row : row + 1] + apart, 0.4 * peak, width, 0.0)[0]
        if row % 5 == 0:
            image[row] *= rng.gamma(10.0, 0.1, 120)
    return np.minimum(exposed(image, 4.0, rng), 20000.0)


def same(one: Line, other: Line, order: slice) -> list[str]:
    return [
        name
        for name in FIELDS
        if not np.array_equal(getattr(one, name), getattr(other, name)[order], equal_nan=name != "flag")
    ]


@pytest.mark.parametrize("method", ROW_LOCAL)
@pytest.mark.parametrize("scintillation", [(), ((0.02, 0.01), (0.005, 0.002))])
def test_rows_in_reverse_order_give_the_same_peaks_in_reverse(method: Method, scintillation: tuple) -> None:
    image = troubled()
    noise: NoiseModel = electrons(4.0, saturation=20000.0).model_copy(update={"scintillation": scintillation})
    forth = extract(image, method=method, noise=noise, peaks=2)
    back = extract(np.ascontiguousarray(image[::-1]), method=method, noise=noise, peaks=2)
    assert same(forth, back, slice(None, None, -1)) == []


@pytest.mark.parametrize("method", [method for method in get_args(Method) if method in METHODS])
def test_an_extraction_is_the_same_each_time_to_the_bit(method: Method) -> None:
    image, noise = troubled(), electrons(4.0, saturation=20000.0)
    first = extract(image, method=method, noise=noise, threads=1)
    np.full((512, 512), 1e300)  # dirties what the next allocation may be given
    assert same(first, extract(image, method=method, noise=noise, threads=4), slice(None)) == []
