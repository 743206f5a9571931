"""From a folder of photographs to views: laser-on and laser-off images put together by name, boards and lines found."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from analysis.calibration.board import Board
from analysis.calibration.detect import detect, on_board, spacing, without_corners
from analysis.calibration.observations import Stripe, View
from analysis.line.estimate import estimate_noise
from analysis.line.extract import extract
from analysis.line.result import Flag
from analysis.line.series.subtract import subtract_off
from analysis.line.settings import ExtractionSettings
from render.base.errors import InputError
from studio.photographs.image_files import load_photograph

SUFFIXES = (".png", ".tif", ".tiff", ".jpg", ".jpeg", ".bmp", ".exr")
ROLE = re.compile(r"(?P<name>.*?)[ _-](?P<role>off|on|laser(?P<laser>\d{1,2}))", re.IGNORECASE)
FEWEST_POINTS = 10
"""Points of a line on the board that a view needs to tell anything of a laser."""
EVEN = 0.1
"""Of the brightness: what the board's may differ by between photographs with the laser and without."""
WIDEST_LINE = 25
"""px of a line that stands on the board's own image."""
CLEAR_WIDTHS = 4.0
"""Line widths (sigma) that the line keeps from the edges of squares."""


@dataclass(frozen=True)
class Shot:
    """The photographs of one pose of the board."""

    name: str
    board: Path | None
    """Laser off, or the one image for both."""
    lasers: dict[int, Path] = field(default_factory=dict)
    """Laser on, by its number."""
    both: bool = False
    """The one image is said to be of the board alone by no name: it may show the line as well."""


@dataclass(frozen=True)
class Found:
    """Views, what was wrong with files, and what else is to be told."""

    views: tuple[View, ...]
    size: tuple[int, int]
    errors: tuple[str, ...]
    notes: tuple[str, ...]


def shots(folder: Path) -> list[Shot]:
    """By name: NAME_off and NAME_on, or NAME_off and NAME_laser0, NAME_laser1; a plain NAME is one image for both.

    InputError: no folder, none with images, or two files of one name.
    """
    if not folder.is_dir():
        raise InputError("there is no such folder", where=str(folder), cure="give the folder of the photographs")
    files = sorted(file for file in folder.iterdir() if file.suffix.lower() in SUFFIXES and file.name[0] != ".")
    if not files:
        raise InputError("the folder holds no images", where=str(folder), allowed=", ".join(SUFFIXES))
    found: dict[str, Shot] = {}
    for file in files:
        role = ROLE.fullmatch(file.stem)
        name = role["name"] if role else file.stem
        shot = found.get(name, Shot(name, None))
        board = role is None or role["role"].lower() == "off"
        laser = 0 if role is None else int(role["laser"] or 0)
        other = shot.board if board else shot.lasers.get(laser)
        if other is not None:
            cure = "give each its own name, or move one away"
            raise InputError(f"{other.name} and {file.name} are one photograph by name", where=str(folder), cure=cure)
        if board:
            shot = replace(shot, board=file, both=role is None)
        else:
            shot = replace(shot, lasers={**shot.lasers, laser: file})
        found[name] = shot
    return list(found.values())


def views_of(
    taken: Sequence[Shot],
    board: Board,
    settings: ExtractionSettings,
    *,
    lasers: bool,
    progress: Callable[[float], None] = lambda done: None,
) -> Found:
    """Every shot whose files are good; a bad file is told, and the rest goes on.

    lasers: the lines are looked for too. InputError: nothing is usable; the first reason is told.
    """
    views: list[View] = []
    errors, notes = [], []
    size: tuple[int, int] | None = None
    seen: dict[bytes, str] = {}
    for number, shot in enumerate(taken):
        progress(number / len(taken))
        file = shot.board or next(iter(shot.lasers.values()))
        try:
            image = load_photograph(file)
            size = _same_size(image, size)
            _check_new(image, seen, shot.name)
            view, told = detect(image, board, shot.name)
            if lasers:
                view, more = _with_lines(view, image, shot, board, settings)
                told += more
        except InputError as error:
            errors.append(f"{file}: {error.what if str(file) in error.where else error}")
            continue
        notes += [f"{shot.name}: {one}" for one in told]
        views.append(view)
    progress(1.0)
    if not views:
        first = errors[0] if errors else "no images"
        raise InputError("no photograph is usable", found=f"{len(errors)} with faults", cure=f"the first: {first}")
    assert size is not None
    return Found(tuple(views), size, tuple(errors), tuple(notes))


def _same_size(image: NDArray[Any], size: tuple[int, int] | None) -> tuple[int, int]:
    own = (image.shape[1], image.shape[0])
    if size is not None and own != size:
        raise InputError(
            "the image is of another size than the first",
            found=f"{own[0]} x {own[1]} px",
            allowed=f"{size[0]} x {size[1]} px",
            cure="do not crop, turn or resize photographs",
        )
    return own


def _check_new(image: NDArray[Any], seen: dict[bytes, str], name: str) -> None:
    import hashlib

    digest = hashlib.sha256(np.ascontiguousarray(image).tobytes()).digest()
    if digest in seen:
        raise InputError(f"the same photograph as {seen[digest]}", cure="every pose counts once")
    seen[digest] = name


def _with_lines(
    view: View, image: NDArray[Any], shot: Shot, board: Board, settings: ExtractionSettings
) -> tuple[View, list[str]]:
    """The view with its laser lines; corners under a line that is in the board's own image are dropped."""
    told, stripes = [], []
    own = {0: shot.board} if shot.both and not shot.lasers else shot.lasers
    if not own:
        told.append("no photograph with the laser on; only its corners are used")
    near = np.zeros(len(view.pixel), dtype=bool)
    disc = spacing(view.pixel) * board.circle / board.square
    for laser, file in sorted(own.items()):
        assert file is not None
        with_line = image if file == shot.board else load_photograph(file)
        if with_line.shape != image.shape:
            raise InputError("laser-on and laser-off image are of different size or kind", where=str(file))
        separate = file != shot.board and shot.board is not None
        if separate:
            brighter = _brightness(with_line, view) / max(_brightness(image, view), 1e-9)
            if abs(brighter - 1.0) > EVEN:
                told.append(
                    f"the board is {brighter:.2f} times as bright with laser {laser} on as without, which spoils their "
                    "difference: switch off automatic exposure"
                )
            if not _has_light(with_line, image):
                told.append(f"the photograph with laser {laser} on shows no light that the other has not; is it on?")
                continue
        pixel, sigma, width, misfit = _line(with_line, image if separate else None, settings)
        if not separate and len(pixel):
            across = 0 if settings.axis == "rows" else 1
            row = np.rint(view.pixel[:, 1 - across])
            index = np.clip(np.searchsorted(pixel[:, 1 - across], row), 0, len(pixel) - 1)
            near |= np.abs(view.pixel[:, across] - pixel[index, across]) < 10.0 + 4.0 * width + disc
        keep = on_board(view, board, pixel, CLEAR_WIDTHS * width + 2.0, settings.axis)
        if np.count_nonzero(keep) < FEWEST_POINTS:
            if misfit > FEWEST_POINTS + len(pixel):
                why = f"has no line's form on {misfit} scan lines, as in a picture that was compressed"
            else:
                why = "is not on the board"
            told.append(f"the line of laser {laser} {why}; only its corners are used")
            continue
        stripes.append(Stripe(laser, pixel[keep], sigma[keep], settings.axis))
    if near.any() and np.count_nonzero(~near) >= 8:
        told.append(f"{int(near.sum())} corners under the line dropped")
        view = without_corners(view, near)
    return replace(view, stripes=tuple(stripes)), told


def _brightness(image: NDArray[Any], view: View) -> float:
    """Median over the board, of which a line is a small part."""
    x, y = (slice(int(low), int(high) + 1) for low, high in zip(view.pixel.min(0), view.pixel.max(0), strict=True))
    return float(np.median(image[y, x]))


def _has_light(image: NDArray[Any], off: NDArray[Any]) -> bool:
    """Whether anything in an image is brighter than in the one without a laser by more than it is darker elsewhere."""
    difference = image.astype(np.float64) - off.astype(np.float64)
    return bool(difference.max() > max(-0.5 * difference.min(), 0.0))


def _line(
    image: NDArray[Any], off: NDArray[Any] | None, settings: ExtractionSettings
) -> tuple[NDArray[np.float64], NDArray[np.float64], float, int]:
    """(m, 2) px, (m,) sigma px, the line's typical width (sigma), px, and scan lines on which there is no such line."""
    noise = None
    if off is not None:
        image, saturation = subtract_off(image, off)
        noise = estimate_noise(image, settings, saturation)
    elif image.ndim == 2:
        image = _without_squares(image, settings.axis)
    line = extract(image, settings=settings, noise=noise)
    pixel, index, rank = line.pixels()
    good = (line.flag[index, rank] == Flag.OK) & np.isfinite(line.sigma_u[index, rank])
    width = line.width[index, rank][good]
    typical = float(np.median(width)) if good.any() and np.isfinite(width).any() else 1.5
    misfit = int(np.count_nonzero((line.flag == Flag.MISFIT).any(axis=1)))
    return pixel[good], np.maximum(line.sigma_u[index, rank][good], 1e-3), typical, misfit


def _without_squares(image: NDArray[Any], axis: str) -> NDArray[np.float32]:
    """What is bright and narrow along the scan lines: the laser's line, without the board's squares."""
    across = (1, WIDEST_LINE) if axis == "rows" else (WIDEST_LINE, 1)
    return np.asarray(cv2.morphologyEx(image.astype(np.float32), cv2.MORPH_TOPHAT, np.ones(across, dtype=np.uint8)))
