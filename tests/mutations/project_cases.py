"""Projects with broken values, and projects that name a broken mesh or image."""

from __future__ import annotations

import json
import math
from pathlib import Path
from random import Random
from typing import Any

from tests.mutations import images, meshes, values
from tests.mutations.sources import Sources

FILE = {"kind": "file", "path": "mesh.ply", "unit": "m"}
QUICK = ("--steps", "2", "--time-limit", "2", "--no-report", "--out", "out")
"""Of `run`: a broken project may ask for any number of steps."""
WORK = {"segments": 512, "triangles": 20_000, "ambient_samples": 4, "light_paths": 1 << 20, "exposures": 2}
"""What an allowed number must not exceed where a frame is rendered: what is large takes long, and is no fault."""


def project(sources: Sources, place: Path, rng: Random, harm: bool) -> list[str]:
    data = sources.projects[rng.choice(sorted(sources.projects)) if harm else "plane"]
    change = values.extreme if rng.random() < 0.5 else values.mutated
    content = change(data, rng, sources.limits) if harm else json.dumps(data).encode()
    return look_or_run(content, place, rng)


def mesh(sources: Sources, place: Path, rng: Random, harm: bool) -> list[str]:
    files = meshes.mutated(rng, sources.texture) if harm else meshes.whole("obj", sources.texture)
    name = rng.choice(("mesh.ply", "mesh.stl", "mesh.obj", "mesh.off", "mesh.glb", "mesh.gltf"))
    name = next((key for key in files if key.rpartition(".")[2] in ("ply", "stl", "obj", "off", "glb", "gltf")), name)
    for side, content in files.items():
        (place / side).write_bytes(content)
    if rng.random() < 0.15:
        return ["import", name]
    albedo = rng.choice((0.5, {"source": "mesh"}, {"path": "texture.png"}))
    material = rng.choice(
        ({"kind": "lambertian", "albedo": albedo}, {"kind": "coated", "albedo": albedo}, {"kind": "glass"})
    )
    unit = rng.choice(("m", "m", "mm"))
    crease = rng.choice((0.0, 0.0, 0.5))
    item = {"name": "mesh", "shape": {**FILE, "path": name, "unit": unit}, "material": material, "crease_angle": crease}
    if not harm:
        item |= {"shape": {**FILE, "path": name}, "material": {"kind": "lambertian", "albedo": {"source": "mesh"}}}
    return look_or_run(json.dumps(with_object(sources, item)).encode(), place, rng)


def texture(sources: Sources, place: Path, rng: Random, harm: bool) -> list[str]:
    suffix, content = images.mutated(sources.image, rng) if harm else ("png", sources.texture)
    name = f"picture.{suffix}"
    (place / name).write_bytes(content)
    texture = rng.choice(({"path": name}, {"path": name, "srgb": False, "scale": 0.5}))
    grey = rng.choice((0.2, {"path": name, "scale": 0.5}))
    relief = rng.choice((None, None, {"kind": "normal_map", "path": name}, {"kind": "bump_map", "path": name}))
    material = rng.choice(
        (
            {"kind": "lambertian", "albedo": texture, "relief": relief},
            {"kind": "coated", "albedo": texture, "roughness": grey},
            {"kind": "conductor", "roughness": {"path": name}, "relief": relief},
        )
    )
    shape = {"kind": "weld_tee", "triangles": 500}
    return look_or_run(
        json.dumps(with_object(sources, {"name": "tee", "shape": shape, "material": material})).encode(), place, rng
    )


def look_or_run(content: bytes, place: Path, rng: Random) -> list[str]:
    """Write the project; mostly look at it, seldom scan it."""
    command = rng.choices(("inspect", "run", "render"), (6, 3, 1))[0]
    (place / "project.json").write_bytes(content if command == "inspect" else quick(content))
    quiet = [option for option in QUICK if command == "run" or option != "--no-report"]
    return [command, "project.json", *(() if command == "inspect" else quiet), *json_or_not(rng)]


def with_object(sources: Sources, item: dict[str, Any]) -> dict[str, Any]:
    data: dict[str, Any] = json.loads(json.dumps(sources.projects["plane"]))
    data["scene"]["objects"].append(item)
    return data


def quick(content: bytes) -> bytes:
    """A project's JSON with no more work in it than WORK and a small image; text that is no JSON stays as it is."""
    try:
        data = json.loads(content)
    except (ValueError, RecursionError):
        return content
    changed = False
    level: list[Any] = [data]
    while level:
        item = level.pop()
        if isinstance(item, dict):
            limits = WORK if "pixel_pitch" not in item else {"width": 128, "height": 128}
            for name, limit in limits.items():
                value = item.get(name)
                if isinstance(value, int | float) and math.isfinite(value) and value > limit:
                    item[name], changed = limit, True
        if isinstance(item, dict | list):
            level += item.values() if isinstance(item, dict) else item
    return json.dumps(data).encode("utf-8", "surrogatepass") if changed else content


def json_or_not(rng: Random) -> list[str]:
    return ["--json"] if rng.random() < 0.6 else []
