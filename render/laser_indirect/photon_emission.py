"""Photons leaving a line laser: where in the fan, across the sheet, and only where they can hit something."""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

from render.base.arrays import Float, Long
from render.base.borrowed import borrowed
from render.base.pose import invert, transform_points
from render.laser.irradiance import sheet_sigma
from render.laser.laser import CONSTANT, GAUSSIAN, LineLaser
from render.world.world import World


def _recurrence(dimensions: int) -> Float:
    """Powers of 1/g, g the positive root of x^(d+1) = x + 1."""
    g = 1.5
    for _ in range(64):
        g = (1.0 + g) ** (1.0 / (dimensions + 1))
    return np.asarray((1.0 / g) ** np.arange(1, dimensions + 1) % 1.0)


SEQUENCE = _recurrence(5)
"""Additive recurrence in five dimensions (Roberts 2018, R5): two at the laser, three for the first bounce."""


FAN_BINS, UNIFORM_FRACTION = 128, 0.25
"""Bins of the fan, each with its own density of photons; the share of photons that stays uniform."""


class FanDistribution(NamedTuple):
    """With which density photons leave along the fan."""

    low: float
    high: float
    """The sheet can hit something between these quantiles of its power, `low` and `high`."""
    cumulative: Float
    """(FAN_BINS + 1,) distribution over equal bins of what lies between them, from 0 to 1."""


class Photons(NamedTuple):
    """Photons on their way: (n, 3) origin and direction (world), (n,) power, number of the path, bin of the fan."""

    origin: Float
    direction: Float
    power: Float
    path_index: Long
    fan_bin: Long


@numba.njit(nogil=True, cache=True, error_model="numpy")
def normal_quantile(share: float) -> float:
    """Inverse of the normal distribution function: Giles (2010), erfinv in single precision, and a Newton step."""
    x = 2.0 * share - 1.0
    w = -math.log((1.0 - x) * (1.0 + x))
    if w < 5.0:
        w -= 2.5
        p = 2.81022636e-08
        for c in (3.43273939e-07, -3.5233877e-06, -4.39150654e-06, 0.00021858087, -0.00125372503, -0.00417768164):
            p = c + p * w
        p = 1.50140941 + (0.246640727 + p * w) * w
    else:
        w = math.sqrt(w) - 3.0
        p = -0.000200214257
        for c in (0.000100950558, 0.00134934322, -0.00367342844, 0.00573950773, -0.0076224613, 0.00943887047):
            p = c + p * w
        p = 2.83297682 + (1.00167406 + p * w) * w
    z = p * x * math.sqrt(2.0)
    return z - (0.5 * math.erfc(-z / math.sqrt(2.0)) - share) * math.sqrt(2.0 * math.pi) * math.exp(0.5 * z * z)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def fan_integral(y: float, beam: Float) -> float:
    """Share of the power below Y, for |Y| <= tan(fan / 2)."""
    edge = beam[4]
    y = min(max(y, -edge), edge)
    if beam[5] == CONSTANT:
        return 0.5 + 0.5 * y / math.sqrt(1.0 + y * y) * math.sqrt(1.0 + edge * edge) / edge
    if beam[5] == GAUSSIAN:
        return 0.5 + 0.5 * math.erf(y / edge * math.sqrt(2.0)) / math.erf(math.sqrt(2.0))
    return 0.5 + 0.5 * y / edge


@numba.njit(nogil=True, cache=True, error_model="numpy")
def fan_quantile(share: float, beam: Float) -> float:
    """Inverse of `fan_integral`."""
    edge = beam[4]
    if beam[5] == CONSTANT:
        sine = (2.0 * share - 1.0) * edge / math.sqrt(1.0 + edge * edge)
        return sine / math.sqrt(max(1.0 - sine * sine, 1e-30))
    if beam[5] == GAUSSIAN:
        inside = math.erf(math.sqrt(2.0))
        return normal_quantile(0.5 + 0.5 * (2.0 * share - 1.0) * inside) * 0.5 * edge
    return (2.0 * share - 1.0) * edge


@numba.njit(nogil=True, cache=True, error_model="numpy")
def emit(
    first: int,
    total: int,
    shift: Float,
    reference_distance: float,
    beam: Float,
    fan: FanDistribution,
    T_world_laser: Float,
    photons: Photons,
) -> None:
    """Fill `photons` with numbers first, first + 1, ... of `total`, in the fan's order; shift (5,) is the pass's.

    A focused sheet bends; its photons fly straight towards where the sheet is at the reference distance, the part's.
    """
    shift, beam, fan, T_world_laser = borrowed(shift), borrowed(beam), borrowed(fan), borrowed(T_world_laser)
    photons = borrowed(photons)
    m = T_world_laser
    emitter, _ = sheet_sigma(0.0, beam)
    sigma, _ = sheet_sigma(reference_distance, beam)
    fan_bin = 0
    for i in range(len(photons.path_index)):
        index = first + i
        place = (index + shift[0]) / total
        while fan_bin < FAN_BINS - 1 and fan.cumulative[fan_bin + 1] <= place:
            fan_bin += 1
        probability = fan.cumulative[fan_bin + 1] - fan.cumulative[fan_bin]
        within = (place - fan.cumulative[fan_bin]) / probability
        along = fan.low + (fan.high - fan.low) * (fan_bin + within) / FAN_BINS
        across = (shift[1] + index * SEQUENCE[1]) % 1.0
        y = fan_quantile(min(max(along, 1e-15), 1.0 - 1e-15), beam)
        q = normal_quantile(min(max(across, 1e-12), 1.0 - 1e-12))
        x0 = q * emitter
        dx, dy, dz = q * (sigma - emitter) / reference_distance, y, 1.0
        length = math.sqrt(dx * dx + dy * dy + dz * dz)
        for axis in range(3):
            photons.origin[i, axis] = m[axis, 3] + m[axis, 0] * x0
            photons.direction[i, axis] = (m[axis, 0] * dx + m[axis, 1] * dy + m[axis, 2] * dz) / length
        photons.power[i] = beam[0] * (fan.high - fan.low) / (FAN_BINS * probability)
        photons.path_index[i], photons.fan_bin[i] = index, fan_bin


@numba.njit(nogil=True, cache=True, error_model="numpy")
def emitted_density(y: float, fan: FanDistribution, beam: Float) -> float:
    """Density of photons towards Y over that of the laser's power; 0: none leave."""
    place = (fan_integral(y, beam) - fan.low) / (fan.high - fan.low) * FAN_BINS
    if place < 0.0 or place > FAN_BINS:
        return 0.0
    part = min(int(place), FAN_BINS - 1)
    return FAN_BINS * (fan.cumulative[part + 1] - fan.cumulative[part]) / (fan.high - fan.low)


def uniform_fan(low: float, high: float) -> FanDistribution:
    """Photons as dense as the laser's power, between two quantiles of it."""
    return FanDistribution(low, high, np.linspace(0.0, 1.0, FAN_BINS + 1))


def guided_fan(fan: FanDistribution, found: Float) -> FanDistribution:
    """Photons where the second moments `found` (FAN_BINS,) of contributions are large; a share stays uniform."""
    density = np.sqrt(found)
    density = 0.5 * density + 0.25 * (np.roll(density, 1) + np.roll(density, -1))
    if not density.sum() > 0.0:
        return fan
    density = (1.0 - UNIFORM_FRACTION) * density / density.sum() + UNIFORM_FRACTION / FAN_BINS
    cumulative = np.concatenate([[0.0], np.cumsum(density)])
    return fan._replace(cumulative=cumulative / cumulative[-1])


def visible_fan_range(world: World, laser: LineLaser, T_world_laser: Float) -> tuple[float, float, float]:
    """Quantiles of the power between which the sheet can hit something, and the part's middle distance, m."""
    local = transform_points(invert(T_world_laser), world.vertices)
    z = local[:, 2]
    if not np.any(z > 0.0):
        return 0.0, 0.0, 1.0
    edge = laser.tan_half_fan
    if np.any(z <= 1e-9):
        # something is beside or behind the laser: no bound by its corners
        low, high = -edge, edge
    else:
        y = local[:, 1] / z
        low, high = max(float(y.min()), -edge), min(float(y.max()), edge)
    beam = laser.packed()
    if low >= high:
        return 0.0, 0.0, 1.0
    return fan_integral(low, beam), fan_integral(high, beam), float(np.median(z[z > 0.0]))
