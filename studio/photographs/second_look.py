"""Scan lines that a line skips, looked at again where it goes on: by the ground there, not by that of the whole image.

What rises above the ground is told by medians of long blocks of pixels. A line in a shadow beside lit ground does not
rise above these, and is found once nothing is looked at but the pixels between the scan lines that have it.
"""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.line.detection.noise import NoiseModel
from analysis.line.extract import extract
from analysis.line.result import Flag, Line
from analysis.line.selection.continuity import GAP, select_chain
from analysis.line.settings import ExtractionSettings
from studio.photographs.line_ends import NEXT, SOFTER, alike

BESIDE, SPARE = 8.0, 12.0
"""Widths of the line, and px, beside it that are looked at: enough to tell its ground by."""


def looked_at_again(
    candidates: Line, image: NDArray[Any], settings: ExtractionSettings, noise: NoiseModel, judged: bool
) -> Line:
    """Candidates (n, k) of an image (h, w) -> (n, k + 1) with what stands out where their chain skips scan lines, as
    the last; as they are where it skips none. judged: as `extract` has it."""
    chain = select_chain(candidates)
    known = np.flatnonzero(chain.valid[:, 0])
    if len(known) < 2:
        return candidates
    skipped = np.setdiff1d(np.arange(known[0], known[-1]), known)
    after = np.searchsorted(known, skipped)
    first, last = known[after - 1], known[after]
    near = last - first <= GAP
    skipped, first, last = skipped[near], first[near], last[near]
    if not len(skipped):
        return candidates
    u = chain.u[:, 0]
    margin = BESIDE * float(np.median(chain.width[known, 0])) + SPARE
    low = np.floor(np.minimum(u[first], u[last]) - margin).astype(np.intp)
    lines = image if settings.axis == "rows" else image.T
    # windows of one size, so that they make an image
    size = min(int(np.ceil(np.abs(u[last] - u[first]).max() + 2.0 * margin)) + 1, lines.shape[1])
    low = np.clip(low, 0, lines.shape[1] - size)
    part = lines[skipped[:, None], low[:, None] + np.arange(size)]
    alone = settings.model_copy(update={"axis": "rows", "select": "strongest", "peaks": 1, "method": candidates.method})
    found = extract(part, settings=alone, noise=noise, threads=1, shared=False, judged=judged)
    place = found.u[:, 0] + low
    beside = [known[max(0, at - NEXT) : at + NEXT] for at in after[near]]
    like = np.array([_is_alike(found, i, chain, rows) for i, rows in enumerate(beside)])
    off = np.maximum(np.minimum(u[first], u[last]) - place, place - np.maximum(u[first], u[last]))
    kept = (like & (off <= chain.width[first, 0]))[:, None]
    flag = np.where(found.valid & ~kept, np.uint8(Flag.REJECTED), found.flag).astype(np.uint8)
    return _beside(candidates, skipped, replace(found, u=np.where(kept, place[:, None], np.nan), flag=flag))


def _is_alike(found: Line, i: int, chain: Line, beside: NDArray[np.intp]) -> bool:
    """Whether what was found on a scan line is as bright and as sharp as the line is on those beside it."""
    width, amplitude, widths = float(found.width[i, 0]), float(found.amplitude[i, 0]), chain.width[beside, 0]
    sharp = width <= SOFTER * float(np.median(widths))
    return sharp and alike(width, amplitude, widths, float(np.median(chain.amplitude[beside, 0])))


def _beside(line: Line, rows: NDArray[np.intp], more: Line) -> Line:
    """The line (n, k) with what was found (m, 1) on some scan lines as rank k."""
    values: dict[str, Any] = {}
    for field in fields(Line):
        ours, theirs = getattr(line, field.name), getattr(more, field.name)
        if not isinstance(ours, np.ndarray):
            continue
        nothing: Any = np.uint8(Flag.NO_PEAK) if field.name == "flag" else 0.0 if field.name == "shared_u" else np.nan
        rank = np.full((len(line.u), 1), nothing)
        rank[rows] = nothing if theirs is None else theirs
        values[field.name] = np.concatenate([ours, rank], axis=1).astype(ours.dtype)
    return replace(line, **values)
