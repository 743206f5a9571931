"""Rays a second reached over those possible, and two threads over one, stage by stage.

    python tests/benchmarks/bench_roofline.py [--scale 0.25] [--templates NAME ...] [--threads 2]

Possible is what Embree alone does with the very rays of the stage, in the same calls from as many threads: they are
recorded and traced again. Its time over the stage's own is also the share of Embree in the stage. Both are processor
seconds, so other work on the machine hardly matters; the ratio of the threads is of seconds on the clock and wants a
quiet one. The recorded calls are those of the first RECORDED rays. Bar: two threads 1.8 times as fast as one from 50 ms
of work on; nothing here passes or fails.
"""

from __future__ import annotations

import argparse
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from render.ambient.integrator import ambient_image
from render.laser_direct.integrator import direct_image
from render.laser_indirect.integrator import indirect_images
from render.run import Run
from render.truth.pixel_truth import truth_images
from render.world.embree import RayScene
from render.world.placed import PlacedLaser
from render.world.world import build_world
from studio.project.project import Project

PROJECTS = Path(__file__).parents[2] / "assets/projects"
TEMPLATES = ("weld_seam", "v_groove", "glass_ball", "shiny_weld_seam")
RECORDED = 10_000_000
PATHS, SAMPLES = 1 << 17, 16
LEAST_WORK, BAR = 0.05, 1.8
"""Seconds on one thread from which the ratio counts, and its bar."""
RUNS = 3

Call = tuple[str, Any, Any, Any, bool]
"""Query, origins, directions, far, coherent."""


@contextmanager
def recorded(calls: list[Call]) -> Iterator[None]:
    """Every query of any scene is kept in `calls`, until there are RECORDED rays."""
    intersect, occluded, count = RayScene.intersect, RayScene.occluded, [0]

    def keep(query: str, origins: Any, directions: Any, far: Any, coherent: bool) -> None:
        if count[0] < RECORDED:
            count[0] += len(directions)
            single = origins.strides[0] == 0
            start = np.broadcast_to(origins[:1].copy(), origins.shape) if single else origins.copy()
            calls.append((query, start, directions.copy(), None if far is None else far.copy(), coherent))

    def intersect_kept(self: Any, origins: Any, directions: Any, far: Any = None, *, coherent: bool = False) -> Any:
        keep("intersect", origins, directions, far, coherent)
        return intersect(self, origins, directions, far, coherent=coherent)

    def occluded_kept(self: Any, origins: Any, directions: Any, far: Any, *, coherent: bool = False) -> Any:
        keep("occluded", origins, directions, far, coherent)
        return occluded(self, origins, directions, far, coherent=coherent)

    RayScene.intersect, RayScene.occluded = intersect_kept, occluded_kept  # type: ignore[method-assign]
    try:
        yield
    finally:
        RayScene.intersect, RayScene.occluded = intersect, occluded  # type: ignore[method-assign]


def traced_again(rays: RayScene, calls: list[Call], threads: int) -> float:
    """Processor seconds of the recorded calls, alone."""
    # far is written to
    left = iter([(q, o, d, None if f is None else f.copy(), c) for q, o, d, f, c in calls])
    lock = threading.Lock()

    def work() -> None:
        while True:
            with lock:
                call = next(left, None)
            if call is None:
                return
            query, origins, directions, far, coherent = call
            getattr(rays, query)(origins, directions, far, coherent=coherent)

    helpers = [threading.Thread(target=work) for _ in range(threads - 1)]
    start = time.process_time()
    for helper in helpers:
        helper.start()
    work()
    for helper in helpers:
        helper.join()
    return time.process_time() - start


def stages(name: str, scale: float) -> tuple[RayScene, dict[str, Callable[[Run], object]]]:
    """The stages of a frame, each of the same work whatever the threads."""
    path = PROJECTS / name / "project.json"
    scene = Project.load(path).scene.scaled(scale)
    world = build_world(scene, path.parent)
    camera, pose = scene.camera, scene.T_world_camera()
    parts = (world, camera, scene.lasers[0], pose, scene.T_world_laser(0))

    def reflections(run: Run) -> None:
        for _ in indirect_images(PlacedLaser(*parts), target=0.0, most_paths=PATHS, run=run):
            pass

    return world.rays, {
        "laser, direct": lambda run: direct_image(*parts, target=0.001, run=run),
        "laser, reflections": reflections,
        "ambient": lambda run: ambient_image(world, scene, camera, pose, samples=SAMPLES, surfaces=None, run=run),
        "truth": lambda run: truth_images(world, camera, pose, run=run),
    }


def seconds_of(work: Callable[[], object]) -> tuple[float, float]:
    """On the clock, and of the processor: the least of some runs."""
    clock, busy = [], []
    for _ in range(RUNS):
        start, spent = time.perf_counter(), time.process_time()
        work()
        clock.append(time.perf_counter() - start)
        busy.append(time.process_time() - spent)
    return min(clock), min(busy)


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--scale", type=float, default=0.25)
    arguments.add_argument("--templates", nargs="*", default=list(TEMPLATES))
    arguments.add_argument("--threads", type=int, default=2)
    options = arguments.parse_args()
    threads = options.threads
    print(f"load {os.getloadavg()[0]:.1f}; million rays a processor second: reached, possible; coherent, others alone")
    for name in options.templates:
        rays, found = stages(name, options.scale)
        print(name)
        for stage, work in found.items():
            work(Run(threads=threads))  # loads the kernels
            before = rays.rays
            many, busy = seconds_of(partial(work, Run(threads=threads)))
            count = (rays.rays - before) / RUNS
            one, _ = seconds_of(partial(work, Run(threads=1)))
            calls: list[Call] = []
            with recorded(calls):
                work(Run(threads=threads))
            note = f"{one / many:.2f} x one thread" + ("" if one >= LEAST_WORK else ", too short to count")
            if not calls:
                print(f"  {stage:<20} {one:7.3f} s   no rays   {note}")
                continue
            alone = {kind: [c for c in calls if c[4] == kind] for kind in (True, False)}
            speed = {}
            for kind, some in alone.items():
                spent = min(traced_again(rays, some, threads) for _ in range(RUNS)) if some else 0.0
                speed[kind] = (sum(len(c[2]) for c in some), spent)
            replayed, spent = (sum(values) for values in zip(*speed.values(), strict=True))
            possible, reached = replayed / spent / 1e6, count / busy / 1e6
            kinds = ", ".join(f"{n / t / 1e6:.1f}" if n else "-" for n, t in speed.values())
            print(
                f"  {stage:<20} {one:7.3f} s   {reached:5.2f} of {possible:5.2f} ({kinds}), "
                f"{reached / possible:4.0%} in Embree   {note}",
                flush=True,
            )
    print(f"bar: two threads {BAR} x one, from {LEAST_WORK:g} s of one on")


if __name__ == "__main__":
    main()
