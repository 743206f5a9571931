"""Lines of any direction in an image file, as a table of points on ridges."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.line.detection.channel import check_image
from analysis.line.estimate import estimate_noise
from analysis.line.result import Flag
from analysis.line.ridges.ridges import find_ridges
from analysis.line.series.subtract import subtract_off
from analysis.line.settings import ExtractionSettings
from render.base.csv_file import write_csv
from studio.photographs.image_files import load_photograph
from studio.photographs.line_tables import table_path
from studio.photographs.photographs import check_light, naming
from studio.scan.own_files import RIDGE_COLUMNS


def ridges_of_file(
    path: Path,
    settings: ExtractionSettings,
    off: NDArray[Any] | None,
    out: Path | None,
    taken: set[Path],
    threads: int | None = None,
) -> dict[str, Any]:
    """One row for each point, line by line; px and e-. InputError names the file, as `extract_photograph`."""
    with naming(path):
        image = check_image(load_photograph(path))
        check_light(image)
        noise = None
        if off is not None:
            image, saturation = subtract_off(image, off)
            noise = estimate_noise(image, settings, saturation)
        found = find_ridges(image, settings=settings, noise=noise, threads=threads)
    numbers = np.column_stack(
        (found.u, found.v, found.sigma_u, found.normal, found.width, found.amplitude, found.background)
    )
    rows = []
    for k, values in enumerate(numbers):
        cells = [f"{value:.9g}" if np.isfinite(value) else "" for value in (*values, found.significance[k])]
        rows.append([int(found.chain[k]), *cells, Flag(int(found.flag[k])).name])
    target = table_path(path, out, taken, "ridges")
    write_csv(target, RIDGE_COLUMNS, rows)
    known = found.sigma_u[np.isfinite(found.sigma_u)]
    lines = int(found.chain.max()) + 1 if len(found.u) else 0
    return {
        "image": str(path),
        "method": "ridges",
        "note": "ridges of any direction",
        "what": f"{len(found.u)} points on {lines} line{'s' if lines != 1 else ''}",
        "points": len(found.u),
        "lines": lines,
        "sigma_u_px": float(np.median(known)) if len(known) else None,
        "width_px": float(np.median(found.width)) if lines else None,
        "amplitude_e": float(np.median(found.amplitude)) if lines else None,
        "file": str(target),
    }
