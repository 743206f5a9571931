"""`develop`, `extract`, `triangulate`, `compare`: each takes what the one before it gave, and needs nothing else."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from analysis.error import Errors
from analysis.line import extract as line_extraction
from analysis.line.result import Axis, Line
from analysis.line.settings import ExtractionSettings, Method
from analysis.report.units import micrometres
from analysis.triangulate import Points
from render.base.errors import InputError
from render.sensor.develop import Image
from render.sensor.sensor import Sensor
from studio.notebook.checks import check_laser, check_number, check_threads, check_whole, expect, extended
from studio.notebook.frame import LOAD, RENDER, RenderedFrame
from studio.project.project import MAX_SEED, Project
from studio.scan.line_extraction import extract_line
from studio.scan.redevelop import development, is_stale
from studio.scan.stages import compare_points, develop_laser, scaled, scaled_sensor, triangulate_line, validated

if TYPE_CHECKING:
    from matplotlib.figure import Figure

EXTRACT = "extract one: line = blazer.extract(image)"
TRIANGULATE = "triangulate a line: points = blazer.triangulate(line)"
DEVELOP = "develop one: image = blazer.develop(frame)"
SETTINGS = 'make some: blazer.ExtractionSettings(method="gaussian")'


@dataclass(frozen=True)
class DevelopedImage(Image):
    """An `Image` (`pixels` (h, w) DN, and what turns them into electrons) that knows its frame and its laser."""

    frame: RenderedFrame = field(kw_only=True)
    project: Project = field(kw_only=True)
    """As it was developed: with the sensor, the laser's power and the seed."""
    laser: int = field(kw_only=True)
    """Index of the laser that fired."""

    @property
    def electrons(self) -> NDArray[Any]:
        """(h, w) e-: (DN - black level) / gain. InputError: a photograph, which the camera has processed."""
        if self.processed:
            cure = "develop it with sensor.processing None"
            raise InputError("the numbers of a photograph are no electrons", where="electrons", cure=cure)
        return (self.pixels - self.black_level) / self.gain

    def show(self, line: Line | None = None) -> Figure:
        """A figure of the image, black level to saturation as the square root; with a line drawn over it if given.

        InputError: what is given is no line.
        """
        from studio.notebook.figures import image_figure

        return image_figure(self, line if line is None else expect(line, Line, "show: line", EXTRACT))

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return np.array(self.pixels, dtype=dtype, copy=copy)

    def __repr__(self) -> str:
        height, width = self.pixels.shape[:2]
        most = int(self.pixels.max())
        return f"<DevelopedImage {width} x {height} px, {self.bits} bit, laser {self.laser}, brightest {most} DN>"


@dataclass(frozen=True)
class ExtractedLine(Line):
    """A `Line` (`u`, `v`, `sigma_u`, `width`, `flag` (n, k): n scan lines, k peaks) that knows its image."""

    settings: ExtractionSettings = field(kw_only=True)
    image: DevelopedImage | None = field(default=None, kw_only=True)
    """None: it was found in a plain array."""

    @property
    def flags(self) -> NDArray[np.uint8]:
        """(n, k) codes of `blazer.Flag`: why a peak has no position, or what is to be minded of one."""
        return self.flag

    def __repr__(self) -> str:
        rows = int(np.count_nonzero(self.valid.any(axis=1)))
        return f"<ExtractedLine by {self.method}: found on {rows} of {len(self.u)} {self.axis}>"


@dataclass(frozen=True)
class TriangulatedPoints(Points):
    """`Points` (`camera`, `rig`, `world` (m, 3) m, `sigma_depth` (m,) m ...) that know their line and laser."""

    line: ExtractedLine = field(kw_only=True)
    laser: int = field(kw_only=True)

    def __repr__(self) -> str:
        return f"<TriangulatedPoints of laser {self.laser}: {int(np.count_nonzero(self.valid))} points>"


@dataclass(frozen=True)
class PointErrors(Errors):
    """`Errors` (`depth_z`, `surface`, `u`: bias, rmse, p95 ...; `completeness`; one error a point) and their points."""

    points: TriangulatedPoints = field(kw_only=True)

    def plot(self) -> Figure:
        """A figure of the depth error by scan line, and how it is spread."""
        from studio.notebook.figures import errors_figure

        return errors_figure(self)

    def __repr__(self) -> str:
        found = f"depth RMSE {micrometres(self.depth_z.rmse)}, bias {micrometres(self.depth_z.bias)}"
        return f"<PointErrors: {found}, {self.completeness:.1%} of the line measured>"


def develop(
    frame: RenderedFrame,
    *,
    laser: int = 0,
    project: Project | None = None,
    sensor: Sensor | None = None,
    power: float | None = None,
    seed: int | None = None,
    noise: bool = True,
    threads: int | None = None,
) -> DevelopedImage:
    """What the sensor takes of a frame while one laser fires: milliseconds, never a new render.

    laser: its index; the others are off. project: whose sensor, power of the lasers, lens of a pinhole, extraction and
    seed count in place of those of the frame's, at full image scale, as in the window's Develop panel. sensor: in place
    of the project's, as at full image scale. power: of this laser, W. seed: of shot, dark and read noise, in place of
    the project's. noise off: the mean, still quantised. The extraction's `exposures` are all taken; the shorter ones
    are `image.shorter`.

    InputError: no such laser, a number out of range, a frame without light, a project with other light than the frame.

    >>> import studio as blazer
    >>> frame = blazer.render(blazer.Project.load("plane"), image_scale=0.1)
    >>> image = blazer.develop(frame, power=0.01)
    >>> image.pixels.shape, str(image.pixels.dtype), image.saturation
    ((205, 245), 'uint16', 4095.0)
    """
    expect(frame, RenderedFrame, "develop: frame", RENDER)
    check_threads(threads)
    project = (
        frame.project if project is None else _developing(frame, expect(project, Project, "develop: project", LOAD))
    )
    check_laser(laser, project.scene)
    if sensor is not None:
        given = expect(sensor, Sensor, "develop: sensor", "blazer.Sensor(exposure_time=0.002)")
        project = project.model_copy(update={"sensor": scaled_sensor(given, frame.image_scale)})
    if power is not None:
        watts = check_number(power, "develop: power", 0.0, 1e4)
        project = _with_powers(project, {laser: watts})
    if seed is not None:
        project = project.model_copy(update={"seed": check_whole(seed, "develop: seed", 0, MAX_SEED)})
    frame.check()
    powers = [one.power for one in project.scene.lasers]
    # powers are told relative to what the frame holds
    rendered = _with_powers(project, {i: one.power for i, one in enumerate(frame.project.scene.lasers)})
    image = develop_laser(rendered, frame, laser, threads, powers, noise=noise)
    return extended(DevelopedImage, image, frame=frame, project=project, laser=laser)


def extract(
    image: DevelopedImage | NDArray[Any],
    *,
    method: Method | None = None,
    axis: Axis | None = None,
    peaks: int | None = None,
    settings: ExtractionSettings | None = None,
    threads: int | None = None,
) -> ExtractedLine:
    """The laser line in an image, each position with its standard deviation or the reason why there is none.

    image: what `develop` gave, or any array (h, w) or (h, w, 3) of uint8, uint16, float32 or float64, such as a
    photograph, whose noise is then estimated. method, axis, peaks: in place of those of the settings, which are the
    project's unless given. Gives `u`, `v`, `sigma_u`, `width`, `flags` (n, k), px.

    InputError: a method that does not exist, a setting out of range, an array that is no image.

    >>> import numpy as np, studio as blazer
    >>> u = np.arange(64.0)
    >>> photograph = np.tile(10 + 200 * np.exp(-0.5 * ((u - 30.25) / 1.5) ** 2), (16, 1)).astype(np.uint8)
    >>> line = blazer.extract(photograph, method="gaussian")
    >>> line.u.shape, bool(np.all(abs(line.u - 30.25) < 0.05))
    ((16, 1), True)
    """
    check_threads(threads)
    if settings is not None:
        expect(settings, ExtractionSettings, "extract: settings", SETTINGS)
    if isinstance(image, DevelopedImage):
        base = image.project.extraction if settings is None else settings
        chosen = line_extraction.settings_of(base, method=method, axis=axis, peaks=peaks)
        project = image.project.model_copy(update={"extraction": chosen})
        line = extract_line(project, image, image.laser, threads)
        if chosen.spacetime:
            note = "; ".join(filter(None, (line.note, "not along time, which takes a whole scan")))
            line = replace(line, note=note)
        return extended(ExtractedLine, line, settings=chosen, image=image)
    if not hasattr(image, "__array__"):
        expect(image, np.ndarray, "extract: image", DEVELOP)
    chosen = line_extraction.settings_of(settings, method=method, axis=axis, peaks=peaks)
    line = line_extraction.extract(np.asarray(image), settings=chosen, threads=threads)
    return extended(ExtractedLine, line, settings=chosen)


def triangulate(line: ExtractedLine, *, project: Project | None = None, laser: int | None = None) -> TriangulatedPoints:
    """The point of each position: where the pixel's ray meets the plane of the laser.

    project, laser: camera and laser of another rig, or those of a line that was found in a plain array (laser: the
    first unless given). For camera and plane as plain numbers there is `analysis.triangulate.triangulate`.
    Gives `camera`, `rig`, `world` (m, 3) m, and `sigma_depth` (m,) m.

    InputError: a line of a plain array without a project, a camera of another size, a laser plane through the camera.

    >>> import studio as blazer
    >>> frame = blazer.render(blazer.Project.load("plane"), image_scale=0.1)
    >>> points = blazer.triangulate(blazer.extract(blazer.develop(frame)))
    >>> points.world.shape == (len(points.depth_z), 3), points.flag.max()
    (True, np.uint8(0))
    """
    expect(line, ExtractedLine, "triangulate: line", EXTRACT)
    image, step = line.image, 0
    if project is not None:
        expect(project, Project, "triangulate: project", LOAD)
    if image is not None:
        step = image.frame.step
        scale = image.frame.image_scale
        given = image.project if project is None else validated(scaled(project, scale), f"at image scale {scale:g}")
    elif project is not None:
        given = project
    else:
        raise InputError(
            "the line was found in a plain array, which does not tell the camera and the laser",
            where="triangulate: line",
            cure="say which: blazer.triangulate(line, project=project, laser=0)",
        )
    which = check_laser((image.laser if image is not None else 0) if laser is None else laser, given.scene)
    camera = given.scene.camera
    across = camera.height if line.axis == "rows" else camera.width
    if len(line.u) != across:
        what = "the image of the line is of another size than the project's"
        found, allowed = f"{len(line.u)} {line.axis}", f"{across}, as the camera has"
        raise InputError(what, where="triangulate: project", found=found, allowed=allowed)
    return extended(TriangulatedPoints, triangulate_line(given, line, which, step), line=line, laser=which)


def compare(points: TriangulatedPoints, frame: RenderedFrame) -> PointErrors:
    """The error of every point against the exact line and the surface of a frame; measured minus true.

    Gives `depth_z`, `surface` (m) and `u` (px), each with `bias`, `rmse`, `robust_sigma`, `p95`; `completeness` 0 to 1;
    `depth`, `distance`, `position` (m,) one value a point, NaN where no truth is matched.

    InputError: the frame is of another size, step or scan axis than the points, or has no such laser.

    >>> import studio as blazer
    >>> frame = blazer.render(blazer.Project.load("plane"), image_scale=0.1)
    >>> points = blazer.triangulate(blazer.extract(blazer.develop(frame)))
    >>> errors = blazer.compare(points, frame)
    >>> errors.depth_z.rmse < 1e-3, errors.completeness
    (True, 1.0)
    """
    expect(points, TriangulatedPoints, "compare: points", TRIANGULATE)
    expect(frame, RenderedFrame, "compare: frame", RENDER)
    laser = check_laser(points.laser, frame.project.scene)
    line, image = points.line, points.line.image
    height, width = frame.shape
    across = height if line.axis == "rows" else width
    if len(line.u) != across:
        raise InputError(
            "the points are of an image of another size",
            where="compare: frame",
            found=f"{across} {line.axis}",
            allowed=f"{len(line.u)}, as the line has",
            cure="compare with the frame that the image was developed from",
        )
    if image is not None and image.frame.step != frame.step:
        raise InputError(
            "the points are of another step",
            where="compare: frame",
            found=f"step {frame.step}",
            allowed=f"step {image.frame.step}",
        )
    found = compare_points(frame.project, frame, frame.world, points, line, laser)
    return extended(PointErrors, found, points=points)


def _developing(frame: RenderedFrame, now: Project) -> Project:
    """How a project develops a frame. InputError: its light is another."""
    if is_stale(frame.project, scaled(now, frame.image_scale)):
        raise InputError(
            "the project has other light than the frame",
            where="develop: project",
            found="a change that sensor, power and lens cannot show",
            allowed="other sensor, power of a laser that was on, lens of a pinhole, extraction, calibration, seed",
            cure="render it: frame = blazer.render(project)",
        )
    return development(frame.project, now, frame.image_scale).powered


def _with_powers(project: Project, watts: dict[int, float]) -> Project:
    """watts: of the lasers by their index."""
    scene = project.scene
    lasers = tuple(one.model_copy(update={"power": watts.get(i, one.power)}) for i, one in enumerate(scene.lasers))
    rig = scene.rig.model_copy(update={"lasers": lasers})
    return project.model_copy(update={"scene": scene.model_copy(update={"rig": rig})})
