"""Photographs that are drawn, not rendered: what strangers send, with the line known exactly.

python -m tests.validation.drawn_photographs FOLDER [NAME ...]     write them, measure them, print the table

A surface of some reflectance in room light, a Gaussian sheet of laser light on it; blur, colours that overlap, shot and
read noise, full scale, file format. Beside ours stands a centre of mass of OpenCV that is told axis and colour.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from tests.validation.opencv_line import centre_of_mass, light_of
from tests.validation.photograph_scenes import Photograph, Score, measured, score

Floats = NDArray[np.float64]

COLOURS = {
    "red": (1.0, 0.12, 0.04),
    "green": (0.10, 1.0, 0.15),
    "blue": (0.03, 0.20, 1.0),
    "mono": (1.0, 1.0, 1.0),
}
"""What red, green and blue see of a laser."""
FULL_WELL, READ_NOISE = 8000.0, 8.0
"""Electrons."""
EXIF = 6
"""Turn by 90 degrees clockwise to be upright."""


@dataclass(frozen=True)
class Drawing:
    """One photograph. Sizes in px, light as a share of full scale on a white surface."""

    colour: str = "red"
    size: tuple[int, int] = (640, 480)
    """Width, height."""
    surface: str = "even"
    room: float = 0.2
    level: float = 0.6
    """Peak of the laser's light."""
    sigma: float = 2.0
    path: str = "straight"
    axis: str = "rows"
    file: str = "png"
    grey: bool = False
    """Saved with one channel."""
    off: bool = False
    """With a laser-off image."""
    halo: float = 0.0
    """Of the laser's light, in a glow of 15 sigmas."""
    turned: bool = False
    lines: int = 1
    part: tuple[float, float] = (0.0, 1.0)
    """Of the scan lines, those that the line is on."""


DRAWINGS = {
    "grey png": Drawing("mono", grey=True),
    "grey png, off": Drawing("mono", grey=True, off=True),
    "grey level": Drawing("mono", grey=True, axis="columns"),
    "grey level, off": Drawing("mono", grey=True, axis="columns", off=True),
    "grey 16 bit": Drawing("mono", grey=True, file="tiff", size=(1280, 960), sigma=3.0, surface="wood"),
    "grey 16 bit level": Drawing("mono", grey=True, file="tiff", size=(1280, 960), sigma=3.0, axis="columns"),
    "grey board": Drawing("mono", grey=True, surface="board", room=0.35, level=0.5),
    "grey board, off": Drawing("mono", grey=True, surface="board", room=0.35, level=0.5, off=True),
    "grey board level": Drawing("mono", grey=True, surface="board", room=0.35, axis="columns", size=(1280, 1024)),
    "grey wood": Drawing("mono", grey=True, surface="wood", room=0.3, path="curved"),
    "grey window, off": Drawing("mono", grey=True, surface="window", off=True),
    "grey window": Drawing("mono", grey=True, surface="window", level=0.8),
    "grey jpeg": Drawing("mono", grey=True, file="jpg", surface="wood"),
    "grey dark": Drawing("mono", grey=True, room=0.01, halo=0.1, level=3.0),
    "grey large": Drawing("mono", grey=True, size=(2448, 2048), sigma=2.5, surface="wood"),
    "grey small": Drawing("mono", grey=True, size=(320, 240), sigma=1.2),
    "red board": Drawing("red", surface="board", room=0.35),
    "red wood": Drawing("red", surface="wood", file="jpg", path="curved"),
    "green board level": Drawing("green", surface="board", axis="columns", file="jpg"),
    "green window": Drawing("green", surface="window"),
    "blue thin": Drawing("blue", sigma=0.8, level=0.7),
    "blue thin board": Drawing("blue", sigma=0.8, surface="board"),
    "blue jpeg": Drawing("blue", file="jpg", surface="wood", size=(1280, 960)),
    "red wide": Drawing("red", sigma=15.0, room=0.1, size=(1280, 960)),
    "green halo": Drawing("green", room=0.02, halo=0.15, level=6.0),
    "green turned": Drawing("green", file="jpg", turned=True, size=(960, 720)),
    "red part": Drawing("red", part=(0.3, 0.7), surface="wood"),
    "green steps": Drawing("green", path="steps"),
    "red steps board": Drawing("red", path="steps", surface="board", file="jpg"),
    "two green": Drawing("green", lines=2, size=(960, 720)),
    "two grey": Drawing("mono", grey=True, lines=2, size=(960, 720)),
    "green 16 bit": Drawing("green", file="tiff", surface="wood", size=(1280, 960)),
    "red curved": Drawing("red", path="curved", surface="window", file="jpg"),
}


def _even(rng: np.random.Generator, h: int, w: int) -> Floats:
    return 0.7 + 0.2 * _soft(rng, h, w, 120.0)


def _board(rng: np.random.Generator, h: int, w: int) -> Floats:
    """Squares of a tenth of the image, seen a little from the side, on a table."""
    y, x = np.mgrid[0:h, 0:w].astype(np.float64)
    side = 0.1 * min(h, w)
    a, b = (x - 0.12 * y) / side, (y + 0.08 * x) / side
    squares = np.where((np.floor(a) + np.floor(b)) % 2 < 1, 0.85, 0.08)
    inside = (a > 1) & (a < w / side - 2) & (b > 1.5) & (b < h / side - 1)
    return cv2.GaussianBlur(np.where(inside, squares, 0.5 + 0.1 * _soft(rng, h, w, 40.0)), (0, 0), 0.8)


def _wood(rng: np.random.Generator, h: int, w: int) -> Floats:
    """Veins along the image's width that wind, in three finenesses."""
    y = np.mgrid[0:h, 0:w][0] + 12.0 * _soft(rng, h, w, 60.0)
    veins = sum(np.sin(2.0 * np.pi * y / period + k) for k, period in enumerate((9.0, 23.0, 61.0))) / 3.0
    return np.asarray(0.55 + 0.2 * veins + 0.05 * _soft(rng, h, w, 1.5))


SURFACES: dict[str, Callable[[np.random.Generator, int, int], Floats]] = {
    "even": _even,
    "board": _board,
    "wood": _wood,
    "window": _even,
}


def _soft(rng: np.random.Generator, h: int, w: int, scale: float) -> Floats:
    """Normal numbers (h, w) that are alike over `scale` px, of unit variance."""
    factor = max(int(scale / 3.0), 1)
    small = rng.normal(size=(h // factor + 8, w // factor + 8))
    small = cv2.GaussianBlur(small, (0, 0), scale / factor)
    large = cv2.resize(
        small / small.std(), ((w // factor + 8) * factor, (h // factor + 8) * factor), interpolation=cv2.INTER_CUBIC
    )
    return np.asarray(large[:h, :w], np.float64)


def _places(drawing: Drawing, count: int, width: int) -> list[Floats]:
    """Of each line, (count,) its middle on each scan line; NaN: none."""
    t = np.linspace(0.0, 1.0, count)
    shapes = {
        "straight": 0.4 + 0.12 * t,
        "curved": 0.35 + 0.25 * np.sin(2.6 * t) ** 2,
        "steps": 0.4 + 0.05 * t + np.where((t > 0.35) & (t < 0.6), 0.12, 0.0),
    }
    there = (t >= drawing.part[0]) & (t <= drawing.part[1])
    first = np.where(there, width * shapes[drawing.path], np.nan)
    return [first + 0.25 * width * k for k in range(drawing.lines)]


def drawn(drawing: Drawing, seed: int = 1) -> tuple[Photograph, NDArray[np.generic] | None, NDArray[np.generic]]:
    """The photograph, its laser-off image, and the image as it is stored."""
    rng = np.random.default_rng(seed)
    w, h = drawing.size
    albedo = SURFACES[drawing.surface](rng, h, w).clip(0.03, 1.0)
    level = drawing.axis == "columns"
    count, width = (w, h) if level else (h, w)
    places = _places(drawing, count, width)
    x = np.arange(width)
    laser = np.zeros((count, width))
    for place in places:
        for share, sigma in ((1.0, drawing.sigma), (drawing.halo, 15.0 * drawing.sigma)):
            if share > 0.0:
                laser += share * np.nan_to_num(np.exp(-0.5 * ((x - place[:, None]) / sigma) ** 2))
    grain = np.clip(1.0 + 0.08 * _soft(rng, count, width, 1.0), 0.0, None)
    laser = (laser * grain).T if level else laser * grain
    y0, x0 = np.mgrid[0:h, 0:w]
    shade = 0.7 + 0.5 * x0 / w - 0.2 * y0 / h
    room = np.stack([drawing.room * k * shade for k in (1.0, 0.95, 0.8)], axis=-1)
    if drawing.surface == "window":
        room[h // 10 : h // 2, int(0.68 * w) : int(0.92 * w)] = 3.0
    hues = np.asarray(COLOURS[drawing.colour])
    with_laser = albedo[..., None] * (room + drawing.level * laser[..., None] * hues)

    def stored(light: Floats) -> NDArray[np.generic]:
        light = cv2.GaussianBlur(light, (0, 0), 0.5)
        light = light.mean(axis=-1) if drawing.grey else light
        electrons = rng.poisson(np.maximum(light * FULL_WELL, 0.0)) + rng.normal(0.0, READ_NOISE, light.shape)
        share = np.clip(electrons / FULL_WELL, 0.0, 1.0)
        if drawing.file == "jpg":
            share = share ** (1.0 / 1.8)
        top, kind = (65535, np.uint16) if drawing.file == "tiff" else (255, np.uint8)
        return np.rint(share * top).astype(kind)

    image = stored(with_laser)
    off = stored(albedo[..., None] * room) if drawing.off else None
    truth = [np.stack([np.arange(count), place], axis=1)[np.isfinite(place)] for place in places]
    blurred = float(np.hypot(drawing.sigma, 0.5))
    pixels = image if image.ndim == 3 else np.repeat(image[..., None], 3, axis=2)
    return Photograph(pixels, tuple(truth), drawing.axis, drawing.colour, blurred), off, image


def _written(path: Path, image: NDArray[np.generic], turned: bool) -> Path:
    if turned:
        from PIL import Image

        exif = Image.Exif()
        exif[0x0112] = EXIF
        # as the sensor saw it: upright turned back
        Image.fromarray(np.rot90(image, 1)).save(path, quality=88, exif=exif)
        return path
    options = [cv2.IMWRITE_JPEG_QUALITY, 88] if path.suffix == ".jpg" else []
    assert cv2.imwrite(str(path), image if image.ndim == 2 else image[..., ::-1], options)
    return path


def judged(name: str, folder: Path, *options: str) -> tuple[Score, Score]:
    """Ours, and a centre of mass that is told axis and colour, and takes the laser-off image away."""
    drawing = DRAWINGS[name]
    taken, off, image = drawn(drawing)
    stem = name.replace(" ", "_").replace(",", "")
    path = _written(folder / f"{stem}.{drawing.file}", image, drawing.turned)
    given = list(options)
    if off is not None:
        given += ["--off", str(_written(folder / f"{stem}_dark.{drawing.file}", off, drawing.turned))]
    ours = score(taken, *measured(path, folder, *given))
    values = image.astype(np.float64) - (0.0 if off is None else off)
    light = light_of(values, drawing.colour, drawing.axis)
    u = centre_of_mass(light)
    rows = np.flatnonzero(np.isfinite(u))
    positions = np.stack([rows, u[rows], np.full(len(rows), np.nan)], axis=1)
    return ours, score(taken, {"axis": drawing.axis, "colour": drawing.colour}, positions)


if __name__ == "__main__":
    target = Path(sys.argv[1])
    target.mkdir(parents=True, exist_ok=True)
    print(f"{'drawing':20s} {'found':>7s} {'false':>7s} {'2 sigma':>8s} {'err/sig':>8s}  told    centre of mass")
    for drawing_name in sys.argv[2:] or DRAWINGS:
        wanted, (got, plain) = DRAWINGS[drawing_name], judged(drawing_name, target)
        numbers = f"{got.found:7.1%} {got.false:7.2%} {got.within:8.1%} {got.normalised:8.2f}"
        told = f"{got.axis:8s} {got.colour or 'none'} ({wanted.colour})"
        print(f"{drawing_name:20s} {numbers}  {told:20s} {plain.found:7.1%} {plain.false:7.2%}", flush=True)
