"""Photographs of every kind, broken or not, for `extract`, `reconstruct` and `twin`."""

from __future__ import annotations

import json
from pathlib import Path
from random import Random

import click

import main
from tests.mutations import images
from tests.mutations.project_cases import json_or_not
from tests.mutations.sources import Sources

METHODS = (
    "auto",
    "likelihood",
    "gaussian",
    "steger",
    "steger_2d",
    "phase",
    "centre_of_mass",
    "caruana",
    "row_maximum",
    "half_energy",
)


def image(sources: Sources, place: Path, rng: Random, harm: bool) -> list[str]:
    (place / "project.json").write_text(json.dumps(sources.projects["plane"]), encoding="utf-8")
    (place / "whole.png").write_bytes(images.encoded("png-16", sources.image))
    suffix, content = images.mutated(sources.image, rng) if harm else ("png", images.encoded("png-16", sources.image))
    name = f"image.{suffix}"
    (place / name).write_bytes(content)
    common = [*json_or_not(rng), "--out", "out"]
    use = (
        rng.choice(
            ("extract",) * 6 + ("reconstruct", "reconstruct", "hdr", "off", "sweep", "ridges", "geometry", "twin")
        )
        if harm
        else "extract"
    )
    if use == "reconstruct":
        return ["reconstruct", name, "--project", "project.json", *common]
    if use == "twin":
        return ["twin", "project.json", name, "whole.png", *common[:-1], "twin.json"]
    order = rng.sample([name, "whole.png"], 2)
    if use == "hdr":
        return ["extract", *order, "--hdr", rng.choice(("8,2", "2,8", "1,1")), *common]
    if use == "off":
        return ["extract", order[0], "--off", order[1], *common]
    if use == "sweep":
        return ["extract", "whole.png", name, "whole.png", "whole.png", "--spacetime", *common]
    if use == "ridges":
        return ["extract", name, "--ridges", *common]
    if use == "geometry":
        return ["extract", name, "--geometry", "--project", "project.json", *common]
    settings = [
        word
        for option in ("method", "laser", "axis", "channel", "pattern", "select")
        for word in _valid("extract", option, rng)
    ]
    settings += ["--smooth-along"] if rng.random() < 0.2 else []
    return ["extract", name, *(settings if harm else ()), *common]


def _valid(command: str, name: str, rng: Random) -> list[str]:
    """One of an option's own choices, or nothing."""
    option = next(option for option in main.cli.commands[command].params if f"--{name}" in option.opts)
    known = list(option.type.choices) if isinstance(option.type, click.Choice) else METHODS
    return [f"--{name}", rng.choice(known)] if rng.random() < 0.25 else []
