"""Read-outs in words: label, value with its unit, how sensible it is, and what it means."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from analysis.report.total import NARROW_PX
from analysis.report.units import grouped
from studio.editing.units import Unit
from studio.preview.estimates import BLURRED_PX, SHARP_PX
from studio.preview.inspection import DIM_ELECTRONS, WIDE_PX
from studio.preview.readouts import Range, Readouts

Level = Literal["", "warning", "error"]
NOTHING = "-"
SATURATED = 0.01
"""Share of the scan lines from which the line counts as saturated."""
MUCH_SATURATED = 0.2
"""Share of the scan lines from which the line is no longer measured as it would be."""
MOST_SATURATED = 0.5
"""Share from which a median along the line is of one that saturates."""

ANGLE = math.radians(10), math.radians(60)
"""rad of triangulation: below the first depth is coarse, above the second much is occluded."""

MEASURED = 3.0
"""Times the detection's threshold from which a line on ambient light is measured nearly as often as it is detected: of
v_groove at 0.3 mW, at twice the threshold, a fit refused six in seven of the scan lines."""

OF_ANOTHER_SET_UP = (
    "That is more than it can be by chance: it was made before the camera, its lens or the laser was changed. "
    "Calibrate again, or take it out of the project: Calibrate, Remove it from the project."
)
PEAK = "Median peak signal"
"""Beside the share of the full well, which is of the brightest place."""
NOT_REFLECTED = "Light that is reflected between surfaces, which a render shows, is not counted."


@dataclass(frozen=True)
class Row:
    """One line of the panel."""

    key: str
    label: str
    value: str
    note: str
    """The range along the line, or what goes with the value."""
    level: Level
    """Whether it is out of its sensible range."""
    help: str


def rows(r: Readouts) -> tuple[Row, ...]:
    """All read-outs of a laser, in the order in which a designer asks."""
    return (
        Row(
            "baseline",
            "Baseline",
            _lengths(r.baseline),
            "",
            "",
            "Distance between the camera's centre and the laser. More baseline: finer depth, more occlusion.",
        ),
        _ranged(
            "angle",
            "Triangulation angle",
            r.triangulation_angle,
            "°",
            lambda value: f"{math.degrees(value):.1f}",
            "Between the rays of camera and laser, at the surface. Below 10° depth is coarse; "
            "above 60° much is occluded.",
            _outside(math.radians(5), *ANGLE, math.radians(75)),
        ),
        _ranged(
            "standoff",
            "Stand-off",
            r.distance,
            f" {Unit.of('m').shown}",
            _length,
            "Depth of the lit line, from the camera along its axis.",
        ),
        Row("working", "Working range", _working(r), _sharp_working(r), *_working_level(r)),
        _ranged(
            "depth",
            "Depth per pixel",
            r.depth_per_px,
            " µm",
            micrometres,
            "Change of depth when the line moves by one pixel. A method that finds the line to 0.1 px "
            "resolves a tenth of it." + _working_depth(r),
        ),
        _ranged(
            "along",
            "Along the line",
            r.along_per_px,
            " µm/px",
            micrometres,
            "Length in the sheet from one scan line to the next: how finely a profile is sampled.",
        ),
        _ranged(
            "width",
            "Line width, sigma",
            r.width_px,
            " px",
            lambda value: f"{value:.2f}",
            f"Gaussian sigma of the line across a scan line, without defocus. {NARROW_PX:g} to {WIDE_PX:g} px "
            "measure well: narrower lines are sampled too coarsely, wider ones waste light.",
            _outside(NARROW_PX / 2, NARROW_PX, WIDE_PX, 2 * WIDE_PX),
        ),
        _peak(r),
        _saturation(r),
        _focus(r),
        _sigma(r),
        *_calibration(r),
        _occlusion(r),
    )


def _ranged(
    key: str,
    label: str,
    values: Range | None,
    unit: str,
    text: Callable[[float], str],
    help: str,
    level: Callable[[Range], Level] = lambda values: "",
) -> Row:
    if values is None:
        return Row(key, label, NOTHING, "", "", help)
    low, high = text(values.low), text(values.high)
    note = f"{low} to {high}" if low != high else ""
    return Row(key, label, f"{text(values.middle)}{unit}", note, level(values), help)


def _outside(least: float, low: float, high: float, most: float) -> Callable[[Range], Level]:
    def level(values: Range) -> Level:
        if not least <= values.middle <= most:
            return "error"
        return "" if low <= values.middle <= high else "warning"

    return level


def _working(r: Readouts) -> str:
    if r.working_nearest is None:
        return "none"
    return _lengths(r.working_nearest, math.inf if r.working_farthest is None else r.working_farthest)


def _sharp_working(r: Readouts) -> str:
    """What of the working range the lens leaves sharp, where images have its blur."""
    if r.working_nearest is None or not r.blurs_images:
        return ""
    near = max(r.working_nearest, r.sharp_nearest)
    far = min(math.inf if r.working_farthest is None else r.working_farthest, r.sharp_farthest)
    return f"sharp {_length(near)} to {_length(far)}" if near < far else "sharp nowhere"


def _working_level(r: Readouts) -> tuple[Level, str]:
    help = "Depths at which the middle of the fan falls into the image."
    if r.working_nearest is None:
        return "error", f"{help} The camera never sees the middle of this sheet: turn one towards the other."
    if r.distance is not None:
        help += f" The line lies at {_lengths(r.distance.low, r.distance.high)}."
    return "", help


def _working_depth(r: Readouts) -> str:
    if r.working_depth_per_px is None:
        return ""
    near, far = (micrometres(value) for value in r.working_depth_per_px)
    return f" Over the working range: {near} to {far} µm (as far as ten times the nearest depth)."


def _peak(r: Readouts) -> Row:
    help = (
        "Electrons of the brightest pixel of a scan line, with the ambient light that no shadow takes away: the median "
        "along the line. "
        f"{NOT_REFLECTED}"
    )
    if r.peak_electrons is None or r.laser_electrons is None or r.ambient_electrons is None or r.detected is None:
        return Row("peak", PEAK, NOTHING, "", "", help)
    middle, low, high = r.peak_electrons.middle, r.peak_electrons.low, r.peak_electrons.high
    help += f" Along the line {grouped(low)} to {grouped(high)} e-. Full well: {grouped(r.full_well)} e-."
    help += (
        f" Ambient light and dark current give {grouped(r.ambient_electrons)} e- of it, "
        f"the laser {grouped(r.laser_electrons)} e-: to the detection {r.detected:.1f} times the least that counts as "
        f"a line. Below 1 it is lost in the noise, below {MEASURED:g} it is often detected and not measured. "
        "Each is the median along the line, so that two need not add up to the third."
    )
    faint = r.detected < MEASURED or r.laser_electrons < DIM_ELECTRONS
    level: Level = "error" if r.detected < 1.0 else "warning" if faint else ""
    note = f"laser {grouped(r.laser_electrons)} over {grouped(r.ambient_electrons)}"
    return Row("peak", PEAK, f"{grouped(middle)} e-", note, level, help)


def _saturation(r: Readouts) -> Row:
    help = (
        "Expected share of the scan lines whose brightest pixel exceeds the full well: shot and read noise decide it, "
        "and speckle where the sensor's is switched on. Beside it stands how full the brightest place of the line is, "
        "as it is expected without noise, and in focus where images do not have the lens's blur. Shorten the exposure, "
        "or lower the power. "
        f"{NOT_REFLECTED}"
    )
    if r.saturated is None or r.peak_electrons is None:
        return Row("saturated", "Saturated", NOTHING, "", "", help)
    level: Level = "error" if r.saturated > MUCH_SATURATED else "warning" if r.saturated > SATURATED else ""
    full = r.peak_electrons.high / r.full_well
    alone = " without speckle" if r.speckled else ""
    if _is_out_of_focus(r):
        alone += ", as if in focus"
    return Row("saturated", "Saturated", f"{r.saturated:.0%}", f"up to {full:.0%} of full well{alone}", level, help)


def _focus(r: Readouts) -> Row:
    help = (
        f"Diameter of the blur disc along the line. At most {SHARP_PX:g} px, which counts as sharp, on the axis from "
        f"{_lengths(r.sharp_nearest, r.sharp_farthest)}. Set the focus distance to that of the line, or close the "
        "aperture; a tilted sensor (tauX, tauY of the distortion) tilts the plane in focus. Images have it where the "
        "camera's lens is rendered as a thin lens, or the sensor's defocus is switched on; else they are sharp at any "
        "depth, as a real scanner's are not."
    )
    note = f"sharp {_length(r.sharp_nearest)} to {_length(r.sharp_farthest)}" if r.blurs_images else "off in images"
    if r.blur_px is None:
        return Row("blur", "Defocus blur", NOTHING, note, "", help)
    worst = round(r.blur_px.high, 2)
    level: Level = "" if worst <= SHARP_PX else "warning" if worst <= BLURRED_PX else "error"
    # what is beyond a limit must not read as the limit itself
    reads_as_limit = any(limit < worst and f"{worst:.1f}" == f"{limit:.1f}" for limit in (SHARP_PX, BLURRED_PX))
    return Row("blur", "Defocus blur", f"{worst:.{2 if reads_as_limit else 1}f} px", note, level, help)


def _sigma(r: Readouts) -> Row:
    help = (
        "Expected standard deviation of depth for the best possible extraction: Cramer-Rao bound of photon and read "
        "noise, and speckle (laser light on a rough surface, fully developed) where the sensor's is switched on."
    )
    if r.photon_sigma is None or r.speckle_sigma is None or r.speckled_sigma is None:
        return Row("sigma", "Depth noise, sigma", NOTHING, "", "", help)
    if r.saturated is not None and r.saturated > MOST_SATURATED:
        help += " Here most of the line saturates: more light would make it look better and the measurement worse."
        return Row("sigma", "Depth noise, sigma", NOTHING, "saturated", "warning", help)
    photon, speckle = micrometres(r.photon_sigma), micrometres(r.speckle_sigma)
    supposed, level = _supposed(r)
    if r.textured:
        help += " Texture, whose edges move the line, adds to it what only a render tells."
    if supposed:
        help += f" Here it is foretold for a line that is {supposed[len('as if ') :]}, which this one is not."
    if not r.speckled:
        both = micrometres(r.speckled_sigma)
        help += (
            f" The sensor's is off: images have none, where a laser on a rough surface would make it {both} µm. "
            "Switch it on in the sensor, under Laser speckle, for what a real scanner meets."
        )
        return Row("sigma", "Depth noise, sigma", f"{photon} µm", _both(supposed, f"with speckle {both}"), level, help)
    help += f" Here: {photon} µm from photons, {speckle} µm from speckle."
    note = f"speckle {speckle}" if r.speckle_sigma > r.photon_sigma else f"photons {photon}"
    return Row("sigma", "Depth noise, sigma", f"{micrometres(r.speckled_sigma)} µm", _both(supposed, note), level, help)


def _occlusion(r: Readouts) -> Row:
    help = (
        "Share of the lit line within the image that the camera cannot see because something stands before it, or it "
        "lies on a side that faces away."
    )
    note = f"{grouped(r.scan_lines_hit)} of {grouped(r.scan_lines)} lines"
    # where no scan line has the line and nothing hides it there is none to be seen
    if r.occluded is None or (r.occluded == 0.0 and not r.scan_lines_hit):
        return Row("occluded", "Occluded", NOTHING, note, "", help)
    level: Level = "" if r.occluded < 0.1 else "warning" if r.occluded < 0.4 else "error"
    return Row("occluded", "Occluded", f"{r.occluded:.0%}", note, level, help)


def _calibration(r: Readouts) -> list[Row]:
    """Nothing where the project has none."""
    if r.calibration is None:
        return []
    off, told = micrometres(r.calibration.off), micrometres(r.calibration.told)
    help = (
        f"The project's calibration puts the lit line {off} µm off in depth, rms over the line, by the scene's own "
        f"camera and laser; it tells {told} µm of itself (one sigma)."
    )
    if not r.calibration.is_of_another(r.depth_sigma or 0.0):
        return [Row("calibration", "Calibration", f"{off} µm off", f"{told} told", "", help)]
    help += f" {OF_ANOTHER_SET_UP}"
    return [Row("calibration", "Calibration", f"{off} µm off", "of another set-up", "error", help)]


def _is_out_of_focus(r: Readouts) -> bool:
    """The lens is, and images do not show it."""
    return r.blur_px is not None and r.blur_px.high > BLURRED_PX and not r.blurs_images


def _supposed(r: Readouts) -> tuple[str, Level]:
    """What the depth's noise takes the line to be, and it is not."""
    wrong = []
    if _is_out_of_focus(r):
        wrong.append("in focus")
    if r.spreads:
        wrong.append("opaque")
    if r.saturated is not None and r.saturated > MUCH_SATURATED:
        wrong.append("unsaturated")
    level: Level = "warning" if wrong else ""
    if r.textured:
        wrong.append("plain")  # which no setting could mend
    return (f"as if {' and '.join(wrong)}", level) if wrong else ("", "")


def _both(supposed: str, note: str) -> str:
    """A narrow panel cuts off the end."""
    return f"{supposed}, {note}" if supposed else note


def _length(value: float) -> str:
    """In the unit that lengths are shown in."""
    return _digits(Unit.of("m").factor * value)


def _lengths(*values: float) -> str:
    return f"{' to '.join(_length(value) for value in values)} {Unit.of('m').shown}"


def micrometres(value: float) -> str:
    return _digits(1e6 * value)


def _digits(value: float) -> str:
    """Three digits, at least those before the point."""
    if not math.isfinite(value):
        return "∞"
    decimals = max(0, 2 - math.floor(math.log10(abs(value)))) if value else 0
    return grouped(value, min(decimals, 3))
