"""When something was made, as files of this program say it."""

from __future__ import annotations

import datetime


def now() -> str:
    """Date and time with its zone, to the second."""
    return datetime.datetime.now().astimezone().isoformat(sep=" ", timespec="seconds")
