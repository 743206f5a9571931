"""Make what is missing of a dataset, on processes of this machine, a Dask cluster, or as one shard of several."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from render.base.threads import Cancel
from studio.dataset.folder import Dataset, begun, images_in, remove_unfinished, take_from, write_index
from studio.dataset.images import Task, make
from studio.dataset.recipe import Recipe, base_of
from studio.dataset.scenes import drawn_scene
from studio.preview.preview import Preview
from studio.project.project import Project
from studio.runtime.workers import EVERY_PROCESSOR, Engine, team
from studio.scan.folder_lock import hold
from studio.study.cells import WHOLE, Shard

Progress = Callable[[int, int], None]
"""Scenes done, of how many."""


@dataclass(frozen=True)
class Wanted:
    """What a run is to make."""

    scenes: int
    """The first so many of the recipe."""
    shard: Shard = WHOLE
    """n of m: only the scenes k with k mod m = n - 1."""
    sources: Sequence[Path] = ()
    """Folders of other shards, whose scenes are taken over."""


@dataclass(frozen=True)
class Result:
    """What a run came to."""

    dataset: Dataset
    images: int
    """In the folder now."""
    made: int
    """Scenes made by this run."""
    rejected: Counter[str]
    """Reasons why scenes of this run were drawn anew."""


def make_dataset(
    recipe: Recipe,
    root: Path,
    wanted: Wanted,
    out: Path,
    *,
    engine: Engine = EVERY_PROCESSOR,
    progress: Progress = lambda done, known: None,
    cancelled: Cancel = lambda: False,
) -> Result:
    """Scenes of a recipe in a folder. What is there already is not made again.

    Scene k is the same in any shard, engine and order.
    InputError: the recipe draws what is not allowed, the folder holds something else, a file cannot be written.
    Cancelled: so asked; the images that are done stay.
    """
    base = base_of(recipe, root)
    drawn_scene(
        recipe, base, root, wanted.shard.number - 1, Preview()
    )  # what does not fit is told before anything runs
    out.mkdir(parents=True, exist_ok=True)
    with hold(out):
        dataset = begun(out, recipe, base)
        remove_unfinished(out)
        for source in wanted.sources:
            take_from(dataset, source)
        scenes = range(wanted.shard.number - 1, wanted.scenes, wanted.shard.count)
        any_of_them = _task(dataset, root)
        tasks = [replace(any_of_them, scene=k) for k in scenes if not dataset.is_made(k)]
        done, rejected = len(scenes) - len(tasks), Counter[str]()
        progress(done, len(scenes))
        begin = partial(_warm_up, base.to_text(), str(base.folder))
        try:
            if tasks:
                with team(engine, make, begin, cancelled) as workers:
                    for _, made in workers.results(tasks, cancelled, "the dataset"):
                        done += 1
                        rejected.update(made.rejected)
                        progress(done, len(scenes))
        finally:
            images = images_in(out)
            write_index(dataset, images)
        return Result(dataset, len(images), len(tasks), rejected)


def _task(dataset: Dataset, root: Path) -> Task:
    """That of scene 0: the others share its texts, which would take 10 kB and 1 ms for each."""
    folder = str(dataset.base.folder.resolve())
    text = dataset.recipe.model_dump_json()
    return Task(text, dataset.base.to_text(), str(root.resolve()), folder, str(dataset.folder.resolve()), 0)


def _warm_up(text: str, folder: str) -> None:
    from studio.study.measuring import warm_up  # takes a while: a window opens without it

    warm_up(Project.from_text(text).in_folder(Path(folder)))
