"""What `main.py extract` does: a table of the line for each photograph or series of exposures, or a sweep in time."""

from __future__ import annotations

import sys
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from render.base.errors import InputError
from studio.runtime.console import print_table, stage_progress
from studio.runtime.streams import print_json

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from analysis.line.selection.geometry import WorkingVolume
    from analysis.line.settings import ExtractionSettings


@dataclass(frozen=True)
class Prepared:
    """The options, read and checked against each other."""

    settings: ExtractionSettings
    volume: WorkingVolume | None
    offs: list[NDArray[Any]]
    """Laser-off images: none, one for all, or one for each image."""
    times: tuple[float, ...]
    """Exposure times of a series; empty: every image stands for itself."""

    def off(self, number: int) -> NDArray[Any] | None:
        if not self.offs:
            return None
        return self.offs[number if len(self.offs) > 1 else 0]


@dataclass(frozen=True)
class ImageOptions:
    """What is to be done with the images, as the command line has it."""

    off: tuple[Path, ...]
    """Images with the laser off."""
    hdr: str | None
    """Exposure times: all images are of one scene."""
    project: Path | None
    laser_number: int
    spacetime: bool
    """The images are a sweep over a scene at rest."""
    ridges: bool


def extract_images(
    images: tuple[Path, ...], *, out: Path | None, threads: int | None, quiet: bool, as_json: bool, **given: Any
) -> int:
    """`extract`: a bad image is reported and left out; returns how many there were.

    given: fields of `ImageOptions`, and extraction settings.
    """
    from studio.commands.commands import check_output
    from studio.photographs.photographs import extract_photograph, extract_series, summary, table_path, write_line
    from studio.photographs.ridge_files import ridges_of_file

    options = ImageOptions(**{field.name: given.pop(field.name) for field in fields(ImageOptions)})
    prepared = _prepared(images, options, given)
    if out is not None:
        check_output(out)
    if options.spacetime + options.ridges + (options.hdr is not None) > 1:
        raise InputError("only one of these at a time", where="--hdr, --spacetime, --ridges")
    if options.spacetime:
        return _extract_sweep(images, prepared, out, threads, as_json)
    done: list[dict[str, Any]] = []
    failed: list[dict[str, Any]] = []
    taken: set[Path] = set()
    groups = [images] if prepared.times else [(path,) for path in images]
    with stage_progress(quiet or as_json or len(groups) < 2) as progress:
        for number, group in enumerate(groups):
            progress("images", number / len(groups))
            try:
                if options.ridges:
                    done.append(ridges_of_file(group[0], prepared.settings, prepared.off(number), out, taken, threads))
                    continue
                if prepared.times:
                    line = extract_series(
                        group, prepared.times, prepared.settings, prepared.offs, prepared.volume, threads
                    )
                else:
                    line = extract_photograph(
                        group[0], prepared.settings, prepared.off(number), threads, prepared.volume
                    )
                table = table_path(group[0], out, taken)
                write_line(table, line)
                done.append(summary(group[0], line, table))
            except InputError as error:
                failed.append({"image": str(group[0]), "message": str(error)})
        progress("images", 1.0)
    if as_json:
        print_json({"ok": not failed, "images": done, "errors": failed})
    else:
        _print_lines(done)
    for failure in failed:
        print(f"error: {failure['message']}", file=sys.stderr)
    return len(failed)


def _prepared(images: tuple[Path, ...], options: ImageOptions, given: dict[str, Any]) -> Prepared:
    """Raises InputError, which names the option."""
    from analysis.line.extract import settings_of
    from studio.commands.commands import load_project
    from studio.photographs.image_files import load_photograph
    from studio.scan.line_extraction import working_volume

    off, laser = options.off, options.laser_number
    given["channel"] = given.pop("laser")
    settings, volume = settings_of(None, **given), None
    if settings.geometry:
        if options.project is None:
            raise InputError(
                "the geometric check needs to know camera and laser", where="--geometry", cure="give --project"
            )
        chosen, _ = load_project(options.project)
        if laser >= len(chosen.scene.lasers):
            allowed = f"0 to {len(chosen.scene.lasers) - 1}"
            raise InputError(
                "there is no such laser in the project", where="--laser-number", found=laser, allowed=allowed
            )
        volume = working_volume(chosen, laser, settings)
    if len(off) not in (0, 1, len(images)):
        found, allowed = f"{len(off)} for {len(images)} images", "one for all, or one for each"
        raise InputError("the laser-off images do not go with the images", where="--off", found=found, allowed=allowed)
    return Prepared(settings, volume, [load_photograph(path) for path in off], exposure_times(options.hdr, len(images)))


def exposure_times(text: str | None, count: int) -> tuple[float, ...]:
    """ "8,2,0.5" -> numbers, one for each image."""
    if text is None:
        return ()
    try:
        times = tuple(float(part) for part in text.split(","))
    except ValueError:
        raise InputError("not a list of numbers", where="--hdr", found=text, allowed='such as "8,2,0.5"') from None
    if len(times) != count or count < 2:
        found = f"{len(times)} times for {count} images"
        raise InputError("every exposure needs its time", where="--hdr", found=found, allowed="two images or more")
    return times


def _extract_sweep(
    images: tuple[Path, ...], prepared: Prepared, out: Path | None, threads: int | None, as_json: bool
) -> int:
    """The images as the frames of one sweep of the sheet over a scene at rest."""
    from studio.photographs.sweep_files import passage_of_files

    result = passage_of_files(images, prepared.settings, out, threads)
    if as_json:
        print_json({"ok": True, **result})
    else:
        print_table("Passage of the sheet", [(name.replace("_", " "), str(value)) for name, value in result.items()])
    return 0


def _print_lines(done: list[dict[str, Any]]) -> None:
    def number(value: float | None, form: str) -> str:
        return "-" if value is None else form.format(value)

    header = ("Line", "found", "sigma_u px", "width px", "peak e-", "method")
    rows = [
        (
            Path(row["image"]).name,
            row["what"] if "what" in row else f"{row['found']} of {row['scan_lines']} {row['axis']}",
            number(row["sigma_u_px"], "{:.4f}"),
            number(row["width_px"], "{:.2f}"),
            number(row["amplitude_e"], "{:.0f}"),
            row["note"] or row["method"],
        )
        for row in done
    ]
    if rows:
        print_table("Laser line", rows, header=header)
    for row in done:
        print(f"wrote {row['file']}")
