"""What `main.py twin` does: a project fitted to photographs of the real scanner, and a table of what they tell."""

from __future__ import annotations

import math
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from render.base.errors import InputError
from studio.commands.advise import check_target, write_project
from studio.commands.places import chosen_file, load_project
from studio.runtime.console import print_table, stage_progress
from studio.runtime.streams import print_json
from studio.study.study import require_laser

if TYPE_CHECKING:
    from studio.photographs.twin import Told
    from studio.photographs.twin_project import Made

NAMES = {
    "scale": ("sheet's width, of the project's", "x"), "sheet_px": ("sheet's sigma in the image", "px"),
    "line_px": ("line's sigma in the image, less the pixel's", "px"), "blur_px": ("lens blur", "px"),
    "halo": ("halo, share of the light", ""), "halo_px": ("halo's sigma", "px"),
    "gain": ("gain", "DN/e-"), "read_noise": ("read noise", "e-"), "scatter": ("the light's own scatter", ""),
    "alike": ("noise shared by neighbouring scan lines", ""), "saturation": ("saturation", "DN"),
    "ambient": ("other light beside the line", "e-"), "peak": ("brightest pixel of a scan line", "e-"),
}  # fmt: skip
"""Field of a twin -> what it is called, and its unit."""


def twin_project(
    path: Path, photographs: tuple[Path, ...], *, laser: int, out: Path | None, threads: int | None, **shown: bool
) -> None:
    """`twin`: writes a new project. InputError: as `twin_of`; a photograph is missing, or a file is in the way."""
    from studio.photographs.twin_project import twin_of

    file = chosen_file(path)
    target = out if out is not None else file.with_name(f"{file.stem}_twin.json")
    check_target(target)
    missing = [one for one in photographs if not one.exists()]
    if missing:
        raise InputError("there is no such photograph", where=str(missing[0]))
    project, root = load_project(path)
    require_laser(project, laser, "--laser")
    with stage_progress(shown["quiet"] or shown["as_json"]) as progress:
        progress("fit", 0.0)
        made = twin_of(project, root, laser, photographs, threads)
        progress("fit", 1.0)
    written = write_project(target, made.project, root)
    if shown["as_json"]:
        print_json({"ok": True, "written": str(written), **_as_data(made)})
        return
    rows = [_row(*NAMES[one.name], getattr(made.twin, one.name)) for one in fields(made.twin) if one.name in NAMES]
    print_table(f"Twin of {made.twin.scan_lines} scan lines", [*rows, _row("laser's power", "W", made.power)])
    for warning in made.warnings:
        print(f"warning: {warning}")
    print(f"wrote {written}")


def _row(name: str, unit: str, told: Told) -> tuple[str, str]:
    if told.why:
        return name, f"{told.value:.4g} {unit}".rstrip() + f", kept: {told.why}"
    spread = f" +- {told.sigma:.2g}" if math.isfinite(told.sigma) and told.sigma > 0.0 else ""
    return name, f"{told.value:.4g}{spread} {unit}".rstrip()


def _as_data(made: Made) -> dict[str, Any]:
    def data(told: Told) -> dict[str, Any]:
        known = math.isfinite(told.sigma)
        return {"value": told.value, "sigma": told.sigma if known else None, "kept": told.why or None}

    twin = {one.name: data(getattr(made.twin, one.name)) for one in fields(made.twin) if one.name in NAMES}
    return {
        "scan_lines": made.twin.scan_lines,
        **twin,
        "laser_power_w": data(made.power),
        "warnings": list(made.warnings),
    }
