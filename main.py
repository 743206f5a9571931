"""The one entry of Blazer Studio."""

from __future__ import annotations

import click


@click.group(invoke_without_command=True)
def cli() -> None:
    """Simulate line laser scanners."""


if __name__ == "__main__":
    cli()
