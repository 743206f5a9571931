"""Whole inputs, which mutations start from: every template as seen by a tiny camera, two scans of them, an image."""

from __future__ import annotations

import json
import os
import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from studio.project.project import Project
from studio.project.templates import DESCRIPTIONS, template_folder
from tests.mutations.images import Image

VERSIONS = Path(__file__).resolve().parents[1] / "studio" / "project" / "projects"
WIDTH = 48
MEASURES = [
    {"name": "step", "kind": "step", "regions": [[-0.2, -0.01], [0.01, 0.2]], "nominal": 0.0, "upper": 0.001},
    {"name": "peak", "kind": "peak", "regions": [[-0.2, -0.01], [0.01, 0.2]], "step": 0},
    {"name": "v", "kind": "v_depth", "regions": [[-0.2, -0.1], [-0.1, 0.0], [0.0, 0.2]], "nominal": 0.0, "lower": 0.0},
    {"name": "arc", "kind": "radius", "regions": [[-0.2, 0.2]]},
]
SCANS = {"still": "plane", "moving": "scan"}


@dataclass(frozen=True)
class Sources:
    """folder: holds the scans, each beside its project."""

    folder: Path
    projects: dict[str, dict[str, Any]]
    texture: bytes

    @cached_property
    def image(self) -> Image:
        """(h, w) of the first frame of a scan."""
        import cv2

        return np.asarray(cv2.imread(str(self.folder / "still" / "scan" / "frame_0000.png"), cv2.IMREAD_UNCHANGED))

    @cached_property
    def limits(self) -> dict[str, list[float]]:
        """The limits of every number in the project's schema, by the field's name."""
        found: dict[str, list[float]] = {}
        for model in Project.model_json_schema()["$defs"].values():
            for name, field in model.get("properties", {}).items():
                limits = re.findall(r'imum": ([-+.\de]+)', json.dumps(field))
                found.setdefault(name, []).extend(float(limit) for limit in limits)
        return found


def make_sources(folder: Path, call: Callable[..., None]) -> Sources:
    """call: runs a command line of the program in the present folder; it must succeed."""
    import cv2

    ramp = np.add.outer(np.arange(8), np.arange(8)).astype(np.uint8) * 16
    texture = bytes(cv2.imencode(".png", np.stack([ramp, ramp.T, ramp // 2], axis=2))[1])
    texts = {name: (template_folder(name) / "project.json").read_text("utf-8") for name in DESCRIPTIONS}
    texts |= {file.stem: file.read_text("utf-8") for file in sorted(VERSIONS.glob("*.json"))}
    projects = {name: small(json.loads(text)) for name, text in texts.items()}
    sources = Sources(folder, projects, texture)
    before = Path.cwd()
    for scan, name in SCANS.items():
        place = folder / scan
        place.mkdir(parents=True)
        os.chdir(place)
        Path("project.json").write_text(json.dumps(projects[name]), encoding="utf-8")
        call("run", "project.json", "--out", "scan", "--no-report", "--steps", "2", "--json")
    os.chdir(before)
    return sources


def small(data: dict[str, Any]) -> dict[str, Any]:
    """The project as JSON, with a camera of WIDTH pixels and little to compute."""
    camera = data["scene"]["rig"]["camera"]
    factor = WIDTH / camera["width"]
    camera["width"], camera["height"] = WIDTH, round(camera["height"] * factor)
    for name in ("fx", "fy", "skew"):
        camera[name] = round(camera.get(name, 0.0) * factor, 3)
    camera["cx"], camera["cy"] = (camera["width"] - 1) / 2, (camera["height"] - 1) / 2
    camera["pixel_pitch"] /= factor
    data["sensor"]["exposure_time"] *= factor**2
    data["render"] = {**data.get("render", {}), "light_paths": 1 << 20, "ambient_samples": 1}
    for item in data["scene"]["objects"]:
        if item["shape"].get("triangles", 0) > 2000:
            item["shape"]["triangles"] = 2000
        if item["shape"].get("segments", 0) > 64:
            item["shape"]["segments"] = 64
    if data["scene"].get("motion", {}).get("kind") == "linear":
        data["scene"]["motion"]["steps"] = 2
    data["measures"] = MEASURES
    return data


def furnish(folder: Path, sources: Sources) -> None:
    """What every case finds: textures, and beside them what only looks like a file."""
    folder.mkdir(parents=True)
    for name in ("texture.png", "textures/weld_tee_albedo.png", "textures/weld_tee_mask.png", "../outside.png"):
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(sources.texture)
    for suffix in ("ply", "json", "png"):
        os.mkfifo(folder / f"fifo.{suffix}")
        (folder / f"loop.{suffix}").symlink_to(f"loop.{suffix}")
        (folder / f"folder.{suffix}").mkdir()
        (folder / f"null.{suffix}").symlink_to("/dev/null")
        (folder / f"zero.{suffix}").symlink_to("/dev/zero")
        with open(folder / f"sparse.{suffix}", "wb") as file:
            file.truncate(3 << 30)


SPECIAL = ("fifo", "loop", "folder", "null", "zero", "sparse")


def copy_scan(sources: Sources, scan: str, folder: Path) -> None:
    """One of SCANS with its project, into a case's folder."""
    shutil.copy(sources.folder / scan / "project.json", folder / "project.json")
    shutil.copytree(sources.folder / scan / "scan", folder / "scan")
