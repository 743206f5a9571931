"""From an image to the laser line: read scan lines, detect peaks, measure each by the method asked for."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray
from pydantic import ValidationError

from analysis.line.channel import check_image, scan_lines
from analysis.line.estimate import estimate_noise
from analysis.line.measure import measure
from analysis.line.noise import NoiseModel
from analysis.line.result import Axis, Line
from analysis.line.settings import ExtractionSettings, Method
from render.errors import InputError


def extract(
    image: NDArray[Any],
    *,
    method: Method | None = None,
    axis: Axis | None = None,
    peaks: int | None = None,
    settings: ExtractionSettings | None = None,
    noise: NoiseModel | None = None,
    threads: int | None = None,
) -> Line:
    """Image (h, w) or (h, w, 3), uint8, uint16, float32 or float64 -> Line with arrays (n, peaks).

    method, axis and peaks override `settings`. noise turns DN into electrons; without it, it is estimated from the
    image (`estimate_noise`). Scan lines without a position carry a flag that says why.
    Raises InputError: an image of the wrong type, shape or size, without a finite pixel, a channel it does not have,
    settings out of range.
    """
    chosen = _settings(settings, method=method, axis=axis, peaks=peaks)
    array = check_image(image)
    if noise is None:
        noise = estimate_noise(array, chosen)
    if chosen.method == "likelihood":
        chosen = chosen.model_copy(update={"smoothing": 0.0})
    lines = scan_lines(array, chosen, noise)
    return measure(lines, chosen, threads)


def _settings(settings: ExtractionSettings | None, **given: Any) -> ExtractionSettings:
    values = {} if settings is None else settings.model_dump()
    values.update({name: value for name, value in given.items() if value is not None})
    try:
        return ExtractionSettings(**values)
    except ValidationError as error:
        first = error.errors()[0]
        where = "extraction." + ".".join(str(part) for part in first["loc"]) if first["loc"] else "extraction"
        raise InputError(first["msg"], where=where, found=first["input"]) from None
