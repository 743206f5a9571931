"""What every engine's process does alike: count its processor time, and leave an image for each budget of it."""

from __future__ import annotations

import json
import os
import time
from pathlib import Path

import numpy as np

THREADS = 2


def cpu_seconds() -> float:
    """Processor seconds of this process over all threads, divided by the threads it may use."""
    return time.process_time() / THREADS


def keep_to(threads: int = THREADS) -> None:
    """Use no more processors than the comparison allows, whatever an engine's own setting."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:threads])


def leave(folder: Path, image: np.ndarray, seconds: float, **more: float) -> None:
    """Write an image (h, w) and what it took; complete or not at all, since the process may abort at any time."""
    number = len(list(folder.glob("*.json")))
    np.save(folder / f"{number}.npy", image.astype(np.float32))
    partial = folder / f"{number}.partial"
    partial.write_text(json.dumps({"seconds": seconds, **more}))
    partial.rename(folder / f"{number}.json")
