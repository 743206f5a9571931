"""Labelled images a second, of every ready-made recipe: reflections, labels and PNG files at 1.25 Mpx.

    python tests/benchmarks/bench_dataset.py [scenes] [recipe ...]      default: 6 of each

Each recipe's scenes are made by one process; processor seconds count, so that other work on the machine hardly does.
Bar: 2.5 images a second on two processors over all recipes, and memory within 2 % from the first tenth on (asked of a
single recipe and 100 scenes or more).
"""

from __future__ import annotations

import math
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from studio.dataset.images import IMAGES, Task, images_of, make, photograph, rendered
from studio.dataset.recipe import Recipe, base_of, ready_made
from studio.dataset.scenes import drawn_scene
from studio.preview.preview import Preview
from tests.benchmarks.bench_profiles import memory

BAR, MEMORY_BAR, ENOUGH = 2.5, 0.02, 100
MEGAPIXELS = 1.25


def main() -> int:
    words = sys.argv[1:]
    scenes = int(words.pop(0)) if words and words[0].isdigit() else 6
    names, spent, fine = words or ready_made(), 0.0, True
    print("processor s an image: whole = render + photographs + labels and files; images a second on two processors")
    for name in names:
        recipe, root = Recipe.load(name)
        base = base_of(recipe, root)
        pixels = base.scene.camera.width * base.scene.camera.height
        recipe = recipe.model_copy(update={"image_scale": math.sqrt(MEGAPIXELS * 1e6 / pixels)})
        held: list[float] = []
        with tempfile.TemporaryDirectory() as out:
            folders = {"root": str(root.resolve()), "base_folder": str(base.folder.resolve()), "out": out}
            task = Task(recipe.model_dump_json(), base.to_text(), scene=scenes, **folders)
            make(task)  # kernels, meshes
            began = time.process_time()
            for scene in range(scenes):
                make(replace(task, scene=scene))
                held.append(memory())
            count = scenes * images_of(recipe, len(base.scene.lasers))
            seconds = (time.process_time() - began) / count
            size = sum(file.stat().st_size for file in (Path(out) / IMAGES).rglob("*.png")) / count / 1e6
        light, shot = parts(recipe, root, scenes)
        spent += seconds
        tenth, most = max(held[: len(held) // 10 + 1]), max(held)
        grown = f"memory {tenth:.0f} to {most:.0f} MB"
        print(f"{name:14} {seconds:6.3f} = {light:.3f} + {shot:.3f} + {seconds - light - shot:.3f}   "
              f"{2.0 / seconds:5.2f} a second, {size:.1f} MB a PNG, {grown}", flush=True)  # fmt: skip
        fine = fine and (len(names) > 1 or scenes < ENOUGH or most <= (1.0 + MEMORY_BAR) * tenth)
    rate = 2.0 * len(names) / spent
    print(f"all {len(names)}: {rate:.2f} images a second on two processors (bar {BAR})")
    return 0 if fine and rate >= BAR else 1


def parts(recipe: Recipe, root: Path, scenes: int) -> tuple[float, float]:
    """Processor s an image of the render, and of one photograph, over a few of the scenes."""
    base, preview, light, shot = base_of(recipe, root), Preview(1), 0.0, 0.0
    few = min(scenes, 3)
    for k in range(few):
        scene = drawn_scene(recipe, base, root, k, preview)
        began = time.process_time()
        frame = rendered(scene)
        between = time.process_time()
        for project in scene.projects:
            photograph(project, frame, None)
        light += between - began
        shot += time.process_time() - between
    return light / (few * recipe.images), shot / (few * recipe.images)


if __name__ == "__main__":
    sys.exit(main())
