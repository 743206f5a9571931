"""What is wrong with how a command ended, with what it said, and with what it left behind."""

from __future__ import annotations

import csv
import hashlib
import json
import os
import re
import signal
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from analysis.cloud import read_ply
from tests.mutations.cases import Case
from tests.mutations.fork import FUNCTIONS, MOST_SECONDS, Ended

MOST_MEMORY = 1 << 30
LONGEST_MESSAGE = 3000
INTERNAL = re.compile(
    r"Traceback|AssertionError|cannot reshape|NoneType|(list|tuple|string|array) index|object has no attribute"
    r"|(Value|Type|Key|Index|Attribute|Overflow|Recursion|ZeroDivision|Runtime|Unicode\w*|OS|Memory|LinAlg)Error"
    r"|invalid literal|codec can't|could not convert|struct\.error|unpack requires|object at 0x|dtype|ufunc|broadcast"
    r"|(User|Runtime|Deprecation)Warning|<class|positional argument|unhashable|not subscriptable|not iterable"
    r"|out of bounds for axis|internal error|buffer size|embedded null|Errno|(?<!main)\.py\b|cv2|OpenCV\("
)
"""Words of Python and of libraries, which tell nobody what to do."""
CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")
NOT_FINITE = re.compile(r"[-+]?(?:nan|inf|infinity)", re.IGNORECASE)
HASHED = 1 << 28
"""Bytes; a larger file is known by the time of its last change."""

State = dict[str, str]


@dataclass(frozen=True)
class Verdict:
    """How a case ended; no faults: as it should."""

    kind: str
    seed: int
    command: str
    code: int
    seconds: float
    megabytes: int
    faults: list[str]
    place: str
    """Where in the program, as far as known."""
    err: str

    def __str__(self) -> str:
        lines = (
            f"{self.kind} {self.seed}: {self.command}",
            *self.faults,
            f"at {self.place or 'a place unknown'}, exit {self.code}, {self.seconds} s, {self.megabytes} MB",
            *self.err[-600:].splitlines(),
            f"again: python -m tests.mutations {self.kind} {self.seed} --keep FOLDER",
        )
        return "\n  ".join(lines)


def faults(case: Case, ended: Ended, before: State, after: State) -> list[str]:
    """In words, none if all is well. before, after: `state` of the case's folder."""
    found = list(_of_ending(case, ended))
    changed = sorted(name for name in before if after.get(name) != before[name] and not name.startswith(case.rewrites))
    found += [f"changed or removed its input {name!r}" for name in changed[:3]]
    new = sorted(after.keys() - before.keys())
    found += [f"left {name!r} behind" for name in new if Path(name).name.startswith(".")][:3]
    if ended.code == 0:
        found += [fault for name in new if (fault := _of_result(case.folder / name)) is not None][:3]
    return found


def _of_ending(case: Case, ended: Ended) -> Iterator[str]:
    code, out, err = ended.code, ended.out, ended.err
    if code in (-signal.SIGXCPU, -signal.SIGKILL):
        yield f"time: more than {MOST_SECONDS} s"
        return
    if code == -signal.SIGALRM:
        yield "time: waits for ever"
        return
    if code not in (0, 2):
        yield f"exit {code}" if code >= 0 else f"signal {signal.Signals(-code).name}"
    if ended.memory > MOST_MEMORY:
        yield f"memory: {ended.memory >> 20} MB"
    if "not enough memory" in err:
        yield "memory: more than the machine has"
    messages = re.findall(r"^error: .*", err, re.MULTILINE | re.IGNORECASE)
    if code == 2 and len(messages) != 1 and not (messages and case.argv[0] == "extract"):  # one for each image
        yield f"{len(messages)} messages"
    if code == 0 and messages:
        yield "a message in spite of exit 0"
    if any(len(message) > LONGEST_MESSAGE for message in messages):
        yield f"a message of more than {LONGEST_MESSAGE} characters"
    words = INTERNAL.search(err) or INTERNAL.search(out)
    if words and code in (0, 2):
        yield f"words of Python: {words[0]}"
    if CONTROL.search(out) or CONTROL.search(err):
        yield "control characters reach the terminal"
    options = case.argv[: case.argv.index("--")] if "--" in case.argv else case.argv
    if "--json" in options and case.argv[0] not in FUNCTIONS:
        try:
            if json.loads(out, parse_constant=_no_constant)["ok"] != (code == 0):
                yield "ok and the exit code disagree"
        except (ValueError, KeyError, TypeError):
            yield f"standard output is {'no JSON object' if out else 'empty'} in spite of --json"
    elif code == 0 and re.search(r"\b(nan|inf)\b", out, re.IGNORECASE):
        yield "NaN or infinity printed"


def _of_result(file: Path) -> str | None:
    """A result file that is damaged, or holds what is no number."""
    if file.suffix == ".csv":
        with open(file, encoding="utf-8", newline="") as lines:
            rows = list(csv.DictReader(lines))
        # an error is NaN where the point has no truth
        cells = [(name, cell) for row in rows for name, cell in row.items() if not name.startswith("error_")]
        bad = sorted({name for name, cell in cells if NOT_FINITE.fullmatch(cell.strip())})
        return f"NaN or infinity in {file.name}: {', '.join(bad)}" if bad else None
    if file.suffix == ".json" and not file.stem.endswith(".damaged"):  # put aside as it was
        try:
            json.loads(file.read_text("utf-8"), parse_constant=_no_constant)
        except ValueError as error:
            return f"{file.name} is no strict JSON: {error}"
    if file.suffix == ".ply" and "meshes" not in file.parts:  # there it is a mesh that was imported, as it came
        points = read_ply(file)
        bad = [name for name in "xyz" if name in points and not np.isfinite(points[name]).all()]
        return f"NaN in {file.name}: {', '.join(bad)}" if bad else None
    return None


def _no_constant(name: str) -> None:
    raise ValueError(name)


def state(folder: Path) -> State:
    """Every file of a case, by its name relative to `folder`, with the digest of what is in it."""
    found = {}
    for file in folder.parent.rglob("*"):
        stream = file.parent == folder.parent and file.name in ("stdout", "stderr")
        if file.is_symlink() or not file.is_file() or stream:
            continue
        status = file.stat()
        content = hashlib.sha256(file.read_bytes()).hexdigest() if status.st_size < HASHED else str(status.st_mtime_ns)
        found[os.path.relpath(file, folder)] = content
    return found


def place_of(text: str) -> str:
    """The last line of a traceback in the program's own files, and the exception."""
    lines = re.findall(r'File "[^"]*/((?:render|analysis|studio)/[\w/]+\.py|main\.py)", line \d+,? in (\w+)', text)
    raised = re.findall(r"^(?:[\w.]+\.)?(\w+(?:Error|Exception|Warning)\b:? ?.{0,80})", text, re.MULTILINE)
    at = [f"{file}:{function}" for file, function in lines if function not in ("invoke", "_report_error")]
    if not at:
        return ""
    first = "most recent call first" in text  # as faulthandler has it
    return " ".join([at[0] if first else at[-1], *raised[-1:]])
