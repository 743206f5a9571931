"""Coverage of sigma over the whole grid: troubles x signals x widths, with the noise known and estimated.

2 sigma hold 93 to 97 % and 1 sigma 65 to 71 % of the errors of the points in every cell, or of those without a flag.

Run: pytest -m validation tests/validation/test_sigma_coverage.py -s, which prints every cell.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.error import MATCH_SIGMAS
from analysis.line.result import Flag
from analysis.line.texture import Texture
from tests.analysis.line.troubles import (
    PLAIN,
    SIGNALS,
    TEXTURE_GRAIN,
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
"""Standard deviations of a share: 600 cells of two shares, one run in three fails by chance at 3.5."""
NOISES = KNOWN, ESTIMATED = "noise known", "noise estimated"
MEANS_OF = (300.0, 1000.0, 10000.0)
"""Electrons of the peaks that means are taken of."""
EXCEPTION = ("neighbour at 3 sigma", 10000.0, 8.0, ESTIMATED)
"""The cell where sigma does not hold, as `analysis/line/README.md` says: it is a sixth too large."""
EXCEPTIONS_OF_MEANS = {
    ("slanted edge to 30 %", 300.0, 0.6, KNOWN),
    *(("slanted edge to 30 %", 1000.0, 0.6, noise) for noise in NOISES),
    *(("texture of 5 %", 300.0, 8.0, noise) for noise in NOISES),
    ("texture of 5 %", 1000.0, 8.0, ESTIMATED),
}
"""Cells where what is told of means does not hold, as there: half a line of 0.6 px looks like a narrower one, and of a
texture four times as fine as the line is wide little is seen."""
ALL_ALIKE = {
    *((f"neighbour at {sigmas} sigma", 10000.0, 0.6, ESTIMATED) for sigmas in ("1.4", "2", "3")),  # all are 2 px away
    *(
        ("slanted edge to 30 %", signal, sigma, noise)
        for signal in MEANS_OF
        for sigma in (2.0, 8.0)
        for noise in NOISES
    ),
    *(("partly occluded", signal, 8.0, noise) for signal in MEANS_OF for noise in NOISES),
    ("mosaic", 10000.0, 0.6, KNOWN),
}
"""Cells where means with flagged points err by more than told, as all of these are moved alike."""
RUNS = 20
"""Means that make a variance."""
MEANS = 8000
"""Scan lines whose means are compared."""
OTHERS = 0.002
"""Share of the scan lines whose peak may be another one than the line: of 300 e- on ground of 2,500 e- one in 1,000."""
CELLS = [(name, signal, sigma) for name in TROUBLES for signal in SIGNALS for sigma in WIDTHS]


def holds(found: Coverage, sigma: float, alike: float) -> bool:
    """Whether the bars are met, where so many scan lines err alike; of lines below 0.6 px, a mean over a pixel and no
    normal deviate, that of two sigma."""
    count = found.count / alike
    return share_is(found.two, 0.93, 0.97, count) and (sigma < 0.6 or share_is(found.one, 0.65, 0.71, count))


def share_is(share: float, low: float, high: float, count: float) -> bool:
    return bool(
        low - MOST * np.sqrt(low * (1 - low) / count) < share < high + MOST * np.sqrt(high * (1 - high) / count)
    )


@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize(("name", "signal", "sigma"), CELLS)
def test_sigma_holds_or_the_point_is_flagged(
    name: str, signal: float, sigma: float, noise: str, request: pytest.FixtureRequest
) -> None:
    if (name, signal, sigma, noise) == EXCEPTION:
        request.applymarker(pytest.mark.xfail(strict=True))
    known = noise == KNOWN
    trouble = TROUBLES[name]
    line, centre = measured(trouble, signal, sigma, ROWS, seed=2024, known=known)
    every = found = coverage(line, centre)
    print(
        f"\n{name:28} A {signal:6g} s {sigma:3} {'known' if known else 'estimated':9}: {found.one:.3f} {found.two:.3f} "
        f"rms {found.rms:.4f} sigma {found.sigma:.4f} lost {found.lost:.3f} flagged {found.flagged:.3f}",
        end="",
    )
    alike = Texture(1.0, TEXTURE_GRAIN).length if trouble.texture else 1.0
    if found.count == 0 or not holds(found, sigma, alike):  # or those that do not are flagged
        alone = line.flag[:, 0] == Flag.OK
        found = coverage(replace(line, flag=np.where(alone[:, None], line.flag, Flag.NO_PEAK)), centre)
        assert found.count < FEWEST or holds(found, sigma, alike)
    if trouble == PLAIN and sigma >= 0.6:
        assert every.flagged <= 0.02
    if trouble == PLAIN and sigma < 0.3 and signal >= 300:
        assert np.mean(line.flag[line.valid] == Flag.UNRESOLVED) > 0.5


@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize("sigma", [0.6, 2.0, 8.0])
@pytest.mark.parametrize("signal", MEANS_OF)
@pytest.mark.parametrize("name", [name for name in TROUBLES if "saturated" not in name])
def test_means_over_10_and_100_scan_lines_are_told_or_flagged(
    name: str, signal: float, sigma: float, noise: str, request: pytest.FixtureRequest
) -> None:
    """Of runs without a flagged point within 15 %; of all points no larger than told, but where they are named."""
    cell = (name, signal, sigma, noise)
    if cell in EXCEPTIONS_OF_MEANS:
        request.applymarker(pytest.mark.xfail(strict=True))
    line, centre = measured(TROUBLES[name], signal, sigma, MEANS, seed=77, known=noise == KNOWN)
    other = np.abs(line.u[:, 0] - centre) > MATCH_SIGMAS * sigma + 1.0
    flagged = line.flag[:, 0] != Flag.OK
    of_all, of_unflagged = np.where(other, np.nan, centre), np.where(other | flagged, np.nan, centre)
    print(f"\n{name:28} A {signal:6g} s {sigma:3} {noise:15} flagged {flagged.mean():.3f}", end="")
    assert np.mean(other) < OTHERS
    told_too_small = False
    for rows in (10, 100):
        every, unflagged = (whole_runs(one, line.valid[:, 0], rows) for one in (of_all, of_unflagged))
        all_ratio = variance_of_means(line, of_all, rows) if every >= RUNS else 1.0
        ratio = variance_of_means(line, of_unflagged, rows) if unflagged >= RUNS else 1.0
        print(f", over {rows}: {all_ratio:.2f} of {every}, unflagged {ratio:.2f} of {unflagged}", end="")
        assert abs(ratio - 1.0) < 0.15 + 3 * np.sqrt(2 / max(unflagged, RUNS))
        told_too_small |= bool(all_ratio >= 1.15 + 3 * np.sqrt(2 / max(every, RUNS)))
    assert told_too_small == (cell in ALL_ALIKE)


def whole_runs(centre: np.ndarray, valid: np.ndarray, rows: int) -> int:
    """How many means over so many scan lines there are."""
    return int((np.isfinite(centre) & valid)[: len(centre) // rows * rows].reshape(-1, rows).all(axis=1).sum())
