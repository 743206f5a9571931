"""Runs one command line in a fork of this process, within bounds, as a shell in UTF-8 would start the program."""

from __future__ import annotations

import faulthandler
import math
import os
import resource
import select
import signal
import sys
import traceback
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import main
from render.base.errors import InputError
from studio.calibration.exchange import read_camera
from studio.editing.units import Unit
from studio.project import step_file
from studio.project.autosave import find, sweep
from studio.project.mesh_import import import_mesh, import_step
from studio.project.step_file import is_step
from studio.runtime.preferences import PreferencesFile
from studio.runtime.streams import clean

MOST_SECONDS = 20
"""Of processor time, all threads together."""
PATIENCE = 10.0
"""s without any processor time, after which a case waits for ever; one that only lacks a processor gets some."""
MOST_ADDRESSES = 3 << 30
"""Beyond those of the warm process: more than may be used, so that a fault does not take the machine's memory."""
MOST_WRITTEN = 4 << 30


@dataclass(frozen=True)
class Ended:
    """code: negative for a signal; seconds of processor time; memory: at most, bytes."""

    code: int
    seconds: float
    memory: int
    out: str
    err: str


def run_forked(argv: list[str], folder: Path, streams: Path) -> Ended:
    """Run a command line in `folder`, or one of FUNCTIONS. streams: where its standard output and error are kept."""
    files = [streams / "stdout", streams / "stderr"]
    child = os.fork()
    if child == 0:
        os._exit(_child(argv, folder, files))
    _wait(child)
    _, status, used = os.wait4(child, 0)
    seconds, code = used.ru_utime + used.ru_stime, os.waitstatus_to_exitcode(status)
    return Ended(code, seconds, used.ru_maxrss * 1024, *(_text(file) for file in files))


def _wait(child: int) -> None:
    """Until a process ends; SIGALRM for one that waits for ever."""
    ended = os.pidfd_open(child)
    spent: list[str] = []
    while not select.select([ended], [], [], PATIENCE)[0]:
        before, spent = spent, _spent(child)
        if spent == before:
            os.kill(child, signal.SIGALRM)
    os.close(ended)


def _spent(process: int) -> list[str]:
    """Processor time, in user and system mode, of a process and of the programs it waits for."""
    try:
        told = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[11:13]
        others = Path(f"/proc/{process}/task/{process}/children").read_text().split()
    except OSError:  # it has ended meanwhile
        return []
    return sum((_spent(int(other)) for other in others), told)


def exit_code(run: Callable[[], Any]) -> int:
    """What a program that does this would exit with, its traceback printed where it would print one."""
    try:
        run()
    except SystemExit as ended:
        return ended.code if isinstance(ended.code, int) else int(ended.code is not None)
    except BaseException:
        traceback.print_exc()
        return 1
    return 0


def _child(argv: list[str], folder: Path, files: list[Path]) -> int:
    for number, file in enumerate(files, 1):
        os.dup2(os.open(file, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), number)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.closerange(3, 1024)
    sys.stdout = os.fdopen(1, "w", encoding="utf-8", errors="strict", closefd=False)
    sys.stderr = os.fdopen(2, "w", encoding="utf-8", errors="backslashreplace", closefd=False, buffering=1)
    os.chdir(folder)
    faulthandler.enable(sys.stderr)
    for ending in (signal.SIGALRM, signal.SIGXCPU):  # tell where it was
        signal.signal(ending, signal.SIG_DFL)
        faulthandler.register(ending, sys.stderr, all_threads=True, chain=True)
    spent = int(sum(os.times()[:2]))
    resource.setrlimit(resource.RLIMIT_CPU, (spent + MOST_SECONDS, spent + MOST_SECONDS + 5))
    addresses = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (addresses + MOST_ADDRESSES,) * 2)
    resource.setrlimit(resource.RLIMIT_FSIZE, (MOST_WRITTEN,) * 2)
    warnings.resetwarnings()
    warnings.filterwarnings("ignore", category=DeprecationWarning)
    function = FUNCTIONS.get(argv[0])
    code = exit_code(lambda: main.cli(argv) if function is None else function(*argv[1:]))
    try:
        sys.stdout.flush()
    except OSError:
        return 120
    return code


def _text(file: Path) -> str:
    with open(file, "rb") as stream:
        return stream.read(4 << 20).decode("utf-8", "backslashreplace")


def _preferences(*argv: str) -> None:
    """As the window does: what is damaged gives the defaults, and can be changed and kept."""
    file = PreferencesFile(Path(argv[-1]))
    file.add_recent(Path("project.json"))
    file.change(theme="dark")
    if PreferencesFile(Path(argv[-1])).values != file.values and os.path.isfile(file.path):
        raise AssertionError("what was kept is not what is read")


def _recovery(*argv: str) -> None:
    for recovery in find(Path(argv[-1])):
        recovery.document()
        recovery.discard()
    sweep(Path(argv[-1]))


def _import(*argv: str) -> None:
    root = Path("imported")
    root.mkdir(exist_ok=True)
    try:
        with warnings.catch_warnings(record=True):  # the window shows them
            file = Path(argv[-1])
            # OpenCASCADE may facet for ever what is a kilometre wide: the limit of processor time ends it, no clock
            step_file.PATIENCE = 1e6
            import_step(file, root, 1e-5) if is_step(file) else import_mesh(file, root, 0.2)
    except InputError as error:
        if "--debug" in argv:
            traceback.print_exc()
        print(f"error: {error}", file=sys.stderr)
        sys.exit(2)


def _camera(*argv: str) -> None:
    """A camera in the format of others."""
    try:
        read_camera(Path(argv[-1]))
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(2)


def _expression(*argv: str) -> None:
    """A number as it is typed into a field."""
    try:
        value = Unit.of(argv[-2]).parse(argv[-1])
    except InputError as error:
        print(f"error: {clean(str(error))}", file=sys.stderr)
        sys.exit(2)
    if not math.isfinite(value):
        raise AssertionError("no field takes what is not finite")
    print(Unit.of(argv[-2]).with_unit(value))


FUNCTIONS = {
    "preferences": _preferences,
    "recovery": _recovery,
    "import": _import,
    "camera": _camera,
    "expression": _expression,
}
"""What the window does without a command line."""
