"""The laser line in image files of a real scanner: read, subtract, check, extract, and write the line as a table."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.line.detection.channel import check_image
from analysis.line.detection.noise import image_saturation
from analysis.line.estimate import estimate_noise, residual_ratio
from analysis.line.extract import extract
from analysis.line.result import Flag, Line
from analysis.line.selection.geometry import WorkingVolume
from analysis.line.series.hdr import Fused, fuse
from analysis.line.series.subtract import subtract_off
from analysis.line.settings import ExtractionSettings
from render.base.errors import InputError
from render.base.files import atomic_write
from studio.photographs.image_files import load_photograph
from studio.scan.line_extraction import note_of
from studio.scan.own_files import LINE_COLUMNS, check_replaceable

SCARCE, PLENTY = 0.25, 0.5
"""Shares of scan lines with a line: below the first, the other axis is tried, and named if it has the second."""
GAIN_ROUNDS = 5
PLATEAU = 32
"""Pixels of one number that a sensor's limit makes, and chance does not."""
SATURATED_SHARE = 0.5
"""Of the scan lines; an exposure with more of them is no base to estimate noise from."""


def extract_photograph(
    path: Path,
    settings: ExtractionSettings,
    off: NDArray[Any] | None = None,
    threads: int | None = None,
    volume: WorkingVolume | None = None,
) -> Line:
    """The line in an image file, less a laser-off image; the noise is estimated from it.

    volume: only peaks that the laser can have made in it. InputError names the file and what is wrong: unreadable, of
    the wrong type or size, black, saturated, not a number, without the channel asked for, or with its line along the
    other axis.
    """
    with naming(path):
        image = check_image(load_photograph(path))
        check_light(image)
        noise = None
        if off is not None:
            image, saturation = subtract_off(image, off)
            noise = estimate_noise(image, settings, saturation)
        check_camera(image, volume)
        line = extract(image, settings=settings, noise=noise, volume=volume, threads=threads)
        _check_axis(image, line, settings, threads)
    return replace(line, note=note_of(line, settings, []))


def extract_series(
    paths: Sequence[Path],
    times: Sequence[float],
    settings: ExtractionSettings,
    offs: Sequence[NDArray[Any]] = (),
    volume: WorkingVolume | None = None,
    threads: int | None = None,
) -> Line:
    """The line in several exposures of one scene, fused in electrons; times in any unit. InputError names the file."""
    fused = fuse_files(paths, times, settings, offs)
    with naming(paths[0]):
        check_camera(fused.electrons, volume)
        line = extract(
            fused.electrons,
            settings=settings,
            noise=fused.noise,
            variance=fused.variance,
            volume=volume,
            threads=threads,
        )
    told = f"{len(paths)} exposures fused"
    return replace(line, note="; ".join(filter(None, (note_of(line, settings, []), told))))


def fuse_files(
    paths: Sequence[Path], times: Sequence[float], settings: ExtractionSettings, offs: Sequence[NDArray[Any]] = ()
) -> Fused:
    """Mono image files of one scene, less their laser-off images -> Fused. InputError names the file."""
    images: list[NDArray[Any]] = []
    highest = 0.0
    for number, path in enumerate(paths):
        with naming(path):
            image = check_image(load_photograph(path))
            if image.ndim != 2:
                raise InputError("exposures are fused of mono or raw images only", found="colour")
            highest = max(highest, image_saturation(image) or _plateau(image))
            if offs:
                image, _ = subtract_off(image, offs[number if len(offs) > 1 else 0])
            images.append(image)
    full = highest or 2.0 * max(float(np.nanmax(image)) for image in images)  # none is saturated
    # the more light, the better the noise can be told, as long as the line is not cut off on most scan lines
    order, across = np.argsort(times)[::-1], 1 if settings.axis == "rows" else 0
    whole = [k for k in order if np.mean((images[k] >= full).any(axis=across)) < SATURATED_SHARE]
    with naming(paths[0]):
        noise = estimate_noise(images[whole[0] if whole else order[-1]], settings)
        noise = noise.model_copy(update={"saturation": full})
        fused = fuse(images, times, noise)
        plain = settings.model_copy(
            update={"method": "likelihood", "peaks": 1, "select": "strongest", "smoothing": 0.0}
        )
        for _ in range(GAIN_ROUNDS):  # all exposures together say more of the gain than one
            line = extract(fused.electrons, settings=plain, noise=fused.noise, variance=fused.variance)
            ratio = residual_ratio(line)
            if ratio is None or abs(ratio - 1.0) < 0.02:
                break
            gain = noise.gain * min(max(ratio, 0.2), 5.0)
            noise = noise.model_copy(update={"gain": gain, "read_noise": noise.read_noise * noise.gain / gain})
            fused = fuse(images, times, noise)
        return fused


def _plateau(image: NDArray[Any]) -> float:
    """The highest number where many pixels share it, as at a full well below the full scale; 0: they do not."""
    top = float(np.nanmax(image))
    return top if np.count_nonzero(image == top) >= PLATEAU else 0.0


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Put the file's name into an InputError that does not say where."""
    try:
        yield
    except InputError as error:
        if str(path) in error.where:
            raise
        where = f"{path}: {error.where}" if error.where not in ("", "image") else str(path)
        raise InputError(error.what, where=where, found=error.found, allowed=error.allowed, cure=error.cure) from None


def check_camera(image: NDArray[Any], volume: WorkingVolume | None) -> None:
    """InputError: the image is not of the size of the camera whose geometry is asked for."""
    if volume is None or image.shape[:2] == (volume.camera.height, volume.camera.width):
        return
    raise InputError(
        "the image is not of the camera's size",
        found=f"{image.shape[1]} x {image.shape[0]} px",
        allowed=f"{volume.camera.width} x {volume.camera.height} px",
    )


def check_light(image: NDArray[Any]) -> None:
    """InputError: an image that is black, saturated or the same all over."""
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
    writer.writerow(LINE_COLUMNS)
    along, across = (line.u, line.v) if line.axis == "rows" else (line.v, line.u)
    length = np.ones_like(line.u) if line.correlation_length is None else line.correlation_length
    numbers = (along, across, line.sigma_u, line.width, line.amplitude, line.background, line.chi2, length)
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
        "correlation_length_rows": None if line.correlation_length is None else typical(line.correlation_length),
        "width_px": typical(line.width),
        "amplitude_e": typical(line.amplitude),
        "flags": {Flag(int(flag)).name: int(count) for flag, count in zip(flags, counts, strict=True)},
        "file": str(table),
    }


def table_path(path: Path, out: Path | None, taken: set[Path], what: str = "line") -> Path:
    """Where an image's table goes: beside it or in `out`; a number tells images of one name apart.

    InputError: a file of that name is there which is no such table.
    """
    folder, number = out if out is not None else path.parent, 1
    target = folder / f"{path.stem}_{what}.csv"
    while target in taken:
        number += 1
        target = folder / f"{path.stem}_{number}_{what}.csv"
    check_replaceable([target])
    taken.add(target)
    return target
