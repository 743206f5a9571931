"""Broken command lines, preferences and recovery files."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path
from random import Random

import click

import main
from studio.project.templates import DESCRIPTIONS
from tests.mutations import values
from tests.mutations.image_cases import METHODS
from tests.mutations.project_cases import QUICK, json_or_not
from tests.mutations.sources import SPECIAL, Sources, copy_scan

NUMBERS = (
    "0", "1", "2", "-1", "0.5", "nan", "-nan", "inf", "-inf", "1e400", "1e-320", "1e308", "-1e308", "1e300", "1e-300",
    "1e-9", "16", "17", "64", "9223372036854775807", "9223372036854775808", "-9223372036854775808",
    "18446744073709551616", "9" * 400, "0.01", "4.0", "0.1", "1024", "1_000", "0x10", "1,5", "+3", " 2 ", "٣", "1e2",
    "100000", "true",
)  # fmt: skip
WORDS = (
    "", " ", "\x1b[31m", "[/red]", "[bold]", "é", os.fsdecode(b"\xff"), "a\nb", "x" * 5000, "None", "auto ", "AUTO",
    "%s", "{}", "-", "--",
)  # fmt: skip
HDR = (
    "8,2", "8", "", ",", "8,2,", "nan,1", "inf,1", "0,1", "-1,1", "1e300,1e-300", "1e308,1e-308", "1,1", "a,b", "8;2",
    "1e400,1", "5e-324,1", "8,2,0.5", "\x1b[31m,1",
)  # fmt: skip
PLACES = (
    "0,0,0", "1,2", "1,2,3,4", "nan,0,0", "inf,0,0", "1e400,0,0", "0,0,-1e7", "1e-300,0,0", "1e9,0,0", ",,", "a,b,c",
    " 1 , 2 , 3 ", "0;0;0", "0,0,1",
)  # fmt: skip
OUTS = (
    "out", ".", "scan", "project.json", "image.png", "fifo.ply", "loop.ply", "folder.ply", "null.png", "zero.png",
    "a/b/c", "é", "[/red]", os.fsdecode(b"\xff"), "\x1b[31m", "a\nb", "o" * 300, "", " ", "../sibling", "/dev/null",
    "/dev/null/x", "/proc/none/x", "textures", "scan/scan.json/x",
)  # fmt: skip
PATHS = (
    "project.json", "image.png", "scan", "absent.json", "folder.ply", "fifo.json", "loop.json", "null.json",
    "zero.json", "sparse.json", "zero.png", "fifo.png", "sparse.png", "/dev/zero", "/dev/null", "/dev/stdin",
    "/proc/self/mem", "/proc/self/environ", "", ".", "..", "/", "~", "-", os.fsdecode(b"\xff.json"), "[/red].json",
    "\x1b[2J.json", "a\nb.json", "x" * 300, "x/" * 3000, "project.json/x", "texture.png",
)  # fmt: skip


def option(sources: Sources, place: Path, rng: Random, harm: bool) -> list[str]:
    copy_scan(sources, "still", place)
    shutil.copy(place / "scan" / "frame_0000.png", place / "image.png")
    plain = {
        "inspect": ["project.json"], "run": ["project.json", *QUICK], "render": ["project.json", "--out", "out"],
        "reconstruct": ["scan", "--out", "out"], "extract": ["image.png", "--out", "out"], "new": ["plane", "made"],
        "report": ["absent"], "twin": ["project.json", "image.png", "--out", "twin.json"],
        "heightmap": ["scan", "--out", "map.png"], "chooser": ["project.json", "--out", "out.onnx"],
        "deviation": ["scan", "--out", "out.csv"], "points": ["scan", "--out", "out.pcd"],
        "section": ["scan", "--through", "0,0,0", "--normal", "1,0,0", "--out", "out.dxf"],
        "film": ["scan", "--out", "out.mp4"],
    }  # fmt: skip
    command = rng.choices(tuple(plain), (2, 6, 2, 6, 8, 3, 1, 3, 3, 1, 3, 2, 3, 2))[0] if harm else "extract"
    argv = [command, *plain[command]]
    if command == "reconstruct" and rng.random() < 0.4:
        argv[1:2] = ["image.png", "--project", "project.json"]
    offered = [option for option in main.cli.commands[command].params if option.name not in ("report", "debug")]
    places = [option.name for option in offered if isinstance(option, click.Argument)]
    for _ in range(rng.choice((1, 1, 1, 2, 3)) if harm else 0):
        chosen = rng.choice(offered)
        if isinstance(chosen, click.Argument):
            argv[1 + places.index(chosen.name)] = _option_value(chosen, rng)
        elif isinstance(chosen, click.Option):
            argv.append(rng.choice(chosen.opts + chosen.secondary_opts))
            argv += [_option_value(chosen, rng)] if not chosen.is_flag and rng.random() < 0.97 else []
    asked = json_or_not(rng)
    argv[1:1] = asked  # first, where no option can take it for its value
    if harm and rng.random() < 0.06:
        odd = rng.choice(("--nope", "--", "-", "", "-q", "--json", "--json=1", "extra", "--out"))
        argv.insert(rng.randrange(1 + len(asked), len(argv) + 1), odd)
    return argv


def _option_value(option: click.Parameter, rng: Random) -> str:
    if isinstance(option.type, click.Choice) and rng.random() < 0.6:
        return rng.choice([str(choice) for choice in option.type.choices])
    if option.name in ("out", "folder"):
        return rng.choice(OUTS)
    if isinstance(option.type, click.Path):
        return rng.choice(PATHS)
    if option.name == "template":
        return rng.choice((*DESCRIPTIONS, *WORDS))
    if option.name == "hdr":
        return rng.choice(HDR)
    if option.name == "method":
        return rng.choice((*METHODS, *WORDS))
    if option.name in ("through", "normal", "spots"):
        return rng.choice((*PLACES, *WORDS))
    return rng.choice((*NUMBERS, *NUMBERS, *WORDS))


def preferences(sources: Sources, place: Path, rng: Random, harm: bool) -> list[str]:
    data = {
        "recent": ["/a/project.json", "b.json"], "theme": "dark", "toured": True, "workspace": "setup",
        "geometry": "AdnQywAD", "arrangements": {"setup": "AAAA", "render": "AAAB"}, "folder": "/a",
    }  # fmt: skip
    file = place / "preferences.json"
    special = rng.choice(SPECIAL)
    if harm and rng.random() < 0.1:
        (place / f"{special}.json").rename(file) if special != "loop" else file.symlink_to("preferences.json")
    else:
        file.write_bytes(values.mutated(data, rng) if harm else json.dumps(data).encode())
    return ["preferences", "."]


def recovery(sources: Sources, place: Path, rng: Random, harm: bool) -> list[str]:
    data = {
        "format": "blazer-recovery", "format_version": 1, "path": "/a/project.json", "root": "/a",
        "when": "2026-01-01 00:00:00+00:00", "project": sources.projects[rng.choice(sorted(sources.projects))],
    }  # fmt: skip
    (place / "recovery").mkdir()
    content = values.mutated(data, rng, sources.limits) if harm else json.dumps(data).encode()
    if harm and rng.random() < 0.3:  # what goes with the file when it is not wanted
        data["root"] = str(place / "recovery" / rng.choice(("..", ".", "1-00000000-a", "../textures", "", "a/../..")))
        content = json.dumps(data).encode()
    (place / "recovery" / "1-00000000.json").write_bytes(content)
    return ["recovery", "recovery"]
