"""One drag step of camera, laser or a mesh of a million triangles: lit curve, camera picture and read-outs.

Prints the median and the 95th percentile of the work of a step, ms, beside the desktop's bar, and what loading cost.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

from render.scene.shape import Sphere
from studio.preview.preview import Preview
from studio.preview.readouts import readouts
from studio.project.document import replaced, value_at
from studio.project.project import Project

PROJECT = Path(__file__).parents[2] / "assets/projects/sphere/project.json"
BAR_MS = 33.0
OBJECT, RIG = ("scene", "objects", 0), ("scene", "rig")
DRAGGED = {
    "mesh": (*OBJECT, "T_world_object", "translation"),
    "camera": (*RIG, "camera", "T_rig_camera", "translation"),
    "laser": (*RIG, "lasers", 0, "T_rig_laser", "translation"),
    "rig": (*RIG, "T_world_rig", "translation"),
}


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--segments", type=int, default=1024, help="of the sphere: about as many triangles, squared")
    arguments.add_argument("--steps", type=int, default=60)
    arguments.add_argument("--threads", type=int, default=2)
    options = arguments.parse_args()
    project, root = Project.load(PROJECT), PROJECT.parent
    sphere = next(i for i, item in enumerate(project.scene.objects) if isinstance(item.shape, Sphere))
    project = replaced(project, ("scene", "objects", sphere, "shape", "segments"), options.segments)
    DRAGGED["mesh"] = ("scene", "objects", sphere, "T_world_object", "translation")
    preview = Preview(options.threads)
    start = time.perf_counter()
    look = preview.look(project, root)
    triangles = sum(len(item.body.surface.triangles) for item in look.placed)
    print(f"{triangles} triangles in {len(look.placed)} objects, loaded in {time.perf_counter() - start:.2f} s")
    readouts(look, 0), look.image()
    for what, path in DRAGGED.items():
        before = np.array(value_at(project, path))
        seconds = np.empty((options.steps, 4))
        for step in range(options.steps):
            moved = replaced(project, path, tuple((before + 1e-4 * step * np.array([1.0, 0.5, 0.2])).tolist()))
            times = [time.perf_counter()]
            look = preview.look(moved, root)
            for part in (look.lit_curve, look.fan):
                part(0)
                times.append(time.perf_counter())
            readouts(look, 0)
            times.append(time.perf_counter())
            image = look.image()
            times.append(time.perf_counter())
            seconds[step] = np.diff(times)
        total = 1e3 * np.append(seconds, seconds.sum(axis=1, keepdims=True), axis=1)
        median, slow = np.median(total, axis=0), np.percentile(total, 95, axis=0)
        print(
            f"drag the {what:<7} curve {median[0]:5.1f}  fan {median[1]:4.1f}  read-outs {median[2]:4.1f}  "
            f"picture {median[3]:5.1f} ({image.camera.width} x {image.camera.height})  "
            f"all {median[4]:5.1f} ms, 95 % {slow[4]:5.1f}   "
            f"bar {BAR_MS:.0f} ms   {len(look.lit_curve(0).index)} points"
        )


if __name__ == "__main__":
    main()
