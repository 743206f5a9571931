"""What `main.py chooser` does: train the network of `--select learned` on recipes."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from render.base.errors import InputError
from studio.chooser.network import check_onnx
from studio.chooser.train import gathered, told_of, trained, write
from studio.commands.places import check_output, never
from studio.dataset.recipe import Recipe
from studio.runtime.console import print_table, stage_progress
from studio.runtime.streams import print_json
from studio.runtime.workers import Engine
from studio.scan.interrupt import stop_on_interrupt

FEW = 0.01
"""Share of wrong rows from which a warning says so."""
MANY = 0.2
"""Share of frames like its own that it flags, from which a warning says so."""


def chooser_command(
    recipes: Sequence[Path],
    *,
    count: int,
    seed: int,
    out: Path,
    workers: int | None,
    quiet: bool,
    as_json: bool,
) -> None:
    """`chooser`: render scenes of the recipes, train, write the weights and their card, and tell the scores."""
    if out.suffix != ".onnx":
        raise InputError("weights are an ONNX file", where="--out", found=str(out), allowed="a name that ends in .onnx")
    check_onnx()
    check_output(out.parent)
    loaded = [Recipe.load(one) for one in recipes]
    with stage_progress(quiet) as progress, stop_on_interrupt(never) as cancelled:
        samples = gathered(
            loaded,
            count,
            engine=Engine(workers),
            progress=lambda done, known: progress("scenes", done / max(known, 1)),
            cancelled=cancelled,
        )
    found = trained(samples, seed, told_of(loaded, count))
    write(out, found)
    scores = found.card.scores
    if as_json:
        print_json({"ok": True, "file": str(out), "card": str(out.with_suffix(".json")), "scores": scores})
        return
    print_table("Scenes that it never saw", _rows(scores))
    if scores["rows"]["wrong"] > FEW:
        print("warning: it is often wrong; more scenes (--count) or a narrower recipe may help", file=sys.stderr)
    if scores["flagged"] > MANY:
        print("warning: it takes frames of its own recipes for strange; more scenes (--count) help", file=sys.stderr)
    print(f"wrote {out} and {out.with_suffix('.json')}")


def _rows(scores: dict[str, Any]) -> list[tuple[str, str]]:
    rows = scores["rows"]
    told = [
        ("wrong rows", f"{rows['wrong']:.2%}"),
        ("rows measured", f"{rows['right']:.1%} of {rows['possible']:.1%} with a candidate on the line"),
        ("frames flagged as unlike", f"{scores['flagged']:.1%}"),
    ]
    unlike = scores["unlike"].items()
    return told + [(f"{name}: flagged, AUC", f"{one['flagged']:.1%}, {one['auc']:.3f}") for name, one in unlike]
