"""Ten thousand labelled images of every ready-made recipe, made as a user makes them: rate and memory; efficiency.

    python tests/benchmarks/bench_dataset_long.py [--images 10000] [recipe ...]        default: of all together
    python tests/benchmarks/bench_dataset_long.py --efficiency [recipe ...]

Each recipe makes its share of the images at 1.25 Mpx by a process per processor, two on the machine of the bars, into a
folder that is removed after. By the clock, starts of the processes and the index of each folder included. Memory is
that of all processes together, its median while each fifth of the scenes was made: peaks of two scenes at once come and
go. Efficiency: what as many perfect processes would take for the same first scenes, each the next one as soon as it is
free and as long for it as one process alone, over what they do take; starts are left out. A long scene that comes last
leaves the others without work, whatever their efficiency.

Bars: 2.5 images a second by two processes over all recipes; memory of each later fifth within 2 % of the first;
efficiency 0.85.
"""

from __future__ import annotations

import argparse
import math
import os
import statistics
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from studio.dataset.images import images_of
from studio.dataset.recipe import Recipe, base_of, ready_made
from studio.dataset.run import Wanted, make_dataset
from studio.runtime.workers import Engine
from tests.benchmarks.bench_dataset import MEGAPIXELS, MEMORY_BAR, parts

BAR, EFFICIENCY_BAR = 2.5, 0.85
WATCHED, FIFTHS = 0.2, 5
"""s between two looks at the memory."""
FIRST, COMPARED = 4, 16
"""Scenes that efficiency leaves out, as processes start, and those that it is about."""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recipes", nargs="*", metavar="recipe", help=", ".join(ready_made()))
    parser.add_argument("--images", type=int, default=10_000)
    parser.add_argument("--efficiency", action="store_true")
    given = parser.parse_args()
    names, processes = given.recipes or ready_made(), os.cpu_count() or 1
    return efficiency(names, processes) if given.efficiency else rate(names, processes, given.images)


def rate(names: list[str], processes: int, wanted: int) -> int:
    images, seconds, fine = 0, 0.0, True
    print(f"images a second by {processes} processes, memory of all; processor s an image of render and photograph")
    for name in names:
        recipe, root, each = scaled(name)
        made, took, held = run(recipe, root, math.ceil(wanted / len(names) / each), processes)
        fine = fine and max(held) <= (1.0 + MEMORY_BAR) * held[0]
        images, seconds = images + made, seconds + took
        light, shot = parts(recipe, root, 1)
        print(
            f"{name:14} {made:5d} images, {made / took:5.2f} a second; {' '.join(f'{one:.0f}' for one in held)} MB; "
            f"render {light:.3f}, photograph {shot:.3f}",
            flush=True,
        )
    flat = "flat" if fine else "NOT flat"
    print(f"{images} images in {seconds:.0f} s: {images / seconds:.2f} a second (bar {BAR}); memory {flat}")
    return 0 if fine and images >= BAR * seconds else 1


def efficiency(names: list[str], processes: int) -> int:
    wanted = took = 0.0
    for name in names:
        recipe, root, _ = scaled(name)
        alone, together = (made_after(recipe, root, count) for count in (1, processes))
        perfect = perfectly(np.diff(alone, prepend=0.0), processes)
        one, best, all_of_them = ((each[-1] - each[FIRST - 1]) / COMPARED for each in (alone, perfect, together))
        wanted, took = wanted + best, took + all_of_them
        told = f"{all_of_them:.2f} by {processes} processes, {best:.2f} by perfect ones"
        print(f"{name:14} {one:.2f} s a scene, {told}: {best / all_of_them:.2f}", flush=True)
    print(f"efficiency of {processes} processes {wanted / took:.2f} (bar {EFFICIENCY_BAR})")
    return 0 if wanted >= EFFICIENCY_BAR * took else 1


def scaled(name: str) -> tuple[Recipe, Path, int]:
    """A recipe with images of 1.25 Mpx, where its files lie, and its images a scene."""
    recipe, root = Recipe.load(name)
    base = base_of(recipe, root)
    pixels = base.scene.camera.width * base.scene.camera.height
    recipe = recipe.model_copy(update={"image_scale": math.sqrt(MEGAPIXELS * 1e6 / pixels)})
    return recipe, root, images_of(recipe, len(base.scene.lasers))


def run(recipe: Recipe, root: Path, scenes: int, processes: int) -> tuple[int, float, list[float]]:
    """Images, s by the clock, and MB held while each fifth of the scenes was made, its start left out."""
    done, over, held = [0], threading.Event(), [list[float]() for _ in range(FIFTHS)]

    def watch() -> None:
        while not over.wait(WATCHED):
            if FIRST <= done[0] < scenes:
                held[FIFTHS * done[0] // scenes].append(memory_of(os.getpid()))

    def progress(made: int, known: int) -> None:
        done[0] = made

    watcher = threading.Thread(target=watch)
    watcher.start()
    try:
        with tempfile.TemporaryDirectory() as out:
            began = time.perf_counter()
            made = make_dataset(recipe, root, Wanted(scenes), Path(out), engine=Engine(processes), progress=progress)
            return made.images, time.perf_counter() - began, [statistics.median(one or [0.0]) for one in held]
    finally:
        over.set()
        watcher.join()


def made_after(recipe: Recipe, root: Path, processes: int) -> list[float]:
    """s by the clock after which the first, second, ... of the same first scenes is made."""
    times: list[float] = []

    def progress(done: int, known: int) -> None:
        times.append(time.perf_counter())

    with tempfile.TemporaryDirectory() as out:
        wanted = Wanted(FIRST + COMPARED)
        make_dataset(recipe, root, wanted, Path(out), engine=Engine(processes), progress=progress)
    return [one - times[0] for one in times[1:]]


def perfectly(seconds: Sequence[float], processes: int) -> list[float]:
    """The same by processes that each take the next scene as soon as they are free, of the s that each scene takes."""
    free, made = [0.0] * processes, []
    for one in seconds:
        next_free = free.index(min(free))
        free[next_free] += one
        made.append(free[next_free])
    return sorted(made)


def memory_of(process: int) -> float:
    """MB that a process and those that it started hold."""
    folder = Path("/proc") / str(process)
    try:
        own = int((folder / "statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6
        children = {
            int(child) for task in (folder / "task").iterdir() for child in (task / "children").read_text().split()
        }
    except OSError:
        return 0.0  # it has just ended
    return own + sum(map(memory_of, children))


if __name__ == "__main__":
    sys.exit(main())
