"""Devices, FIFOs, folders, loops and hostile names in place of files."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path
from random import Random

from tests.mutations import meshes
from tests.mutations.project_cases import FILE, QUICK, json_or_not, with_object
from tests.mutations.scan_cases import measure
from tests.mutations.sources import SPECIAL, Sources, copy_scan

NAMES = (
    os.fsdecode(b"\xff\xfe"),
    "[red]",
    "[bold]",
    "a\nb",
    "\x1b[2J",
    "é",
    "a b",
    "%s",
    "n" * 200,
    "-x",
    "\u202e",
    "..",
)
TARGETS = (
    "project.json", "mesh.ply", "texture.png", "image.png", "off.png", "scan", "out", "scan/scan.json",
    "scan/scan_project.json", "scan/frame_0000.exr", "scan/frame_0000.json", "scan/frame_0000.png",
)  # fmt: skip


def place_of_file(sources: Sources, place: Path, rng: Random, harm: bool) -> list[str]:
    """A device, FIFO, folder, loop, huge or absent file in place of one that is read, or one of a hostile name."""
    copy_scan(sources, "still", place)
    (place / "mesh.ply").write_bytes(next(iter(meshes.whole("ply", sources.texture).values())))
    shutil.copy(place / "scan" / "frame_0000.png", place / "image.png")
    target = rng.choice(TARGETS) if harm else ""
    material = {"kind": "lambertian", "albedo": {"path": "texture.png"}}
    items = [
        {"name": "mesh", "shape": FILE},
        {"name": "tee", "shape": {"kind": "weld_tee", "triangles": 500}, "material": material},
    ]
    data = with_object(sources, items[0])
    data["scene"]["objects"].append(items[1])
    if target in ("mesh.ply", "texture.png", ""):
        (place / "project.json").write_text(json.dumps(data), encoding="utf-8")
    name = target
    if harm:
        file = place / target
        special = rng.choice((*SPECIAL, "absent", "named"))
        if file.is_dir():
            shutil.rmtree(file)
        elif special != "named":
            file.unlink(missing_ok=True)
        if special == "named" and file.is_file():
            name = str(Path(target).with_name(rng.choice(NAMES) + file.suffix))
            file.rename(place / name)
            project = place / "project.json"
            if project.exists():
                renamed = json.dumps(name).encode()
                project.write_bytes(project.read_bytes().replace(json.dumps(target).encode(), renamed))
        elif special not in ("absent", "named"):
            source = (
                place / f"{special}.{'json' if file.suffix == '.json' else 'ply' if file.suffix == '.ply' else 'png'}"
            )
            file.symlink_to(os.readlink(source)) if source.is_symlink() and special != "loop" else source.rename(file)
    if target.startswith("scan"):
        return measure(rng)
    if target == "image.png":
        return ["extract", name, "--out", "out", *json_or_not(rng)]
    if target == "off.png":
        return ["extract", "image.png", "--off", name, "--out", "out", *json_or_not(rng)]
    project = name if target == "project.json" else "project.json"
    return [*rng.choice((["inspect", project], ["run", project, *QUICK])), *json_or_not(rng)]
