"""What a person sees while a command runs: progress on standard error, results on standard output."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console

StageProgress = Callable[[str, float], None]
REFRESH_SECONDS = 0.1


def silent(stage: str, done: float) -> None:
    """Progress that nobody watches."""


@contextmanager
def stage_progress(quiet: bool = False) -> Iterator[StageProgress]:
    """Yield progress(stage, done 0..1): a bar with an estimate on a terminal, else a line for every finished stage."""
    if quiet:
        yield silent
    elif sys.stderr.isatty():
        with _bars() as report:
            yield report
    else:
        yield _lines()


def print_json(result: dict[str, Any]) -> None:
    """The machine-readable result, one JSON object, the only thing on standard output."""
    sys.stdout.write(json.dumps(result, indent=2, allow_nan=False, default=str) + "\n")
    sys.stdout.flush()


def print_table(title: str, rows: list[tuple[str, str]], *, stream: Any = None) -> None:
    """Names and values in two columns."""
    from rich.table import Table

    table = Table(title=title, title_justify="left", title_style="bold", show_header=False, box=None, pad_edge=False)
    table.add_column(style="dim", no_wrap=True)
    table.add_column(overflow="fold")
    for name, value in rows:
        table.add_row(name, value)
    _console(stream or sys.stdout).print(table)


@contextmanager
def _bars() -> Iterator[StageProgress]:
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description:<34}"),
        BarColumn(bar_width=30),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    tasks: dict[str, Any] = {}
    shown: dict[str, float] = {}
    with Progress(*columns, console=_console(sys.stderr)) as bars:

        def report(stage: str, done: float) -> None:
            if stage not in tasks or (done == 0.0 and bars.tasks[tasks[stage]].finished):
                tasks[stage] = bars.add_task(stage, total=1.0)
            now = time.monotonic()
            if done >= 1.0 or now - shown.get(stage, 0.0) >= REFRESH_SECONDS:
                shown[stage] = now
                bars.update(tasks[stage], completed=done)

        yield report


def _lines() -> StageProgress:
    started: dict[str, float] = {}

    def report(stage: str, done: float) -> None:
        if done <= 0.0:
            started[stage] = time.monotonic()
        elif done >= 1.0:
            seconds = time.monotonic() - started.pop(stage, time.monotonic())
            print(f"{stage}: {seconds:.1f} s", file=sys.stderr)

    return report


def _console(stream: Any) -> Console:
    from rich.console import Console

    return Console(file=stream, highlight=False, soft_wrap=not stream.isatty())
