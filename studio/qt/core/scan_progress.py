"""How far a scan is, as one share of all its work: stages of a frame come again with each, and go back to nothing."""

from __future__ import annotations

from render.base.progress import StageProgress
from studio.runtime.console import FRAMES, frame_of
from studio.runtime.jobs import Progress

BEFORE, OF_FRAMES, AFTER, OF_AFTER = 0.02, 0.93, 0.96, 0.03
"""Shares that are done when the first frame begins, of all frames, before what follows the last one, and of that."""


def share(stage: str, done: float) -> float | None:
    """How much of a scan is done; None: the stage does not say."""
    if stage == FRAMES:
        return BEFORE + OF_FRAMES * done
    return AFTER + OF_AFTER * done if stage in ("writing points", "report") else None


def scan_progress(progress: Progress, count: int) -> StageProgress:
    """Hears every stage of a scan of so many frames, and tells which frame it is of."""
    at, where = 0.0, ""

    def tell(stage: str, done: float) -> None:
        nonlocal at, where
        at = max(at, share(stage, done) or 0.0)
        if stage == FRAMES:
            where = f"{frame_of(done, count)}: " if done < 1.0 else ""
        else:
            progress(where + stage, at)

    return tell
