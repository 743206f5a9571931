"""Images of a folder, small, with the exact lines of their labels."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import cv2
import numpy as np

from render.base.errors import InputError
from render.base.files import read_bytes
from render.base.threads import Cancel
from render.run import never
from studio.dataset.contact_sheet import SIDE, Curve, Picture
from studio.dataset.folder import label_record
from studio.dataset.images import IMAGES, name_of

MOST_BYTES = 2**30
"""Of an image's file."""


def written_pictures(folder: Path, images: Sequence[int], cancelled: Cancel = never) -> Iterator[Picture]:
    """Images of a folder, as they lie there; one that cannot be read is left out."""
    for image in images:
        if cancelled():
            return
        try:
            yield written_picture(folder, image)
        except (InputError, KeyError, TypeError, ValueError, cv2.error):
            continue  # who goes on with the folder, or reads it, is told


def written_picture(folder: Path, image: int, side: int | None = SIDE) -> Picture:
    """One of them. side: px of the longer side at most; None: as it is. InputError: it cannot be read."""
    record = label_record(folder, image)
    data = read_bytes(folder / IMAGES / f"{name_of(image)}.png", MOST_BYTES, "image")
    pixels = np.asarray(cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED))
    height, width = pixels.shape[:2]
    scale = 1.0 if side is None else min(1.0, side / max(height, width))
    size = max(1, round(width * scale)), max(1, round(height * scale))
    small = cv2.resize(pixels, size, interpolation=cv2.INTER_AREA).astype(np.float64)
    if small.ndim == 3:
        small = small.mean(axis=2)
    lasers = [laser for k, laser in enumerate(record["lasers"]) if record["fired"] in (None, k)]
    curves = [[(np.array(one[key], np.float64) + 0.5) * scale - 0.5 for key in ("index", "position")] for one in lasers]
    return Picture(
        image,
        np.sqrt(small / max(float(small.max()), 1.0)),
        tuple(Curve(record["scan_lines"], index, position) for index, position in curves),
        tuple(record["rejected"]),
    )
