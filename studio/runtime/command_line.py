"""The command line's frame: every way a command can end becomes one message and an exit code.

Only click is imported here, and what needs the standard library alone, so that --help answers at once.
"""

from __future__ import annotations

import math
import os
import signal
import sys
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import click

from studio.runtime.streams import finish, print_json, streams
from studio.runtime.system import message, missing_needs, missing_python_package, why_not_in_this_folder

BAD_INPUT, INTERNAL_ERROR, INTERRUPTED, BROKEN_PIPE = 2, 3, 130, 141
LONGEST_MESSAGE = 2000
"""Characters; what click and the system quote may be of any length."""
NEEDS_LESS = "fewer pixels (--scale, where a command has it) or smaller meshes, textures and images need less"
ISSUE_HINT = "this is a fault of Blazer Studio, please report it; --debug shows where it happened"


def require_system() -> None:
    """Before heavy imports: name the system libraries that are missing, and the command that brings them."""
    missing, reason = missing_needs(), why_not_in_this_folder()
    if missing or reason:
        from render.base.errors import InputError

        raise InputError(reason or f"the system lacks libraries\n{message(missing)}")


class FiniteRange(click.FloatRange):
    """A number between two limits; click's own range lets NaN through, which compares with nothing."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        number = float(super().convert(value, param, ctx))
        if not math.isfinite(number):
            self.fail(f"{value} is not a finite number in the range {self._describe_range()}.", param, ctx)
        return number


class Commands(click.Group):
    """Turns every way a command can end into one message and an exit code."""

    def resolve_command(self, context: click.Context, args: list[str]) -> Any:
        """A path in place of a command is a project to open."""
        if args and args[0] not in self.commands and (args[0].lower().endswith(".json") or os.path.exists(args[0])):
            args = ["open", *args]
        return super().resolve_command(context, args)

    def main(self, args: Sequence[str] | None = None, *given: Any, **extra: Any) -> Any:
        """Ends the program, by SystemExit. What is wrong with the options is told before they are known."""
        words = list(sys.argv[1:] if args is None else args)
        asked = [word.split("=")[0] for word in (words[: words.index("--")] if "--" in words else words)]
        with streams("--json" in asked):
            try:
                ended = super().main(args, *given, **{**extra, "standalone_mode": False})
                if isinstance(ended, BaseException):
                    raise ended
                code: Any = ended if isinstance(ended, int) else 0
                finish(code)
                if args is None:
                    signal.signal(signal.SIGINT, signal.SIG_IGN)  # all is done and said
            except SystemExit as ended:  # click's end of shell completion, and of help that nobody reads
                code = BROKEN_PIPE if ended.code == 1 else ended.code
            except BaseException as error:
                if args is None:
                    signal.signal(signal.SIGINT, signal.SIG_IGN)  # once is enough
                code = _report_error(error, "--debug" in asked, "--json" in asked)
        if args is None:  # only threads are waited for from now on, and a second Ctrl-C ends that without a word
            signal.signal(signal.SIGINT, signal.SIG_DFL)
        sys.exit(code)

    def invoke(self, context: click.Context) -> Any:
        """Returns what ended a command: click has its own mind about some exceptions."""
        try:
            return super().invoke(context)
        except (click.ClickException, click.exceptions.Exit):
            raise
        except BaseException as error:
            return error


def _report_error(error: BaseException, debug: bool, as_json: bool) -> int:
    """Say what happened, on standard error and, where asked for, as JSON; return the exit code."""
    from render.base.errors import Cancelled, InputError
    from render.base.full_disk import is_full, no_room

    details: dict[str, Any] = {}
    if isinstance(error, BrokenPipeError) or isinstance(error.__context__, BrokenPipeError):
        return BROKEN_PIPE
    if isinstance(error, (KeyboardInterrupt, Cancelled, click.Abort)):
        kept = f"; {error}" if isinstance(error, Cancelled) and str(error) else ""
        code, text = INTERRUPTED, f"interrupted; no file was left half-written{kept}"
    elif isinstance(error, click.ClickException):
        code, text = BAD_INPUT, error.format_message()
        context = getattr(error, "ctx", None)
        if context is not None:
            text = f"{text.rstrip('.')}; see {context.command_path} --help"
    elif isinstance(error, InputError):
        code, text = BAD_INPUT, str(error)
        details = {name: getattr(error, name) for name in ("what", "where", "found", "allowed", "cure")}
    elif isinstance(error, ModuleNotFoundError) and not (error.name or "").startswith(("render", "analysis", "studio")):
        code, text = BAD_INPUT, missing_python_package(error.name)
    elif isinstance(error, MemoryError):
        code, text = BAD_INPUT, f"not enough memory{f' ({error})' if str(error) else ''}; {NEEDS_LESS}"
    elif is_full(error):
        code, text = BAD_INPUT, str(no_room(getattr(error, "filename", None) or "the system's files", error))
    elif isinstance(error, OSError):
        code, text = BAD_INPUT, f"{error.filename or 'the system refused'}: {error.strerror or error}"
    else:
        code, text = INTERNAL_ERROR, f"internal error: {type(error).__name__}: {error}; {ISSUE_HINT}"
    if debug:
        import traceback

        traceback.print_exception(error)
    if len(text) > LONGEST_MESSAGE:
        text = f"{text[: LONGEST_MESSAGE // 2]} ... {text[-LONGEST_MESSAGE // 2 :]}"
    print(f"error: {text}", file=sys.stderr)
    if as_json:
        with suppress(OSError):
            print_json({"ok": False, "exit_code": code, "error": {"message": text, **details}})
    return code
