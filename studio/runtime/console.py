"""What a person sees while a command runs: progress on standard error, results on standard output.

Names come from files, and files from strangers: nothing that is printed is taken as markup or reaches the terminal as
a control character.
"""

from __future__ import annotations

import sys
import textwrap
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from studio.runtime.streams import clean, unescaped

if TYPE_CHECKING:
    from rich.console import Console

StageProgress = Callable[[str, float], None]
Note = Callable[[str], str]
REFRESH_SECONDS = 0.1
PLAIN_WIDTH = 160
"""Columns where there is no terminal to ask."""
FRAMES = "frames"
"""The stage that counts the frames of a moving scan."""


def silent(stage: str, done: float) -> None:
    """Progress that nobody watches."""


@contextmanager
def stage_progress(quiet: bool = False, note: Note = lambda stage: "", *, frames: int = 1) -> Iterator[StageProgress]:
    """Yield progress(stage, done 0..1): a bar with an estimate on a terminal, else a line for every finished stage.

    note: what else there is to say of a stage, as it is now; frames: how many a scan will take.
    """
    if quiet:
        yield silent
    elif sys.stderr.isatty():
        with _bars(note, frames) as report:
            yield report
    else:
        yield _lines(note, frames)


def frame_of(done: float, frames: int) -> str:
    """Which frame of a scan is under way, given the share that is done: "frame 19 of 20"."""
    return f"frame {min(int(done * frames + 0.5) + 1, frames)} of {frames}"


def print_table(title: str, rows: Sequence[Sequence[str]], *, header: Sequence[str] = ()) -> None:
    """A titled table; the first column names the row, numbers below a header are aligned to the right and never cut."""
    from rich.table import Table

    table = Table(title=clean(title), title_justify="left", title_style="bold", show_header=bool(header), box=None)
    for i in range(max(map(len, rows), default=0)):
        justify: Any = "right" if header and i > 0 else "left"
        style = "dim" if i == 0 and not header else None
        table.add_column(
            clean(header[i]) if header else "", style=style, justify=justify, no_wrap=(i == 0) != bool(header)
        )
    for row in rows:
        table.add_row(*map(clean, row))
    _console(sys.stdout).print(table)


def print_plan(lines: Sequence[str], *, to_errors: bool = False) -> None:
    """What is computed of the light, then what is left out, each with its reason."""
    stream = sys.stderr if to_errors else sys.stdout
    print("Plan", file=stream)
    for line in lines:
        print(textwrap.fill(line, PLAIN_WIDTH, initial_indent="  ", subsequent_indent="    "), file=stream)


@contextmanager
def _bars(note: Note, frames: int) -> Iterator[StageProgress]:
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description:<34}", markup=False),
        BarColumn(bar_width=30),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        TextColumn("{task.fields[note]}", style="dim", markup=False),
    )
    tasks: dict[str, Any] = {}
    shown: dict[str, float] = {}
    with Progress(*columns, console=_console(sys.stderr)) as bars:

        def report(stage: str, done: float) -> None:
            if stage not in tasks:
                tasks[stage] = bars.add_task(clean(stage), total=1.0, note="")
            elif done <= 0.0 and bars.tasks[tasks[stage]].finished:
                bars.reset(tasks[stage])  # the same stage of the next frame
            now = time.monotonic()
            if done >= 1.0 or now - shown.get(stage, 0.0) >= REFRESH_SECONDS:
                shown[stage] = now
                told = frame_of(done, frames) if stage == FRAMES else stage
                bars.update(tasks[stage], description=told, completed=done, note=clean(note(stage)))

        yield report


def _lines(note: Note, frames: int) -> StageProgress:
    started: dict[str, float] = {}
    told: set[str] = set()

    def report(stage: str, done: float) -> None:
        if stage == FRAMES:
            if done < 1.0:
                print(frame_of(done, frames), file=sys.stderr)
        elif done <= 0.0:
            started[stage] = time.monotonic()
        elif done >= 1.0 and stage in started and stage not in told:  # of many frames the first speaks for all
            told.add(stage)
            more = note(stage)
            print(f"{stage}: {time.monotonic() - started[stage]:.1f} s{more and f', {more}'}", file=sys.stderr)

    return report


def _console(stream: Any) -> Console:
    from rich.console import Console

    width = None if stream.isatty() else PLAIN_WIDTH
    return Console(file=unescaped(stream), highlight=False, markup=False, emoji=False, width=width)
