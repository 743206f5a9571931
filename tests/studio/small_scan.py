"""A scan of a mesh file with a texture, of two frames and a few thousand pixels, for tests of what it leaves."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from render.material.material import Lambertian, Texture
from render.scene.motion import LinearStage
from render.scene.scene import SceneObject
from render.scene.shape import MeshFile
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.scan.options import Listener, ScanOptions
from studio.scan.scan import ScanResult, run_scan

SCALE = 0.05
PLATE = """v -0.15 -0.15 0\nv 0.15 -0.15 {rise}\nv 0.15 0.15 {rise}\nv -0.15 0.15 0
vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"""


def write_plate(folder: Path, rise: float = 0.02) -> None:
    (folder / "plate.obj").write_text(PLATE.format(rise=rise))


def small_project(folder: Path) -> Path:
    """The project file, with a mesh and a texture beside it."""
    folder.mkdir(parents=True, exist_ok=True)
    write_plate(folder)
    grain = np.random.default_rng(1).integers(100, 200, (16, 16, 3), dtype=np.uint8)
    assert cv2.imwrite(str(folder / "grain.png"), grain)
    found = Project.load(template_folder("plane") / "project.json")
    plate = SceneObject(
        name="plate", shape=MeshFile(path="plate.obj"), material=Lambertian(albedo=Texture(path="grain.png"))
    )
    dark = found.scene.environment.model_copy(update={"radiance": (0.0, 0.0, 0.0)})
    motion = LinearStage(moves="rig", step=(0.005, 0.0, 0.0), steps=2)
    scene = found.scene.model_copy(update={"objects": (plate,), "lights": (), "environment": dark, "motion": motion})
    # for the image: how a pixel moves the line takes far longer than all else here, and no file depends on it
    render = found.render.model_copy(update={"truth_images": False, "transport": "direct", "goal": None})
    project = found.model_copy(update={"scene": scene, "render": render, "name": "small"})
    project.save(folder / "project.json")
    return folder / "project.json"


def scan(file: Path, out: Path, listener: Listener = Listener(), **options) -> ScanResult:
    """The project's scan without its report, unless asked for."""
    project, source = options.pop("project", None) or Project.load(file), options.pop("source", file)
    given = ScanOptions(**{"report": False, "image_scale": SCALE, "threads": 1} | options)
    return run_scan(project, file.parent, out=out, options=given, listener=listener, source=source)


def contents(folder: Path) -> dict[str, bytes]:
    """The bytes of all that a scan makes again alike: not its times."""
    names = sorted(path.name for path in folder.iterdir() if not path.name.startswith("."))
    return {name: (folder / name).read_bytes() for name in names if name.endswith((".exr", ".png", ".ply", ".csv"))}
