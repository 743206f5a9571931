"""Every extraction method over the whole published table of efficiencies (accuracy note 2.2), cell by cell."""

from __future__ import annotations

import csv
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest

from analysis.line import measure
from analysis.line.extract import extract
from analysis.line.settings import ExtractionSettings
from tests.analysis.line.line_images import cramer_rao, electrons, expected, exposed

pytestmark = pytest.mark.validation

ROWS = 8000
BETTER = {
    "centre_of_mass": "the window is put back on its result",
    "guo": "the iteration runs until it rests",
    "caruana": "only the run of pixels around the peak counts",
    "likelihood": "its efficiency is 1 within the noise",
    "gaussian": "narrow lines keep their width from below",
}
FITTED = ("gaussian", "likelihood")
"""Published with a width of their own; where it is held, least squares lose more of the light's noise."""


def published():
    cells = defaultdict(list)
    with Path(__file__).with_name("line_efficiency.csv").open() as file:
        for row in csv.DictReader(file):
            for amplitude in (100, 1000, 10000):
                printed = float(row[f"a{amplitude}"])
                cells[row["method"]].append((amplitude, float(row["sigma"]), float(row["read_noise"]), printed))
    return dict(cells)


@pytest.mark.parametrize("name", published())
def test_efficiency_is_the_published_one(name, monkeypatch):
    method, _, scale = name.partition(" one step ")
    if scale:
        one_step = measure.METHODS["steger"]._replace(variant=1)
        monkeypatch.setitem(measure.METHODS, "steger", one_step)
    rng = np.random.default_rng(5)
    worst, far = 0.0, []
    for amplitude, sigma, read_noise, printed in published()[name]:
        if amplitude / read_noise < 20 or (scale and sigma < 1):  # a single step's narrow filter is anyone's choice
            continue
        centre = 80 + rng.uniform(-0.5, 0.5, ROWS)
        image = exposed(expected(160, centre, amplitude, sigma, 10.0), read_noise, rng).astype(np.float32)
        width = None if method in FITTED else sigma
        settings = ExtractionSettings(width=width, filter_scale=float(scale or 1.0))
        line = extract(image, method=method, settings=settings, noise=electrons(read_noise))
        error = (line.u[:, 0] - centre)[line.valid[:, 0]]
        found = cramer_rao(amplitude, sigma, read_noise, 10.0) ** 2 / np.mean(error**2)
        # four sigmas, since there are 900 cells: the mean squares of both experiments, and the two printed digits
        bound = 4 * printed * np.sqrt(4 / ROWS) + 0.01
        off = found - printed
        worst = max(worst, abs(off) / bound)
        if off < -bound or (off > bound and name not in BETTER):
            far.append((amplitude, sigma, read_noise, printed, round(found, 3)))
    print(f"\n{name}: worst cell at {worst:.2f} of its tolerance; outside: {far}")
    assert not far
