"""The report on points from photographs: no truth, so residuals to a fitted shape, noise, coverage, and pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import cv2
import numpy as np

from analysis.cloud import at_first_step
from analysis.line.result import Flag
from analysis.report.colour import ACCENT, MUTED
from analysis.report.page import page_of
from analysis.report.style import figure, image_uri, plain, png_uri, short
from analysis.report.units import NONE, count, micrometres, percent
from analysis.report.write import write_pdf
from analysis.triangulate import Points
from render.base.arrays import Float
from render.base.files import atomic_write
from studio.photographs.fitted_shapes import STRAY, Fit, fit_flat, fit_round
from studio.photographs.overlay import draw_overlay
from studio.photographs.photograph_set import Look
from studio.photographs.photographs import Measured
from studio.project.found_motion import measured_pose
from studio.project.project import Project

Shape = Literal["plane", "sphere"]

PICTURES, CURVES = 4, 6
"""Photographs that are shown; the first and the last are."""
PICTURE_SIDE = 1100
"""px"""
UNTRUE, UNFIT = 1.3, 0.05
"""Residual over sigma, and share of strays, above which a remark says so."""
COLUMNS = (
    "found",
    "coverage",
    "sigma, px",
    "width, px",
    "residual",
    "over sigma",
    "strays",
    "gain, DN/e-",
    "dark noise, e-",
)


@dataclass(frozen=True)
class PhotographReport:
    """What the page is made of: one entry for each photograph."""

    project: Project
    laser: int
    look: Look
    names: list[str]
    measured: list[Measured]
    points: list[Points]
    shape: Shape = "plane"


def write_photograph_report(html: Path, pdf: Path, report: PhotographReport) -> list[dict[str, Any]]:
    """Write the page, whole in itself, and the same as PDF; returns the fits for programs."""
    singles = [_single(one, report) for one in report.points]
    whole = _whole(report)
    page = page_of(Path(__file__).parent / "photograph_report.html", _content(report, singles, whole))
    with atomic_write(html) as temporary:
        temporary.write_text(page, encoding="utf-8")
    with atomic_write(pdf) as temporary:
        write_pdf(page, temporary)
    return _fits(report, singles, whole)


def _names(report: PhotographReport) -> tuple[str, str]:
    return ("straight line", "plane") if report.shape == "plane" else ("circle", "sphere")


def _basis(report: PhotographReport) -> Float:
    """(3, 2) two directions of the laser's plane in the camera frame."""
    normal = report.project.scene.laser_plane(report.laser)[:3]
    return np.asarray(np.linalg.svd(normal[None, :])[2][1:].T)


def _single(points: Points, report: PhotographReport) -> tuple[Fit, float] | None:
    """Fit in the laser's plane, which holds all points of a photograph, and residual over sigma."""
    basis, valid = _basis(report), points.valid
    fit = (fit_flat if report.shape == "plane" else fit_round)(points.camera[valid] @ basis)
    if fit is None:
        return None
    error = (points.gradient * points.sigma_pixel[:, None])[valid] @ basis
    return fit, fit.normalised(error)


def _whole(report: PhotographReport) -> tuple[Fit, float] | None:
    """Fit to the points of all photographs on the part as it was in the first; None: one photograph, or no such fit."""
    if len(report.points) < 2:
        return None
    scene = report.project.scene
    places, errors = [], []
    for step, one in enumerate(report.points):
        valid = one.valid
        start = at_first_step(one.world, scene, step)[valid]
        # a difference moves with the part: the error's direction, carried along by a second point
        turn = measured_pose(scene, report.project.calibration.motion, step)[:3, :3]
        tip = one.world + (one.gradient * one.sigma_pixel[:, None]) @ turn.T
        places.append(start)
        errors.append(at_first_step(tip, scene, step)[valid] - start)
    fit = (fit_flat if report.shape == "plane" else fit_round)(np.concatenate(places))
    return None if fit is None else (fit, fit.normalised(np.concatenate(errors)))


def _fits(
    report: PhotographReport, singles: Sequence[tuple[Fit, float] | None], whole: tuple[Fit, float] | None
) -> list[dict[str, Any]]:
    one, all_of_them = _names(report)
    found = []
    for name, what, fit in [
        *((name, one, single) for name, single in zip(report.names, singles, strict=True)),
        ("all photographs", all_of_them, whole),
    ]:
        if fit is None:
            continue
        text = f"{name}: {micrometres(fit[0].rms)} RMS from a fitted {what}"
        ratio = fit[1] if np.isfinite(fit[1]) else None
        if ratio is not None:  # some methods tell no sigma
            text += f", {ratio:.2f} times sigma"
        text += f", {percent(fit[0].strays)} strays"
        radius = None if np.isnan(fit[0].radius) else fit[0].radius
        if radius is not None:
            text += f", radius {radius * 1e3:.3f} mm"
        row = {"of": name, "shape": what, "rms_m": fit[0].rms, "over_sigma": ratio, "strays": fit[0].strays}
        found.append(row | {"radius_m": radius, "text": text})
    return found


def _content(
    report: PhotographReport, singles: Sequence[tuple[Fit, float] | None], whole: tuple[Fit, float] | None
) -> dict[str, Any]:
    lines = [one.line for one in report.measured]
    found, total = sum(int(line.valid[:, 0].sum()) for line in lines), sum(len(line.u) for line in lines)
    sigma = np.concatenate([line.sigma_u[line.valid] for line in lines])
    known = [one for one in singles if one is not None]
    axis = report.look.settings.axis
    one, all_of_them = _names(report)
    fitted = ""
    if whole is not None:
        fitted = f" They lie {micrometres(whole[0].rms)} RMS from a fitted {all_of_them}."
    elif known:
        fitted = f" They lie {micrometres(known[0][0].rms)} RMS from a fitted {one}."
    tiles = [
        ("Coverage", percent(found / max(total, 1)), f"{count(found)} of {count(total)} {axis}"),
        ("Sigma in the image", f"{np.median(sigma):.3f} px" if len(sigma) else NONE, "typical, as each fit says"),
    ]
    if known:
        residual, ratio = np.median([fit.rms for fit, _ in known]), np.median([ratio for _, ratio in known])
        tiles.append(("Residual", micrometres(float(residual)), f"RMS from a {one}, each photograph"))
        tiles.append(("Residual over sigma", f"{ratio:.2f}", "1 where sigma is true"))
    if whole is not None:
        tiles.append((f"From one {all_of_them}", micrometres(whole[0].rms), "RMS, all photographs"))
    flags, counts = np.unique(np.concatenate([line.flag[~line.valid[:, 0], 0] for line in lines]), return_counts=True)
    return {
        "title": plain(report.project.name),
        "facts": f"{len(lines)} photograph{'s' if len(lines) > 1 else ''} · no truth: nothing here is an error",
        "headline": f"{count(found)} points on {percent(found / max(total, 1))} of the {axis}.{fitted}",
        "tiles": tiles,
        "remarks": [*report.look.warnings, *_remarks(report, singles, whole)] or ["Nothing unusual."],
        "chosen": report.look.told,
        "columns": COLUMNS,
        "rows": [_row(report, k, single) for k, single in enumerate(singles)],
        "one": one,
        "stray": f"{STRAY:g}",
        "residuals": _residual_figure(report, singles) if known else None,
        "pictures": [(plain(report.names[k]), _picture(report.measured[k])) for k in _spread(len(lines), PICTURES)],
        "reasons": [
            (Flag(int(flag)).name.lower().replace("_", " "), count(int(number)))
            for flag, number in zip(flags, counts, strict=True)
        ],
    }


def _remarks(
    report: PhotographReport, singles: Sequence[tuple[Fit, float] | None], whole: tuple[Fit, float] | None
) -> list[str]:
    found = []
    ratios = [one[1] for one in singles if one is not None and np.isfinite(one[1])]
    if ratios and np.median(ratios) > UNTRUE:
        found.append(
            f"The points lie {np.median(ratios):.1f} times farther from the fitted {_names(report)[0]} than their "
            "sigmas say: the surface is not of that shape, the calibration bends it, or the noise of the image is "
            "underestimated."
        )
    if whole is not None and whole[1] > UNTRUE:
        found.append(
            f"All photographs together lie {whole[1]:.3g} times farther from one {_names(report)[1]} than their sigmas "
            "say: the part is not of that shape, or did not move as the project says."
        )
    shares = [one[0].strays for one in singles if one is not None]
    if shares and np.median(shares) > UNFIT:
        found.append(
            f"{percent(float(np.median(shares)))} of the points of a photograph lie beside its {_names(report)[0]}: "
            "what is told of the residuals is told of the others alone."
        )
    for name, one in zip(report.names, report.measured, strict=True):
        line = one.line
        saturated = float(np.mean(line.flag[line.valid] == Flag.SATURATED)) if line.valid.any() else 0.0
        if not line.valid.any():
            found.append(f"{name}: no line was found.")
        elif saturated > 0.5:
            found.append(f"{name}: the line is saturated on {percent(saturated, 0)} of its points; expose less.")
    return found


def _row(report: PhotographReport, k: int, single: tuple[Fit, float] | None) -> tuple[str, list[str]]:
    line, noise = report.measured[k].line, report.measured[k].noise
    there = line.valid[:, 0]

    def typical(values: Float) -> str:
        known = values[there, 0][np.isfinite(values[there, 0])]
        return f"{np.median(known):.3f}" if len(known) else NONE

    fitted = [NONE] * 3
    if single is not None:
        fitted = [micrometres(single[0].rms), f"{single[1]:.2f}", percent(single[0].strays)]
    told = [NONE] * 2 if noise is None else [f"{noise.gain:.3g}", f"{noise.read_noise:.3g}"]
    cells = [count(int(there.sum())), percent(float(there.mean())), typical(line.sigma_u), typical(line.width)]
    return plain(short(report.names[k])), [*cells, *fitted, *told]


def _spread(number: int, most: int) -> list[int]:
    return [int(k) for k in np.unique(np.linspace(0, number - 1, min(number, most)).astype(int))]


def _picture(measured: Measured) -> str:
    drawn = draw_overlay(measured.image, measured.line)
    factor = PICTURE_SIDE / max(drawn.shape[:2])
    if factor < 1.0:
        drawn = cv2.resize(drawn, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
    return image_uri(np.ascontiguousarray(drawn[..., ::-1]))


def _residual_figure(report: PhotographReport, singles: Sequence[tuple[Fit, float] | None]) -> str:
    shown = [k for k in _spread(len(singles), CURVES) if singles[k] is not None]
    with figure(0.4 + 1.05 * max(len(shown), 1)) as made:
        axes = made.subplots(max(len(shown), 1), 1, sharex=True, squeeze=False)[:, 0]
        for k, plot in zip(shown, axes, strict=False):
            single = singles[k]
            assert single is not None
            index = report.points[k].index[report.points[k].valid]
            residual, inlier = single[0].residual * 1e6, np.asarray(single[0].inlier, bool)
            limit = 1.2 * max(float(np.max(np.abs(residual[inlier]))), 1e-6)
            plot.plot(index[~inlier], np.clip(residual[~inlier], -limit, limit), ".", color=MUTED, ms=2.5, alpha=0.5)
            plot.plot(index[inlier], residual[inlier], ".", color=ACCENT, ms=2.5)
            plot.set_ylim(-limit, limit)
            plot.set_ylabel("µm")
            plot.set_title(short(report.names[k]))
        axes[-1].set_xlabel(f"image {report.look.settings.axis.removesuffix('s')}")
        return png_uri(made)
