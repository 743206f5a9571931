"""Commands that ask of a finished scan. Only click is imported here, and everything else where it is used."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from studio.runtime.command_line import FiniteRange, require_system
from studio.runtime.command_options import common


class Place(click.ParamType):  # type: ignore[type-arg]
    """Three numbers with commas between them."""

    name = "X,Y,Z"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[float, ...]:
        """Fails where it is none, or one is not finite or beyond 100 km."""
        try:
            numbers = tuple(float(part) for part in str(value).split(","))
        except ValueError:
            numbers = ()
        if len(numbers) != 3 or not all(abs(number) < 1e8 for number in numbers):
            self.fail(f"{value!r} are not three numbers, as in 1,2.5,-3.", param, ctx)
        return numbers


FOLDER = click.argument("folder", type=click.Path(path_type=Path))


@click.command()
@click.argument("source", type=click.Path(path_type=Path))
@click.option("--pitch", type=FiniteRange(1e-3, 1e3), help="Of the cells, mm  [default: a cell for each point].")
@click.option("--all-heights", is_flag=True, help="Keep those of stray points, which make the levels coarser.")
@click.option("--out", type=click.Path(path_type=Path), help="PNG or TIFF  [default: heightmap.png beside the points].")
@common
def heightmap(source: Path, **options: Any) -> None:
    """Points of a results folder, or a PLY, as heights on a uniform grid: a 16-bit picture, and its scale as JSON."""
    require_system()
    from studio.commands.height_map import make_height_map

    make_height_map(source, **options)


@click.command()
@FOLDER
@click.option("--part", help="Name of the object  [default: all, or the only one].")
@click.option("--cad", type=click.Path(path_type=Path), help="Nominal in its place: STEP, STL, PLY, OBJ, GLB.")
@click.option("--unit", type=click.Choice(["m", "cm", "mm", "um", "in"]), help="Of the nominal's file.")
@click.option(
    "--align",
    type=click.Choice(["none", "best-fit", "3-2-1"]),
    default="none",
    show_default=True,
    help="How the points are laid onto the nominal: as measured; least squares; by six spots.",
)
@click.option(
    "--spot", "spots", type=Place(), multiple=True, help="On the nominal, world, mm; six of them, in order 3, 2, 1."
)
@click.option("--spot-radius", type=FiniteRange(1e-3, 1e3), default=2.0, show_default=True, help="mm.")
@click.option("--lower", type=FiniteRange(-1e6, 1e6), help="Tolerance of the surface from, um.")
@click.option("--upper", type=FiniteRange(-1e6, 1e6), help="And to, um.")
@click.option("--out", type=click.Path(path_type=Path), help="CSV  [default: deviation.csv in the folder].")
@common
def deviation(folder: Path, **options: Any) -> None:
    """How far a scan's points are from the nominal part: table, map with callouts, and the verdict of a tolerance."""
    require_system()
    from studio.commands.deviation import tell_deviation

    tell_deviation(folder, **options)


@click.command()
@FOLDER
@click.option("--through", type=Place(), required=True, help="A point of the plane, world, mm.")
@click.option("--normal", type=Place(), required=True, help="Of the plane, any length.")
@click.option(
    "--thickness",
    type=FiniteRange(1e-3, 1e3),
    help="Of the slab of points, mm  [default: 1, or the scan's step where that is more].",
)
@click.option("--out", type=click.Path(path_type=Path), help="DXF or CSV  [default: section.dxf in the folder].")
@common
def section(folder: Path, **options: Any) -> None:
    """A plane through a scan: where it cuts the true part, and the points near it, as a drawing or a table."""
    require_system()
    from studio.commands.section import make_section

    make_section(folder, **options)


@click.command()
@FOLDER
@click.option("--rate", type=FiniteRange(0.1, 120.0), default=10.0, show_default=True, help="Steps a second.")
@click.option("--out", type=click.Path(path_type=Path), help="MP4  [default: scan.mp4 in the folder].")
@common
def film(folder: Path, **options: Any) -> None:
    """A scan played back: the image of each step beside the points measured so far, as an MP4."""
    require_system()
    from studio.commands.film import make_film

    make_film(folder, **options)


@click.command()
@FOLDER
@click.option("--out", type=click.Path(path_type=Path), required=True, help="PLY, CSV, PCD, XYZ, LAS, E57: by its end.")
@common
def points(folder: Path, **options: Any) -> None:
    """The points of a scan in the format of another program; LAS and E57 need the extra "points"."""
    require_system()
    from studio.commands.points import convert_points

    convert_points(folder, **options)


COMMANDS = (heightmap, deviation, section, film, points)
