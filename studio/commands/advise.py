"""What `main.py advise` does: a table of what each part of the render is good for, a proof, a cheaper project."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from analysis.study.intervals import Interval
from render.base.errors import InputError
from studio.commands.places import check_output, load_project, never
from studio.project.project import Project
from studio.project.project_files import carry
from studio.runtime.console import print_table, stage_progress
from studio.runtime.streams import print_json
from studio.runtime.workers import Engine
from studio.scan.interrupt import stop_on_interrupt
from studio.study.advice import PAYS, Advice, Proof, Question, advise
from studio.study.alike import Change
from studio.study.cheaper_parts import GOAL, TRANSPORT
from studio.study.study import require_laser


def advise_project(
    path: Path | None, *, out: Path | None, within: float, seeds: int, quiet: bool, as_json: bool, **given: Any
) -> None:
    """given: scale, laser and workers. InputError: as `Project.load`; `out` is there already or cannot be written."""
    project, root = load_project(path)
    if out is not None:
        check_target(out)
    laser = require_laser(project, given["laser"], "--laser")
    question = Question(within / 100.0, seeds, given["scale"], laser, Engine(given["workers"]))
    with stage_progress(quiet) as progress, stop_on_interrupt(never) as cancelled:
        found = advise(project, question, progress, cancelled)
    written = None
    if out is not None and found.proved is not None:
        written = write_project(out, found.project(project), root)
    if as_json:
        print_json({"ok": True, **_as_data(found), "written": None if written is None else str(written)})
        return
    _print(found, question, project)
    if written is not None:
        print(f"wrote {written}")
    elif out is not None:
        print(f"nothing was written to {out}")


def check_target(out: Path) -> None:
    """InputError: the file is there, or could not be written."""
    check_output(out.parent)
    if out.exists():
        cure = "choose another file with --out"
        raise InputError("a project would replace a file that is there", where=str(out), cure=cure)


def write_project(out: Path, project: Project, root: Path) -> Path:
    """The project and the files that it names, which move with it. InputError: another file is in the way."""
    carry(project, root, out.parent)
    project.save(out)
    return out


def _print(found: Advice, question: Question, project: Project) -> None:
    header = ("part", "instead", "seconds", "depth bias", "depth sigma", "wrong rows", "taken")
    rows = [
        (one.part.name, one.part.change, _seconds(one.found), _percent(one.found.bias), _percent(one.found.sigma),
         _wrong(one.found), "yes" if one.taken else "no")
        for one in found.tried
    ]  # fmt: skip
    if rows:
        print_table(f"What each part of {project.name} is good for", rows, header=header)
        print(
            "Bias in % of the depth error's RMS, sigma in % of itself, both of the rows measured on the line; wrong "
            "rows in % of the rows on which it can be seen; processor seconds of a frame, medians. On the seeds of "
            "the choice, the first of them alone where it decides."
        )
        if any(one.taken and one.part.name in (GOAL, TRANSPORT) for one in found.tried):
            print(f"What stands below a {GOAL} or {TRANSPORT} that is taken is tried with it, and held against it.")
    if found.untried:
        least = f"{100.0 * (1.0 - PAYS):.0f} %"
        print(f"Not tried, as less than {least} of the seconds could be saved: {', '.join(found.untried)}.")
    asked = f"{100.0 * question.within:g} %"
    for number, proof in enumerate(found.proofs, 1):
        print(f"Proof {number}: {_sentence(proof, question.within)}")
    if found.proved is None:
        print(f"No cheaper project is known that measures within {asked} of this one.")
    if question.image_scale != 1.0:
        print(f"All this holds at image scale {question.image_scale:g}; --scale 1 asks the scanner itself.")


def _sentence(proof: Proof, share: float) -> str:
    asked = f"{100.0 * share:g} %"
    found, parts = proof.found, ", ".join(f"{part.name} {part.change}" for part in proof.parts)
    within = f"within {asked}" if proof.alike else f"not shown to be within {asked}"
    if not proof.alike and found.undecided(share) and not found.beyond(share):
        within += ", nor could it be by so few: the intervals are wider than that, and more --seeds or rows narrow them"
    pays = "" if proof.holds or not proof.alike else ", which is not worth a change"
    return (
        f"{parts}: on {len(proof.seeds)} fresh seeds bias changes by {_percent(found.bias)}, sigma by "
        f"{_percent(found.sigma)}, completeness by {_percent(found.completeness)} and wrong rows, {_wrong(found)}, by "
        f"{_percent(found.wrong)} of the rows to be seen (95 % intervals), {within}; {found.seconds:.3g} s in place of "
        f"{found.seconds_before:.3g} s a frame{pays}."
    )


def _wrong(found: Change) -> str:
    """Before and after."""
    if not math.isfinite(found.wrong_after):
        return "measures nothing"
    return f"from {100.0 * found.wrong_before:.2g} to {100.0 * found.wrong_after:.2g} %"


def _seconds(found: Change) -> str:
    return f"{found.seconds:.3g} of {found.seconds_before:.3g}"


def _percent(one: Interval) -> str:
    if not math.isfinite(one.mean):
        return "measures nothing"
    if one.count == 1:
        return f"{100.0 * one.mean:+.2g} %"
    return f"{100.0 * one.low:+.2g} to {100.0 * one.high:+.2g} %"


def _as_data(found: Advice) -> dict[str, Any]:
    tried = [
        {"part": one.part.name, "instead": one.part.change, "values": dict(one.part.values), "taken": one.taken,
         **_numbers(one.found)}
        for one in found.tried
    ]  # fmt: skip
    proofs = [
        {"values": {field: value for part in proof.parts for field, value in part.values.items()},
         "seeds": list(proof.seeds), "holds": proof.holds, **_numbers(proof.found)}
        for proof in found.proofs
    ]  # fmt: skip
    return {"parts": tried, "proofs": proofs, "proved": found.proved is not None, "not_tried": found.untried}


def _numbers(found: Change) -> dict[str, Any]:
    """Shares, not percent; None: nothing was measured."""
    intervals = {"bias": found.bias, "sigma": found.sigma, "completeness": found.completeness, "wrong": found.wrong}
    said: dict[str, Any] = {
        name: [value if math.isfinite(value) else None for value in (one.mean, one.low, one.high)]
        for name, one in intervals.items()
    }
    rows = {"wrong_before": found.wrong_before, "wrong_after": found.wrong_after}
    said |= {name: value if math.isfinite(value) else None for name, value in rows.items()}
    return {**said, "seconds": found.seconds, "seconds_before": found.seconds_before}
