"""What `main.py extract` does: a table of the line for each photograph or series of exposures, or a sweep in time."""

from __future__ import annotations

import sys
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from render.base.errors import InputError
from studio.runtime.console import print_table, stage_progress
from studio.runtime.streams import print_json

if TYPE_CHECKING:
    from analysis.line.selection.geometry import WorkingVolume
    from analysis.line.settings import ExtractionSettings
    from studio.photographs.photograph_set import Look, Wishes


@dataclass(frozen=True)
class Prepared:
    """The options, read and checked against each other."""

    look: Look
    volume: WorkingVolume | None
    times: tuple[float, ...]
    """Exposure times of a series; empty: every image stands for itself."""


@dataclass(frozen=True)
class ImageOptions:
    """What is to be done with the images, as the command line has it."""

    hdr: str | None
    """Exposure times: all images are of one scene."""
    project: Path | None
    laser_number: int
    spacetime: bool
    """The images are a sweep over a scene at rest."""
    ridges: bool
    overlay: bool


def extract_images(
    images: tuple[Path, ...], *, out: Path | None, threads: int | None, quiet: bool, as_json: bool, **given: Any
) -> int:
    """`extract`: a bad image is reported and left out; returns how many there were.

    given: fields of `ImageOptions`, those of `wishes_of`, and extraction settings.
    """
    from studio.commands.places import check_output

    options = ImageOptions(**{field.name: given.pop(field.name) for field in fields(ImageOptions)})
    if options.spacetime + options.ridges + (options.hdr is not None) > 1:
        raise InputError("only one of these at a time", where="--hdr, --spacetime, --ridges")
    if given.get("smooth_along") and (options.spacetime or options.ridges):
        raise InputError(
            "there is no line by scan lines to be smoothed along",
            where="--smooth-along",
            found="--ridges" if options.ridges else "--spacetime",
            allowed="neither of them beside it",
        )
    if out is not None:
        check_output(out)
    prepared = _prepared(images, options, given)
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
                done.append(_extract_group(group, prepared, options, out, taken, threads))
            except InputError as error:
                failed.append({"image": str(group[0]), "message": str(error)})
        progress("images", 1.0)
    look = prepared.look
    if as_json:
        print_json({"ok": not failed, "chosen": look.record(), "images": done, "errors": failed})
    else:
        if done and look.told:
            print_table("Chosen for these photographs", look.told)
        for text in look.warnings if done else ():
            print(f"warning: {text}")
        _print_lines(done)
    for failure in failed:
        print(f"error: {failure['message']}", file=sys.stderr)
    return len(failed)


def _extract_group(
    group: tuple[Path, ...],
    prepared: Prepared,
    options: ImageOptions,
    out: Path | None,
    taken: set[Path],
    threads: int | None,
) -> dict[str, Any]:
    """One image, or the exposures of one scene: written, and summed up. InputError names the file."""
    from studio.photographs.line_tables import summary, table_path, write_line
    from studio.photographs.overlay import write_overlay
    from studio.photographs.photographs import extract_photograph, extract_series
    from studio.photographs.ridge_files import ridges_of_file

    look = prepared.look
    if options.ridges:
        _, off = look.read(group[0])
        return ridges_of_file(group[0], look.settings, off, out, taken, threads)
    if prepared.times:
        line = extract_series(group, prepared.times, look, prepared.volume, threads)
        table = table_path(group[0], out, taken)
        write_line(table, line)
        return summary(group[0], line, table, look.region)
    measured = extract_photograph(group[0], look, threads, prepared.volume)
    table = table_path(group[0], out, taken)
    write_line(table, measured.line)
    row = summary(group[0], measured.line, table, look.region)
    if options.overlay:
        row["overlay"] = str(write_overlay(table.with_suffix(".png"), measured))
    return row


def _prepared(images: tuple[Path, ...], options: ImageOptions, given: dict[str, Any]) -> Prepared:
    """Raises InputError, which names the option."""
    from analysis.line.extract import settings_of
    from studio.commands.places import load_project
    from studio.photographs.photograph_set import NEARBY, Look, look_at
    from studio.scan.line_extraction import working_volume

    laser = options.laser_number
    wishes = wishes_of(given)
    if given.get("select") is None:
        given["select"] = "continuous"
    if given.get("peaks") is None and given["select"] == "continuous" and options.hdr is None:
        wishes = replace(wishes, count_lines=True)
    if given.get("smooth_along") is None and given["select"] == "continuous":
        given["smooth_along"] = not (options.spacetime or options.ridges or options.hdr)
        wishes = replace(wishes, longest=NEARBY)
    settings, volume = settings_of(None, channel=wishes.colour, axis=wishes.axis, **given), None
    if settings.geometry:
        if options.project is None:
            raise InputError(
                "the geometric check needs to know camera and laser", where="--geometry", cure="give --project"
            )
        project, _ = load_project(options.project)
        if laser >= len(project.scene.lasers):
            allowed = f"0 to {len(project.scene.lasers) - 1}"
            raise InputError(
                "there is no such laser in the project", where="--laser-number", found=laser, allowed=allowed
            )
        volume = working_volume(project, laser, settings)
    times = exposure_times(options.hdr, len(images))
    if options.spacetime:
        look = Look(settings, None, "mono", wishes.region, {}, [], [])
    else:
        look = look_at(images, settings, wishes)
    return Prepared(look, volume, times)


def wishes_of(given: dict[str, Any], project: ExtractionSettings | None = None) -> Wishes:
    """The options `off`, `axis`, `colour`, `channel`, `roi` and `mask`, taken out of `given`.

    An option that is not given is as in the project's settings, or, without a project, found by the photographs.
    """
    from studio.photographs.photograph_set import Wishes
    from studio.photographs.region import region_of

    region = region_of(given.pop("roi"), given.pop("mask"))
    auto = {name: given.pop(name) for name in ("axis", "colour", "channel")}
    if project is not None:
        auto["axis"], auto["colour"] = auto["axis"] or project.axis, auto["colour"] or project.channel
    axis, colour, channel = (None if value == "auto" else value for value in auto.values())
    if colour == "mono" and channel is None:
        channel = "mono"
    return Wishes(
        axis=axis,
        colour=colour,
        channel=channel,
        off=tuple(given.pop("off")),
        region=region,
        shape="sphere" if given.pop("shape", None) == "sphere" else "plane",
    )


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

    result = passage_of_files(images, prepared.look.settings, out, threads)
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
        print(f"wrote {row['file']}" + (f" and {row['overlay']}" if "overlay" in row else ""))
