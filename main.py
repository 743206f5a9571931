"""The one entry of Blazer Studio: no arguments opens the studio, subcommands run the same work without windows.

Exit codes: 0 done, 2 bad input (one message says what to change), 3 a fault of the program, 130 interrupted.
Only click is imported here, and what needs the standard library alone; everything else where it is used, so that
--help answers at once.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

try:
    import click

    from studio.commands.of_scans import COMMANDS as OF_SCANS
    from studio.runtime.command_line import BAD_INPUT, Commands, FiniteRange, require_system
    from studio.runtime.command_options import (
        COLOUR,
        THREADS,
        calibrating,
        common,
        extracting,
        labelling,
        measuring,
        photographed,
        printing,
        repeating,
        sharing,
        training,
        working,
    )
except KeyboardInterrupt:
    sys.exit(130)
except ModuleNotFoundError as missing:
    from studio.runtime.system import missing_python_package

    print(missing_python_package(missing.name), file=sys.stderr)
    sys.exit(2)

VERSION = "0.1.0"


PROJECT = click.argument("project", required=False, type=click.Path(path_type=Path))


@click.group(cls=Commands, invoke_without_command=True, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(VERSION, prog_name="Blazer Studio")
@click.pass_context
def cli(context: click.Context) -> None:
    """Blazer Studio simulates line laser scanners: what the camera sees, what is reconstructed, and how wrong it is.

    Without a command it opens the studio.
    """
    if context.invoked_subcommand is not None:
        return
    reason = why_no_studio()
    if reason is None:
        from studio.qt.shell.app import open_studio

        context.exit(open_studio())
    click.echo(f"The studio does not open here: {reason}. Running the sample scan without it.", err=True)
    context.invoke(run)


@cli.command("open")
@PROJECT
@common
@click.pass_context
def open_project(context: click.Context, /, project: Path | None, **_: Any) -> None:
    """Open the studio on a project, as `main.py PROJECT` does, or on the folder of a finished scan."""
    from studio.qt.shell.app import open_studio

    context.exit(open_studio(project))


def why_no_studio() -> str | None:
    """The reason why no window can open, or None."""
    from importlib.util import find_spec

    if find_spec("PySide6") is None:
        return "the Qt library (PySide6) is not installed"
    from studio.runtime.display import why_no_display

    reason = why_no_display()
    if reason is not None:
        return reason
    from studio.qt.shell.app import why_not

    return why_not()


@cli.command()
@PROJECT
@click.option("--report/--no-report", default=True, show_default=True, help="Write the HTML and PDF report.")
@click.option("--root", type=click.Path(path_type=Path), help="Folder of the meshes and textures of a report.")
@measuring
@working
@click.pass_context
def run(context: click.Context, /, project: Path | None, root: Path | None, **options: Any) -> None:
    """Scan a project: render, extract the line, triangulate, compare with the truth, report. Default: the sample.

    A report.html in place of a project is run again as it was, to the same numbers.
    """
    require_system()
    if project is not None and project.suffix.lower() in (".html", ".htm"):
        from studio.commands.run_report import run_report

        given = click.core.ParameterSource.COMMANDLINE
        chosen = [name for name in options if context.get_parameter_source(name) is given]
        run_report(project, root, chosen, **options)
        return
    from studio.commands.commands import run_project

    if root is not None:
        raise click.UsageError("--root is of a report; the meshes of a project are in its own folder", context)
    run_project(project, **options)


@cli.command()
@PROJECT
@working
def render(project: Path | None, **options: Any) -> None:
    """Render the frames of a project with their truth, and stop there."""
    require_system()
    from studio.commands.commands import render_project

    render_project(project, **options)


@cli.command()
@click.argument("sources", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--project", type=click.Path(path_type=Path), help="Project with camera, laser and settings.")
@click.option("--laser", type=click.IntRange(0), default=0, show_default=True, help="Which laser made the line.")
@click.option("--hdr", metavar="TIMES", help="The images are exposures of one scene, so long: 8,2,0.5.")
@click.option("--colour", type=COLOUR, help="The laser's, in photographs  [default: the project's].")
@click.option("--shape", type=click.Choice(["plane", "sphere"]), help="That photographs show, for the report.")
@photographed
@click.option("--out", type=click.Path(path_type=Path), help="Output folder  [default: beside the source].")
@measuring
@THREADS
@common
def reconstruct(sources: tuple[Path, ...], **options: Any) -> None:
    """Points from rendered frames (a folder that `render` wrote), or from photographs with --project.

    Several photographs are the steps of the project's motion, or, with --hdr, exposures of one scene. They get a report
    of their own: residuals to a straight line and a plane, noise, coverage, warnings and pictures.
    """
    require_system()
    from studio.commands.commands import reconstruct_source

    reconstruct_source(sources, **options)


@cli.command()
@click.argument("images", nargs=-1, required=True, type=click.Path(path_type=Path))
@extracting
@common
def extract(images: tuple[Path, ...], **options: Any) -> None:
    """The laser line in image files of a real scanner (PNG, TIFF, EXR, JPEG, BMP), as a table for each."""
    require_system()
    from studio.commands.extract import extract_images

    if extract_images(images, **options):
        click.get_current_context().exit(BAD_INPUT)


@cli.command()
@click.argument("folder", type=click.Path(path_type=Path))
@THREADS
@common
def report(folder: Path, **options: Any) -> None:
    """Rebuild the report of a finished scan from its folder."""
    require_system()
    from studio.commands.commands import rebuild_report

    rebuild_report(folder, **options)


@cli.command()
@click.argument("a", type=click.Path(path_type=Path))
@click.argument("b", type=click.Path(path_type=Path))
@common
def compare(a: Path, b: Path, **options: Any) -> None:
    """What changed from one finished run to another, in set-up and results, and whether it is more than chance.

    A and B are results folders, or reports (report.html).
    """
    require_system()
    from studio.commands.compare import compare_paths

    compare_paths(a, b, **options)


for of_scan in OF_SCANS:
    cli.add_command(of_scan)


@cli.command()
@PROJECT
@common
def inspect(project: Path | None, **options: Any) -> None:
    """What is in a project, whether it is sane, and what the camera will see."""
    require_system()
    from studio.commands.commands import inspect_project

    inspect_project(project, **options)


@cli.command()
@click.argument("template", required=False)
@click.argument("folder", required=False, type=click.Path(path_type=Path))
@click.option("--force", is_flag=True, help="Overwrite files that are there.")
@click.option("--sensor", metavar="NAME", help='With a preset\'s sensor, by a part of its name: "webcam", "phone", ...')
@common
def new(template: str | None, folder: Path | None, **options: Any) -> None:
    """Start a project from a template; without a template, list them."""
    from studio.commands.commands import start_project

    start_project(template, folder, **options)


@cli.command()
@PROJECT
@click.option("--out", type=click.Path(path_type=Path), help="Output folder  [default: scan-output/budget-<name>].")
@click.option("--repeats", type=click.IntRange(3, 10_000), default=8, show_default=True, help="Of each state.")
@repeating
def budget(project: Path | None, **options: Any) -> None:
    """What makes the depth error: each effect switched off and on alone, bias and spread apart. Default: the sample.

    The same command goes on after an interrupt; study show tells what a folder holds.
    """
    require_system()
    from studio.commands.budget import budget_project

    budget_project(project, **options)


@cli.command()
@PROJECT
@click.option("--out", type=click.Path(path_type=Path), help="Write the cheaper project there, if it is proved.")
@click.option("--within", type=FiniteRange(0.1, 50.0), default=3.0, help="Percent that depth may change  [default: 3].")
@click.option("--seeds", type=click.IntRange(3, 10_000), default=8, show_default=True, help="Fresh ones, of a proof.")
@repeating
def advise(project: Path | None, **options: Any) -> None:
    """No more than a scene needs: a cheaper project that is proved to measure depth alike. Default: the sample."""
    require_system()
    from studio.commands.advise import advise_project

    advise_project(project, **options)


@cli.command()
@click.argument("project", type=click.Path(path_type=Path))
@click.argument("photographs", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--laser", type=click.IntRange(0), default=0, show_default=True, help="Which laser made the line.")
@click.option("--out", type=click.Path(path_type=Path), help="Project to write  [default: PROJECT_twin.json].")
@THREADS
@common
def twin(project: Path, photographs: tuple[Path, ...], **options: Any) -> None:
    """Fit a project to photographs of its scanner: sheet, blur, halo, noise, laser power; a new project.

    The photographs, raw mono ones or those of a webcam or a phone, are the steps of the project's motion, or all of its
    first step. What they do not tell is kept.
    """
    require_system()
    from studio.commands.twin import twin_project

    twin_project(project, photographs, **options)


@cli.command()
@click.argument("recipe", required=False, type=click.Path(path_type=Path))
@labelling
@common
def dataset(recipe: Path | None, **options: Any) -> None:
    """Labelled images of a recipe, or of a ready-made one by its name; without a recipe, list them.

    The same command goes on after an interrupt or a kill, with more scenes where --count is raised.
    """
    require_system()
    from studio.commands.dataset import dataset_command

    dataset_command(recipe, **options)


@cli.command()
@click.argument("recipes", nargs=-1, required=True, type=click.Path(path_type=Path))
@training
@common
def chooser(recipes: tuple[Path, ...], **options: Any) -> None:
    """Train the network of --select learned on scenes of recipes, or of ready-made ones by their names."""
    require_system()
    from studio.commands.chooser import chooser_command

    chooser_command(recipes, **options)


@cli.command()
@click.argument("what", metavar="WHAT")
@click.argument("folder", required=False, type=click.Path(path_type=Path))
@calibrating
@common
def calibrate(what: str, folder: Path | None, **options: Any) -> None:
    """Calibrate a camera, its lasers, or both: camera|laser|scanner FOLDER of photographs, or a PROJECT in silico.

    check FOLDER tells by one to three new photographs whether the calibration of --camera still holds.
    Photographs of one pose are named NAME_off and NAME_on (NAME_laser0, NAME_laser1, ...), or NAME for both in one.
    """
    require_system()
    from studio.commands.calibrate import calibrate_command

    if calibrate_command(what, folder, **options):
        click.get_current_context().exit(BAD_INPUT)


@cli.command()
@click.argument("board", default="checkerboard:13x9:25mm")
@printing
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="PDF file, or GLB: a mesh to render  [default: PDF named by the board].",
)
@common
def board(board: str, **options: Any) -> None:
    """A board as a PDF to scale: checkerboard:13x9:25mm (inner corners), charuco:14x10:25mm:18mm (squares) or
    circles:13x9:25mm:12mm (discs)."""
    require_system()
    from studio.commands.board import print_board

    print_board(board, **options)


@cli.group()
def study() -> None:
    """Many runs with one question: speed against accuracy, where a method breaks; as a table and charts."""


@study.command("list")
@common
def list_studies(**options: Any) -> None:
    """The studies that come with the program."""
    from studio.commands.study import list_studies

    list_studies(**options)


@study.command("run")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Output folder  [default: scan-output/study-<name>].")
@sharing
@common
def run_study(file: Path, **options: Any) -> None:
    """Run a study file, or a ready-made study by its name. The same command goes on after an interrupt or a kill."""
    require_system()
    from studio.commands.study import run_file

    run_file(file, **options)


@study.command("show")
@click.argument("folder", type=click.Path(path_type=Path))
@common
def show_study(folder: Path, **options: Any) -> None:
    """What a study's folder says so far; its tables and charts are made anew."""
    require_system()
    from studio.commands.study import show_folder

    show_folder(folder, **options)


@study.command("merge")
@click.argument("folders", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--out", required=True, type=click.Path(path_type=Path), help="Folder of the whole study.")
@common
def merge_studies(folders: tuple[Path, ...], **options: Any) -> None:
    """Put the shards of a study together: the same table as of one run."""
    require_system()
    from studio.commands.study import merge_folders

    merge_folders(folders, **options)


if __name__ == "__main__":
    cli()
