"""One frame that gets better while it is looked at: a quick one first, then truth and ever more samples.

The last frame holds the same numbers, bit for bit, as `render_world` gives for the same settings.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, wait
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from render.ambient.transport_plan import choose_ambient, expected_ambient, has_ambient, planned_images
from render.base.counts import DIRECT_DROPPED, DIRECT_ERROR, DIRECT_SAMPLES, EMBREE_SECONDS, LIT_PIXELS, RAYS, Counts
from render.base.deadline import Limit
from render.base.errors import Cancelled
from render.base.progress import Clock, WholeClock
from render.base.threads import Cancel
from render.camera.focus import lens_lines
from render.checkpoint import AMBIENT, RenderState
from render.frame import Axis, Frame, LaserCurve
from render.laser_direct.integrator import direct_image
from render.laser_indirect.transport_plan import DIRECT, INDIRECT, choose_plan, clamp_line, indirect_light
from render.sampling.random import wrapped
from render.scan_plan import ScanPlan
from render.scene.scene import Scene
from render.scene.settings import RenderSettings
from render.truth.laser_curve import laser_curve
from render.truth.pixel_truth import truth_images
from render.world.embree import RayScene
from render.world.material_checks import check_materials, scene_warnings
from render.world.placement_checks import check_placement
from render.world.world import World

Float32 = NDArray[np.float32]
Progress = Callable[[str, float], None]
"""progress(what is being done, share of the whole 0..1)."""

LOOK_SECONDS = 0.02
"""Between two looks whether the user cancelled."""
QUICK_ERROR = 0.05
"""Relative error of the laser light in the first frame."""


def plan(scene: Scene, settings: RenderSettings) -> tuple[str, ...]:
    """What will be computed, what is left out, and why; one line each."""
    lines = [DIRECT]
    if settings.transport == "direct":
        lines.append(f"left out: {INDIRECT} - switched off")
    elif settings.transport != "auto":
        lines.append(f"{settings.transport}: {INDIRECT} - asked for")
    else:
        lines.append(
            f"{INDIRECT}: a pilot decides kind by kind, and leaves out what is below {settings.negligible:.2%}"
        )
    if settings.transport != "direct":
        lines.extend(clamp_line(settings))
    lines.extend(expected_ambient(scene, settings))
    lines.extend(lens_lines(scene.camera))
    lines.append(
        "truth: depth, position, normal and object at every pixel's centre"
        if settings.truth_images
        else "left out: truth at every pixel (switched off); the exact line is there"
    )
    return tuple(lines)


def refine(  # noqa: PLR0913
    world: World,
    scene: Scene,
    *,
    settings: RenderSettings | None = None,
    step: int = 0,
    axis: Axis = "rows",
    seed: int = 0,
    threads: int | None = None,
    progress: Progress | None = None,
    cancelled: Cancel | None = None,
    keeps: Cancel | None = None,
    seconds: float | None = None,
    state: RenderState | None = None,
) -> Iterator[Frame]:
    """Frames of a world placed for `step`, each usable and better than the one before; the last is the final one.

    `Frame.ambient` and `Frame.truth` are None until their turn comes. `Frame.counts` tells the estimated relative error
    of each laser and of the ambient light. keeps: asked when cancelled, whether the unfinished light is wanted, as one
    more frame. seconds: the refinement ends then, whatever its errors; every light group has its share of that time.
    state: to go on from, and to keep. Raises InputError, Cancelled.
    """
    settings = settings or RenderSettings()
    targets = (QUICK_ERROR, settings.laser_error) if settings.laser_error < QUICK_ERROR else (settings.laser_error,)
    clock = WholeClock(_workload(world, scene, settings), progress)
    return frames(world, scene, settings, clock, targets, step, axis, seed, threads, cancelled, keeps, seconds, state)


def frames(  # noqa: PLR0913
    world: World,
    scene: Scene,
    settings: RenderSettings,
    clock: Clock | WholeClock,
    targets: tuple[float, ...],
    step: int = 0,
    axis: Axis = "rows",
    seed: int = 0,
    threads: int | None = None,
    cancelled: Cancel | None = None,
    keeps: Cancel | None = None,
    seconds: float | None = None,
    state: RenderState | None = None,
    scan: ScanPlan | None = None,
) -> Iterator[Frame]:
    """As `refine`; targets: errors of the laser light, one after the other; scan: what was decided for all frames."""
    limit = Limit(seconds, cancelled, keeps)
    cancelled = None if cancelled is None else limit.asked
    with clock.stage("acceleration structure", len(world.triangles) * 10):
        check_placement(world, scene, step)
        _stop(cancelled)
        check_materials(world, scene)
        warnings = scene_warnings(world, scene, step)
        rays = _rays(world, cancelled)
    ray_start, embree_start = rays.rays, rays.seconds
    frame = Frame(step, (), None, (), None, "\n".join(plan(scene, settings)), warnings=warnings)

    def told(frame: Frame, counts: Counts | None = None) -> Frame:
        frame.check()
        so_far = {RAYS: float(rays.rays - ray_start), EMBREE_SECONDS: rays.seconds - embree_start}
        return replace(frame, seconds=clock.so_far(), counts={**frame.counts, **(counts or {}), **so_far})

    pixels, lit = scene.camera.width * scene.camera.height, has_ambient(scene)
    with clock.stage("exact line", 0):
        curves = tuple(_curves(world, scene, step, axis, threads))
    for target in targets:
        with clock.stage("laser light", _laser_work(pixels, scene, target)) as report:
            direct, counts = _lasers(world, scene, step, target, seed, threads, report, cancelled)
        frame = told(replace(frame, laser_direct=direct, curves=curves), counts)
        yield frame
    with clock.stage("reflected laser light", _indirect_work(pixels, settings)) as report:
        if scan is None:
            chosen = choose_plan(world, scene, settings, direct, step=step, seed=seed, cancelled=cancelled)
        else:
            chosen = scan.light
        frame = told(replace(frame, plan="\n".join((*chosen.lines, *expected_ambient(scene, settings)))))
        for indirect, counts in indirect_light(
            world,
            scene,
            settings,
            chosen,
            step=step,
            seed=seed,
            threads=threads,
            cancelled=cancelled,
            progress=report,
            keeps=keeps,
            enough=lambda left: limit.share(left + lit),
            state=state,
        ):
            frame = told(replace(frame, laser_indirect=indirect), counts)
            yield frame
    if not (frame.laser_indirect or settings.truth_images or lit):
        # nothing is left to do but to say so
        yield frame
    if settings.truth_images:
        with clock.stage("truth images", pixels) as report:
            camera, pose = scene.camera, scene.T_world_camera(step)
            truth = truth_images(world, camera, pose, threads=threads, cancelled=cancelled, progress=report)
        frame = told(replace(frame, truth=truth))
        yield frame
    if lit:
        with clock.stage("ambient light", _ambient_work(pixels, settings)) as report:
            if scan is None:
                wanted = choose_ambient(world, scene, settings, step=step, seed=seed, cancelled=cancelled)
            else:
                wanted = scan.ambient
            frame = replace(frame, plan="\n".join((*chosen.lines, *wanted.lines)))
            for image, counts in limit.until_over(
                planned_images(
                    world,
                    scene,
                    settings,
                    wanted,
                    step=step,
                    seed=seed,
                    threads=threads,
                    cancelled=limit.over,
                    progress=report,
                    keeps=limit.keeps,
                    before=None if state is None else state.saved.get(AMBIENT),
                    keep=None if state is None else partial(state.keep, AMBIENT),
                )
            ):
                frame = told(replace(frame, ambient=image.radiance), counts)
                yield frame


def _rays(world: World, cancelled: Cancel | None) -> RayScene:
    """The scene for ray queries. Raises Cancelled, and leaves embree, which cannot stop halfway, to end alone."""
    if cancelled is None or "rays" in vars(world):
        return world.rays
    built: Future[RayScene] = Future()

    def build() -> None:
        try:
            built.set_result(world.rays)
        except BaseException as error:
            built.set_exception(error)

    threading.Thread(target=build, name="embree", daemon=True).start()
    while not built.done():
        _stop(cancelled)
        wait((built,), LOOK_SECONDS)
    return built.result()


def _stop(cancelled: Cancel | None) -> None:
    if cancelled is not None and cancelled():
        raise Cancelled


def _curves(world: World, scene: Scene, step: int, axis: Axis, threads: int | None) -> Iterator[LaserCurve]:
    for i, laser in enumerate(scene.lasers):
        poses = scene.T_world_camera(step), scene.T_world_laser(i, step)
        yield laser_curve(world, scene.camera, laser, *poses, axis, threads)


def _lasers(
    world: World,
    scene: Scene,
    step: int,
    target: float,
    seed: int,
    threads: int | None,
    report: Callable[[float], None],
    cancelled: Cancel | None,
) -> tuple[tuple[Float32, ...], Counts]:
    """The direct light of every laser, and what it took."""
    images = []
    counts: Counts = {}
    for i, laser in enumerate(scene.lasers):
        image = direct_image(
            world,
            scene.camera,
            laser,
            scene.T_world_camera(step),
            scene.T_world_laser(i, step),
            target=target,
            seed=wrapped(seed + i),
            threads=threads,
            cancelled=cancelled,
            progress=lambda done, i=i: report((i + done) / len(scene.lasers)),  # type: ignore[misc]
        )
        images.append(image.radiance)
        counts[DIRECT_ERROR.of(i)] = image.error
        counts[LIT_PIXELS.of(i)] = image.pixels
        counts[DIRECT_SAMPLES.of(i)] = image.samples
        counts[DIRECT_DROPPED.of(i)] = image.dropped
    return tuple(images), counts


def _laser_work(pixels: int, scene: Scene, target: float) -> float:
    """About how many rays: a strip of a twentieth of the image, four rays a pixel, a few more for a finer target."""
    return 0.2 * pixels * len(scene.lasers) * (1.0 + 0.2 * math.log2(max(1.0, QUICK_ERROR / target)))


def _indirect_work(pixels: int, settings: RenderSettings) -> float:
    """About how many rays: next to none where there is nothing to reflect on, dozens a pixel where there is."""
    return float(pixels) if settings.transport == "direct" else 8.0 * pixels


def _ambient_work(pixels: int, settings: RenderSettings) -> float:
    """About how many rays: a camera ray and two more a sample; it ends before that where the error is reached."""
    return 3.0 * pixels * settings.ambient_samples


def _workload(world: World, scene: Scene, settings: RenderSettings) -> float:
    """The sum of what the stages say of themselves."""
    pixels = scene.camera.width * scene.camera.height
    total = len(world.triangles) * 10 + _laser_work(pixels, scene, settings.laser_error)
    total += _laser_work(pixels, scene, QUICK_ERROR) if settings.laser_error < QUICK_ERROR else 0.0
    total += _indirect_work(pixels, settings)
    total += pixels if settings.truth_images else 0.0
    if has_ambient(scene):
        total += _ambient_work(pixels, settings)
    return max(total, 1.0)
