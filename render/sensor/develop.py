"""From radiance to digital numbers, after EMVA 1288; the last step of a frame, milliseconds, never a new render.

    optics      each light group through defocus and the lens's point spread, each laser's through its speckle: all off
                unless the sensor's switches say so; a thin lens is rendered with its defocus, which is not done twice
    signal      mu    = sum over light groups of radiance x response (optics, cos^4, photons, QE: `response.py`)
    charge      e     ~ Poisson(mu x the pixel's own gain (PRNU) + dark current x exposure)
    read-out    e    += the pixel's own offset (DSNU) + Gaussian read noise;  e <= full well
    numbers     DN    = round(K e + black level), clipped to 0 .. 2^bits - 1
    processing  what a webcam or a phone makes of them (`processing.py`); off unless the sensor has it

Shot noise, dark noise and read noise are drawn anew for every frame (seed and step); PRNU and DSNU belong to the
sensor, so they have a seed of their own and are the same in every frame. Full well clips last, so a saturated pixel
reads exactly `Image.saturation`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float, Float32
from render.base.errors import InputError
from render.base.finite import check_finite
from render.base.kept_result import kept
from render.base.threads import map_chunks, rows_of
from render.frame import Frame
from render.sampling.poisson import poisson
from render.sampling.random import normal, wrapped
from render.scene.scene import Scene
from render.sensor.blur import Spread, defocus, disc_diameter, point_spread
from render.sensor.processing import photograph
from render.sensor.response import band_response, joules_per_radiance, laser_response, relative_illumination
from render.sensor.sensor import Processing, Sensor
from render.sensor.speckle import Speckle, scintillate, speckle

Pixels = NDArray[np.uint8] | NDArray[np.uint16]

PATTERN_SEED = 0x50524E55_44534E55
ROWS = 16
_PRNU, _DSNU = 0, 1
_READ, _SHOT = 0, 1


@dataclass(frozen=True)
class Image:
    """The camera's output: raw digital numbers (Bayer: the mosaic), and the constants that turn them into electrons.

    Of a sensor that processes its image a photograph, (h, w, 3) RGB where it has colours. What the tone curve and the
    rest make of a number is not held: `gain` is that of white light before them.
    """

    pixels: Pixels
    """(h, w) DN, uint8 for 8 bits and uint16 for more, not shifted; or a photograph."""
    bits: int
    gain: float
    """EMVA's K, DN/e-: electrons = (DN - black_level) / gain."""
    black_level: float
    """DN of a pixel without electrons."""
    saturation: float
    """DN at or above which a pixel is saturated: a lower bound of its signal only."""
    read_noise: float
    """Standard deviation of the read noise, e-."""
    pattern: str | None
    """Bayer pattern of the first 2 x 2 pixels, None for mono."""
    exposure_time: float = 1.0
    """Exposure time, s."""
    shorter: tuple[Image, ...] = ()
    """Further exposures of the same scene, to be fused with this one."""
    processed: bool = False
    """A photograph: its numbers are no electrons times a gain."""

    @property
    def grey(self) -> NDArray[Any]:
        """(h, w) DN; of a photograph in colour the mean of its channels."""
        return self.pixels if self.pixels.ndim == 2 else self.pixels.mean(axis=2, dtype=np.float32)


def develop(
    frame: Frame,
    scene: Scene,
    sensor: Sensor,
    *,
    seed: int = 0,
    threads: int | None = None,
    laser_power: Sequence[float] | None = None,
    noise: bool = True,
) -> Image:
    """The (h, w) image, or photograph (h, w, 3), that the sensor takes of a frame; the same for any number of threads.

    laser_power: W for each laser in place of the scene's. noise off: the mean, without PRNU, DSNU and speckle, but
    saturated and quantised. Raises InputError: the frame is not of this scene, a power is out of range, or a laser that
    was off in the render is given one.
    Source: EMVA 1288 release 4, section 2 (linear model) and 4 (spatial non-uniformity).
    """
    exposure = _Exposure(frame, scene, sensor, laser_power, threads, seed if noise else None)
    height, width = exposure.shape
    top = float(2**sensor.bits - 1)
    gain = sensor.dn_per_electron
    pixels = np.empty((height, width), dtype=np.uint8 if sensor.bits == 8 else np.uint16)
    chain = np.array(
        [
            sensor.dark_current * sensor.exposure_time,
            sensor.prnu,
            sensor.dsnu,
            sensor.read_noise,
            sensor.full_well,
            gain,
            sensor.black_level,
            top,
        ]
    )

    fixed = fixed_pattern(height, width, threads=threads)

    def rows(start: int, stop: int) -> None:
        numbers = np.empty((stop - start, width), dtype=np.uint16)
        light = exposure.signal(start, stop)
        check_finite("sensor", electrons=light)
        _read_out(light, fixed[start:stop], start, wrapped(seed), frame.step, chain, noise, numbers)
        pixels[start:stop] = numbers

    map_chunks(rows, height, rows_of(width, ROWS), threads)
    saturation = min(top, math.floor(gain * sensor.full_well + sensor.black_level + 0.5))
    pattern = sensor.pattern if sensor.colour == "bayer" else None
    image = Image(
        pixels, sensor.bits, gain, sensor.black_level, saturation, sensor.read_noise, pattern, sensor.exposure_time
    )
    return image if sensor.processing is None else _processed(image, sensor.processing)


def _processed(raw: Image, how: Processing) -> Image:
    """The photograph that the camera makes of a raw image."""
    numbers = photograph(raw.pixels, raw.black_level, raw.saturation, raw.pattern, how)
    gain = 255.0 * raw.gain / (raw.saturation - raw.black_level)
    return Image(numbers, 8, gain, 0.0, 255.0, raw.read_noise, None, raw.exposure_time, processed=True)


def expected_electrons(
    frame: Frame,
    scene: Scene,
    sensor: Sensor,
    *,
    threads: int | None = None,
    laser_power: Sequence[float] | None = None,
) -> Float32:
    """(h, w) mean electrons of light and dark current, of the ideal pixel: no PRNU, DSNU or saturation.

    Raises InputError as `develop` does.
    """
    exposure = _Exposure(frame, scene, sensor, laser_power, threads)
    electrons = np.empty(exposure.shape, dtype=np.float32)

    def rows(start: int, stop: int) -> None:
        electrons[start:stop] = exposure.signal(start, stop) + sensor.dark_current * sensor.exposure_time
        check_finite("sensor", electrons=electrons[start:stop])

    map_chunks(rows, len(electrons), rows_of(electrons.shape[1], ROWS), threads)
    return electrons


class _Exposure:
    """A frame's light groups with the electrons that each makes per radiance."""

    def __init__(
        self,
        frame: Frame,
        scene: Scene,
        sensor: Sensor,
        laser_power: Sequence[float] | None,
        threads: int | None,
        seed: int | None = None,
    ) -> None:
        camera, lasers = scene.camera, scene.lasers
        self.shape = (camera.height, camera.width)
        if len(frame.laser_direct) != len(lasers):
            found = f"{len(frame.laser_direct)} laser images"
            raise InputError("the frame is not of this scene", where="frame", found=found, allowed=f"{len(lasers)}")
        groups = [*frame.laser_direct, *frame.laser_indirect, *([] if frame.ambient is None else [frame.ambient])]
        for image in groups:
            if image.shape[:2] != self.shape:
                found, allowed = f"{image.shape[1]} x {image.shape[0]} px", f"{camera.width} x {camera.height} px"
                raise InputError("the frame is not of this scene", where="frame", found=found, allowed=allowed)
        joule = joules_per_radiance(camera, sensor)
        optics = _Optics(frame, scene, sensor, threads)
        scales = _power_scales(scene, laser_power)
        self.lasers = [
            (optics(image), scale * joule * laser_response(sensor, laser.wavelength_nm))
            for image, laser, scale in zip(map(frame.laser, range(len(lasers))), lasers, scales, strict=True)
        ]
        self.ambient = None if frame.ambient is None else optics(frame.ambient)
        self.speckles: list[Speckle | None] = [None] * len(lasers)
        self.seed, self.step = seed, frame.step
        if sensor.speckle != "off" and seed is not None:
            pupil = (camera.working_f_number, camera.pixel_pitch, sensor.speckle == "depolarised")
            self.speckles = [speckle(laser.wavelength_nm, *pupil) for laser in lasers]
        self.bands = joule * band_response(sensor)
        self.illumination = relative_illumination(camera, threads)

    def signal(self, start: int, stop: int) -> Float:
        """(stop - start, w) mean photo-electrons of rows start..stop."""
        mean = np.zeros((stop - start, self.shape[1]))
        for i, ((image, response), field) in enumerate(zip(self.lasers, self.speckles, strict=True)):
            rows = image[start:stop]
            if field is not None and self.seed is not None:
                rows = scintillate(image, start, stop, field, self.seed, self.step, i)
            _add_laser(mean, rows, response, start)
        if self.ambient is not None:
            _add_ambient(mean, self.ambient[start:stop], self.bands, start)
        mean *= self.illumination[start:stop]
        return mean


class _Optics:
    """The sensor's switches for lens blur and defocus, applied to one light group's image after the other."""

    def __init__(self, frame: Frame, scene: Scene, sensor: Sensor, threads: int | None) -> None:
        self.camera, self.sensor, self.threads = scene.camera, sensor, threads
        self.diameter = None
        if sensor.needs_depth(scene.camera.lens.model):
            if frame.truth is None:
                cure = "render the frame with its truth, or switch defocus off"
                raise InputError(
                    "the frame does not hold the depth that defocus needs", where="sensor.defocus", cure=cure
                )
            self.diameter = disc_diameter(scene.camera, frame.truth.depth_z)

    def __call__(self, image: Float32) -> Float32:
        """(h, w) or (h, w, 3) radiance, as the lens throws it on the sensor."""
        sensor, pitch = self.sensor, self.camera.pixel_pitch
        spreads = sensor.blur_sigma > 0.0 or sensor.halo > 0.0 or sensor.scatter > 0.0
        if image.ndim == 3 and not (self.diameter is not None or spreads):
            return np.ascontiguousarray(image, dtype=np.float32)
        if image.ndim == 3:
            return np.stack([self(image[..., channel]) for channel in range(3)], axis=2)
        image = np.ascontiguousarray(image, dtype=np.float32)
        if self.diameter is not None:
            image = defocus(image, self.diameter, self.threads)
        if spreads:
            halo, scatter = sensor.halo_sigma / pitch, sensor.scatter_sigma / pitch
            image = point_spread(image, Spread(sensor.blur_sigma / pitch, sensor.halo, halo, sensor.scatter, scatter))
        return image


def _power_scales(scene: Scene, laser_power: Sequence[float] | None) -> list[float]:
    if laser_power is None:
        return [1.0] * len(scene.lasers)
    if len(laser_power) != len(scene.lasers):
        found, allowed = f"{len(laser_power)} powers", f"{len(scene.lasers)}"
        raise InputError("one power for each laser is needed", where="laser_power", found=found, allowed=allowed)
    scales = []
    for laser, power in zip(scene.lasers, laser_power, strict=True):
        where = f"laser_power of {laser.name!r}"
        if not (math.isfinite(power) and power >= 0.0):
            raise InputError("the power is out of range", where=where, found=power, allowed="0 W or more, finite")
        if laser.power == 0.0 and power > 0.0:
            cure = "render the scene with the laser on"
            raise InputError("the frame holds no light of a laser of 0 W", where=where, found=power, cure=cure)
        scales.append(power / laser.power if laser.power > 0.0 else 1.0)
    return scales


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _add_laser(mean: Float, radiance: Float32, response: Float, first_row: int) -> None:
    """Add one laser's electrons to (n, w); response (2, 2) by parity of row and column."""
    for i in range(mean.shape[0]):
        for j in range(mean.shape[1]):
            if radiance[i, j] > 0.0:
                mean[i, j] += response[(first_row + i) & 1, j & 1] * radiance[i, j]


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _add_ambient(mean: Float, radiance: Float32, response: Float, first_row: int) -> None:
    """Add the ambient bands' electrons to (n, w); response (2, 2, 3)."""
    for i in range(mean.shape[0]):
        for j in range(mean.shape[1]):
            r = response[(first_row + i) & 1, j & 1]
            electrons = r[0] * radiance[i, j, 0] + r[1] * radiance[i, j, 1] + r[2] * radiance[i, j, 2]
            if electrons > 0.0:
                mean[i, j] += electrons


@kept(most=2)
def fixed_pattern(height: int, width: int, *, threads: int | None = None) -> Float32:
    """(h, w, 2) standard normal numbers of the sensor's pixels, for PRNU and DSNU."""
    pattern = np.empty((height, width, 2), dtype=np.float32)

    def rows(start: int, stop: int) -> None:
        _fill_pattern(pattern[start:stop], start)

    map_chunks(rows, height, rows_of(width, ROWS), threads)
    pattern.flags.writeable = False
    return pattern


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _fill_pattern(pattern: Float32, first_row: int) -> None:
    width = pattern.shape[1]
    for i in range(pattern.shape[0]):
        for j in range(width):
            index = (first_row + i) * width + j
            pattern[i, j, 0] = normal(PATTERN_SEED, index, 0, _PRNU)
            pattern[i, j, 1] = normal(PATTERN_SEED, index, 0, _DSNU)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _read_out(
    mean: Float,
    fixed: Float32,
    first_row: int,
    seed: int,
    step: int,
    chain: Float,
    noise: bool,
    numbers: NDArray[np.uint16],
) -> None:
    """(n, w) mean photo-electrons -> (n, w) DN by the chain at the head of this file.

    fixed (n, w, 2): PRNU and DSNU of each pixel, in standard deviations.
    """
    dark, prnu, dsnu, read, full_well, gain, black, top = chain
    width = mean.shape[1]
    for i in range(mean.shape[0]):
        for j in range(width):
            index = (first_row + i) * width + j
            charge = mean[i, j]
            if not noise:
                charge += dark
            else:
                charge *= max(0.0, 1.0 + prnu * fixed[i, j, 0])
                charge = poisson(charge + dark, seed, index, step, _SHOT)
                charge += dsnu * fixed[i, j, 1]
                if read > 0.0:
                    charge += read * normal(seed, index, step, _READ)
            number = math.floor(gain * min(charge, full_well) + black + 0.5)
            numbers[i, j] = np.uint16(min(max(number, 0.0), top))
