"""The report's section on the calibration that points were made with: what was found, how well, how far off it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.line.result import exact_line
from analysis.report.colour import DIVERGING
from analysis.report.style import figure, png_uri
from analysis.report.units import micrometres
from analysis.triangulate import CALIBRATION, triangulate
from render.base.arrays import Float
from render.camera.camera import Camera
from render.scene.scene import Scene

ACROSS, DOWN = 96, 64
"""Places of the image at which depth is told."""
NEARER, FARTHER = 0.9, 1.1
"""Of the points' depths: over so much of it the map is drawn."""
COLUMNS = ("", "found", "sigma", "true", "off by, in sigmas")
LENS = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4", "taux", "tauy")


MOTION: dict[str, tuple[tuple[str, float], ...]] = {
    "stage": tuple((f"way {axis}, mm for each mm told", 1.0) for axis in "xyz"),
    "turntable": (*((f"axis {axis}", 1.0) for axis in "xyz"), *((f"point {axis} mm", 1e3) for axis in "xyz")),
    "hand_eye": (*((f"turn {axis} mrad", 1e3) for axis in "xyz"), *((f"place {axis} mm", 1e3) for axis in "xyz")),
}
"""Of each kind of motion its values' names, and what they are multiplied by."""
CARRIED = {
    "stage": "The stage, by the objects' way in the camera's frame",
    "turntable": "The turntable, by its axis in the camera's frame and the point of it next to the camera",
    "hand_eye": "The robot's hand, by the camera's pose in it, or in its base where it holds the objects",
}


@dataclass(frozen=True)
class MotionFound:
    """What puts the points of a scan's steps together: its kind, and (n,) values, sigmas and the scene's, m and rad."""

    kind: str
    values: Float
    sigma: Float
    true: Float


@dataclass(frozen=True)
class FoundCalibration:
    """Camera, laser planes (4,) and their covariances, as `triangulate` has them, that points were made with."""

    camera: Camera
    planes: tuple[Float, ...]
    covariances: tuple[Float | None, ...]
    motion: MotionFound | None = None
    """None: the scene's."""


@dataclass(frozen=True)
class DepthMap:
    """Over (DOWN, ACROSS) places of the image, NaN outside the depths that were measured; m."""

    sigma: Float
    off: Float
    depth: tuple[float, float]
    size: tuple[int, int]


def parameter_rows(found: FoundCalibration, scene: Scene, laser: int) -> list[list[str]]:
    """Cells of `COLUMNS` for camera and plane of a laser; sigma and what follows from it "-" where it is exact."""
    camera, plane, true = found.camera, found.planes[laser], scene.laser_plane(laser)
    names = [*(f"{name} px" for name in CALIBRATION[:4]), "normal x", "normal y", "normal z", "distance mm"]
    values = [camera.fx, camera.fy, camera.cx, camera.cy, *plane[:3], -1e3 * plane[3]]
    truths = [getattr(scene.camera, name) for name in CALIBRATION[:4]] + [*true[:3], -1e3 * true[3]]
    terms = len(camera.distortion)
    lens = np.zeros(max(terms, len(LENS)))
    lens[: len(scene.camera.distortion)] = scene.camera.distortion
    names += LENS[:terms]
    values += camera.distortion
    truths += lens[:terms].tolist()
    covariance = found.covariances[laser]
    spread = np.zeros(len(values))
    if covariance is not None:
        spread[: len(covariance)] = np.sqrt(np.maximum(np.diag(covariance), 0.0))[: len(values)]
    spread[7] *= 1e3
    return [_row(*each) for each in zip(names, values, spread.tolist(), truths, strict=True)]


def motion_rows(found: MotionFound) -> list[list[str]]:
    """Cells of `COLUMNS` for what carried the objects, or the scanner."""
    each = zip(MOTION[found.kind], found.values, found.sigma, found.true, strict=True)
    return [_row(name, scale * value, scale * sigma, scale * truth) for (name, scale), value, sigma, truth in each]


def _row(name: str, value: float, sigma: float, truth: float) -> list[str]:
    digits = ".3f" if name.endswith("px") else ".6g"
    off = f"{(value - truth) / sigma:+.1f}" if sigma > 0.0 else "-"
    return [name, f"{value:{digits}}", f"{sigma:.2g}" if sigma > 0.0 else "-", f"{truth:{digits}}", off]


def depth_map(found: FoundCalibration, scene: Scene, laser: int, depths: Float) -> DepthMap | None:
    """Depth's sigma by the calibration and its true error, where the laser plane has the depths (m,) measured.

    None: nothing was measured.
    """
    if not len(depths):
        return None
    low, high = np.quantile(depths, [0.01, 0.99]) * [NEARER, FARTHER]  # of a few false points no map is drawn
    camera = found.camera
    u = np.linspace(0.0, camera.width - 1.0, ACROSS)
    v = np.rint(np.linspace(0.0, camera.height - 1.0, DOWN)).astype(int)
    place = np.full((camera.height, ACROSS), np.nan)
    place[v] = u
    line = exact_line("rows", place)
    sigma, depth = np.full((DOWN, ACROSS), np.nan), [np.full((DOWN, ACROSS), np.nan) for _ in range(2)]
    ways = ((camera, found.planes[laser], found.covariances[laser]), (scene.camera, scene.laser_plane(laser), None))
    for values, (lens, plane, covariance) in zip(depth, ways, strict=True):
        points = triangulate(
            line, lens, plane, T_rig_camera=np.eye(4), T_world_camera=np.eye(4), calibration_covariance=covariance
        )
        here = points.valid
        at = np.searchsorted(v, points.index[here]), points.rank[here]
        values[at] = points.depth_z[here]
        if covariance is not None:
            sigma[at] = points.sigma_depth_systematic[here]
    inside = (depth[0] > low) & (depth[0] < high)
    sigma, off = (np.where(inside, each, np.nan) for each in (sigma, depth[0] - depth[1]))
    return DepthMap(sigma, off, (float(low), float(high)), (camera.width, camera.height))


def sentence(one: DepthMap) -> str:
    """What the map says in words: told and true depth error, rms."""
    with np.errstate(invalid="ignore"):
        off = float(np.sqrt(np.nanmean(one.off**2))) if np.isfinite(one.off).any() else 0.0
        told = float(np.sqrt(np.nanmean(one.sigma**2))) if np.isfinite(one.sigma).any() else 0.0
    span = f"between {one.depth[0]:.3g} and {one.depth[1]:.3g} m"
    span = f"{span} depth is off by {micrometres(off)} rms by the calibration"
    return f"{span}; {micrometres(told)} were told." if told > 0.0 else f"{span}, of which it tells nothing."


def map_figure(one: DepthMap) -> str:
    """Left the sigma that the calibration tells over the image, right the true error."""
    with figure(2.7) as made:
        panels = made.subplots(1, 2, sharey=True)
        told = one.sigma if np.isfinite(one.sigma).any() else np.zeros_like(one.sigma)
        limit = 1e6 * max(float(np.nanmax(np.abs(one.off), initial=0.0)), float(np.nanmax(told, initial=0.0)), 1e-9)
        for axes, values, title in zip(
            panels, (told, one.off), ("Standard deviation told", "True error of depth"), strict=True
        ):
            span = {"vmin": 0.0, "vmax": limit} if values is told else {"vmin": -limit, "vmax": limit}
            drawn = axes.imshow(
                1e6 * values,
                cmap="Blues" if values is told else DIVERGING,
                extent=(-0.5, one.size[0] - 0.5, one.size[1] - 0.5, -0.5),
                interpolation="nearest",
                **span,
            )
            axes.set(title=title, xlabel="u (px)")
            axes.grid(False)
            made.colorbar(drawn, ax=axes, label="µm", shrink=0.8)
        panels[0].set(ylabel="v (px)")
        return png_uri(made)
