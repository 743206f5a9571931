"""The laser line in image files of a real scanner: read, subtract, check, and extract."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.line.along.smooth import smooth_along
from analysis.line.detection.channel import check_image
from analysis.line.detection.noise import NoiseModel, image_saturation
from analysis.line.estimate import estimate_noise, residual_ratio
from analysis.line.extract import extract
from analysis.line.result import Flag, Line
from analysis.line.selection.geometry import WorkingVolume
from analysis.line.series.hdr import Fused, fuse
from analysis.line.series.subtract import subtract_off
from analysis.line.settings import ExtractionSettings
from analysis.line.shared_noise import with_shared_noise
from render.base.arrays import Float
from render.base.errors import InputError
from render.camera.camera import Camera
from studio.photographs.bands import about, bands, course
from studio.photographs.blur_along import with_blur_along
from studio.photographs.candidates import peaks_to_choose_from
from studio.photographs.choice import carried_on, selected
from studio.photographs.completion import FILLED
from studio.photographs.evidence import Chain
from studio.photographs.half_height import with_half_heights
from studio.photographs.image_files import Photograph
from studio.photographs.laser_light import full_scale, laser_light
from studio.photographs.light import Light, without
from studio.photographs.line_arrays import changed, column
from studio.photographs.line_ends import Tone, ended
from studio.photographs.mosaic import with_mosaic
from studio.photographs.photograph_set import NEARBY, Look
from studio.photographs.pieces import NO_LINE, above_noise, lines_only
from studio.photographs.second_look import looked_at_again
from studio.scan.line_extraction import note_of

GAIN_ROUNDS = 5
PLATEAU = 32
"""Pixels of one number that a sensor's limit makes, and chance does not."""
SATURATED_SHARE = 0.5
"""Of the scan lines; an exposure with more of them is no base to estimate noise from."""

WIDER, PIXEL = 2.0, 12.0**-0.5
"""Times the line's usual width that one scan line's may be; px, the sigma of light spread over a pixel."""

FOLLOWED = 0.95
"""Share of its ridge on which a line has to lie, of as much as it could be found on."""

FITS = ("auto", "likelihood", "gaussian")
"""Methods that a profile may defeat."""


@dataclass(frozen=True)
class Measured:
    """The line of a photograph, in its whole image."""

    line: Line
    image: NDArray[Any]
    """(h, w) or (h, w, 3), upright."""
    part: NDArray[Any] | None = None
    """(h', w') that was measured; None: nothing was."""
    corner: tuple[int, int] = (0, 0)
    """(x, y) of its first pixel."""
    noise: NoiseModel | None = None

    @property
    def light(self) -> NDArray[Any] | None:
        """(h, w) that was measured, NaN beside it; None: nothing was."""
        return None if self.part is None else whole_light(self.part, self.corner, self.image.shape)


def whole_light(part: NDArray[Any], corner: tuple[int, int], shape: tuple[int, ...]) -> NDArray[Any]:
    """A part (h', w') of an image (h, w, ...), the (x, y) of its first pixel -> (h, w), NaN beside it."""
    if part.shape == shape[:2]:
        return part
    (x, y), (height, width) = corner, part.shape
    around = np.full(shape[:2], np.nan, np.float32)
    around[y : y + height, x : x + width] = part
    return around


def extract_photograph(
    path: Path, look: Look, threads: int | None = None, volume: WorkingVolume | None = None
) -> Measured:
    """The line in an image file, less its laser-off image; the noise is estimated from it.

    look: of the set that it belongs to. volume: only peaks that the laser can have made in it. InputError names the
    file and what is wrong: unreadable, of the wrong type or size, black, saturated, not a number, without the channel
    asked for.
    """
    with naming(path):
        taken, off = look.read(path)
        whole = check_image(taken.pixels)
        check_camera(whole, volume)
        check_light(look.region.part(whole))
        measured = _measured(path, taken, off, look, threads, volume, look.coloured)
        if look.coloured or not look.stands_out or volume is not None or look.settings.select != "continuous":
            return measured
        image = look.region.part(whole)
        chains = look.lines(path, image, None if off is None else look.region.part(off))
        seen, held = _on_ridges(measured.line, chains, look, image.shape)
        if held >= FOLLOWED * seen:
            return measured
        # something else in the room may be brighter than the line
        within = _measured(path, taken, off, look, threads, volume, True)
        return within if held < FOLLOWED * _on_ridges(within.line, chains, look, image.shape)[1] else measured


def _on_ridges(line: Line, chains: Sequence[Chain], look: Look, shape: tuple[int, ...]) -> tuple[int, int]:
    """On how many scan lines chains of ridges in an image (h, w, ...) are, and on how many of them a line (n, k)."""
    axis, (x, y) = look.settings.axis, look.region.corner
    along, first = (x, y) if axis == "rows" else (y, x)
    count, width = shape[:2] if axis == "rows" else shape[1::-1]
    u = line.u[first : first + count] - along
    seen = held = 0
    for one in (course(chain, count, width) for chain in chains):
        there = one.beyond == 0.0
        seen += int(there.sum())
        held += int((there & np.any([one.holds(u[:, k]) for k in range(u.shape[1])], axis=0)).sum())
    return seen, held


def _measured(
    path: Path,
    taken: Photograph,
    off: NDArray[Any] | None,
    look: Look,
    threads: int | None,
    volume: WorkingVolume | None,
    banded: bool,
) -> Measured:
    """As `extract_photograph`; banded: only where the line's ridge runs."""
    # what is smoothed along is the line that was selected, with its noise, and not with what all scan lines share
    settings = look.settings.model_copy(update={"smooth_along": False})
    whole = check_image(taken.pixels)
    light, corner = measured_light(path, whole, off, look, taken.lossy, banded)
    if light is None:
        return Measured(no_line(whole.shape, settings, "no light of the laser's colour on a line"), whole)
    noise = estimate_noise(light.seen, settings, light.saturation, processed=taken.lossy, threads=threads)
    alone = settings.select == "strongest" and volume is None
    # what neighbouring pixels share is asked of the line that was selected, not of the strongest peaks
    shared = noise.alike or whole.ndim == 3 or taken.lossy
    noise = noise.model_copy(update={"alike": shared})
    # where a camera has shaped the profile, no line is a Gaussian, and what some scan lines are taken for, one line
    # or two, would move them against the others
    judged = not shared
    # of a difference nobody knows where on its curve it is
    coded = taken.lossy and off is None and look.channel != "difference"
    tone = Tone(noise.gain, noise.black_level) if coded else None
    if alone:
        line = extract(light.image, settings=settings, noise=noise, threads=threads, shared=False, judged=judged)
    else:
        every = volume is not None
        line = peaks_to_choose_from(light.image, settings, noise, threads, every=every, judged=judged)
        if settings.select == "continuous" and settings.peaks == 1 and volume is None:
            line = looked_at_again(line, light.image, settings, noise, judged)
    line = placed(unsure_dropped(line), whole.shape, corner)
    fits = settings.select == "continuous" and settings.method in FITS
    if fits and np.isin(line.flag[:, : settings.peaks], FILLED).any():
        plainly = settings.model_copy(update={"method": "centre_of_mass", "select": "strongest"})
        centres = extract(light.image, settings=plainly, noise=noise, threads=threads, shared=False)
        centres = placed(centres, whole.shape, corner)
        if settings.peaks == 1 and look.settings.pattern is None:
            around = whole_light(light.image, corner, whole.shape)
            centres = with_half_heights(centres, column(line, 0), around, noise.gain)
        line = carried_on(line, centres, settings, volume, tone)
    elif not alone:
        line = selected(line, settings, volume)
    if settings.select == "continuous":
        found = above_noise(ended(line, tone), noise, settings.threshold)
        line = lines_only(found)
        if found.valid.any() and not line.valid.any():
            return Measured(no_line(whole.shape, settings, NO_LINE), whole, light.image, corner, noise)
    line = _no_wider(with_shared_noise(line), line) if shared else line
    line = smooth_along(line, look.longest) if look.settings.smooth_along else line
    if taken.lossy:
        course = line if look.settings.smooth_along else smooth_along(line, NEARBY)
        line = with_mosaic(with_blur_along(line, course), look.channel, noise.gain)
    return Measured(replace(line, note=note_of(line, settings, [])), whole, light.image, corner, noise)


def measured_light(
    path: Path, whole: NDArray[Any], off: NDArray[Any] | None, look: Look, lossy: bool, banded: bool
) -> tuple[Light | None, tuple[int, int]]:
    """What is measured of an image, in its region and about its lines, and (x, y) of its first pixel; None: nothing is
    left.
    """
    image, closed = look.region.part(whole), look.region.closed
    x, y = corner = look.region.corner
    off = None if off is None else look.region.part(off)
    full, within = full_scale(image, lossy), None
    if banded:
        found = look.lines(path, image, off)
        near = about(found, look.settings.axis, image.shape)
        chains = [replace(chain, u=chain.u - near.start) for chain in found]
        part, corner = ((slice(None), near), (x + near.start, y))
        if look.settings.axis == "columns":
            part, corner = (near, slice(None)), (x, y + near.start)
        image, closed = image[part], None if closed is None else closed[part]
        off = None if off is None else off[part]
        within = bands(chains, look.settings.axis, image.shape)
        if not len(within.rows):
            return None, corner
        image, off = within.of(image), None if off is None else within.of(off)
    if look.settings.pattern is not None:
        light = Light(image, None) if off is None else Light(*subtract_off(image, off))
    else:
        if image.ndim == 2 and look.named is not None:
            allowed = "auto or mono on a mono image"
            raise InputError("the image has no such channel", where="channel", found=look.named, allowed=allowed)
        colour = "mono" if look.evidence is None else look.evidence.colour
        light = laser_light(image, off, look.channel, colour, full)
    if within is not None:
        light = within.on_level_ground(light)
    if closed is not None:
        light = without(light, closed)
    return (light if light.open is None or light.open.any() else None), corner


def no_line(shape: tuple[int, ...], settings: ExtractionSettings, note: str) -> Line:
    """The line of an image (h, w, ...) that has none."""
    count = shape[0] if settings.axis == "rows" else shape[1]
    none = np.full((count, 1), np.nan)
    flag = np.full((count, 1), np.uint8(Flag.NO_PEAK))
    return Line(settings.axis, settings.method, none, none, none, none, none, none, flag, note)


def unsure_dropped(line: Line) -> Line:
    """The line without the positions that are less certain than the line is wide."""
    unsure = line.valid & (line.sigma_u > _widest(line))
    if not unsure.any():
        return line

    def kept(values: Float) -> Float:
        return np.where(unsure, np.nan, values)

    return changed(line, kept, np.where(unsure, np.uint8(Flag.UNSURE), line.flag).astype(np.uint8))


def _widest(line: Line) -> Float:
    """(n, k) px, the sigma of a position of which nothing is known but that it is in the line: as wide as pixels show
    it, and no wider than a line of its usual width can be.
    """
    usual = float(np.median(line.width[line.valid])) if line.valid.any() else math.inf
    return np.asarray(np.hypot(np.minimum(line.width, WIDER * usual), PIXEL))


def _no_wider(line: Line, before: Line) -> Line:
    """The line whose sigma was made larger, by no more than to what `_widest` says: before that it was within it."""
    return replace(line, sigma_u=np.minimum(line.sigma_u, np.maximum(before.sigma_u, _widest(line))))


def placed(line: Line, shape: tuple[int, ...], corner: tuple[int, int]) -> Line:
    """The line of a part of an image, in the whole image; scan lines beyond the part have no pixels."""
    count = shape[0] if line.axis == "rows" else shape[1]
    along, first = corner if line.axis == "rows" else corner[::-1]
    if len(line.u) == count:
        return line if along == 0 else replace(line, u=line.u + along)

    def whole(values: Float) -> Float:
        out = np.full((count, values.shape[1]), np.nan)
        out[first : first + len(values)] = values
        return out

    flag = np.full((count, line.flag.shape[1]), np.uint8(Flag.NO_PIXELS))
    flag[first : first + len(line.flag)] = line.flag
    found = changed(line, whole, flag)
    return replace(found, u=found.u + along)


def extract_series(
    paths: Sequence[Path],
    times: Sequence[float],
    look: Look,
    volume: WorkingVolume | None = None,
    threads: int | None = None,
) -> Line:
    """The line in several exposures of one scene, fused in electrons; times in any unit. InputError names the file."""
    settings = look.settings
    fused = fuse_files(paths, times, look)
    with naming(paths[0]):
        check_camera(fused.electrons, volume)
        line = extract(
            fused.electrons,
            settings=settings,
            noise=fused.noise,
            variance=fused.variance,
            volume=volume,
            threads=threads,
        )
    told = f"{len(paths)} exposures fused"
    return replace(line, note="; ".join(filter(None, (note_of(line, settings, []), told))))


def fuse_files(paths: Sequence[Path], times: Sequence[float], look: Look) -> Fused:
    """Mono image files of one scene, less their laser-off images -> Fused. InputError names the file."""
    settings = look.settings
    images: list[NDArray[Any]] = []
    highest = 0.0
    for path in paths:
        with naming(path):
            taken, off = look.read(path)
            image = check_image(taken.pixels)
            if image.ndim != 2:
                raise InputError("exposures are fused of mono or raw images only", found="colour")
            highest = max(highest, image_saturation(image) or _plateau(image))
            if off is not None:
                image, _ = subtract_off(image, off)
            images.append(image)
    full = highest or 2.0 * max(float(np.nanmax(image)) for image in images)  # none is saturated
    # the more light, the better the noise can be told, as long as the line is not cut off on most scan lines
    order, across = np.argsort(times)[::-1], 1 if settings.axis == "rows" else 0
    whole = [k for k in order if np.mean((images[k] >= full).any(axis=across)) < SATURATED_SHARE]
    with naming(paths[0]):
        noise = estimate_noise(images[whole[0] if whole else order[-1]], settings)
        noise = noise.model_copy(update={"saturation": full})
        fused = fuse(images, times, noise)
        plain = settings.model_copy(
            update={"method": "likelihood", "peaks": 1, "select": "strongest", "smoothing": 0.0, "smooth_along": False}
        )
        for _ in range(GAIN_ROUNDS):  # all exposures together say more of the gain than one
            line = extract(fused.electrons, settings=plain, noise=fused.noise, variance=fused.variance)
            ratio = residual_ratio(line)
            if ratio is None or abs(ratio - 1.0) < 0.02:
                break
            gain = noise.gain * min(max(ratio, 0.2), 5.0)
            noise = noise.model_copy(update={"gain": gain, "read_noise": noise.read_noise * noise.gain / gain})
            fused = fuse(images, times, noise)
        return fused


def _plateau(image: NDArray[Any]) -> float:
    """The highest number where many pixels share it, as at a full well below the full scale; 0: they do not."""
    top = float(np.nanmax(image))
    return top if np.count_nonzero(image == top) >= PLATEAU else 0.0


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Put the file's name into an InputError that does not say where."""
    try:
        yield
    except InputError as error:
        if str(path) in error.where:
            raise
        where = f"{path}: {error.where}" if error.where not in ("", "image") else str(path)
        raise InputError(error.what, where=where, found=error.found, allowed=error.allowed, cure=error.cure) from None


def check_camera(image: NDArray[Any], volume: WorkingVolume | None) -> None:
    """InputError: the image is not of the size of the camera whose geometry is asked for."""
    if volume is not None:
        check_size(image, volume.camera)


def check_size(image: NDArray[Any], camera: Camera) -> None:
    """InputError: the image is not of the camera's size."""
    if image.shape[:2] == (camera.height, camera.width):
        return
    raise InputError(
        "the image is not of the camera's size",
        found=f"{image.shape[1]} x {image.shape[0]} px",
        allowed=f"{camera.width} x {camera.height} px",
    )


def check_light(image: NDArray[Any]) -> None:
    """InputError: an image that is black, saturated or the same all over."""
    finite = image[np.isfinite(image)] if image.dtype.kind == "f" else image
    low, high = float(finite.min()), float(finite.max())
    if high <= 0.0:
        raise InputError(
            "the image is black", found=f"no pixel above {high:g}", cure="expose longer, or turn the laser on"
        )
    if low == high:
        full = image_saturation(image)
        if full is not None:
            raise InputError("the image is saturated all over", found=f"every pixel at {full:g}", cure="expose less")
        raise InputError("the image is the same everywhere", found=f"every pixel at {high:g}")
