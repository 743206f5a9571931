"""Compiles every kernel, or loads it from its cache, by asking of tiny scenes what the program asks of large ones.

That takes half a minute where the cache is empty, a second where it is not. It happens once in the life of the
program, step by step on a thread of its own: whoever waits can be cancelled at once, which a compiler cannot. Where the
cache is empty, a process of its own compiles meanwhile what is needed last (`beside`); here that is then only loaded.
What both need within their kernels, the first hands over to the other (`render.base.sealed_cache`).
"""

from __future__ import annotations

import atexit
import gc
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterable
from concurrent.futures import Future, wait
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from render.base.errors import Cancelled
from render.base.kernel_cache import ROOT, hand_over_callees, kept_in, remove_callees
from render.base.pose import Pose
from render.base.threads import Cancel, thread_count
from render.camera.camera import Camera, Lens
from render.laser.laser import LineLaser
from render.material.material import Conductor, Emitter, Glass, Material, Subsurface
from render.run import Run, never
from render.scene.lights import Environment, PointLight, RectangleLight
from render.scene.scene import Rig, Scene, SceneObject
from render.scene.settings import DepthGoal, RenderSettings
from render.scene.shape import Box, Plane
from render.sensor.sensor import Sensor, SpectralCurve
from studio.project.project import Project
from studio.project.templates import template_folder

if TYPE_CHECKING:
    from render.frame import Frame
    from render.sensor.develop import Image
    from render.world.world import World
    from studio.runtime.console import StageProgress
    from studio.scan.stages import Clock

PREPARING = "preparing kernels (compiled on the first run)"
TEMPLATE, IMAGE_SCALE = "plane", 0.05
LOOK_SECONDS = 0.02
"""Between two looks whether somebody who waits was cancelled."""
COLLECTED = (20_000, 20, 20)
"""Thresholds of the search for garbage meanwhile."""
CAMERA = Camera(width=64, height=48, fx=100.0, fy=100.0, cx=31.5, cy=23.5)
LASER = LineLaser(T_rig_laser=Pose(translation=(0.1, 0.0, 0.0), rotation=(0.0, -0.2, 0.0)))
PLATE = SceneObject(name="plate", shape=Plane(), T_world_object=Pose(translation=(0.0, 0.0, 0.5)))
WAX = Subsurface(mean_free_path=0.01, scattering_albedo=0.5)
SENSOR = Sensor(efficiency=(SpectralCurve(wavelength_nm=(400.0, 700.0), value=(0.5, 0.5)),))
LAST = "scan"
"""The step that waits for what another process has compiled."""

_ends: dict[str, Future[None]] = {}
_helper: subprocess.Popen[bytes] | None = None
_lock = threading.Lock()


def begin(steps: Iterable[str]) -> None:
    """Start on some of STEPS, after those that were started before."""
    global _helper
    for name in steps:
        with _lock:
            if not _ends:
                _helper = _start_helper()
            if name not in _ends:
                _ends[name] = Future()
                before = list(_ends.values())[:-1]
                # no daemon: the program may not end while a compiler works in it
                threading.Thread(target=_run, args=(name, before), name=f"warm-up {name}").start()


def warm_up(steps: Iterable[str], progress: StageProgress, cancelled: Cancel) -> None:
    """Wait until the kernels of some of STEPS are there. Raises Cancelled, and whatever is found to be broken."""
    names = tuple(steps)
    begin(names)
    for i, name in enumerate(names):
        while not _ends[name].done():
            if cancelled():
                raise Cancelled
            progress(PREPARING, i / len(names))
            wait((_ends[name],), LOOK_SECONDS)
        _ends[name].result()


def all_compiled() -> bool:
    """Nothing is left to compile: each kernel is loaded within milliseconds where it is called first."""
    return _compiled().exists()


def needed(project: Project) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The steps whose kernels the line of a project needs, and those of what is drawn and measured after it."""
    pinhole = project.scene.camera.lens.model == "pinhole"
    chosen = ("learned",) if project.extraction.select == "learned" else ()
    return ("draw",) if pinhole else ("draw", "lens"), ("light", "scan", *chosen)


def _run(name: str, before: list[Future[None]]) -> None:
    wait(before)
    thresholds = gc.get_threshold()
    # a compiler leaves much garbage, and looking for it as often as usual takes a tenth of its time
    gc.set_threshold(*COLLECTED)
    try:
        if name == LAST:
            _wait_for_helper()
        STEPS[name](_program_ends)
        if name == LAST:
            _mark()
        _ends[name].set_result(None)
    except BaseException as error:
        _ends[name].set_exception(error)
    finally:
        gc.set_threshold(*thresholds)


def _compiled() -> Path:
    """The file that says that a program has compiled all of its kernels into the cache."""
    return Path(kept_in(), f"{LAST}.compiled")


def _mark() -> None:
    remove_callees()
    with suppress(OSError):
        _compiled().touch()


def _start_helper() -> subprocess.Popen[bytes] | None:
    """Begin to compile in another process; None: it is done already, or that process could not hand anything over."""
    folder = _compiled().parent
    if _compiled().exists() or thread_count(None) < 2:
        return None
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if not os.access(folder, os.W_OK):
            return None
        path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
        helper = subprocess.Popen(
            [sys.executable, "-m", "studio.scan.kernel_warm_up"],
            env=os.environ | {"PYTHONPATH": path},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
    except OSError:  # no more processes or memory: it is compiled here
        return None
    atexit.register(helper.kill)
    hand_over_callees()
    return helper


def _wait_for_helper() -> None:
    """Until the other process has ended; it is ended where nobody is left to wait. What it left undone is done here."""
    while _helper is not None and _helper.poll() is None:
        if _program_ends():
            _helper.kill()
        with suppress(subprocess.TimeoutExpired):
            _helper.wait(LOOK_SECONDS)


def _program_ends() -> bool:
    """Nobody is left to wait."""
    return not threading.main_thread().is_alive()


def look(cancelled: Cancel) -> None:
    """All that panels ask of a look."""
    from studio.preview import rig_drawing
    from studio.preview.preview import Preview
    from studio.preview.readouts import readouts

    scene = _blocks(CAMERA, (), 0.05)
    made = Preview(1).look(Project(scene=scene, sensor=SENSOR), Path())
    readouts(made, 0)
    made.image(1.0)
    rig_drawing.frustum(scene)


def draw(cancelled: Cancel) -> None:
    """The line on the tilted plane at 122 x 102 px, in memory, with its pictures: the first image of a render."""
    _drawn(cancelled, None)


def scan(cancelled: Cancel) -> None:
    """The same, foretold, measured by every method, smoothed, and what calibrations need. Raises whatever is broken."""
    from analysis.calibration.estimate import Estimate
    from analysis.calibration.observations import Stripe, View, gather
    from analysis.calibration.residuals import corners, laser_points
    from analysis.line.along.smooth import smoothed
    from studio.scan.depth_noise import foreseen_noise
    from studio.scan.results import measure_frame

    smoothed(np.zeros(32), np.ones(32), np.ones(32), np.zeros(32))
    point, alone = np.ones((1, 2)), np.eye(3)[None]
    seen = gather([View("", point, alone[:, :2, :2], point, (Stripe(0, point, np.ones(1)),))])
    estimate = Estimate(np.ones(4), np.zeros(0), np.zeros(2), alone[0, :1], alone, alone[0, 2:])
    corners(seen, estimate)
    laser_points(seen, estimate)
    look(cancelled)  # a scan foretells its noise by such a look
    project, frame, world, images, clock = _drawn(cancelled, DepthGoal())
    foreseen_noise(project, template_folder(TEMPLATE))
    found = measure_frame(project, frame, world, images, clock, None, keep=False)
    if not found.lasers[0].extractions[0].points.valid.any():
        raise RuntimeError("the warm-up scan found no point: the installation is damaged")


def _drawn(cancelled: Cancel, goal: DepthGoal | None) -> tuple[Project, Frame, World, list[Image], Clock]:
    from render.world.world import build_world
    from studio.scan.stages import Clock, develop_step, render_step

    folder, project = template_folder(TEMPLATE), _small()
    line = project.scene.model_copy(update={"lights": (), "environment": Environment()})
    direct = project.render.model_copy(update={"transport": "direct", "truth_images": False, "goal": goal})
    project = project.model_copy(update={"scene": line, "render": direct})
    clock = Clock(progress=lambda stage, done: None, cancelled=cancelled)
    world = build_world(project.scene, folder, 0)
    frame = render_step(project, world, 0, clock)
    images = develop_step(project, frame, clock, None)
    _show(project.scene, frame, images)
    return project, frame, world, images, clock


def _small() -> Project:
    """The project that is drawn and measured."""
    from studio.scan.stages import scaled

    return scaled(Project.load(template_folder(TEMPLATE) / "project.json"), IMAGE_SCALE)


def light(cancelled: Cancel) -> None:
    """Every kind of light: of lamps and shining objects, reflected, through glass, below surfaces."""
    drawn_into = Glass(), WAX.model_copy(update={"priority": 1})
    # that of lamps last, whose kernels another process may have by then
    for lamps in (False, True):
        _render(CAMERA, cancelled, "subsurface", lamps=lamps)
        _render(CAMERA, cancelled, "subsurface", Glass(), Conductor(), WAX, *(Emitter(),) * lamps, lamps=lamps)
        _render(CAMERA, cancelled, "subsurface", *drawn_into, apart=0.03, lamps=lamps)
    _aim(_blocks(CAMERA, (), 0.05), cancelled)
    # the second block stands in the sheet
    _integrate(_blocks(CAMERA, (Conductor(), Glass()), 0.06), cancelled)


def beside() -> None:
    """What is needed last: lines in an image that is made up, the light of lamps, a lens that blurs."""
    from render.sensor.develop import Image
    from studio.scan.line_extraction import extract_line
    from studio.scan.results import METHODS

    project = _small()
    camera, sensor = project.scene.camera, project.sensor
    across = np.arange(camera.width) - 0.5 * camera.width
    level = np.tile(0.05 + 0.5 * np.exp(-0.5 * (across / 1.5) ** 2), (camera.height, 1))
    top = 2**sensor.bits - 1
    pixels = (top * level).astype(np.uint8 if sensor.bits == 8 else np.uint16)
    gain, noise = sensor.dn_per_electron, sensor.read_noise
    image = Image(pixels, sensor.bits, gain, sensor.black_level, float(top), noise, None, sensor.exposure_time)
    for method in METHODS:
        extract_line(project, image, 0, None, method)
    scene = _blocks(CAMERA, (Glass(), Conductor(), WAX, Emitter()), 0.05)
    _rendered(scene.model_copy(update={"rig": Rig(camera=CAMERA)}), "subsurface")
    _aim(_blocks(CAMERA, (), 0.05), never)
    lens(never)


def learned(cancelled: Cancel) -> None:
    """What chooses among peaks, those that brighter light hides as well."""
    from studio.scan.line_extraction import extract_line

    project, _, _, images, _ = _drawn(cancelled, None)
    extract_line(project.replaced({"extraction.select": "learned"}), images[0], 0)


def lens(cancelled: Cancel) -> None:
    """The line by way of a lens that blurs, on plain and on shiny surfaces."""
    blurred = CAMERA.model_copy(update={"lens": Lens(model="thin-lens", focus_distance=0.4)})
    _render(blurred, cancelled, "direct", lamps=False)
    _render(blurred, cancelled, "direct", Conductor(), lamps=False)


def _render(
    camera: Camera, cancelled: Cancel, transport: str, *materials: Material, apart: float = 0.05, lamps: bool
) -> None:
    """A plate, and blocks of some materials before it, so far apart, under all sorts of lamps or none, by few paths."""
    from studio.scan.exposure import expose

    scene = _blocks(camera, materials, apart)
    if not lamps:
        scene = scene.model_copy(update={"lights": (), "environment": Environment()})
    frame = _rendered(scene, transport, cancelled)
    _show(scene, frame, [expose(Project(scene=scene, sensor=SENSOR), frame, [1.0], 0)])


def _rendered(scene: Scene, transport: str, cancelled: Cancel = never) -> Frame:
    """By next to no paths of every kind, for the image."""
    from render.render import render_world
    from render.world.world import build_world

    run = Run(cancelled=cancelled)
    return render_world(build_world(scene, Path()), scene, settings=_few(transport), run=run)


def _aim(scene: Scene, cancelled: Cancel) -> None:
    """What a goal asks of reflected light, and ambient light for what is measured."""
    from render.ambient.line_samples import pool
    from render.ambient.measured_light import measured_images
    from render.importance import LEAST_SAMPLES, Importance
    from render.laser_indirect.accumulator import PASSES_A_WAVE
    from render.laser_indirect.integrator import empty_buffer
    from render.laser_indirect.line_goal import Effect, LineErrors
    from render.laser_indirect.line_paths import PathDemand
    from render.laser_indirect.line_sums import mean_image
    from render.laser_indirect.lone_light import keep_largest, lone_light
    from render.world.placed import PlacedScene
    from render.world.world import build_world

    world, run, camera = build_world(scene, Path()), Run(cancelled=cancelled), scene.camera
    ones = np.ones((camera.height, camera.width), np.float32)
    everywhere = Importance((ones,), ones, peaks=(ones,))
    buffers, errors = [empty_buffer(ones.size) for _ in range(PASSES_A_WAVE)], LineErrors.of(everywhere, 0)
    buffers[0].touched[:] = True
    keep_largest(buffers, mean_image(buffers), 1.0, 1.0)
    Effect.of(errors.projection, buffers)
    lone_light(np.ones(ones.size), ones.ravel(), 1.0, errors.projection)
    demand = PathDemand.none(errors.projection).learned(errors.projection, errors.spread(buffers), ones.ravel(), 1.0)
    demand.aim(ones.flatten(), errors.projection, camera.width, 1.0)
    list(measured_images(PlacedScene(world, scene), everywhere, most=LEAST_SAMPLES, run=run))
    pool(np.ones((1, 3)), np.zeros(1, np.int32), np.zeros((1, 1), np.int32), np.empty((1, 3)))


def _integrate(scene: Scene, cancelled: Cancel) -> None:
    """Light of the laser over plane glass, which images as small as these leave to random paths."""
    from render.laser_indirect.bdpt_pass import BdptPass
    from render.laser_indirect.clear_light import Integral, unknown_near
    from render.world.placed import PlacedScene
    from render.world.world import build_world

    for laser in PlacedScene(build_world(scene, Path()), scene).lasers:
        integral = Integral(BdptPass.of(laser, 1.0, 1), Run(cancelled=cancelled), [])
        integral.candidates()
        integral.sampled(np.arange(scene.camera.width), 1)
    unknown_near(np.zeros(1, np.int64), np.ones((1, 1), np.bool_), np.empty(1, np.int64))


def _few(transport: str) -> RenderSettings:
    """Settings by which next to nothing is rendered, of every kind."""
    few = {"transport": transport, "light_paths": 1, "ambient_samples": 2, "laser_error": 0.1}
    return RenderSettings().model_copy(update=few)


def _blocks(camera: Camera, materials: tuple[Material, ...], apart: float) -> Scene:
    """The scene of `_render`."""
    blocks = []
    for i, material in enumerate(materials):
        shape = Box(size_x=0.04, size_y=0.04, size_z=0.02)
        pose = Pose(translation=(apart * i - 0.05, 0.005 * i, 0.45 + 0.005 * i))
        blocks.append(SceneObject(name=material.kind, shape=shape, material=material, T_world_object=pose))
    lamps = PointLight(), RectangleLight(T_world_light=Pose(translation=(0.0, -0.3, 0.0)))
    return Scene(
        rig=Rig(camera=camera, lasers=(LASER,)),
        objects=(PLATE, *blocks),
        lights=lamps,
        environment=Environment(radiance=(1.0, 1.0, 1.0)),
    )


def _show(scene: Scene, frame: Frame, images: list[Image]) -> None:
    """Every picture of a frame."""
    from render.output.tone_mapping import pyramid
    from studio.scan.frame_views import picture, views

    for view in views(scene, frame):
        made = picture(view, scene, frame, images, True)
        if made is not None:
            pyramid(made)


STEPS: dict[str, Callable[[Cancel], None]] = {
    "look": look,
    "draw": draw,
    "light": light,
    "lens": lens,
    "scan": scan,
    "learned": learned,
}


if __name__ == "__main__":
    if sys.argv[1:] == ["all"]:
        warm_up(STEPS, lambda stage, done: None, never)
    else:
        gc.set_threshold(*COLLECTED)
        hand_over_callees()
        beside()
