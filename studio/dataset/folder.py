"""A dataset's folder: what it was made by, which images are whole, and the index, card and formats made of them.

dataset.json           recipe, base project, program version
images/00000/00000042.png, labels/..., objects/..., maps/...     1,000 images a folder
index.csv              of each image: scene, split, files and their SHA-256
card.md                the data card
"""

from __future__ import annotations

import csv
import io
import json
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from render.base.errors import InputError
from render.base.files import atomic_write, read_bytes, remove_all_unfinished, sha256
from studio.dataset.image_kind import image_kind, notes_of_depth
from studio.dataset.images import IMAGES, LABELS, MAPS, OBJECTS, images_of, name_of
from studio.dataset.recipe import Recipe
from studio.project.project import Project
from studio.project.strict_json import read_object

IMAGE = re.compile(r"[0-9]+\.(png|exr|json)")
ABOUT, INDEX, CARD = "dataset.json", "index.csv", "card.md"
MOST_LABEL_BYTES = 2**26
COLUMNS = ("image", "scene", "split", "fired", "file", "sha256", "labels", "labels_sha256")


@dataclass(frozen=True)
class Dataset:
    """A folder with its recipe."""

    folder: Path
    recipe: Recipe
    base: Project
    digest: str

    @property
    def per_scene(self) -> int:
        return images_of(self.recipe, len(self.base.scene.lasers))

    def is_made(self, scene: int) -> bool:
        """Every image of the scene is there, whole: labels are written last."""
        first = scene * self.per_scene
        return all((self.folder / LABELS / f"{name_of(first + k)}.json").is_file() for k in range(self.per_scene))

    def record(self, image: int) -> dict[str, Any]:
        """The labels of an image. InputError: they are damaged."""
        return label_record(self.folder, image)


def label_record(folder: Path, image: int) -> dict[str, Any]:
    """The labels of an image of a folder. InputError: they are missing or damaged."""
    path = folder / LABELS / f"{name_of(image)}.json"
    data = read_bytes(path, MOST_LABEL_BYTES, "image's labels")
    try:
        found = json.loads(data)
        if not _is_whole(found, image):
            raise ValueError
    except (ValueError, KeyError, TypeError, AttributeError, UnicodeDecodeError, RecursionError):
        cure = "remove it, and run the same command again: it is made anew"
        raise InputError("the image's labels are damaged", where=str(path), cure=cure) from None
    return dict(found)


def _is_whole(found: dict[str, Any], image: int) -> bool:
    """Labels of this image that name no files but its own, wherever another folder's would lead.

    KeyError, TypeError, AttributeError: something is missing, or of another kind.
    """
    name = name_of(image)
    own = {f"{IMAGES}/{name}.png", f"{OBJECTS}/{name}.png", f"{MAPS}/{name}.exr"}
    files, rejected = found["files"], found["rejected"]
    return (
        found["image"] == image
        and isinstance(found["scene"], int)
        and isinstance(found["split"], str)
        and (found["fired"] is None or isinstance(found["fired"], int))
        and isinstance(rejected, list)
        and all(isinstance(reason, str) for reason in rejected)
        and f"{IMAGES}/{name}.png" in files
        and files.keys() <= own
        and all(isinstance(digest, str) for digest in files.values())
    )


def is_of(folder: Path, recipe: Recipe, base: Project) -> bool:
    """Whether a folder holds images of a recipe, with which it can go on. InputError: it cannot be read."""
    about = folder / ABOUT
    return about.exists() and read_object(about, "dataset").get("digest") == recipe.digest(base)


def begun(folder: Path, recipe: Recipe, base: Project) -> Dataset:
    """The folder for a recipe, new or gone on with. InputError: it holds another dataset, or other files."""
    digest = recipe.digest(base)
    about = folder / ABOUT
    if about.exists():
        if not is_of(folder, recipe, base):
            raise InputError(
                "the folder holds another dataset: its recipe or base project differs",
                where=str(folder),
                cure="choose another folder with --out; only the count may differ",
            )
    else:
        there = folder.iterdir() if folder.is_dir() else ()
        strangers = sorted(path.name for path in there if not path.name.startswith("."))
        if strangers:
            found = ", ".join(strangers[:5])
            allowed, cure = "an empty or new folder", "choose another with --out"
            raise InputError("the folder is not empty", where=str(folder), found=found, allowed=allowed, cure=cure)
        said = {
            "digest": digest,
            "program": version("blazer-studio"),
            "recipe": recipe.model_dump(mode="json"),
            "base": base.model_dump(mode="json"),
        }
        _write(about, json.dumps(said, indent=2) + "\n")
    return Dataset(folder, recipe, base, digest)


def images_in(folder: Path) -> list[int]:
    """The images that a folder holds whole, in order."""
    return sorted(int(path.stem) for path in (folder / LABELS).glob("[0-9]*/[0-9]*.json"))


def remove_unfinished(folder: Path) -> None:
    """Remove what killed programs left half-written; only for the one that holds the folder."""
    remove_all_unfinished(folder, (ABOUT, INDEX, CARD).__contains__)
    for kind in (IMAGES, OBJECTS, MAPS, LABELS):
        for below in (folder / kind).glob("[0-9]*"):
            remove_all_unfinished(below, IMAGE.fullmatch)


def opened(folder: Path) -> Dataset:
    """The dataset of a folder. InputError: it holds none."""
    about = read_object(folder / ABOUT, "dataset")
    try:
        recipe, base = Recipe.model_validate_json(json.dumps(about["recipe"])), Project.from_data(about["base"])
        return Dataset(folder, recipe, base, str(about["digest"]))
    except (KeyError, TypeError, ValueError):
        raise InputError("the dataset is damaged", where=str(folder / ABOUT), cure="make it anew") from None


def take_from(dataset: Dataset, source: Path) -> int:
    """Take over the scenes that another folder of the same recipe made; how many. InputError: it is of another."""
    other = opened(source)
    if other.digest != dataset.digest:
        raise InputError("the folder holds another dataset", where=str(source), allowed="one of the same recipe")
    taken = 0
    for image in images_in(source):
        if (dataset.folder / LABELS / f"{name_of(image)}.json").exists():
            continue
        for name, digest in other.record(image)["files"].items():
            _copy(source / name, dataset.folder / name, digest)
        name = f"{LABELS}/{name_of(image)}.json"
        _copy(source / name, dataset.folder / name, None)
        taken += 1
    return taken


def write_index(dataset: Dataset, images: list[int]) -> list[Path]:
    """Write index and card of the images; their paths."""
    table = io.StringIO()
    writer = csv.writer(table, lineterminator="\n")
    writer.writerow(COLUMNS)
    splits: Counter[str] = Counter()
    reasons: Counter[str] = Counter()
    for record in records(dataset, images):
        labels = f"{LABELS}/{name_of(record['image'])}.json"
        file = f"{IMAGES}/{name_of(record['image'])}.png"
        writer.writerow(
            [record["image"], record["scene"], record["split"], "" if record["fired"] is None else record["fired"],
             file, record["files"][file], labels, sha256(dataset.folder / labels)]
        )  # fmt: skip
        splits[record["split"]] += 1
        if record["image"] % dataset.per_scene == 0:
            reasons.update(record["rejected"])
    index, card = dataset.folder / INDEX, dataset.folder / CARD
    _write(index, table.getvalue())
    _write(card, _card(dataset, len(images), splits, reasons))
    return [index, card]


def records(dataset: Dataset, images: list[int]) -> Iterator[dict[str, Any]]:
    """The labels of images, one at a time."""
    return (dataset.record(image) for image in images)


def _card(dataset: Dataset, count: int, splits: Counter[str], reasons: Counter[str]) -> str:
    recipe = dataset.recipe
    lines = [
        f"# {recipe.name}",
        "",
        recipe.about or "Rendered images of laser lines with exact labels.",
        "",
        f"- images: {count}, of {count // dataset.per_scene} scenes; {dataset.per_scene} of each scene share its light",
        f"- split by scene: {', '.join(f'{name} {splits[name]}' for name in sorted(splits))}",
        f"- base project: {recipe.base}, image scale {recipe.image_scale:g}, seed {recipe.seed}",
        *_scale_note(recipe.image_scale),
        f"- image size and depth: {image_kind(recipe, dataset.base)}",
        *(f"- {note}" for note in notes_of_depth(recipe, dataset.base)),
        f"- made by Blazer Studio {version('blazer-studio')}; recipe and base SHA-256 {dataset.digest}",
        "- line positions are exact for the meshes, at scan-line centres; sigma_floor is the Cramer-Rao bound of shot, "
        "read and quantisation noise without speckle, px",
        "",
        "## Drawn",
        "",
    ]
    for one in recipe.draw:
        said = one.model_dump(exclude_defaults=True, exclude={"field"})
        kind = said.pop("kind", "uniform")
        lines.append(f"- `{one.field}`: {kind}, {', '.join(f'{name} {value}' for name, value in said.items())}")
    lines += ["", "## Scenes drawn anew", ""]
    lines += [f"- {reason}: {times}" for reason, times in sorted(reasons.items())] or ["- none"]
    return "\n".join(lines) + "\n"


def _copy(source: Path, target: Path, digest: str | None) -> None:
    """InputError: the file is damaged."""
    data = read_bytes(source, 2**32, "image file")
    if digest is not None:
        import hashlib

        if hashlib.sha256(data).hexdigest() != digest:
            raise InputError("the file is damaged", where=str(source), cure="make that part of the dataset anew")
    with atomic_write(target) as temporary:
        temporary.write_bytes(data)


def _write(path: Path, text: str) -> None:
    with atomic_write(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _scale_note(image_scale: float) -> list[str]:
    """What the numbers of a label are of, where images are smaller or larger than the scanner's."""
    if image_scale == 1.0:
        return []
    return [
        f"- `camera` and `sensor` of a label are its image's: pixels are {1.0 / image_scale:.4g} times as large, "
        f"exposures {1.0 / image_scale**2:.4g} times as short, so that they fill as much; `drawn` has the scanner's own"
    ]
