"""Images and labels for PyTorch: of a folder, or rendered as they are asked for. Importable without torch.

from torch.utils.data import DataLoader
loader = DataLoader(FolderImages("frames", split="train"), batch_size=8, collate_fn=list)
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np
from numpy.typing import NDArray

from render.base.errors import InputError
from render.base.files import read_bytes
from studio.dataset.folder import images_in, label_record, opened, records
from studio.dataset.images import IMAGES, name_of, photograph, rendered
from studio.dataset.labels import labels
from studio.dataset.recipe import Recipe, base_of
from studio.dataset.scenes import SPLITS, drawn_scene
from studio.preview.preview import Preview

if TYPE_CHECKING:

    class MapDataset: ...

    class StreamDataset: ...

else:
    try:
        from torch.utils.data import Dataset as MapDataset
        from torch.utils.data import IterableDataset as StreamDataset
    except ModuleNotFoundError:
        MapDataset = StreamDataset = object

Sample = tuple[NDArray[Any], dict[str, Any]]
"""(h, w) DN and the image's labels, as in its JSON file."""


class FolderImages(MapDataset):
    """The images of a dataset's folder by number in a split: `dataset[i]` is (pixels, labels).

    split: "train", "validation" or "test"; None: all. InputError: the folder holds no dataset, or no such split.
    """

    def __init__(self, folder: Path | str, split: str | None = None) -> None:
        if split is not None and split not in SPLITS:
            raise InputError("there is no such split", where="split", found=split, allowed=", ".join(SPLITS))
        self.folder = Path(folder)
        dataset, images = opened(self.folder), images_in(self.folder)
        if split is not None:
            images = [record["image"] for record in records(dataset, images) if record["split"] == split]
        self.images = images

    def __len__(self) -> int:
        return len(self.images)

    def __getitem__(self, i: int) -> Sample:
        image = self.images[i]
        path = self.folder / IMAGES / f"{name_of(image)}.png"
        pixels = cv2.imdecode(np.frombuffer(read_bytes(path, 2**30, "image"), np.uint8), cv2.IMREAD_UNCHANGED)
        if pixels is None:
            raise InputError("the image is damaged", where=str(path), cure="make that part of the dataset anew")
        return np.asarray(pixels), label_record(self.folder, image)


class LiveImages(StreamDataset):
    """The scenes of a recipe, rendered as they are asked for: an endless stream of (pixels, labels) from scene `first`.

    A worker of a DataLoader takes every n-th scene, so that workers never render the same one.
    """

    def __init__(self, recipe: Path | str, first: int = 0) -> None:
        self.recipe, self.root = Recipe.load(recipe)
        self.first = first

    def __iter__(self) -> Iterator[Sample]:
        start, step = _worker()
        base, preview = base_of(self.recipe, self.root), Preview(1)
        number = self.first + start
        while True:
            scene = drawn_scene(self.recipe, base, self.root, number, preview)
            frame = rendered(scene)
            for image, project in enumerate(scene.projects):
                yield photograph(project, frame, None), labels(scene, image, frame)
            preview.drop_unused(base, base.folder)
            number += step


def _worker() -> tuple[int, int]:
    """Number and count of the DataLoader's workers, where this is one."""
    try:
        from torch.utils.data import get_worker_info
    except ModuleNotFoundError:
        return 0, 1
    found = get_worker_info()
    return (0, 1) if found is None else (found.id, found.num_workers)
