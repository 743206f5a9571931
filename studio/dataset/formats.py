"""The labels in the formats of others' readers, made of the folder's own: files beside them, or one archive.

    coco         annotations_<split>.json   RLE mask and keypoints of each line
    yolo         yolo/<name>.txt            outline of each line as a polygon (YOLO segmentation)
    tusimple     tusimple_<split>.json      x on each scan line, a JSON object a line; -2 where there is none
    culane       culane/<name>.lines.txt    x y pairs of each line
    webdataset   webdataset/<split>-00000.tar   image and labels of 1,000 images a shard
    hdf5         dataset.h5                 images and rows of exact positions as arrays

Row anchors (tusimple, culane) are exact: u at whole v. They need scan lines along rows.
"""

from __future__ import annotations

import io
import json
import tarfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float
from render.base.errors import InputError
from render.base.files import atomic_write, read_bytes
from studio.dataset.folder import Dataset, records
from studio.dataset.images import A_FOLDER, IMAGES, LABELS, name_of
from studio.dataset.scenes import SPLITS

HALF_WIDTH = 3.0
"""px to each side of the exact position that count as the line's in masks and outlines."""
KEYPOINTS = 17
GAP = 1.5
"""Scan lines, and px a scan line, within which neighbouring crossings are one line."""
STEEPEST = 5.0
Record = Mapping[str, Any]


def write_format(dataset: Dataset, images: list[int], name: str) -> list[Path]:
    """Write one format of all images; the paths. InputError: unknown, or not for these images."""
    if name not in FORMATS:
        raise InputError("there is no such format", where="--format", found=name, allowed=", ".join(FORMATS))
    return FORMATS[name](dataset, images)


def pieces(laser: Record) -> list[Float]:
    """Each unbroken piece of a laser's line as (n, 2): scan line, position."""
    index, position = np.array(laser["index"], float), np.array(laser["position"], float)
    found: list[list[tuple[float, float]]] = []
    for row, at in zip(index.tolist(), position.tolist(), strict=True):
        near = [one for one in found if 0 < row - one[-1][0] <= GAP and abs(at - one[-1][1]) <= STEEPEST]
        if near:
            min(near, key=lambda one: abs(one[-1][1] - at)).append((row, at))
        else:
            found.append([(row, at)])
    return [np.array(one) for one in found]


def line_mask(record: Record, laser: Record) -> NDArray[np.bool_]:
    """(h, w) pixels within HALF_WIDTH of the exact line."""
    rows = record["scan_lines"] == "rows"
    shape = (record["height"], record["width"]) if rows else (record["width"], record["height"])
    mask = np.zeros(shape, np.bool_)
    for row, at in zip(laser["index"], laser["position"], strict=True):
        first, last = int(np.ceil(at - HALF_WIDTH)), int(np.floor(at + HALF_WIDTH))
        mask[row, max(first, 0) : last + 1] = True
    return mask if rows else mask.T


def run_lengths(mask: NDArray[np.bool_]) -> list[int]:
    """COCO's uncompressed RLE: runs of 0 and 1 in turn, down the columns, beginning with 0."""
    flat = np.concatenate([[False], mask.ravel(order="F"), [False]])
    edges = np.flatnonzero(flat[1:] != flat[:-1])
    ends = np.concatenate([[0], edges, [mask.size]])
    runs = np.diff(ends)
    return [int(one) for one in (runs[:-1] if mask.size and runs[-1] == 0 else runs)]


def _coco(dataset: Dataset, images: list[int]) -> list[Path]:
    found: dict[str, dict[str, list[Any]]] = {name: {"images": [], "annotations": []} for name in SPLITS}
    for record in records(dataset, images):
        part = found[record["split"]]
        part["images"].append({"id": record["image"], "file_name": f"{IMAGES}/{name_of(record['image'])}.png",
                               "width": record["width"], "height": record["height"]})  # fmt: skip
        for laser in _fired(record):
            mask = line_mask(record, laser)
            if not mask.any():
                continue
            v, u = np.nonzero(mask)
            box = [int(u.min()), int(v.min()), int(u.max() - u.min() + 1), int(v.max() - v.min() + 1)]
            points = _keypoints(record, laser)
            part["annotations"].append(
                {
                    "id": len(part["annotations"]) + 1,
                    "image_id": record["image"],
                    "category_id": 1,
                    "iscrowd": 1,
                    "area": int(mask.sum()),
                    "bbox": box,
                    "segmentation": {"counts": run_lengths(mask), "size": [record["height"], record["width"]]},
                    "keypoints": points,
                    "num_keypoints": KEYPOINTS,
                }
            )
    names = [f"p{k}" for k in range(KEYPOINTS)]
    category = {"id": 1, "name": "laser line", "supercategory": "line", "keypoints": names,
                "skeleton": [[k, k + 1] for k in range(1, KEYPOINTS)]}  # fmt: skip
    written = []
    for name, part in found.items():
        if part["images"]:
            said = {"info": {"description": dataset.recipe.name}, "licenses": [], "categories": [category], **part}
            written.append(_write(dataset.folder / f"annotations_{name}.json", json.dumps(said).encode()))
    return written


def _keypoints(record: Record, laser: Record) -> list[float]:
    """KEYPOINTS points evenly along the crossings: u, v, 2 each; COCO counts from the corner of the first pixel."""
    chosen = np.linspace(0, len(laser["index"]) - 1, KEYPOINTS).round().astype(int)
    flat: list[float] = []
    for k in chosen.tolist():
        row, at = laser["index"][k] + 0.5, laser["position"][k] + 0.5
        flat += [at, row, 2] if record["scan_lines"] == "rows" else [row, at, 2]
    return flat


def _yolo(dataset: Dataset, images: list[int]) -> list[Path]:
    for record in records(dataset, images):
        lines = []
        width, height = record["width"], record["height"]
        for laser in _fired(record):
            for piece in pieces(laser):
                if len(piece) < 2:
                    continue
                left = np.stack([piece[:, 1] - HALF_WIDTH, piece[:, 0]], 1)
                right = np.stack([piece[:, 1] + HALF_WIDTH, piece[:, 0]], 1)[::-1]
                outline = np.concatenate([left, right]) + 0.5
                outline = outline if record["scan_lines"] == "rows" else outline[:, ::-1]
                scaled = np.clip(outline / (width, height), 0.0, 1.0)
                lines.append("0 " + " ".join(f"{one:.8f}" for one in scaled.ravel()))
        _write(dataset.folder / "yolo" / f"{name_of(record['image'])}.txt", "\n".join([*lines, ""]).encode())
    return [dataset.folder / "yolo"]


def _tusimple(dataset: Dataset, images: list[int]) -> list[Path]:
    found: dict[str, list[str]] = {name: [] for name in SPLITS}
    for record in records(dataset, images):
        _along_rows(record, "tusimple")
        lanes = []
        for laser in _fired(record):
            for piece in pieces(laser):
                lane = np.full(record["height"], -2.0)
                lane[piece[:, 0].astype(int)] = piece[:, 1]
                lanes.append([round(one, 6) for one in lane.tolist()])
        said = {"raw_file": f"{IMAGES}/{name_of(record['image'])}.png", "lanes": lanes,
                "h_samples": list(range(record["height"]))}  # fmt: skip
        found[record["split"]].append(json.dumps(said))
    return [
        _write(dataset.folder / f"tusimple_{name}.json", "\n".join([*lines, ""]).encode())
        for name, lines in found.items()
        if lines
    ]


def _culane(dataset: Dataset, images: list[int]) -> list[Path]:
    for record in records(dataset, images):
        _along_rows(record, "culane")
        lines = [
            " ".join(f"{at:.6f} {row:g}" for row, at in piece.tolist())
            for laser in _fired(record)
            for piece in pieces(laser)
        ]
        _write(dataset.folder / "culane" / f"{name_of(record['image'])}.lines.txt", "\n".join([*lines, ""]).encode())
    return [dataset.folder / "culane"]


def _webdataset(dataset: Dataset, images: list[int]) -> list[Path]:
    by_split: dict[str, list[int]] = {name: [] for name in SPLITS}
    for record in records(dataset, images):
        by_split[record["split"]].append(record["image"])
    written = []
    for split, chosen in by_split.items():
        for first in range(0, len(chosen), A_FOLDER):
            path = dataset.folder / "webdataset" / f"{split}-{first // A_FOLDER:05d}.tar"
            with atomic_write(path) as temporary, tarfile.open(temporary, "w") as archive:
                for image in chosen[first : first + A_FOLDER]:
                    for kind, suffix in ((IMAGES, "png"), (LABELS, "json")):
                        content = read_bytes(dataset.folder / kind / f"{name_of(image)}.{suffix}", 2**30, "image file")
                        entry = tarfile.TarInfo(f"{image:08d}.{suffix}")
                        entry.size = len(content)
                        archive.addfile(entry, io.BytesIO(content))
            written.append(path)
    return written


def _hdf5(dataset: Dataset, images: list[int]) -> list[Path]:
    try:
        import h5py
    except ModuleNotFoundError:
        cure = 'install it: pip install "blazer-studio[dataset]"'
        raise InputError("h5py is not installed", where="--format hdf5", cure=cure) from None
    import cv2

    path = dataset.folder / "dataset.h5"
    with atomic_write(path) as temporary, h5py.File(temporary, "w") as file:
        for record in records(dataset, images):
            name = f"{record['image']:08d}"
            png = read_bytes(dataset.folder / IMAGES / f"{name_of(record['image'])}.png", 2**30, "image file")
            pixels = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_UNCHANGED)
            group = file.create_group(name)
            group.create_dataset("image", data=pixels, compression="gzip", compression_opts=1)
            group.attrs["split"], group.attrs["scene"] = record["split"], record["scene"]
            for k, laser in enumerate(_fired(record)):
                part = group.create_group(f"laser{k}")
                part["index"] = np.array(laser["index"], np.int32)
                for quantity in ("position", "depth_z", "sigma_floor"):
                    values = [np.nan if one is None else one for one in laser[quantity]]
                    part[quantity] = np.array(values, np.float64)
                part["states"] = np.array([int(one) for one in laser["states"]], np.int8)
    return [path]


def _fired(record: Record) -> Iterator[Record]:
    """The lasers whose light is in the image."""
    return (laser for k, laser in enumerate(record["lasers"]) if record["fired"] in (None, k))


def _along_rows(record: Record, name: str) -> None:
    if record["scan_lines"] != "rows":
        cure = "choose another format"
        raise InputError(f"{name} has a position on each row", where="extraction.axis", found="columns", allowed="rows",
                         cure=cure)  # fmt: skip


def _write(path: Path, content: bytes) -> Path:
    with atomic_write(path) as temporary:
        temporary.write_bytes(content)
    return path


FORMATS: Mapping[str, Callable[[Dataset, list[int]], list[Path]]] = {
    "coco": _coco,
    "yolo": _yolo,
    "tusimple": _tusimple,
    "culane": _culane,
    "webdataset": _webdataset,
    "hdf5": _hdf5,
}
