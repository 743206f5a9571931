"""Ambient light to 1 % by way of any number of surfaces, on a whole image: seconds, samples and rays.

    python tests/benchmarks/bench_ambient.py [template] [scale]      default: weld_seam 1, 5 Mpx

Bar of the sample at full size: 40 s on two processors, told as processor seconds / 2 beside those on the clock.
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from render.ambient.integrator import ambient_images
from render.run import Run
from render.world.placed import PlacedScene
from render.world.world import build_world
from studio.project.project import Project

PROJECTS = Path(__file__).parents[2] / "assets/projects"
TARGET, MOST, BAR, THREADS = 0.01, 1024, 40.0, 2


def main() -> None:
    template = sys.argv[1] if len(sys.argv) > 1 else "weld_seam"
    scale = float(sys.argv[2]) if len(sys.argv) > 2 else 1.0
    path = PROJECTS / template / "project.json"
    scene = Project.load(path).scene.scaled(scale)
    world = build_world(scene, path.parent)
    placed, run = PlacedScene(world, scene), Run(threads=THREADS)
    next(ambient_images(placed, most=1, surfaces=None, run=run))  # loads the kernels
    began, spent, rays = time.perf_counter(), time.process_time(), world.rays.rays
    for image in ambient_images(placed, target=TARGET, most=MOST, surfaces=None, run=run):
        busy = (time.process_time() - spent) / THREADS
        print(f"{busy:7.1f} s: error {image.error:.2%}, {image.samples:.1f} samples a pixel", flush=True)
    seconds, traced = time.perf_counter() - began, (world.rays.rays - rays) / 1e6
    verdict = ("met" if busy <= BAR else "missed") if template == "weld_seam" and scale == 1.0 else "of the whole image"
    print(
        f"{template}, {scene.camera.width} x {scene.camera.height}: {seconds:.1f} s on the clock, {busy:.1f} s of two "
        f"processors, {traced:.0f} million rays; bar {BAR:g} s: {verdict} (load {os.getloadavg()[0]:.1f})"
    )


if __name__ == "__main__":
    main()
