"""Standard output and error as the commands use them: results alone on the one, readable text on both.

Standard library only, so that --help answers at once.
"""

from __future__ import annotations

import io
import json
import math
import os
import re
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

NOT_TEXT = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ufeff\ud800-\udfff]")
"""What moves the cursor or turns the direction of text, and the bytes of a file name that are no characters."""


def clean(text: str) -> str:
    r"""The text with every such character as an escape, `\x1b`; line ends and tabs stay."""
    return NOT_TEXT.sub(lambda found: found[0].encode("unicode_escape").decode(), text)


class Escaping:
    """A text stream that shows all that is written to it."""

    def __init__(self, stream: Any, lossy: bool) -> None:
        """lossy: what cannot be written is lost in silence."""
        self.stream, self.lossy = stream, lossy

    def write(self, text: str) -> int:
        try:
            self.stream.write(clean(text))
        except OSError:
            if not self.lossy:
                raise
        return len(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.stream, name)


def unescaped(stream: Any) -> Any:
    """The stream below, for what writes codes of the terminal on purpose."""
    return stream.stream if isinstance(stream, Escaping) else stream


class Answer:
    """Where the JSON object goes that is all of standard output, whether it went, and what else was printed."""

    def __init__(self, stream: Any) -> None:
        self.stream, self.given, self.words = stream, False, io.StringIO()


_answer: Answer | None = None


@contextmanager
def streams(as_json: bool) -> Iterator[None]:
    """Make the standard streams so, until the context ends; what libraries write to descriptor 1 goes to the errors.

    as_json: only `print_json` writes to standard output. What else is printed goes to the errors, or becomes the
    answer's `text` where a command has no other (--help).
    """
    global _answer
    _open_closed()
    before = sys.stdout, sys.stderr, warnings.formatwarning, _answer
    results = _results_alone(sys.stdout)
    errors = sys.stderr
    for stream in (results, errors):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    warnings.formatwarning = _one_line
    sys.stderr = Escaping(errors, lossy=True)
    _answer = Answer(results) if as_json else None
    sys.stdout = Escaping(results, lossy=False) if _answer is None else _answer.words
    try:
        yield
    finally:
        if _answer is not None:
            sys.stderr.write(_answer.words.getvalue())
        sys.stdout, sys.stderr, warnings.formatwarning, _answer = before
        _flush(results)
        _flush(errors)
        if results is not before[0]:
            results.close()


def print_json(result: dict[str, Any]) -> None:
    """The machine-readable result: one JSON object, the only thing on standard output. What is not finite is null."""
    text = json.dumps(_plain(result), indent=2, allow_nan=False) + "\n"
    stream = sys.stdout
    if _answer is not None:
        if _answer.given:
            return
        _answer.given, stream = True, _answer.stream
    stream.write(text)
    stream.flush()


def finish(code: int) -> None:
    """All that is left to print is printed. OSError: it cannot be."""
    if _answer is not None and not _answer.given:
        print_json({"ok": code == 0, "exit_code": code, "text": _answer.words.getvalue()})
        _answer.words.truncate(0)
    sys.stdout.flush()


def _plain(value: Any) -> Any:
    """What JSON can hold: finite numbers, Unicode text."""
    if isinstance(value, dict):
        return {_text(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [_plain(item) for item in value]
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    if value is None or isinstance(value, bool | int):
        return value
    if hasattr(value, "tolist"):  # numbers and arrays of numpy
        return _plain(value.tolist())
    return _text(value)


def _text(value: Any) -> str:
    return str(value).encode("utf-8", "backslashreplace").decode("utf-8")


def _open_closed() -> None:
    """A stream that was closed on purpose leads nowhere; its number must not become that of a file."""
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        with suppress(OSError):
            os.fstat(number)
            continue
        os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free
        if getattr(sys, name) is None:
            setattr(sys, name, open(number, "r" if number == 0 else "w", closefd=False))  # noqa: SIM115


def _results_alone(stdout: Any) -> Any:
    """A stream to standard output that C libraries do not know: from now on theirs leads to standard error."""
    try:
        if stdout.fileno() != 1:
            return stdout
    except (AttributeError, OSError, ValueError):
        return stdout  # a test's
    stdout.flush()
    kept = os.dup(1)
    os.dup2(2, 1)
    prompt = stdout.line_buffering or stdout.write_through
    return open(kept, "w", buffering=1 if prompt else -1, encoding=stdout.encoding)


def _flush(stream: Any) -> None:
    """Or lead it nowhere, so that the interpreter does not try again, and complain, when it ends."""
    try:
        stream.flush()
    except OSError:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)
        stream.flush()


def _one_line(message: Warning | str, category: type[Warning], *where: Any, **more: Any) -> str:
    return f"warning: {message}\n" if category is UserWarning else _usual(message, category, *where, **more)


_usual = warnings.formatwarning
