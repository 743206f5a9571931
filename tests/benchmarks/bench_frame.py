"""One 2448 x 2048 frame of the weld joint, stage by stage, beside the bars of the founding issue.

Prints seconds (the least of several runs: machines are shared), the speed-up of two threads over one, the share of
time inside embree, and the peak memory. Nothing here passes or fails.
"""

from __future__ import annotations

import argparse
import resource
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from render.ambient.integrator import ambient_image, ambient_images
from render.laser_direct.integrator import direct_image
from render.run import Run
from render.truth.laser_curve import laser_curve
from render.truth.pixel_truth import truth_images
from render.world.placed import PlacedScene
from render.world.world import build_world
from studio.project.project import Project

PROJECT = Path(__file__).parents[2] / "assets/projects/weld_seam/project.json"


def best(work: Callable[[], object], runs: int = 5) -> float:
    seconds = []
    for _ in range(runs):
        start = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - start)
    return min(seconds)


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--project", type=Path, default=PROJECT)
    arguments.add_argument("--threads", type=int, default=2)
    options = arguments.parse_args()
    project = Project.load(options.project)
    scene, threads = project.scene, options.threads
    world = build_world(scene, options.project.parent)
    camera, laser, pose = scene.camera, scene.lasers[0], scene.T_world_camera()
    parts = (world, camera, laser, pose, scene.T_world_laser(0))
    print(f"{camera.width} x {camera.height}, {len(world.triangles)} triangles, {threads} threads")

    def row(name: str, seconds: float, bar: str, note: str = "") -> None:
        print(f"{name:<38}{seconds:>9.4f} s   bar {bar:<9}{note}")

    for target in (0.01, 0.001):
        image = direct_image(*parts, target=target)
        before, start = world.rays.seconds, time.perf_counter()
        direct_image(*parts, target=target, run=Run(threads=1))
        share = (world.rays.seconds - before) / (time.perf_counter() - start)
        one = best(partial(direct_image, *parts, target=target, run=Run(threads=1)))
        many = best(partial(direct_image, *parts, target=target, run=Run(threads=threads)))
        row(
            f"laser light to {target:.1%}",
            many,
            "0.1 s" if target == 0.01 else "0.5 s",
            f"estimated error {image.error:.2%}, {image.samples} samples, {one / many:.2f} x one thread (bar 1.8), "
            f"{share:.0%} inside embree (bar 60 %)",
        )
    reference = direct_image(*parts, target=1e-4, run=Run(seed=99)).radiance.astype(np.float64)
    rough = direct_image(*parts, target=0.01, run=Run(seed=1)).radiance
    lit = reference > 0
    error = np.sqrt(np.mean((rough - reference)[lit] ** 2) / np.mean(reference[lit] ** 2))
    print(f"{'  measured error of the first':<38}{error:>9.2%}")
    pinhole = best(partial(direct_image, *parts, target=0.01, run=Run(threads=threads)))
    for f_number, focus in ((5.6, 0.8), (1.4, 0.8), (1.4, 1.0)):
        lens = camera.lens.model_copy(update={"model": "thin-lens", "f_number": f_number, "focus_distance": focus})
        through = (world, camera.model_copy(update={"lens": lens}), *parts[2:])
        image = direct_image(*through, target=0.01)
        seconds = best(partial(direct_image, *through, target=0.01, run=Run(threads=threads)), 3)
        name = f"  through f/{f_number:g} focused at {focus:g} m"
        row(name, seconds, "-", f"{seconds / pinhole:.1f} x the pinhole, {image.samples} samples")
    row("exact line", best(lambda: laser_curve(*parts)), "0.1 s")
    row("truth images", best(lambda: truth_images(world, camera, pose), 3), "1 s")
    world.rays.seconds, before = 0.0, world.rays.rays
    start = time.perf_counter()
    direct_image(*parts, target=0.01)
    laser_curve(*parts)
    truth_images(world, camera, pose)
    ambient = best(lambda: ambient_image(world, scene, camera, pose, samples=16), 1)
    whole = time.perf_counter() - start
    row("ambient light, 16 samples", ambient, "30 s")
    rays = world.rays.rays - before
    print(
        f"{'inside embree':<38}{world.rays.seconds / threads / whole:>9.0%}     bar 50 %     "
        f"{rays / 1e6:.0f} million rays, {rays / whole / 1e6:.1f} million a second"
    )
    for name, surfaces in (("one surface", 1), ("any number of surfaces", None)):
        before, start = world.rays.seconds, time.perf_counter()
        *_, image = ambient_images(
            PlacedScene(world, scene), target=0.01, most=64, surfaces=surfaces, run=Run(threads=threads)
        )
        spent = time.perf_counter() - start
        share = (world.rays.seconds - before) / threads / spent
        note = f"error {image.error:.2%}, {image.samples:.0f} samples a pixel, {share:.0%} inside embree (bar 60 %)"
        row(f"ambient light to 1 %, {name}", spent, "-", note)
    print(f"{'peak memory':<38}{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20:>9.2f} GB    bar 2 GB")


if __name__ == "__main__":
    main()
