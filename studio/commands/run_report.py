"""`main.py run REPORT.html`: the run that a report tells of, once more, and whether its numbers are the same."""

from __future__ import annotations

import platform
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from render.base.errors import InputError
from studio.commands.commands import print_scan, scan_into
from studio.commands.places import OUTPUT, folder_name
from studio.project.input_files import listed
from studio.scan.options import ScanOptions
from studio.scan.results import versions
from studio.scan.run_record import Recorded, input_root, other_figures, read_run

FREE = {"out", "threads", "quiet", "as_json", "report", "resume"}
"""Options that change no number."""


def run_report(
    path: Path,
    root: Path | None,
    chosen: Sequence[str],
    *,
    out: Path | None,
    quiet: bool,
    as_json: bool,
    **given: Any,
) -> None:
    """given: options of `run`; chosen: those that a person gave, of which the report's own are refused.

    InputError: as `read_run` and `input_root`.
    """
    refused = [f"--{name.replace('_', '-')}" for name in chosen if name not in FREE]
    if refused:
        raise InputError(
            "the report says itself how it was run",
            where=", ".join(refused),
            allowed="--out, --root, --threads, --resume, --no-report",
            cure="for other settings run the project",
        )
    found = read_run(path)
    place, said = input_root(found, root), found.record
    free = {name: given[name] for name in ("threads", "report", "resume")}
    options = ScanOptions(steps=said.frames, image_scale=said.image_scale, at_scale=True, **free)
    folder = out if out is not None else Path(OUTPUT) / f"{folder_name(found.project.name)}_again"
    done = scan_into(folder, found.project, place, options, source=path, quiet=quiet)
    differs = other_figures(said.results, done.manifest["results"])
    print_scan(done, quiet=quiet, as_json=as_json, more={"reproduced": not differs, "differs": differs})
    if differs:
        print(
            f"warning: {len(differs)} numbers differ from the report: {listed(differs)}{_why(found)}", file=sys.stderr
        )
    elif not as_json:
        print(f"every number is that of {path}, to the bit")


def _why(found: Recorded) -> str:
    said, now = found.record, versions()
    others = [f"{name} {then} then, {now.get(name, 'none')} now" for name, then in said.versions.items()
              if now.get(name) != then]  # fmt: skip
    if said.machine != platform.machine():
        others.append(f"machine {said.machine} then, {platform.machine()} now")
    if not said.finished:
        others.append("light of its frames was ended by the clock")
    return f"; likely because of {listed(others)}" if others else ""
