"""Photographs of a sheet that sweeps a scene at rest: when its middle passes each pixel, as an image."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from analysis.line.detection.channel import check_image
from analysis.line.estimate import estimate_noise
from analysis.line.result import Flag
from analysis.line.series.spacetime_at_rest import passage
from analysis.line.settings import ExtractionSettings
from render.base.errors import InputError
from render.base.files import atomic_write
from studio.photographs.image_files import load_photograph
from studio.scan.own_files import check_replaceable


def passage_of_files(
    paths: tuple[Path, ...], settings: ExtractionSettings, out: Path | None, threads: int | None = None
) -> dict[str, Any]:
    """Frames in the order of the sweep -> an EXR of the passage's time (frames), its sigma, width and amplitude (e-).

    InputError: a frame that cannot be read, in colour or of another size, or fewer than 8.
    """
    import OpenEXR

    frames = []
    for path in paths:
        try:
            frames.append(check_image(load_photograph(path)))
        except InputError as error:
            if str(path) in error.where:
                raise
            raise InputError(error.what, where=str(path), found=error.found, allowed=error.allowed) from None
    # the noise where the sheet is in the middle of its way
    noise = estimate_noise(frames[len(frames) // 2], settings)
    found = passage(frames, noise, settings=settings, threads=threads)
    channels = {
        "time": found.time,
        "sigma_time": found.sigma_time,
        "width": found.width,
        "amplitude": found.amplitude,
        "flag": found.flag,
    }
    target = (out if out is not None else paths[0].parent) / f"{paths[0].stem}_passage.exr"
    layers = {name: np.ascontiguousarray(values, dtype=np.float32) for name, values in channels.items()}
    check_replaceable([target], paths)
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with atomic_write(target) as temporary:
        OpenEXR.File(header, layers).write(str(temporary))
    flags, counts = np.unique(found.flag, return_counts=True)
    known = found.sigma_time[found.valid]
    return {
        "frames": len(frames),
        "pixels": int(found.flag.size),
        "passed": int(found.valid.sum()),
        "sigma_time_frames": float(np.median(known)) if len(known) else None,
        "width_frames": float(np.median(found.width[found.valid])) if len(known) else None,
        "flags": {Flag(int(flag)).name: int(count) for flag, count in zip(flags, counts, strict=True)},
        "file": str(target),
    }
