"""What `main.py section` does: a plane through a scan, as a drawing or a table."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from analysis.section import Plane
from studio.runtime.streams import print_json
from studio.scan.section import take_section, write_section


def make_section(
    folder: Path,
    *,
    through: tuple[float, float, float],
    normal: tuple[float, float, float],
    thickness: float | None,
    out: Path | None,
    quiet: bool,
    as_json: bool,
) -> None:
    """through, thickness: mm; None: as the scan needs it. InputError: as `take_section` and `write_section`."""
    x, y, z = (1e-3 * value for value in through)
    made = take_section(folder, Plane((x, y, z), normal), None if thickness is None else 1e-3 * thickness)
    path = write_section(made, out or folder / "section.dxf", [folder / "points.ply"])
    length = sum(float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum()) for line in made.true)
    if as_json:
        counts = {"lines": len(made.true), "length": length, "points": len(made.measured), "thickness": made.thickness}
        print_json({"ok": True, "file": str(path), **counts, "axes": made.plane.axes.tolist()})
        return
    print(f"{path}: {len(made.true)} true lines of {1e3 * length:.2f} mm, {len(made.measured)} points")
    if made.remark:
        print(f"The slab is {made.remark}".replace("\u00a0", " "))
    if not quiet:
        across, up, _ = (", ".join(f"{value:.4f}" for value in axis) for axis in made.plane.axes.tolist())
        print(f"Across is ({across}), up is ({up}), from {through} mm; the slab is {1e3 * made.thickness:g} mm thick")
