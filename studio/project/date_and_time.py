"""When something was made, as files of this program say it."""

from __future__ import annotations

import datetime


def now() -> str:
    """Date and time with its zone, to the second."""
    return datetime.datetime.now().astimezone().isoformat(sep=" ", timespec="seconds")


def read_out(when: str) -> str:
    """Of `now`, as a person reads it here: 22 November 2026, 19:03. What is no date stays."""
    try:
        local = datetime.datetime.fromisoformat(when).astimezone()
    except ValueError:
        return when
    return f"{local.day} {local:%B %Y, %H:%M}"
