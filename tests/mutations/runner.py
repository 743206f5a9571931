"""Runs cases, each in a fork of a process that has loaded the program, and gives a verdict on each."""

from __future__ import annotations

import contextlib
import io
import json
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path
from queue import SimpleQueue

import main
from tests.mutations.cases import WEIGHTS, Case, make
from tests.mutations.fork import exit_code, run_forked
from tests.mutations.sources import make_sources
from tests.mutations.verdict import HASHED, Verdict, faults, place_of, state

ROOT = Path(__file__).resolve().parents[2]
Named = tuple[str, int]
"""Kind and seed of a case."""


class Runner:
    """A process of its own, so that no thread of this one's is lost in a fork. Takes some seconds to start."""

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="mutations-", ignore_cleanup_errors=True)
        home = dict.fromkeys(("HOME", "XDG_CONFIG_HOME", "XDG_STATE_HOME", "XDG_CACHE_HOME"), self._folder.name)
        known = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
        self._process = subprocess.Popen(
            [sys.executable, "-c", f"from tests.mutations.runner import serve; serve({self._folder.name!r})"],
            cwd=ROOT,
            env={**known, **home, "PYTHONUTF8": "1", "PYTHONHASHSEED": "0"},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def run(self, kind: str, seed: int, keep: str = "") -> Verdict:
        """One case; keep: a folder for its files, which is emptied before."""
        assert self._process.stdin is not None and self._process.stdout is not None
        self._process.stdin.write(json.dumps([kind, seed, keep]) + "\n")
        self._process.stdin.flush()
        line = self._process.stdout.readline()
        if not line:
            raise RuntimeError(f"the runner could not start, or ended at {kind} {seed}")
        return Verdict(**json.loads(line))

    def close(self) -> None:
        self._process.communicate()
        self._folder.cleanup()


def run_all(cases: Iterable[Named], runners: int) -> Iterator[Verdict]:
    """The verdicts in order, from several runners."""
    free: SimpleQueue[Runner] = SimpleQueue()
    started = [Runner() for _ in range(runners)]
    for runner in started:
        free.put(runner)

    def one(case: Named) -> Verdict:
        runner = free.get()
        try:
            return runner.run(*case)
        finally:
            free.put(runner)

    pool = ThreadPoolExecutor(runners)
    try:
        yield from pool.map(one, cases)
    finally:
        pool.shutdown(cancel_futures=True)
        for runner in started:
            runner.close()


def share(count: int, first: int = 1) -> list[Named]:
    """About so many cases of all kinds, each by its weight and at least one, mixed; their seeds begin with `first`."""
    whole = sum(WEIGHTS.values())
    numbers = {kind: max(1, round(count * weight / whole)) for kind, weight in WEIGHTS.items()}
    return sorted(
        ((kind, first + k) for kind, number in numbers.items() for k in range(number)),
        key=lambda case: (case[1] - first + 0.5) / numbers[case[0]],
    )


def serve(folder: str) -> None:
    """Answer each line on standard input, a kind, a seed and a folder to keep, by a verdict; both are JSON."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    sources = make_sources(Path(folder) / "sources", _call)
    _warm(sources.folder / "moving")
    for line in sys.stdin:
        kind, seed, keep = json.loads(line)
        place = Path(keep or f"{folder}/case").absolute()
        shutil.rmtree(place, ignore_errors=True)
        answers.write(json.dumps(asdict(_judge(make(kind, seed, sources, place), place))) + "\n")
        answers.flush()
        if not keep:
            shutil.rmtree(place, ignore_errors=True)


def _warm(scan: Path) -> None:
    """Load what the commands load, so that a fork has it."""
    before = Path.cwd()
    os.chdir(scan)
    _call("inspect", "project.json", "--json")
    _call("reconstruct", "scan", "--out", "warm", "--json")
    _call("extract", "scan/frame_0000.png", "--out", "warm", "--json")
    os.chdir(before)


def _call(*argv: str) -> None:
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()) as told:
        code = exit_code(lambda: main.cli(list(argv)))
    if code:
        raise RuntimeError(f"{shlex.join(argv)} ended with {code}: {told.getvalue()}")


def _judge(case: Case, place: Path) -> Verdict:
    before = state(case.folder)
    ended = run_forked(case.argv, case.folder, place)
    found = faults(case, ended, before, state(case.folder))
    where = place_of(ended.err)
    if found and not where:
        where = _place_again(case, place.with_name(f"{place.name}-again"))
    return Verdict(
        kind=case.kind,
        seed=case.seed,
        command=shlex.join(case.argv),
        code=ended.code,
        seconds=round(ended.seconds, 2),
        megabytes=ended.memory >> 20,
        faults=found,
        place=where,
        err=ended.err[-2000:],
    )


def _place_again(case: Case, folder: Path) -> str:
    """Where in the program, by running the case again with its traceback shown."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(case.folder, folder / "work", symlinks=True, copy_function=_copy)
    shutil.rmtree(folder / "work" / "out", ignore_errors=True)
    ended = run_forked([case.argv[0], "--debug", *case.argv[1:]], folder / "work", folder)
    shutil.rmtree(folder, ignore_errors=True)
    return place_of(ended.err)


def _copy(source: str, target: str) -> None:
    if os.path.isfile(source) and os.path.getsize(source) < HASHED:  # no FIFO
        shutil.copy(source, target)
