"""Whether two projects measure alike: seed by seed, so that what both have in common, the sensor's noise, cancels.

Bias and sigma are those of the points that both measure on the line, each at the same crossing of the exact line. A
point off it, on a reflection that outshines the line, say, errs by a thousand times a right one: a single one would
decide a sigma, and whether it is there hangs on a little noise. So wrong rows are a share of their own, of the rows on
which the line can be seen, and so are the rows that are measured on it. A point whose predicted sigma is more than a
pixel tells itself that it may be anywhere, and is wrong wherever it lies. Right and wrong are told by the exact line
and by each run's own sigma, never by how well the two agree, which would leave out the very changes that are asked for.
Where a point tells itself to be ten times less sure than is usual in its run it is wrong as well: two or three of a
thousand, hundreds of times less sure, would make most of sigma.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from analysis.study.intervals import Interval, mean_interval, student
from render.base.arrays import Float
from studio.study.kept import ROW
from studio.study.tables import seconds_of

FEWEST = 4
"""Points that both have, at least: fewer have no spread worth telling."""
BLOCKS = 16
"""Of neighbouring points, at most: how well one seed alone tells a change."""


@dataclass(frozen=True)
class Run:
    """A project on one seed."""

    crossing: np.ndarray
    """(n,) of the exact line, ascending: where a point lies on it."""
    error: Float
    """(n,) m, in depth."""
    wrong: float
    """Rows with a point off the line, over those on which it can be seen; NaN: nothing is measured."""
    completeness: float
    seconds: float
    """Processor time of a frame."""
    stages: Mapping[str, float]
    """Share of the seconds that each stage of the render takes."""
    reason: str = ""
    """Why nothing was measured."""

    def share(self, stages: Sequence[str]) -> float:
        """Of the seconds, all of these stages together."""
        return sum(self.stages.get(stage, 0.0) for stage in stages)


def run_of(row: Mapping[str, Any]) -> Run:
    """Of a row of `measure_task` that kept "errors", with its seconds."""
    kept = row.get(ROW, {"crossing": [], "error": [], "wrong": np.nan, "complete": np.nan, "stages": {}})
    seconds, rendering = float(seconds_of([dict(row)], "frame")[0]), row.get("seconds_render", np.nan)
    wall = max(sum(kept["stages"].values()), 1e-9)
    return Run(
        np.array(kept["crossing"], dtype=np.int64),
        np.array(kept["error"], dtype=np.float64),
        float(kept["wrong"]),
        float(kept["complete"]),
        seconds,
        {name: rendering * share / (wall * seconds) for name, share in kept["stages"].items()},
        str(row.get("reason") or ""),
    )


@dataclass(frozen=True)
class Change:
    """Of one project against another, over seeds that both have; shares, with their 95 % intervals."""

    bias: Interval
    """Of the RMS depth error."""
    sigma: Interval
    """Of the depth sigma."""
    completeness: Interval
    """Of the rows that are measured on the line."""
    wrong: Interval
    """Wrong rows that came or went, over the rows on which the line can be seen."""
    wrong_before: float
    wrong_after: float
    seconds: float
    """Median processor seconds of a frame."""
    seconds_before: float

    @property
    def intervals(self) -> tuple[Interval, ...]:
        return (self.bias, self.sigma, self.completeness, self.wrong)

    def within(self, share: float) -> bool:
        """All intervals lie within it."""
        return all(-share <= one.low and one.high <= share for one in self.intervals)

    def beyond(self, share: float) -> bool:
        """Shown to be larger, or nothing was measured."""
        return not all(one.low <= share and one.high >= -share for one in self.intervals)

    def undecided(self, share: float) -> bool:
        """An interval is so wide that no change, not even none, could be shown to lie within it."""
        return any(one.high - one.low > 2.0 * share for one in self.intervals)

    def size(self, less: float = 0.0) -> float:
        """The largest of the mean changes, each less so many of its standard errors, where these are known."""
        return float(
            np.max([abs(one.mean) - less * _standard_error(one) for one in self.intervals])
        )  # NaN where one is


def change(before: Sequence[Run], after: Sequence[Run]) -> Change:
    """Seed i of one against seed i of the other; NaN where a seed measured nothing, which no mean may hide."""
    pairs = [_common(a, b) for a, b in zip(before, after, strict=True)]
    rms = float(np.mean([np.sqrt(np.mean(a**2)) if len(a) else np.nan for a, _ in pairs]))
    sigma = float(np.mean([_spread(a) for a, _ in pairs]))
    complete = float(np.mean([one.completeness for one in before]))

    def share(of: Callable[[Float, Float], float], scale: float) -> Interval:
        if len(pairs) == 1:
            return _of_blocks(lambda a, b: of(a, b) / scale, *pairs[0])
        return _all_or_nothing(np.array([of(a, b) for a, b in pairs]) / scale)

    def differs(of: Callable[[Run], float], scale: float) -> Interval:
        return _all_or_nothing(np.array([of(b) - of(a) for a, b in zip(before, after, strict=True)]) / scale)

    return Change(
        bias=share(lambda a, b: float(np.mean(b - a)) if len(a) else np.nan, rms),
        sigma=share(lambda a, b: _spread(b) - _spread(a), sigma),
        completeness=differs(lambda run: run.completeness, complete),
        wrong=differs(lambda run: run.wrong, 1.0),
        wrong_before=float(np.mean([one.wrong for one in before])),
        wrong_after=float(np.mean([one.wrong for one in after])),
        seconds=float(np.median([one.seconds for one in after])),
        seconds_before=float(np.median([one.seconds for one in before])),
    )


def _common(a: Run, b: Run) -> tuple[Float, Float]:
    """Errors at the crossings that both have; of too few, none."""
    _, in_a, in_b = np.intersect1d(a.crossing, b.crossing, assume_unique=True, return_indices=True)
    return (a.error[in_a], b.error[in_b]) if len(in_a) >= FEWEST else (a.error[:0], b.error[:0])


def _of_blocks(of: Callable[[Float, Float], float], a: Float, b: Float) -> Interval:
    """Of one seed: the delete-a-block jackknife. Source: Kuensch (1989), Annals of Statistics 17, 1217."""
    count, found = min(BLOCKS, len(a)), of(a, b)
    if count < FEWEST:
        return _all_or_nothing(np.array([found]))
    block = np.arange(len(a)) * count // len(a)
    left = np.array([of(a[block != i], b[block != i]) for i in range(count)])
    half = student(count - 1) * float(np.sqrt((count - 1) * np.var(left)))
    return Interval(found, found - half, found + half, count)


def _standard_error(one: Interval) -> float:
    return 0.5 * (one.high - one.low) / student(one.count - 1) if one.count > 1 else 0.0


def _spread(error: Float) -> float:
    return float(np.std(error)) if len(error) else np.nan


def _all_or_nothing(values: Float) -> Interval:
    return mean_interval(values if np.isfinite(values).all() else np.full(1, np.nan))
