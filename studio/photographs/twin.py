"""A twin of a real scanner: the sheet, blur, halo and noise of a project, fitted to what photographs show.

    profile     (1 - halo) G(sqrt(a S + B + ...)) + halo G(halo_sigma), each integrated over the pixel
    width^2     a S_k + B + defocus^2 + sigma_u^2 of the stretch k of line, S_k that of the project's sheet there, px^2
    noise       variance = gain (mean - black level) + R + (c light)^2 + 1/12, DN^2

The sheet's a and the blur's B are told apart only where S_k changes along the line: by depth, or by slant. Elsewhere
the blur is the project's and the sheet takes what is left. The surface is the project's, or, where the line is not
where the project has it, taken to face the laser. All Gaussians, as in the sensor's own model
(`render/sensor/blur.py`); noise after EMVA 1288.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.special import ive, ndtr

from analysis.line.result import Line
from render.base.arrays import Float
from render.base.errors import InputError
from render.frame import LaserCurve
from render.sensor.blur import disc_diameter
from studio.photographs.line_profile import BIN, Profile, Stretch, Transfer, mean_profile, stretch_of, transfer_of
from studio.preview.estimates import line_width_px
from studio.preview.inspection import facets
from studio.project.project import Project

STRETCHES, ROWS = 8, 64
"""Stretches of line by the sheet's width, and scan lines below which there are fewer."""
WIDEST = 1e4
"""Of the variance of the project's sheet, the most that is believed."""
SHORTEST = 16
"""Bins of a profile below which no width is fitted."""
HALF, WIDER = 40, 8.0
"""px of a window to either side of the line, at least, and widths of the line."""
TOLD = 0.1
"""Relative sigma of the sheet's width and the blur above which the photographs do not tell them apart."""
VARIED = 0.1
"""Change of the sheet's variance along the line, below which only the shape of a Gaussian's pixels would part them."""
SURE = 3.0
"""Sigmas from which a halo, a scatter of the light, or a likeness of neighbours is there."""
NEAR = 3.0
"""px between the line and the project's within which it is the project's surface."""
LAG = 8
"""Scan lines to either side between which the line's direction on the surface is taken."""


@dataclass(frozen=True)
class Told:
    """A number with its standard deviation; `why` where the photographs do not tell it, and it is the project's."""

    value: float
    sigma: float
    why: str = ""


@dataclass(frozen=True)
class Twin:
    """What was fitted. Widths in px of the image, levels in electrons; scale: of the sheet's width in the project."""

    scale: Told
    sheet_px: Told
    blur_px: Told
    halo: Told
    halo_px: Told
    gain: Told
    """DN/e-."""
    read_noise: Told
    scatter: Told
    """Of the light itself, relative: speckle and PRNU."""
    alike: Told
    """Correlation of the noise of neighbouring scan lines."""
    saturation: Told
    """DN."""
    ambient: Told
    peak: Told
    """Of the laser alone, in the brightest pixel of a scan line, median."""
    scan_lines: int


@dataclass(frozen=True)
class Seen:
    """All stretches of the photographs."""

    stretches: list[Stretch]
    sheet: list[Float]
    """(n,) sigma of the project's sheet for every scan line of a stretch, px."""
    known: list[Float]
    """(n,) px^2: variance of defocus by depth."""
    width: float
    saturation: float | None
    """DN; None: nothing is saturated."""
    facing: bool
    """The surface is not the project's and was taken to face the laser."""


def look(
    project: Project,
    laser: int,
    images: Sequence[NDArray[np.generic]],
    lines: Sequence[Line],
    curves: Sequence[LaserCurve],
) -> Seen:
    """Images (h, w) DN, their lines and the project's own -> what is fitted.

    InputError: too few scan lines that are not saturated.
    """
    full = float(2**project.sensor.bits - 1)
    tops = [float(image.max()) for image in images]
    saturated = max(tops) if sum(int((image == max(tops)).sum()) for image in images) >= ROWS // 2 else None
    widths = np.concatenate([line.width[line.valid] for line in lines])
    width = float(np.median(widths[np.isfinite(widths)])) if np.isfinite(widths).any() else 1.0
    half = int(np.ceil(max(HALF, WIDER * width)))
    limit = saturated if saturated is not None else full
    stretches, sheets, known, facing = [], [], [], False
    for image, line, curve in zip(images, lines, curves, strict=True):
        one = stretch_of(image, line, half, limit)
        if len(one.row) <= 2 * LAG:
            continue
        normal = _normals(project, laser, line, one.row, curve)
        facing |= normal is None
        sheet, blur = _expected(project, laser, line, one.row, normal)
        good = np.isfinite(sheet) & np.isfinite(blur)
        if not good.any():
            continue
        stretches.append(Stretch(one.values[good], one.distance[good], one.sigma_u[good], one.row[good]))
        sheets.append(sheet[good])
        known.append(blur[good])
    count = sum(len(one.row) for one in stretches)
    if count < ROWS:
        raise InputError(
            "too little of the line can be compared",
            found=f"{count} scan lines that are measured, not saturated and {half} px from the image's edge",
            allowed=f"{ROWS} or more",
            cure="expose less, or add photographs",
        )
    return Seen(stretches, sheets, known, width, saturated, facing)


def _normals(project: Project, laser: int, line: Line, rows: NDArray[np.intp], curve: LaserCurve) -> Float | None:
    """(n, 3) normals of the project's surface along the line; None: the line is not where the project has it."""
    index, first = np.unique(curve.index, return_index=True)
    if len(index) < 2:
        return None
    off = np.interp(rows, index, curve.position[first], np.nan, np.nan) - line.u[rows, 0]
    if not np.nanmedian(np.append(np.abs(off), np.nan)) <= NEAR or np.isfinite(off).mean() < 0.5:
        return None
    normal = facets(curve, project.scene.T_camera_laser(laser)[:3, 3])[first]
    nearest = np.clip(np.searchsorted(index, rows), 0, len(index) - 1)
    return np.where((np.abs(off) <= NEAR)[:, None], normal[nearest], np.nan)


def _expected(
    project: Project, laser: int, line: Line, rows: NDArray[np.intp], normal: Float | None
) -> tuple[Float, Float]:
    """(n,) sigma of the project's sheet in the image, px, and variance of defocus by depth, px^2.

    normal: (n, 3) of the surface; None: it faces the laser.
    """
    scene, camera = project.scene, project.scene.camera
    u = line.u[rows, 0]
    pixels = np.stack([u, rows] if line.axis == "rows" else [rows, u], axis=1).astype(np.float64)
    rays, _ = camera.rays(pixels)
    plane = scene.laser_plane(laser)
    with np.errstate(divide="ignore", invalid="ignore"):
        point = rays * (-plane[3] / (rays @ plane[:3]))[:, None]
    T_camera_laser = scene.T_camera_laser(laser)
    if normal is None:
        at = np.arange(len(rows))
        along = point[np.minimum(at + LAG, len(at) - 1)] - point[np.maximum(at - LAG, 0)]
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        facing = T_camera_laser[:3, 3] - point
        normal = facing - np.einsum("ij,ij->i", facing, along)[:, None] * along
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    sheet = line_width_px(camera, scene.lasers[laser], T_camera_laser, normal, point, pixels, line.axis == "rows")
    blurred = project.sensor.defocus_by(camera.lens.model) != "nothing"
    disc = disc_diameter(camera, point[:, 2:].astype(np.float32))[:, 0] if blurred else np.zeros(len(rows))
    return sheet, disc**2 / 16.0


def fitted(project: Project, seen: Seen) -> Twin:
    """The twin's numbers. InputError: a line narrower than the project's blur, or no noise to be seen."""
    pitch = project.scene.camera.pixel_pitch
    profiles, sheet, known = _profiles(seen)
    shape, halo, halo_px = _fit_profiles(project, profiles, sheet, known, pitch)
    scale, blur_px = shape
    sensor = project.sensor
    transfer = _transfer(seen, scale.value, blur_px.value, sensor.black_level)
    gain, read_noise, scatter = _noise(transfer, project)
    usual = float(np.median(np.concatenate(seen.sheet)))
    ground = np.concatenate([np.median(one.values[:, [0, 1, -2, -1]], axis=1) for one in seen.stretches])
    peak = np.concatenate([one.values.max(axis=1) for one in seen.stretches]) - ground
    ambient = max(float(np.median(ground)) - sensor.black_level, 0.0) / gain.value
    relative, count = gain.sigma / gain.value, len(peak)
    alike = 0.0 if transfer is None else transfer.alike
    none = "no number is shared by so many pixels: nothing is saturated"
    return Twin(
        scale,
        Told(scale.value * usual, scale.sigma * usual, scale.why),
        blur_px,
        halo,
        halo_px,
        gain,
        read_noise,
        scatter,
        Told(alike, np.nan if transfer is None else transfer.alike_sigma),
        Told(2.0**sensor.bits - 1, 0.0, none) if seen.saturation is None else Told(seen.saturation, 0.0),
        Told(ambient, ambient * relative),
        Told(float(np.median(peak)) / gain.value, float(np.median(peak)) / gain.value * relative),
        count,
    )


def _profiles(seen: Seen) -> tuple[list[Profile], Float, Float]:
    """Mean profiles of stretches whose sheet is about as wide, (k,) mean square of that width, and known px^2."""
    values = np.concatenate([one.values for one in seen.stretches])
    whole = Stretch(
        values,
        np.concatenate([one.distance for one in seen.stretches]),
        np.concatenate([one.sigma_u for one in seen.stretches]),
        np.arange(len(values)),
    )
    sheet, known = np.concatenate(seen.sheet), np.concatenate(seen.known)
    parts = np.array_split(np.argsort(sheet, kind="stable"), max(1, min(STRETCHES, len(sheet) // ROWS)))
    profiles = [mean_profile(whole, part, seen.width) for part in parts]
    if any(len(one.value) < SHORTEST or not one.value.max() > 0.0 for one in profiles):
        raise InputError(
            "the line's profile cannot be told",
            found=f"{len(values)} scan lines",
            cure="add photographs, or expose longer",
        )
    added = np.nan_to_num(whole.sigma_u) ** 2 + known + BIN**2 / 12.0
    return profiles, np.array([np.mean(sheet[k] ** 2) for k in parts]), np.array([np.mean(added[k]) for k in parts])


def pixel_gaussian(distance: Float, sigma: Float | float) -> Float:
    """Share of a line of unit light, a Gaussian of `sigma` px, in a pixel so far from its middle."""
    return np.asarray(ndtr((distance + 0.5) / sigma) - ndtr((distance - 0.5) / sigma))


def blurred_line(distance: Float, sigma: Float | float, blur: float) -> Float:
    """The same through the sensor's blur (px^2), which acts on pixels (Lindeberg's discrete Gaussian)."""
    reach = int(np.ceil(5.0 * np.sqrt(blur) + 3.0))
    taps = ive(np.abs(np.arange(-reach, reach + 1)), blur)
    return np.asarray(sum(tap * pixel_gaussian(distance - k + reach, sigma) for k, tap in enumerate(taps)))


def _fit_profiles(
    project: Project, profiles: list[Profile], sheet: Float, known: Float, pitch: float
) -> tuple[tuple[Told, Told], Told, Told]:
    """(scale of the sheet, blur px), halo, halo px: by least squares on all profiles at once."""
    blur, halo, halo_px = project.sensor.blur_sigma / pitch, project.sensor.halo, project.sensor.halo_sigma / pitch

    def left(p: Float) -> Float:
        found = []
        for one, s, k in zip(profiles, sheet, known, strict=True):
            sharp = p[0] * s + k
            core = blurred_line(one.distance, np.sqrt(sharp), p[1])
            wide = pixel_gaussian(one.distance, np.sqrt(sharp + p[3] ** 2))
            basis = np.stack([(1.0 - p[2]) * core + p[2] * wide, np.ones_like(core)], axis=1)
            basis, value = basis / one.sigma[:, None], one.value / one.sigma
            found.append(value - basis @ np.linalg.lstsq(basis, value, rcond=None)[0])
        return np.concatenate(found)

    width = np.sqrt(max(float(np.mean(sheet)), 1e-6))
    start = np.array([1.0, blur**2, halo, max(halo_px, 2.0 * np.hypot(width, blur))])
    narrowest = max(1.5 * np.sqrt(_variance(profiles)), 1.5)  # a narrower halo would be the line itself
    low, high = np.array([1e-6, 0.0, 0.0, narrowest]), np.array([1e6, 1e4, 0.5, max(HALF / 2.0, 2.0 * narrowest)])
    start = np.clip(start, low + 1e-9, high)

    def solved(free: list[int]) -> tuple[Float, Float, float]:
        def some(q: Float) -> Float:
            p = start.copy()
            p[free] = q
            return left(p)

        done = least_squares(some, start[free], bounds=(low[free], high[free]), x_scale="jac")
        excess = 2.0 * done.cost / max(len(done.fun) - len(free) - 2 * len(profiles), 1)
        covariance = np.linalg.pinv(done.jac.T @ done.jac) * max(excess, 1.0)
        p, sigma = start.copy(), np.zeros(4)
        p[free], sigma[free] = done.x, np.sqrt(np.diag(covariance))
        return p, sigma, 2.0 * done.cost / max(excess, 1.0)

    p, sigma, _ = solved([0, 1, 2, 3])
    haloed = p[2] > SURE * sigma[2] and sigma[3] < 0.5 * p[3]
    varied = float(np.ptp(sheet)) > VARIED * float(np.mean(sheet))
    apart = varied and sigma[0] < 2.0 * TOLD * p[0] and sigma[1] < 2.0 * TOLD * max(p[1], 0.25)
    if not (haloed and apart):
        start[2:] = (p[2], p[3]) if haloed else (0.0, start[3])
        p, sigma, _ = solved(([0, 1] if apart else [0]) + ([2, 3] if haloed else []))
    if p[0] < 1e-4:
        raise InputError(
            "the line is narrower than the project's lens blur alone",
            where="sensor.blur_sigma",
            found=f"{blur:.3g} px of blur",
            cure="lower it in the project",
        )
    if p[0] > WIDEST or sigma[0] > p[0]:
        raise InputError(
            "the width of the line cannot be told by the project's sheet",
            found=f"{np.sqrt(p[0]):.3g} times as wide as the project's",
            cure="see that the photographs are of this project's scanner, from where it stands",
        )
    scale = Told(float(np.sqrt(p[0])), float(0.5 * sigma[0] / np.sqrt(p[0])))
    why = "" if apart else "the sheet is about as wide everywhere: the two cannot be told apart"
    spread = float(np.sqrt(p[1]))
    halo_why = "" if haloed else "no halo stands out"
    return (
        (scale, Told(spread, 0.0 if why else float(0.5 * sigma[1] / max(spread, 1e-3)), why)),
        Told(float(p[2]), float(sigma[2]), halo_why),
        Told(float(p[3]) if haloed else halo_px, float(sigma[3]), halo_why),
    )


def _variance(profiles: list[Profile]) -> float:
    """Of the line, px^2, by the half height of its profiles."""
    widths = []
    for one in profiles:
        above = one.distance[one.value > 0.5 * one.value.max()]
        widths.append((above.max() - above.min()) / 2.355)
    return float(np.median(widths)) ** 2


def _transfer(seen: Seen, scale: float, blur: float, black: float) -> Transfer | None:
    """The noise of the stretch with the most scan lines... of all, one below the other."""
    values = np.concatenate([one.values for one in seen.stretches])
    distance = np.concatenate([one.distance for one in seen.stretches])
    sigma = np.sqrt((scale * np.concatenate(seen.sheet)) ** 2 + np.concatenate(seen.known))[:, None]
    shape = blurred_line(distance, sigma, blur**2)
    slope = 5.0 * (blurred_line(distance + 0.1, sigma, blur**2) - blurred_line(distance - 0.1, sigma, blur**2))
    step = 10 * max(int(one.row.max()) for one in seen.stretches) + 10
    row = np.concatenate([one.row + k * step for k, one in enumerate(seen.stretches)])
    whole = Stretch(values, distance, np.concatenate([one.sigma_u for one in seen.stretches]), row)
    return transfer_of(whole, shape, slope, seen.width, 0.0)


def _noise(transfer: Transfer | None, project: Project) -> tuple[Told, Told, Told]:
    """Gain, read noise and the light's own scatter."""
    sensor, k = project.sensor, project.sensor.dn_per_electron
    if transfer is None:
        why = "too few pixels above the lowest number"
        return Told(k, 0.0, why), Told(sensor.read_noise, 0.0, why), Told(sensor.prnu, 0.0, why)
    level = np.maximum(transfer.mean - sensor.black_level, 0.0)
    basis = np.stack([level, np.ones_like(level), transfer.light**2], axis=1) / transfer.sigma[:, None]
    value = (transfer.variance - 1.0 / 12.0) / transfer.sigma

    def solved(free: list[int]) -> tuple[Float, Float]:
        some = basis[:, free]
        done = least_squares(lambda p: some @ p - value, np.full(len(free), 1e-6), bounds=(0.0, np.inf), x_scale="jac")
        excess = max(2.0 * done.cost / max(len(value) - len(free), 1), 1.0)
        p, sigma = np.zeros(3), np.zeros(3)
        p[free], sigma[free] = done.x, np.sqrt(np.diag(np.linalg.pinv(some.T @ some)) * excess)
        return p, sigma

    p, sigma = solved([0, 1, 2])
    scattered = p[2] >= SURE * sigma[2]
    if not scattered:
        value = value - sensor.prnu**2 * basis[:, 2]
        p, sigma = solved([0, 1])
    if p[0] <= SURE * sigma[0]:
        raise InputError(
            "the noise does not grow with the light: these are not a sensor's own numbers",
            found=f"gain {p[0]:.3g} +- {sigma[0]:.3g} DN/e-",
            cure="give raw images without compression, denoising or a tone curve",
        )
    read = float(np.sqrt(p[1]) / p[0])
    scatter = float(np.sqrt(p[2]))
    return (
        Told(float(p[0]), float(sigma[0])),
        Told(read, float(0.5 * sigma[1] / max(np.sqrt(p[1]), 1e-9) / p[0]))
        if p[1] > 0.5 * sigma[1]
        else Told(sensor.read_noise, 0.0, "too little beside that of the light"),
        Told(scatter, float(0.5 * sigma[2] / scatter))
        if scattered
        else Told(sensor.prnu, 0.0, "too little beside that of counting"),
    )
