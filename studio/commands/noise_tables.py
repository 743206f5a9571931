"""What rendering may add to the depth, as a person reads it before a scan and after."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

from analysis.report.light_text import NAMES, noise_text, seconds_text
from studio.runtime.console import print_table
from studio.scan.depth_noise import DepthNoise


def print_foreseen(noise: Sequence[DepthNoise]) -> None:
    """On standard error, beside the plan."""
    if noise:
        print("Noise that rendering may add to the depth, in 95% of the rows", file=sys.stderr)
    for one in noise:
        told = noise_text(one.allowed, one.foreseen_m)
        if one.foretold_seconds is not None:
            told += f", {seconds_text(one.foretold_seconds)}"
        print(f"  {one.laser}, {NAMES[one.group]}: {told}", file=sys.stderr)


def print_reached(noise: Sequence[dict[str, Any]]) -> None:
    """Of a manifest: what was allowed, what was reached in the first frame, and the time that it took."""
    rows = []
    for one in noise:
        reached = "-" if one["reached"] is None else noise_text(one["reached"], one["reached_m"])
        spent = "-" if one["seconds"] is None else f"{one['seconds']:.2g} s"
        foretold = "-" if one["foretold_seconds"] is None else f"{float(format(one['foretold_seconds'], '.1g')):g} s"
        allowed = noise_text(one["allowed"], one["foreseen_m"])
        rows.append((f"{one['laser']}, {NAMES[one['group']]}", allowed, reached, foretold, spent))
    if rows:
        print_table(
            "Noise of the render in depth",
            rows,
            header=("light", "allowed, foreseen", "reached", "processor, foretold", "time"),
        )
