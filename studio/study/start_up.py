"""How long the workers of a study take until they begin: what their last start on this machine took."""

from __future__ import annotations

import json
from contextlib import suppress
from pathlib import Path

from render.base.errors import InputError
from render.base.files import atomic_write, read_bytes
from render.base.kernel_cache import kept_in

USUAL = 15.0
"""s, of processes that load the program and its kernels, before any was started here."""
FILE = "study_start.json"
"""Beside the kernels that workers load, as with others they take another time."""
MOST_BYTES = 2**16


def foretold(workers: int) -> float:
    """s until so many workers begin."""
    return _known().get(str(workers), USUAL)


def remember(workers: int, seconds: float) -> None:
    """What a start took. Where nothing can be written it is forgotten."""
    known = {**_known(), str(workers): round(seconds, 1)}
    with suppress(InputError, OSError), atomic_write(_file()) as temporary:
        temporary.write_text(json.dumps(known))


def _known() -> dict[str, float]:
    try:
        told = json.loads(read_bytes(_file(), MOST_BYTES))
    except (InputError, OSError, ValueError):
        return {}
    found = told.items() if isinstance(told, dict) else ()
    return {name: float(value) for name, value in found if isinstance(value, int | float) and 0.0 <= value < 1e5}


def _file() -> Path:
    return Path(kept_in(), FILE)
