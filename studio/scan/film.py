"""A scan played back as a film: the camera's image of every step beside the points measured so far. Qt-free."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.cloud import Cloud, merge, ply_pieces
from analysis.report.colour import DIVERGING
from render.base.arrays import Float
from render.base.errors import Cancelled, InputError
from render.base.files import atomic_write, read_bytes
from render.base.progress import StageProgress
from render.base.threads import Cancel
from render.run import never
from studio.runtime.console import frame_of, silent
from studio.scan.height_map import points_of
from studio.scan.own_files import FILM_TITLE, check_replaceable
from studio.scan.scan_folder import ScanFolder, check_kept, open_folder
from studio.scan.scan_results import ScanResults

HEIGHT = 720
"""px of the film."""
GROUND, INK, FAINT = (32, 26, 22), (235, 230, 225), (120, 110, 104)
"""Blue, green, red."""
STRIP = 40
"""px below the pictures, for what is told."""
FONT = 0.5
NEEDED = ("x", "y", "error_depth", "step")
RATE = 10.0
"""Steps a second, where nobody asks for others."""
CODEC = "mp4v"


def write_film(
    folder: Path,
    path: Path,
    rate: float,
    progress: Callable[[float], None] = lambda done: None,
    cancelled: Cancel = never,
) -> int:
    """An MP4 of a results folder, `rate` steps a second; gives the number of its frames.

    Left the developed image of the step, its dark parts lifted, right the points of all steps so far from above,
    coloured by their depth error. InputError: the scan kept no images, the suffix is another, or the machine's OpenCV
    writes no MP4. Cancelled.
    """
    import cv2

    found = open_folder(folder)
    check_kept(found)
    images = [sidecar.with_suffix(".png") for sidecar in found.frames]
    if missing := [image for image in images if not image.is_file()]:
        cure = "a scan of one laser with --frames all keeps them"
        raise InputError("the scan has no image of a step", where=str(missing[0]), cure=cure)
    if path.suffix.lower() != ".mp4":
        raise InputError("a film is an MP4", where=str(path), allowed="a name ending in .mp4")
    check_replaceable([path], [*images, *found.frames])
    cloud = _Growing(_points(found))
    with atomic_write(path) as temporary:
        part = temporary.with_name(temporary.name + ".mp4")  # OpenCV chooses the container by the name
        film: Any = None
        try:
            for step, image in enumerate(images):
                if cancelled():
                    raise Cancelled
                picture = _frame(_image(image), cloud.until(step), f"step {step + 1} of {len(images)}", cloud.legend)
                if film is None:
                    size = (picture.shape[1], picture.shape[0])
                    film = cv2.VideoWriter(str(part), cv2.VideoWriter.fourcc(*CODEC), rate, size)
                    if not film.isOpened():
                        raise InputError("this machine's OpenCV writes no MP4", where=str(path), found=CODEC)
                film.write(picture)
                progress((step + 1) / len(images))
            if film is not None:
                film.release()
                film = None
                part.replace(temporary)
                with open(temporary, "ab") as file:  # a free box (ISO 14496-12, 8.1.2): whose film it is
                    file.write((8 + len(FILM_TITLE)).to_bytes(4, "big") + b"free" + FILM_TITLE)
        finally:
            if film is not None:
                film.release()
            part.unlink(missing_ok=True)
    return len(images)


def export_film(
    scan: ScanResults | None,
    path: Path,
    _: object = None,
    *,
    progress: StageProgress = silent,
    cancelled: Cancel = never,
) -> list[Path]:
    """Of the whole scan that a frame is a step of. InputError: it is of none, or as `write_film`. Cancelled."""
    if scan is None:
        raise InputError("a single frame is no film", cure="run the scan, or open the results of one")
    count = scan.count

    def drawn(done: float) -> None:
        progress(frame_of(done, count), done)

    drawn(0.0)
    write_film(scan.found.folder, path, RATE, drawn, cancelled)
    return [path]


class _Growing:
    """Points from above, drawn once each."""

    def __init__(self, points: Cloud) -> None:
        from analysis.report.error_figures import nice_limit  # slow to load

        self.order = np.argsort(points["step"], kind="stable")
        self.step = points["step"][self.order]
        self.done = 0
        self.canvas = np.full((HEIGHT, HEIGHT, 3), GROUND, dtype=np.uint8)
        place = np.column_stack([points["x"], points["y"]])
        low, high = (place.min(axis=0), place.max(axis=0)) if len(place) else (np.zeros(2), np.ones(2))
        self.pitch = max(float((high - low).max()), 1e-9) / (0.9 * HEIGHT)
        middle = 0.5 * (low + high)
        self.place = np.round((place - middle) / self.pitch * [1.0, -1.0] + 0.5 * HEIGHT).astype(np.intp)
        self.limit = nice_limit(points["error_depth"])
        self.colour = _colours(points["error_depth"], self.limit)
        self.size = 3
        self.legend = f"depth error: white 0, deepest colours {1e6 * self.limit:g} um and beyond"

    def until(self, step: int) -> NDArray[np.uint8]:
        """With the points of all steps up to this one."""
        end = int(np.searchsorted(self.step, step, side="right"))
        new = self.order[self.done : end]
        for right in range(self.size):
            for down in range(self.size):
                column, row = self.place[new, 0] + right, self.place[new, 1] + down
                inside = (column >= 0) & (column < HEIGHT) & (row >= 0) & (row < HEIGHT)
                self.canvas[row[inside], column[inside]] = self.colour[new[inside]]
        self.done = end
        return self.canvas


def _colours(error: Float, limit: float) -> NDArray[np.uint8]:
    """(n, 3) blue, green, red; points without an error are grey."""
    import matplotlib

    shown = matplotlib.colormaps[DIVERGING](np.clip(0.5 + 0.5 * np.nan_to_num(error) / limit, 0.0, 1.0))[:, :3]
    shown[~np.isfinite(error)] = 0.5
    return np.asarray(255.0 * shown[:, ::-1]).round().astype(np.uint8)


def _image(path: Path) -> NDArray[np.uint8]:
    """HEIGHT px tall, the largest of each block so that the line stays, its dark parts lifted by a square root."""
    import cv2

    data = np.frombuffer(read_bytes(path, 2**31, "image"), dtype=np.uint8)
    numbers = cv2.imdecode(data, cv2.IMREAD_UNCHANGED)
    if numbers is None:
        raise InputError("the image cannot be read", where=str(path))
    top = 255.0 if numbers.dtype == np.uint8 else 65535.0
    if numbers.ndim == 2:
        numbers = numbers[..., None]
    block = max(1, numbers.shape[0] // HEIGHT)
    rows, columns = numbers.shape[0] // block, numbers.shape[1] // block
    cut = numbers[: rows * block, : columns * block, :3]
    largest = cut.reshape(rows, block, columns, block, -1).max(axis=(1, 3)).astype(np.float64)
    largest = np.repeat(largest, 3, axis=2) if largest.shape[2] == 1 else largest
    lifted = (255.0 * np.sqrt(largest / max(float(largest.max()), 1e-3 * top))).astype(np.uint8)
    width = max(1, round(HEIGHT * columns / rows))
    return np.asarray(cv2.resize(lifted, (width, HEIGHT), interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _frame(image: NDArray[np.uint8], cloud: NDArray[np.uint8], told: str, legend: str) -> NDArray[np.uint8]:
    """Both side by side over a strip of text; width and height are even, as the codec wants them."""
    import cv2

    gap = np.full((HEIGHT, 4, 3), FAINT, dtype=np.uint8)
    above = np.concatenate([image, gap, cloud], axis=1)
    above = above[:, : above.shape[1] // 2 * 2]
    strip = np.full((STRIP, above.shape[1], 3), GROUND, dtype=np.uint8)
    right = image.shape[1] + 12
    for text, x in ((told, 12), (legend, right)):
        cv2.putText(strip, text, (x, 26), cv2.FONT_HERSHEY_SIMPLEX, FONT, INK, 1, cv2.LINE_AA)
    return np.ascontiguousarray(np.concatenate([above, strip]))


def _points(found: ScanFolder) -> Cloud:
    """Columns of all points; of a scan that was rendered alone there are none."""
    if not (found.folder / "points.ply").is_file():
        return {name: column for name, column in merge([]).items() if name in NEEDED}
    return merge([{name: piece[name] for name in NEEDED} for piece in ply_pieces(points_of(found.folder))])
