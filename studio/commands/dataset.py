"""What `main.py dataset` does: labelled images of a recipe."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from render.base.errors import Cancelled, InputError
from studio.commands.places import check_output, folder_name, never
from studio.commands.study import shard_of
from studio.dataset.contact_sheet import write_contact_sheet
from studio.dataset.folder import images_in
from studio.dataset.formats import FORMATS, write_format
from studio.dataset.image_kind import notes_of_depth
from studio.dataset.recipe import Recipe, ready_made
from studio.dataset.run import Wanted, make_dataset
from studio.runtime.console import print_table, stage_progress
from studio.runtime.streams import print_json
from studio.runtime.workers import Engine
from studio.scan.interrupt import stop_on_interrupt


def dataset_command(
    file: Path | None, *, preview: bool, count: int, shard: str, sources: Sequence[Path], workers: int | None,
    scheduler: str | None, **options: Any,
) -> None:  # fmt: skip
    """`dataset`: list the recipes, look at one, or make its images."""
    if file is None:
        list_recipes(as_json=options["as_json"])
    elif preview:
        del options["formats"]
        preview_recipe(file, **options)
    else:
        make_images(file, wanted=(count, shard, sources), engine=Engine(workers, scheduler), **options)


def list_recipes(*, as_json: bool) -> None:
    """`dataset` alone: the ready-made recipes."""
    found = {name: Recipe.load(name)[0].about for name in ready_made()}
    if as_json:
        print_json({"ok": True, "recipes": found})
    else:
        print_table("Ready-made recipes", list(found.items()))


def preview_recipe(file: Path, *, out: Path | None, quiet: bool, as_json: bool) -> None:
    """`dataset --preview`: the contact sheet of its first scenes."""
    recipe, root = Recipe.load(file)
    path = (out if out is not None else Path("scan-output") / f"dataset-{folder_name(recipe.name)}") / "contact.png"
    with stage_progress(quiet) as progress:
        write_contact_sheet(recipe, root, path, progress=lambda done, known: progress("scenes", done / known))
    print_json({"ok": True, "file": str(path)}) if as_json else print(f"wrote {path}")


def make_images(
    file: Path,
    *,
    wanted: tuple[int, str, Sequence[Path]],
    out: Path | None,
    formats: Sequence[str],
    engine: Engine,
    quiet: bool,
    as_json: bool,
) -> None:
    """`dataset RECIPE`: make what is missing, then index, card and formats. wanted: scenes, shard, other folders."""
    recipe, root = Recipe.load(file)
    for name in formats:
        if name not in FORMATS:
            raise InputError("there is no such format", where="--format", found=name, allowed=", ".join(FORMATS))
    folder = out if out is not None else Path("scan-output") / f"dataset-{folder_name(recipe.name)}"
    check_output(folder)
    engine.check()
    scenes, shard, sources = wanted
    with stage_progress(quiet) as progress, stop_on_interrupt(never) as cancelled:
        try:
            result = make_dataset(
                recipe,
                root,
                Wanted(scenes, shard_of(shard), tuple(sources)),
                folder,
                engine=engine,
                progress=lambda done, known: progress("scenes", done / max(known, 1)),
                cancelled=cancelled,
            )
        except Cancelled:
            raise Cancelled(f"{len(images_in(folder))} images are kept; the same command goes on from there") from None
    images = images_in(folder)
    written = [path for name in formats for path in write_format(result.dataset, images, name)]
    if as_json:
        print_json({"ok": True, "folder": str(folder), "images": result.images, "scenes_made": result.made,
                    "rejected": dict(result.rejected), "files": [str(path) for path in written]})  # fmt: skip
        return
    for reason, times in sorted(result.rejected.items()):
        print(f"{times} scenes drawn anew: {reason}", file=sys.stderr)
    print(f"{result.images} images, {result.made} scenes made now\nwrote {folder}")
    for note in notes_of_depth(result.dataset.recipe, result.dataset.base):
        print(note)
    for path in written:
        print(f"wrote {path}")
