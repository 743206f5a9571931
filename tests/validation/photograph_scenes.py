"""Twelve photographs of webcams and phones whose line is known exactly, and how well `main.py extract` finds it.

python -m tests.validation.photograph_scenes FOLDER [NAME ...]     write them, measure them, print the table
"""

from __future__ import annotations

import csv
import json
import math
import sys
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
from click.testing import CliRunner
from scipy.spatial.transform import Rotation

from main import cli
from render.frame import Frame
from render.laser.laser import Divergence
from render.material.material import Coated
from render.run import Run
from render.scene.scene import Scene
from render.sensor.develop import develop, expected_electrons
from render.sensor.sensor import Sensor
from render.world.world import build_world
from studio.editing.presets import preset_named
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.scan.stages import Clock, render_step, scaled

SCALE = 0.25
"""Of the templates' 2448 x 2048 px."""
NEAR = 2.0
"""px, or the line's own sigma if that is more: farther off the truth a position is false."""
PEAK = 0.95
"""Quantile of the line's peaks that `level` speaks of."""
BESIDE = 64
"""px beside an image that a moved line may leave it by."""
MRAD_PER_PX = 2.4e-3
"""Full angle of a sheet whose line is 1 px in sigma, of the templates at `SCALE`."""


@dataclass(frozen=True)
class Trouble:
    """One photograph. `level`: peak of the line in its strongest colour over what saturates; `room`: mean ambient
    light in green over the same."""

    template: str
    sensor: str
    wavelength_nm: float
    level: float = 0.7
    room: float = 0.08
    sigma: float = 2.0
    """px of the line."""
    jpeg: int = 85
    lasers: int = 1
    roll: float = 0.0
    """rad of the sheet about its axis."""
    glossy: bool = False
    level_line: bool = False
    """The camera is turned, so that the line is level and crosses columns."""

    @property
    def colour(self) -> str:
        return "blue" if self.wavelength_nm < 490 else "green" if self.wavelength_nm < 590 else "red"


TROUBLES = {
    "room light": Trouble("plane", "webcam", 520, room=0.35),
    "white core": Trouble("plane", "webcam", 640, level=25.0),
    "wide hollow line": Trouble("sphere", "phone", 450, level=8.0, sigma=6.0),
    "two lines": Trouble("plane", "webcam", 520, lasers=2),
    "near vertical": Trouble("plane", "phone", 640, roll=math.radians(12)),
    "glossy": Trouble("v_groove", "webcam", 640, level=2.0, glossy=True),
    "steps": Trouble("step_block", "phone", 520, jpeg=93),
    "JPEG 70": Trouble("v_groove", "webcam", 640, jpeg=70),
    "JPEG 95": Trouble("sphere", "webcam", 450, jpeg=95),
    "level": Trouble("plane", "webcam", 520, level_line=True),
    "level steps": Trouble("step_block", "phone", 640, level=3.0, level_line=True),
    "faint": Trouble("v_groove", "phone", 450, level=0.12, room=0.03),
}


@dataclass(frozen=True)
class Photograph:
    """pixels (h, w, 3) RGB; truth: of each laser, (n, 2) scan line and place on it where the light's middle is, px."""

    pixels: np.ndarray
    truth: tuple[np.ndarray, ...]
    axis: str
    colour: str
    sigma: float


@dataclass(frozen=True)
class Score:
    """Shares of the truth's crossings that were found, of positions that are false and of right ones within 2 sigma.

    normalised: robust standard deviation of error over sigma."""

    found: float
    false: float
    within: float
    normalised: float
    axis: str
    colour: str | None
    """None: nothing was measured."""


@dataclass(frozen=True)
class Place:
    """Where the line is drawn: it is moved along its scan lines, and leans."""

    shift: float = 0.0
    """px, on the middle scan line."""
    slope: float = 0.0
    """px a scan line, more than rendered."""


def photograph(trouble: Trouble, seed: int = 1, place: Place | None = None) -> Photograph:
    """The image that the sensor takes of the rendered template."""
    project, frame = _rendered(trouble.template, trouble.sigma, trouble.lasers, trouble.roll, trouble.glossy)
    frame = frame if place is None else _moved(frame, place)
    scene, truth = project.scene, tuple(map(_middles, frame.curves))
    if trouble.level_line:
        scene, frame = _turned(scene, frame)
    lasers = tuple(laser.model_copy(update={"wavelength_nm": trouble.wavelength_nm}) for laser in scene.lasers)
    scene = scene.model_copy(update={"rig": scene.rig.model_copy(update={"lasers": lasers})})
    sensor = Sensor(**preset_named("sensors", trouble.sensor, "trouble").values["sensor"])
    how = sensor.processing.model_copy(update={"jpeg_quality": trouble.jpeg})
    sensor = sensor.model_copy(update={"processing": how, "speckle": "depolarised"})
    frame = _lit(scene, frame, sensor, trouble)
    pixels = develop(frame, scene, sensor, seed=seed).pixels
    axis = "columns" if trouble.level_line else "rows"
    return Photograph(pixels, truth, axis, trouble.colour, trouble.sigma)


@lru_cache
def _rendered(template: str, sigma: float, lasers: int, roll: float, glossy: bool) -> tuple[Project, Frame]:
    folder = template_folder(template)
    project = scaled(Project.load(folder / "project.json"), SCALE)
    scene = project.scene
    first = scene.lasers[0]
    turned = Rotation.from_rotvec(first.T_rig_laser.rotation) * Rotation.from_rotvec((0.0, 0.0, roll))
    pose = first.T_rig_laser.model_copy(update={"rotation": tuple(turned.as_rotvec())})
    sheet = Divergence(full_angle=MRAD_PER_PX * sigma)
    first = first.model_copy(update={"T_rig_laser": pose, "sheet": sheet})
    aside = pose.model_copy(update={"translation": (pose.translation[0] + 0.08, *pose.translation[1:])})
    second = first.model_copy(update={"name": "second", "T_rig_laser": aside})
    rig = scene.rig.model_copy(update={"lasers": (first, second)[:lasers]})
    objects = scene.objects
    if glossy:
        objects = (objects[0].model_copy(update={"material": Coated(roughness=0.15)}), *objects[1:])
    scene = scene.model_copy(update={"rig": rig, "objects": objects})
    render = project.render.model_copy(update={"truth_images": False, "transport": "direct"})
    project = project.model_copy(update={"scene": scene, "render": render})
    clock = Clock(lambda stage, done: None, lambda: False)
    frame = render_step(project, build_world(scene, folder, 0), 0, clock, Run(threads=2))
    return project, frame


def _moved(frame: Frame, place: Place) -> Frame:
    """The laser's light and truth elsewhere on their rows, exactly (Fourier), as light is smooth across the line."""
    height, width = frame.laser(0).shape
    shift = place.shift + place.slope * (np.arange(height) - 0.5 * height)
    turns = np.exp(-2j * np.pi * shift[:, None] * np.fft.rfftfreq(width + 2 * BESIDE))

    def move(light: np.ndarray) -> np.ndarray:
        spectrum = np.fft.rfft(np.pad(light.astype(np.float64), ((0, 0), (BESIDE, BESIDE))), axis=1)
        whole = np.fft.irfft(spectrum * turns, width + 2 * BESIDE, axis=1)
        return np.maximum(whole[:, BESIDE:-BESIDE], 0.0).astype(np.float32)

    direct = tuple(move(frame.laser(i)) for i in range(len(frame.laser_direct)))
    curves = tuple(
        replace(curve, position=curve.position + shift[np.asarray(curve.index, np.intp)]) for curve in frame.curves
    )
    return replace(frame, laser_direct=direct, laser_indirect=(), curves=curves)


def _middles(curve) -> np.ndarray:
    return np.stack([curve.index, curve.position + np.nan_to_num(curve.sheet_bias)], axis=1)


def _turned(scene: Scene, frame: Frame) -> tuple[Scene, Frame]:
    """The camera turned, so that rows are columns: the light alone, which is all that developing asks for."""
    camera = scene.camera
    values = {"width": camera.height, "height": camera.width, "fx": camera.fy, "fy": camera.fx}
    camera = camera.model_copy(update={**values, "cx": camera.cy, "cy": camera.cx})
    scene = scene.model_copy(update={"rig": scene.rig.model_copy(update={"camera": camera})})

    def turn(image: np.ndarray) -> np.ndarray:
        return np.ascontiguousarray(image.swapaxes(0, 1))

    direct = tuple(turn(frame.laser(i)) for i in range(len(scene.lasers)))
    ambient = None if frame.ambient is None else turn(frame.ambient)
    return scene, replace(frame, laser_direct=direct, laser_indirect=(), ambient=ambient)


def _lit(scene: Scene, frame: Frame, sensor: Sensor, trouble: Trouble) -> Frame:
    """The frame with laser and lamps as bright as they are asked for."""
    bare = sensor.model_copy(update={"halo": 0.0, "scatter": 0.0, "blur_sigma": 0.0, "dark_current": 0.0})
    dark = replace(frame, ambient=None)
    scan = 0 if trouble.level_line else 1
    peaks = expected_electrons(dark, scene, bare).max(axis=scan)
    laser = trouble.level * sensor.full_well / float(np.quantile(peaks[peaks > 0.0], PEAK))
    ambient = frame.ambient
    if ambient is not None:
        alone = replace(frame, laser_direct=tuple(np.zeros_like(one) for one in frame.laser_direct), laser_indirect=())
        mean = float(expected_electrons(alone, scene, bare).mean())
        ambient = (trouble.room * sensor.full_well / max(mean, 1e-9) * ambient).astype(np.float32)
    direct = tuple((laser * frame.laser(i)).astype(np.float32) for i in range(len(frame.laser_direct)))
    return replace(frame, laser_direct=direct, laser_indirect=(), ambient=ambient)


def measured(path: Path, folder: Path, *options: str) -> tuple[dict, np.ndarray]:
    """What `main.py extract` tells of an image file, and (n, 3) positions: across the scan axis, along it, sigma."""
    arguments = ["extract", str(path), "--out", str(folder), "--json", "--threads", "2", *options]
    result = CliRunner().invoke(cli, arguments)
    answer = json.loads(result.stdout)
    if not answer.get("images"):
        return {"axis": "none", "message": answer}, np.zeros((0, 3))
    told = {**answer["images"][0], "colour": answer["chosen"]["colour"]}
    with open(told["file"], newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["u"]]
    u, v, sigma = (np.array([float(row[name] or "nan") for row in rows]) for name in ("u", "v", "sigma_u"))
    pair = (v, u) if told["axis"] == "rows" else (u, v)
    return told, np.stack([*pair, sigma], axis=1)


def nearest(taken: Photograph) -> float:
    """px, below which a position is right."""
    return max(NEAR, taken.sigma)


def off_by(taken: Photograph, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n, 3) -> (n,) px off the nearest crossing of the truth, inf where there is none, and which of the
    truth's crossings have a right one."""
    truth = np.concatenate(taken.truth)
    error, reached = np.full(len(positions), np.inf), np.zeros(len(truth), np.bool_)
    for i, (line, place, _) in enumerate(positions):
        here = np.flatnonzero(truth[:, 0] == line)
        if len(here):
            off = place - truth[here, 1]
            best = int(np.argmin(np.abs(off)))
            error[i] = off[best]
            reached[here[best]] |= abs(error[i]) < nearest(taken)
    return error, reached


def score(taken: Photograph, told: dict, positions: np.ndarray) -> Score:
    """Positions (n, 3) against the truth."""
    colour = told.get("colour")
    if told["axis"] != taken.axis or not len(positions):
        return Score(0.0, 1.0 if len(positions) else 0.0, math.nan, math.nan, told["axis"], colour)
    error, reached = off_by(taken, positions)
    right = np.abs(error) < nearest(taken)
    ratio = error[right] / positions[right, 2]
    ratio = ratio[np.isfinite(ratio)]
    within = float(np.mean(np.abs(ratio) < 2.0)) if len(ratio) else math.nan
    spread = float(1.4826 * np.median(np.abs(ratio))) if len(ratio) else math.nan
    return Score(float(reached.mean()), float(np.mean(~right)), within, spread, told["axis"], colour)


def judged(name: str, folder: Path, *options: str) -> Score:
    """The scene's photograph as a PNG in the folder, measured and scored."""
    taken = photograph(TROUBLES[name])
    path = folder / f"{name.replace(' ', '_')}.png"
    cv2.imwrite(str(path), taken.pixels[..., ::-1])
    return score(taken, *measured(path, folder, *options))


if __name__ == "__main__":
    target = Path(sys.argv[1])
    target.mkdir(parents=True, exist_ok=True)
    print(f"{'scene':18s} {'found':>7s} {'false':>7s} {'2 sigma':>8s} {'err/sigma':>9s}  axis     colour")
    for scene_name in sys.argv[2:] or TROUBLES:
        wanted, got = TROUBLES[scene_name], judged(scene_name, target)
        numbers = f"{got.found:7.1%} {got.false:7.2%} {got.within:8.1%} {got.normalised:9.2f}"
        print(f"{scene_name:18s} {numbers}  {got.axis:8s} {got.colour or 'not told'} ({wanted.colour})", flush=True)
