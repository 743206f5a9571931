"""What the commands of main.py do: find the project, show progress, print the result for a person or a program."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from render.base.errors import InputError
from studio.commands.places import OUTPUT, check_output, chosen_file, folder_name, load_project, never
from studio.editing.units import Unit
from studio.project.project import Project
from studio.project.templates import DESCRIPTIONS, new_project
from studio.runtime.console import print_plan, print_table, stage_progress
from studio.runtime.streams import print_json

if TYPE_CHECKING:
    from render.frame import Frame
    from render.plan import GroupQuality
    from studio.preview.inspection import Inspection, LaserView
    from studio.scan.options import ScanOptions
    from studio.scan.scan import ScanResult

SCAN_OPTIONS = {
    "steps": "steps",
    "scale": "image_scale",
    "seed": "seed",
    "threads": "threads",
    "time_limit": "seconds",
    "report": "report",
    "frames": "frames",
    "resume": "resume",
}
"""Option of the command line -> field of `studio.scan.options.ScanOptions`."""


def start_project(
    template: str | None, folder: Path | None, *, sensor: str | None, force: bool, quiet: bool, as_json: bool
) -> None:
    """`new`: copy a template, with another sensor if one is named, or list them."""
    from studio.editing.presets import SENSOR, preset_named, with_preset

    chosen = None if sensor is None else preset_named("sensors", sensor, "--sensor")
    if template is None:
        if as_json:
            print_json({"ok": True, "templates": DESCRIPTIONS})
        else:
            print_table("Templates", list(DESCRIPTIONS.items()))
        return
    made = new_project(template, folder if folder is not None else Path(template), force=force)
    if chosen is not None:
        with_preset(Project.load(made.project), SENSOR, chosen).save(made.project)
    if as_json:
        print_json({"ok": True, "project": made.project, "files": list(made.files)})
    elif not quiet:
        print(f"wrote {made.project}; next: python main.py inspect {made.project}")


def inspect_project(path: Path | None, *, quiet: bool, as_json: bool) -> None:
    """`inspect`: tables of what is there and what will be seen."""
    from analysis.report.light_text import plan_lines
    from studio.preview.inspection import inspect

    project, root = load_project(path)
    with stage_progress(quiet or as_json) as progress:
        progress("looking", 0.0)
        found = inspect(project, root)
        progress("looking", 1.0)
    if as_json:
        print_json({"ok": True, **found.as_dict()})
        return
    print_table(f"Project {found.name}", _project_rows(project, found))
    print()
    print_plan(plan_lines(found.plan))
    for view in found.lasers:
        print()
        print_table(f"Laser {view.name}", _laser_rows(view, found.full_well))
    for warning in found.warnings:
        print(f"\nwarning: {warning}")


def run_project(
    path: Path | None, *, out: Path | None, quiet: bool, as_json: bool, measure: bool = True, **given: Any
) -> None:
    """`run`, and `render` with `measure` off.

    given: options of the scan, by the names of the command line, and extraction settings; None: the project's.
    """
    from studio.scan.options import ScanOptions

    named = {name: given.pop(option) for option, name in SCAN_OPTIONS.items() if option in given}
    options, file = ScanOptions(measure=measure, **named), chosen_file(path)
    project = with_extraction(Project.load(file), given)
    folder = out if out is not None else Path(OUTPUT) / folder_name(project.name)
    done = scan_into(folder, project, file.parent, options, source=file, quiet=quiet)
    print_scan(done, quiet=quiet, as_json=as_json)


def scan_into(
    folder: Path, project: Project, root: Path, options: ScanOptions, *, source: Path, quiet: bool
) -> ScanResult:
    """A scan with its plan and progress on standard error."""
    from studio.scan.options import Listener
    from studio.scan.scan import run_scan

    check_output(folder)
    from analysis.report.light_text import plan_lines, stage_note
    from render.products import expected_plan
    from studio.commands.noise_tables import print_foreseen

    quality: tuple[GroupQuality, ...] = ()
    foretold: Mapping[str, float] = {}

    def refined(frame: Frame) -> None:
        nonlocal quality, foretold
        quality, foretold = frame.quality, frame.foretold

    if not quiet:
        scene = project.scene if options.at_scale else project.scene.scaled(options.image_scale)
        plan = expected_plan(scene, project.render_settings)
        print_plan(plan_lines(plan), to_errors=True)
    frames = min(options.steps or project.scene.frame_count, project.scene.frame_count)
    with stage_progress(quiet, lambda stage: stage_note(stage, quality, foretold), frames=frames) as progress:
        listener = Listener(progress, foreseen=(lambda noise: None) if quiet else print_foreseen, refined=refined)
        return run_scan(project, root, out=folder, options=options, listener=listener, source=source)


def print_scan(done: ScanResult, *, quiet: bool, as_json: bool, more: Mapping[str, Any] = MappingProxyType({})) -> None:
    """What a scan found; more: of the JSON object."""
    if as_json:
        files = [str(file) for file in done.files]
        print_json({"ok": True, "folder": str(done.folder), "files": files, **done.manifest, **more})
        return
    if not quiet:
        from studio.commands.noise_tables import print_reached

        _print_light(done.manifest["light"])
        print_reached(done.manifest["depth_noise"])
    _print_results(done.manifest)
    kept = {"all": "frame(s)", "band": "frame(s), a band of each,", "none": "frame(s) measured, none kept,"}
    told = f"{done.manifest['frame_count']} {kept[done.manifest['frames_kept']]}"
    rate = done.manifest.get("profiles_per_second")
    quick = f", {rate:.2g} profiles a second" if rate is not None and done.manifest["frame_count"] > 1 else ""
    print(f"{told} in {done.folder}, {done.manifest['seconds']['all']:.1f} s{quick}")
    for file in done.report:
        print(f"report: {file}")


def with_extraction(project: Project, options: dict[str, Any]) -> Project:
    """The project with other extraction settings, where an option is given. InputError names the setting."""
    if all(value is None for value in options.values()):
        return project
    from analysis.line.extract import settings_of

    return project.model_copy(update={"extraction": settings_of(project.extraction, **options)})


def render_project(path: Path | None, **options: Any) -> None:
    """`render`: frames and truth only."""
    run_project(path, measure=False, **options)


def reconstruct_source(
    sources: tuple[Path, ...],
    *,
    project: Path | None,
    laser: int,
    hdr: str | None,
    out: Path | None,
    threads: int | None,
    quiet: bool,
    as_json: bool,
    **extraction: Any,
) -> None:
    """`reconstruct`: from a scan's folder, or from images with a project."""
    from studio.commands.extract import exposure_times, wishes_of
    from studio.photographs.reconstruct_images import reconstruct_images
    from studio.scan.reconstruct import reconstruct_folder
    from studio.scan.scan_folder import open_folder
    from studio.scan.stages import Clock

    missing = [source for source in sources if not source.exists()]
    if missing:
        raise InputError("there is no such image or scan folder", where=str(missing[0]))
    source = sources[0]
    if source.is_dir():
        if len(sources) > 1:
            raise InputError("a scan folder is measured alone", where=str(sources[1]), allowed="one folder, or images")
        found = open_folder(source)
        _no_photographs(extraction)
        chosen, root = (found.project, found.root) if project is None else load_project(project)
        chosen = with_extraction(chosen, extraction)
        folder = out if out is not None else source
        check_output(folder)
        with stage_progress(quiet, frames=len(found.frames)) as progress:
            clock = Clock(progress, never)
            result = reconstruct_folder(found, chosen, root, folder, clock, report=False, threads=threads)
    else:
        if project is None:
            raise InputError(
                "an image does not say by which camera and laser it was taken",
                where=str(source),
                cure="give the project with --project",
            )
        chosen = load_project(project)[0]
        wishes = wishes_of(extraction, chosen.extraction)
        if extraction.get("select") is None and chosen.extraction.select == "strongest":
            extraction["select"] = "continuous"
        chosen = with_extraction(chosen, extraction)
        folder = out if out is not None else source.parent
        check_output(folder)
        times = exposure_times(hdr, len(sources))
        with stage_progress(quiet) as progress:
            result = reconstruct_images(sources, chosen, laser, folder, Clock(progress, never), times, threads, wishes)
    _print_reconstruction(result, as_json)


def _no_photographs(options: dict[str, Any]) -> None:
    """Take the options of photographs out. InputError: one of them is given."""
    for name in ("off", "axis", "colour", "channel", "roi", "mask", "pattern", "shape"):
        if options.pop(name):
            raise InputError("an option of photographs is given for a scan folder", where=f"--{name}")


def rebuild_report(folder: Path, *, threads: int | None, quiet: bool, as_json: bool) -> None:
    """`report`: measure the frames of a finished scan again, as its points were last, and write its report."""
    from studio.scan.reconstruct import reconstruct_folder
    from studio.scan.scan_folder import measured_project, open_folder
    from studio.scan.stages import Clock

    found = open_folder(folder)
    with stage_progress(quiet, frames=len(found.frames)) as progress:
        clock = Clock(progress, never)
        result = reconstruct_folder(
            found, measured_project(found), found.root, folder, clock, report=True, threads=threads
        )
    _print_reconstruction(result, as_json)


def _print_reconstruction(result: dict[str, Any], as_json: bool) -> None:
    if as_json:
        print_json({"ok": True, **result})
        return
    _print_results(result)
    for note in result["extraction"]:
        print(note)
    if "chosen" in result:
        print_table("Chosen for these photographs", list(result["chosen"]["told"].items()))
        for text in result["chosen"]["warnings"]:
            print(f"warning: {text}")
        for fit in result["fits"]:
            print(fit["text"])
    if "flags" in result:
        print(f"{result['points']} points on {result['scan_lines']} scan lines")
    for file in result["files"]:
        print(f"wrote {file}")


def _print_light(light: list[dict[str, Any]]) -> None:
    """Plan and light groups of the first frame."""
    from analysis.report.light_text import plan_lines, quality_lines
    from render.output.light_record import plan_from, quality_from

    print_plan(plan_lines(plan_from(light[0]["plan"])))
    rows = quality_lines(quality_from(light[0]["groups"]))
    print_table("Light" + (", first frame" if len(light) > 1 else ""), rows)


def _print_results(result: dict[str, Any]) -> None:
    """One line a laser and method."""

    def micro(error: dict[str, float | None], name: str) -> str:
        value = error[name]
        return "-" if value is None else f"{value * 1e6:.1f} um"

    rows = [
        (
            f"{row['laser']}: {row['method'].replace('_', ' ')}",
            f"{row['points']}",
            "-" if row["completeness"] is None else f"{row['completeness']:.1%}",
            f"{row['false_scan_lines']}",
            *(micro(row["depth_m"], name) for name in ("bias", "rmse", "robust_sigma", "p95")),
        )
        for row in result.get("results", [])
    ]
    header = ("Depth error", "points", "complete", "false", "bias", "RMSE", "robust sigma", "P95")
    scale = result.get("image_scale", 1.0)
    title = result["name"] + ("" if scale == 1.0 else f", image scale {scale:g}: not the scanner's figures")
    if rows:
        print_table(title, rows, header=header)
    if result.get("measures"):
        from analysis.report import gauge_table

        found = [(row["name"], *gauge_table.plain_cells(row)) for row in result["measures"]]
        print_table("Measures", found, header=("Measure", *gauge_table.COLUMNS))
        for text in (*gauge_table.over_steps(result["measures"]), *gauge_table.reasons(result["measures"])):
            print(text)
        if result.get("measures_note"):
            print(result["measures_note"])
    for row in result.get("results", [])[:1]:
        if row["sampled_scan_lines"] < row["scan_lines"]:
            sample = f"a sample of {row['sampled_scan_lines']} of {row['scan_lines']} scan lines"
            print(f"robust sigma and P95 are those of {sample}, all else of every point")
    for text in dict.fromkeys([*result.get("notes", ()), *result.get("remarks", ())]):
        print(f"warning: {text}")


def _project_rows(project: Project, found: Inspection) -> list[tuple[str, str]]:
    camera, sensor, settings = project.scene.camera, project.sensor, project.extraction
    focus = camera.lens.focus_distance
    rows = [
        ("camera", f"{camera.width} x {camera.height} px of {camera.pixel_pitch * 1e6:.2f} um"),
        ("lens", f"{camera.focal_length * 1e3:.4g} mm, f/{camera.lens.f_number:g}, focused "
                 f"{'far away' if focus is None else f'at {focus * 1e3:g} mm'}, image distance "
                 f"{camera.image_distance * 1e3:.4g} mm, rendered as a {camera.lens.model.replace('-', ' ')}"),
        ("sensor", f"{sensor.colour}, {sensor.bits} bit, exposure {Unit.of('s').with_unit(sensor.exposure_time)}, "
                   f"full well {sensor.full_well:.0f} e-, read noise {sensor.read_noise:g} e-"),
    ]  # fmt: skip
    rows += [("object", f"{name}: {kind}, {count} triangles") for name, kind, count in found.objects]
    rows.append(("frames", str(found.frames)))
    rows.append(("extraction", f"{settings.method}, one position on each of the image's {settings.axis}"))
    return rows


def _laser_rows(view: LaserView, full_well: float) -> list[tuple[str, str]]:
    def number(value: float | None, unit: float, form: str) -> str:
        return "-" if value is None else form.format(value / unit)

    degree = math.radians(1)
    end = number(view.working_farthest, 1e-3, "{:.0f} mm") if view.working_farthest is not None else "no end"
    return [
        ("baseline", number(view.baseline, 1e-3, "{:.1f} mm")),
        ("triangulation angle", number(view.triangulation_angle, degree, "about {:.1f} deg")),
        ("working range", f"{number(view.working_nearest, 1e-3, '{:.0f}')} to {end} in depth"),
        ("line seen", f"on {view.scan_lines_hit} of {view.scan_lines} scan lines"),
        ("line length", f"{view.line_length_px:.0f} px, {view.line_length * 1e3:.1f} mm on the surface"),
        (
            "depth of the line",
            f"{number(view.depth_nearest, 1e-3, '{:.1f}')} to {number(view.depth_farthest, 1e-3, '{:.1f}')} mm",
        ),
        ("depth per pixel", number(view.depth_per_px, 1e-6, "about {:.0f} um across the line")),
        ("surface per pixel", number(view.along_line_per_px, 1e-6, "about {:.0f} um along the line")),
        ("line width", number(view.width_px, 1, "sigma about {:.2f} px")),
        (
            "brightest pixels",
            number(view.peak_electrons, 1, "about {:.0f} e-")
            + number(view.peak_electrons_most, 1, ", at most {:.0f} e-")
            + f" of {full_well:.0f} e-",
        ),
        ("saturated", number(view.saturated, 0.01, "the brightest pixel, on {:.1f} % of the scan lines that are hit")),
        ("steepest view", number(view.steepest_view, degree, "{:.1f} deg to camera or laser")),
    ]
