"""Options that commands share. Only click is imported, so that --help answers at once."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from studio.runtime.command_line import FiniteRange


def common(command: Callable[..., Any]) -> Callable[..., Any]:
    """Options that every command has."""
    for option in (
        click.option("--debug", is_flag=True, expose_value=False, help="Show tracebacks."),
        click.option("--quiet", "-q", is_flag=True, help="No progress."),
        click.option("--json", "as_json", is_flag=True, help="Print the result as one JSON object."),
    ):
        command = option(command)
    return command


THREADS = click.option("--threads", type=click.IntRange(1, 1024), help="Threads  [default: all processors].")


def working(command: Callable[..., Any]) -> Callable[..., Any]:
    """Options of the commands that compute and write."""
    for option in (
        click.option("--steps", type=click.IntRange(1), help="Only the first so many frames of a moving scan."),
        click.option("--scale", type=FiniteRange(0.01, 4.0), default=1.0, show_default=True, help="Image scale."),
        click.option(
            "--time-limit",
            type=FiniteRange(0.1, 1e9),
            metavar="SECONDS",
            help="Time for the light of each frame; it ends then, short of its errors. --resume goes on from there.",
        ),
        click.option(
            "--frames",
            type=click.Choice(["all", "band", "none"]),
            default="all",
            show_default=True,
            help="What is kept of each frame: all; a band about the line, coarse elsewhere, without PNG; nothing.",
        ),
        click.option("--resume", is_flag=True, help="Go on where an earlier scan into the same folder ended."),
        click.option("--seed", type=click.IntRange(0, 2**63 - 1), help="Random seed  [default: the project's]."),
        THREADS,
        click.option("--out", type=click.Path(path_type=Path), help="Output folder  [default: scan-output/<name>]."),
    ):
        command = option(command)
    return common(command)


METHOD = click.option("--method", help="How the line is found; auto picks, an unknown name lists all.")
SELECT = click.option(
    "--select",
    type=click.Choice(["strongest", "first", "last", "continuous", "learned"]),
    help="Which peak of a scan line; continuous: the one on the smoothest chain of peaks; learned: the one that a "
    "trained network takes for the line.",
)


def _named_here(file: Path) -> str:
    """A file that the command line names may lie outside the project's folder; imported only where one is named."""
    from studio.project.allowed_files import of_command_line

    return of_command_line(file)


CHOOSER = click.option(
    "--chooser",
    type=click.Path(path_type=Path),
    callback=lambda context, option, file: None if file is None else _named_here(file),
    help="Weights (.onnx) of --select learned, as `chooser` trains them  [default: the program's].",
)
GEOMETRY = click.option(
    "--geometry/--no-geometry", default=None, help="Only peaks that the laser can have made, in the working volume."
)
NEAREST = click.option("--nearest", type=FiniteRange(0.0, 1e4), help="Nearest depth of the working volume, m.")
FARTHEST = click.option("--farthest", type=FiniteRange(1e-6, 1e4), help="Farthest depth of the working volume, m.")


def selecting(command: Callable[..., Any]) -> Callable[..., Any]:
    """Which of a scan line's candidates is the line."""
    for option in (FARTHEST, NEAREST, GEOMETRY, CHOOSER, SELECT):
        command = option(command)
    return command


SMOOTH_ALONG = "Estimate positions with their neighbours on the line; steps and corners are kept."
SMOOTH_PHOTOGRAPHS = (
    "Estimate positions with their neighbours, as far along the line as it is smooth, or not at all; steps and corners "
    "are kept  [default: over 2.5 scan lines at most]."
)


def measuring(command: Callable[..., Any]) -> Callable[..., Any]:
    """Settings of the line extraction in place of the project's."""
    for option in (
        click.option("--spacetime/--no-spacetime", default=None, help="Measure a moving scan along time."),
        click.option("--smooth-along/--no-smooth-along", default=None, help=SMOOTH_ALONG),
        click.option(
            "--exposure-ratio",
            type=FiniteRange(1.0, 100.0, min_open=True),
            help="Each exposure is so many times shorter than the one before.",
        ),
        click.option("--exposures", type=int, help="Exposures taken of each frame and fused."),
        selecting,
        METHOD,
    ):
        command = option(command)
    return command


def photographed(command: Callable[..., Any]) -> Callable[..., Any]:
    """What photographs say themselves, and a person may say instead."""
    for option in (
        click.option("--mask", type=click.Path(path_type=Path), help="Image that is black where not to look."),
        click.option("--roi", metavar="X,Y,W,H", help="Part of the image to look at, px."),
        click.option("--pattern", type=click.Choice(["RGGB", "BGGR", "GRBG", "GBRG"]), help="Bayer, of raw images."),
        click.option(
            "--off",
            type=click.Path(path_type=Path),
            multiple=True,
            help="Image with the laser off, to subtract: one for all, or one for each, by name or in order.",
        ),
        click.option(
            "--channel",
            type=click.Choice(["auto", "mono", "luminance", "red", "green", "blue", "difference"]),
            help="What is measured of colour images, else found; difference: the laser's colour less the others.",
        ),
        click.option(
            "--axis",
            type=click.Choice(["auto", "rows", "columns"]),
            help="Scan lines: rows for an upright line, columns for a level one. Auto: by evidence.",
        ),
    ):
        command = option(command)
    return command


COLOUR = click.Choice(["auto", "mono", "red", "green", "blue"])


def extracting(command: Callable[..., Any]) -> Callable[..., Any]:
    """How lines are found in photographs without a project."""
    for option in (
        THREADS,
        click.option("--out", type=click.Path(path_type=Path), help="Output folder  [default: beside each image]."),
        click.option(
            "--laser-number", type=click.IntRange(0), default=0, show_default=True, help="Which laser of the project."
        ),
        click.option(
            "--project", type=click.Path(path_type=Path), help="Project with camera and laser, for --geometry."
        ),
        click.option(
            "--spacetime", is_flag=True, help="The images are a sweep over a scene at rest: when it passes each pixel."
        ),
        click.option(
            "--ridges", is_flag=True, help="Lines of any direction, as points with their normal (2-D Steger)."
        ),
        click.option("--smooth-along/--no-smooth-along", default=None, help=SMOOTH_PHOTOGRAPHS),
        click.option("--overlay", is_flag=True, help="Write a picture of each image with its line beside the table."),
        click.option("--hdr", metavar="TIMES", help="The images are exposures of one scene: 8,2,0.5. One table."),
        selecting,
        click.option("--peaks", type=int, help="Peaks kept on each scan line  [default: as many as lines stand out]."),
        photographed,
        click.option("--laser", "colour", type=COLOUR, help="Its colour  [default: auto]."),
        METHOD,
    ):
        command = option(command)
    return command


def repeating(command: Callable[..., Any]) -> Callable[..., Any]:
    """Options of the commands that run a project many times."""
    for option in (
        click.option("--workers", type=click.IntRange(1, 1024), help="Processes  [default: one a processor]."),
        click.option("--laser", type=click.IntRange(0), default=0, show_default=True, help="Which laser is measured."),
        click.option("--scale", type=FiniteRange(0.01, 4.0), default=1.0, show_default=True, help="Image scale."),
    ):
        command = option(command)
    return common(command)


def sharing(command: Callable[..., Any]) -> Callable[..., Any]:
    """Options of long work that processes, a cluster or several machines share."""
    for option in (
        click.option("--shard", default="1/1", show_default=True, help="Only this part of the work: 3/40."),
        click.option(
            "--scheduler", metavar="ADDRESS", help="Of a Dask cluster, tcp://host:8786, in place of processes here."
        ),
        click.option("--workers", type=click.IntRange(1, 1024), help="Processes  [default: one a processor]."),
    ):
        command = option(command)
    return command


def labelling(command: Callable[..., Any]) -> Callable[..., Any]:
    """Options of labelled images of a recipe."""
    for option in (
        sharing,
        click.option(
            "--from",
            "sources",
            multiple=True,
            type=click.Path(path_type=Path),
            help="Folder of another shard: take over.",
        ),
        click.option("--preview", is_flag=True, help="Only a contact sheet of the first 64 scenes, small."),
        click.option(
            "--format", "formats", multiple=True, help="Labels for others' readers too; an unknown name lists all."
        ),
        click.option(
            "--out", type=click.Path(path_type=Path), help="Output folder  [default: scan-output/dataset-<name>]."
        ),
        click.option("--count", type=click.IntRange(1, 10_000_000), default=100, show_default=True, help="Scenes."),
    ):
        command = option(command)
    return command


def training(command: Callable[..., Any]) -> Callable[..., Any]:
    """Options of training a chooser."""
    scenes = click.IntRange(5, 1_000_000)
    for option in (
        click.option("--workers", type=click.IntRange(1, 1024), help="Processes  [default: one a processor]."),
        click.option(
            "--out", required=True, type=click.Path(path_type=Path), help="Weights (.onnx); the card goes beside."
        ),
        click.option("--seed", type=click.IntRange(0, 2**32 - 1), default=0, show_default=True, help="Of training."),
        click.option("--count", type=scenes, default=40, show_default=True, help="Scenes of each recipe."),
    ):
        command = option(command)
    return command


def virtual_views(command: Callable[..., Any]) -> Callable[..., Any]:
    """Options of a calibration in silico."""
    sigma = FiniteRange(1e-4, 10.0)
    for option in (
        click.option("--line-sigma", type=sigma, default=0.05, help="Of virtual lines, px."),
        click.option("--corner-sigma", type=sigma, default=0.05, help="Of virtual corners, px."),
        click.option("--seed", type=click.IntRange(0, 2**63 - 1), default=0, help="Of virtual views."),
        click.option("--views", type=click.IntRange(3, 1000), default=20, show_default=True, help="Virtual ones."),
    ):
        command = option(command)
    return command


def real_views(command: Callable[..., Any]) -> Callable[..., Any]:
    """Options of a calibration from photographs."""
    for option in (
        FARTHEST,
        NEAREST,
        click.option(
            "--channel",
            type=click.Choice(["auto", "mono", "red", "green", "blue"]),
            default="auto",
            help="The laser's colour.",
        ),
        click.option(
            "--axis", type=click.Choice(["rows", "columns"]), default="rows", show_default=True, help="Scan lines."
        ),
        click.option(
            "--lens",
            type=click.Choice(["auto", "0", "4", "5", "8", "12", "14"]),
            default="auto",
            help="Distortion terms.",
        ),
        click.option(
            "--hand",
            type=click.Choice(["camera", "board"]),
            default="camera",
            show_default=True,
            help="What the robot of --motion carries.",
        ),
        click.option(
            "--motion",
            type=click.Path(path_type=Path),
            help="CSV with view and position_mm, angle_deg, or a robot's x_mm, y_mm, z_mm, qx, qy, qz, qw.",
        ),
        click.option(
            "--camera",
            type=click.Path(path_type=Path),
            help="That laser holds (ours, OpenCV, ROS, Kalibr, mrcal) or check is about.",
        ),
    ):
        command = option(command)
    return command


def calibrating(command: Callable[..., Any]) -> Callable[..., Any]:
    """Options of a calibration, from photographs or in silico."""
    for option in (
        click.option(
            "--project",
            type=click.Path(path_type=Path),
            help="Project to measure photographs with, which takes it on; made where there is none.",
        ),
        click.option(
            "--export",
            type=click.Choice(["opencv", "ros", "kalibr", "mrcal"]),
            multiple=True,
            help="The camera for others.",
        ),
        virtual_views,
        click.option("--target-um", type=FiniteRange(0.01, 1e6), help="Depth error that is enough, um."),
        click.option(
            "--most-tilt", type=FiniteRange(5.0, 70.0), default=45.0, show_default=True, help="Of boards, degrees."
        ),
        real_views,
        click.option(
            "--out", type=click.Path(path_type=Path), help="Calibration file  [default: FOLDER/calibration.json]."
        ),
        click.option(
            "--board",
            help="Kind, counts and side; see board  [default: checkerboard:13x9:25mm; check: the calibration's].",
        ),
    ):
        command = option(command)
    return command


def printing(command: Callable[..., Any]) -> Callable[..., Any]:
    """How a board is printed."""
    for option in (
        click.option(
            "--contrast", type=FiniteRange(0.1, 1.0), default=1.0, help="1: black on white; 0.6 shows the line better."
        ),
        click.option(
            "--paper", type=click.Choice(["A4", "A3", "A2", "A1", "A0"]), help="Size  [default: the least that holds]."
        ),
    ):
        command = option(command)
    return command
