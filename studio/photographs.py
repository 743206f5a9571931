"""The laser line in image files of a real scanner: read, subtract, check, extract, and write the line as a table."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.line.channel import check_image
from analysis.line.estimate import estimate_noise
from analysis.line.extract import extract
from analysis.line.noise import image_saturation
from analysis.line.result import Flag, Line
from analysis.line.settings import ExtractionSettings
from analysis.line.subtract import subtract_off
from render.errors import InputError
from render.files import atomic_write
from studio.reconstruct import MAX_IMAGE_BYTES, read_image

SCARCE, PLENTY = 0.25, 0.5
"""Shares of scan lines with a line: below the first, the other axis is tried, and named if it has the second."""
COLUMNS = ("scan_line", "rank", "u", "v", "sigma_u", "width", "amplitude", "background", "chi2", "flag")


def load_photograph(path: Path) -> NDArray[Any]:
    """(h, w) or (h, w, 3) of a PNG, TIFF, JPEG, BMP or EXR. InputError: missing, too big, damaged, without RGB or Y."""
    return _read_exr(path) if path.suffix.lower() == ".exr" else read_image(path)


def _read_exr(path: Path) -> NDArray[Any]:
    import OpenEXR

    try:
        if path.stat().st_size > MAX_IMAGE_BYTES:
            raise InputError("the image is too big", where=str(path), allowed=f"{MAX_IMAGE_BYTES} bytes")
        stream = io.BytesIO(path.read_bytes())
    except OSError as error:
        raise InputError("the image cannot be read", where=str(path), found=error.strerror or error) from None
    try:
        layers = OpenEXR.File(stream, separate_channels=True).channels()
        pixels = {name: np.asarray(channel.pixels, dtype=np.float32) for name, channel in layers.items()}
    except (RuntimeError, TypeError, ValueError) as error:
        raise InputError("the image cannot be decoded", where=str(path), found=error) from None
    if {"R", "G", "B"} <= pixels.keys():
        return np.stack([pixels[name] for name in "RGB"], axis=2)
    if "Y" in pixels or len(pixels) == 1:
        return pixels.get("Y", next(iter(pixels.values())))
    found = ", ".join(sorted(pixels))
    raise InputError("the EXR has no image of its own", where=str(path), found=found, allowed="channels R, G, B, or Y")


def extract_photograph(
    path: Path, settings: ExtractionSettings, off: NDArray[Any] | None = None, threads: int | None = None
) -> Line:
    """The line in an image file, less a laser-off image; the noise is estimated from it.

    InputError names the file and what is wrong: unreadable, of the wrong type or size, black, saturated, not a number,
    without the channel asked for, or with its line along the other axis.
    """
    try:
        image = check_image(load_photograph(path))
        _check_light(image)
        noise = None
        if off is not None:
            image, saturation = subtract_off(image, off)
            noise = estimate_noise(image, settings).model_copy(update={"saturation": saturation})
        line = extract(image, settings=settings, noise=noise, threads=threads)
        _check_axis(image, line, settings, threads)
    except InputError as error:
        if str(path) in error.where:
            raise
        where = f"{path}: {error.where}" if error.where not in ("", "image") else str(path)
        raise InputError(error.what, where=where, found=error.found, allowed=error.allowed, cure=error.cure) from None
    return line


def _check_light(image: NDArray[Any]) -> None:
    finite = image[np.isfinite(image)] if image.dtype.kind == "f" else image
    low, high = float(finite.min()), float(finite.max())
    if high <= 0.0:
        raise InputError(
            "the image is black", found=f"no pixel above {high:g}", cure="expose longer, or turn the laser on"
        )
    full = image_saturation(image)
    if full is not None and low >= full:
        raise InputError("the image is saturated all over", found=f"every pixel at {full:g}", cure="expose less")
    if low == high:
        raise InputError("the image is the same everywhere", found=f"every pixel at {high:g}")


def _check_axis(image: NDArray[Any], line: Line, settings: ExtractionSettings, threads: int | None) -> None:
    share = float(line.valid[:, 0].mean())
    if share >= SCARCE:
        return
    other = "columns" if settings.axis == "rows" else "rows"
    turned = settings.model_copy(update={"axis": other, "method": "centre_of_mass", "select": "strongest"})
    crossed = float(extract(image, settings=turned, threads=threads).valid[:, 0].mean())
    if crossed >= PLENTY and crossed > 2.0 * share:
        raise InputError(
            f"the line runs along the image's {settings.axis}",
            where="axis",
            found=f"a line on {share:.0%} of the {settings.axis}, but on {crossed:.0%} of the {other}",
            cure=f"use --axis {other}",
        )


def write_line(path: Path, line: Line) -> None:
    """One row of the table for each scan line and peak: where it is, or the reason why there is none. Units: px, e-."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    along, across = (line.u, line.v) if line.axis == "rows" else (line.v, line.u)
    numbers = (along, across, line.sigma_u, line.width, line.amplitude, line.background, line.chi2)
    for i in range(line.u.shape[0]):
        for k in range(line.u.shape[1]):
            flag = Flag(int(line.flag[i, k]))
            there = line.valid[i, k]
            cells = [f"{values[i, k]:.9g}" if there and np.isfinite(values[i, k]) else "" for values in numbers]
            writer.writerow([i, k, *cells, flag.name])
    with atomic_write(path) as temporary:
        temporary.write_text(text.getvalue(), encoding="utf-8")


def summary(path: Path, line: Line, table: Path) -> dict[str, Any]:
    """What a person or a program wants to know of one image."""
    found = line.valid[:, 0]

    def typical(values: NDArray[np.float64]) -> float | None:
        known = values[found, 0][np.isfinite(values[found, 0])]
        return float(np.median(known)) if len(known) else None

    flags, counts = np.unique(line.flag[:, 0], return_counts=True)
    return {
        "image": str(path),
        "method": line.method,
        "note": line.note,
        "axis": line.axis,
        "scan_lines": len(found),
        "found": int(found.sum()),
        "sigma_u_px": typical(line.sigma_u),
        "width_px": typical(line.width),
        "amplitude_e": typical(line.amplitude),
        "flags": {Flag(int(flag)).name: int(count) for flag, count in zip(flags, counts, strict=True)},
        "file": str(table),
    }


def table_path(path: Path, out: Path | None, taken: set[Path]) -> Path:
    """Where an image's table goes: beside it or in `out`; a number tells images of one name apart."""
    folder, number = out if out is not None else path.parent, 1
    target = folder / f"{path.stem}_line.csv"
    while target in taken:
        number += 1
        target = folder / f"{path.stem}_{number}_line.csv"
    taken.add(target)
    return target
