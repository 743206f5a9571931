"""The version of the program."""

from __future__ import annotations

from importlib import metadata


def version() -> str:
    """Of the program, as it is installed."""
    try:
        return metadata.version("blazer-studio")
    except metadata.PackageNotFoundError:
        return ""
