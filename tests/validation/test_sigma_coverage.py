"""Coverage of sigma over the whole grid: troubles x signals x widths, with the noise known and estimated.

2 sigma hold 93 to 97 % and 1 sigma 65 to 71 % of the errors of the points in every cell, or of those without a flag.

Run: pytest -m validation tests/validation/test_sigma_coverage.py -s, which prints every cell.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.line.result import Flag
from tests.analysis.line.troubles import (
    PLAIN,
    SIGNALS,
    TROUBLES,
    WIDTHS,
    Coverage,
    coverage,
    measured,
    variance_of_means,
)

pytestmark = pytest.mark.validation

ROWS = 1000
FEWEST = 100
"""Points without a flag that make a share."""
MOST = 3.5
"""Standard deviations of a share: 560 cells of two shares, one run in three fails by chance at 3.5."""
KNOWN, ESTIMATED = "noise known", "noise estimated"
FEW = 0.01
"""Share of flagged points from which what is told of them may outweigh that of the others."""
MEANS = 8000
"""Scan lines whose means are compared."""
CELLS = [(name, signal, sigma) for name in TROUBLES for signal in SIGNALS for sigma in WIDTHS]


def holds(found: Coverage, sigma: float) -> bool:
    """Whether the bars are met; of lines below 0.6 px, a mean over a pixel and no normal deviate, that of two sigma."""
    return share_is(found.two, 0.93, 0.97, found.count) and (
        sigma < 0.6 or share_is(found.one, 0.65, 0.71, found.count)
    )


def share_is(share: float, low: float, high: float, count: int) -> bool:
    return bool(
        low - MOST * np.sqrt(low * (1 - low) / count) < share < high + MOST * np.sqrt(high * (1 - high) / count)
    )


@pytest.mark.parametrize("noise", [KNOWN, ESTIMATED])
@pytest.mark.parametrize(("name", "signal", "sigma"), CELLS)
def test_sigma_holds_or_the_point_is_flagged(name: str, signal: float, sigma: float, noise: str) -> None:
    known = noise == KNOWN
    trouble = TROUBLES[name]
    line, centre = measured(trouble, signal, sigma, ROWS, seed=2024, known=known)
    every = found = coverage(line, centre)
    print(
        f"\n{name:28} A {signal:6g} s {sigma:3} {'known' if known else 'estimated':9}: {found.one:.3f} {found.two:.3f} "
        f"rms {found.rms:.4f} sigma {found.sigma:.4f} lost {found.lost:.3f} flagged {found.flagged:.3f}",
        end="",
    )
    if found.count == 0 or not holds(found, sigma):  # or those that do not are flagged
        alone = line.flag[:, 0] == Flag.OK
        found = coverage(replace(line, flag=np.where(alone[:, None], line.flag, Flag.NO_PEAK)), centre)
        assert found.count < FEWEST or holds(found, sigma)
    if trouble == PLAIN and sigma >= 0.6:
        assert every.flagged <= 0.02
    if trouble == PLAIN and sigma < 0.3 and signal >= 300:
        assert np.mean(line.flag[line.valid] == Flag.UNRESOLVED) > 0.5


@pytest.mark.parametrize("sigma", [0.6, 2.0, 8.0])
@pytest.mark.parametrize("signal", [300.0, 1000.0, 10000.0])
@pytest.mark.parametrize("name", ["plain", "defocus of 2 sigma", "reflection of 10 %"])
def test_means_over_10_and_100_scan_lines_are_told_or_flagged(
    name: str, signal: float, sigma: float, request: pytest.FixtureRequest
) -> None:
    """Of flagged points no larger than told."""
    if (name, signal, sigma) == ("reflection of 10 %", 10000.0, 8.0):
        request.applymarker(pytest.mark.xfail(strict=True, reason="a light as wide is taken for the background"))
    line, centre = measured(TROUBLES[name], signal, sigma, MEANS, seed=77)
    ten, hundred = (variance_of_means(line, centre, rows) for rows in (10, 100))
    flagged = np.mean(line.flag != Flag.OK)
    print(
        f"\n{name:28} A {signal:6g} s {sigma:3}: over 10 {ten:.2f}, over 100 {hundred:.2f}, flagged {flagged:.2f}",
        end="",
    )
    for ratio, count in ((ten, MEANS / 10), (hundred, MEANS / 100)):
        chance = 3 * np.sqrt(2 / count)
        assert ratio < 1.15 + chance
        assert flagged > FEW or ratio > 0.85 - chance
