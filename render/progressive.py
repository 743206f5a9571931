"""One frame that gets better while it is looked at: a quick one first, then truth and ever more samples.

The last frame holds the same numbers, bit for bit, as `render_world` gives for the same settings.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, wait
from dataclasses import replace
from typing import Any

from render.base.arrays import Float32
from render.base.counts import EMBREE_SECONDS, RAYS
from render.base.deadline import Deadline
from render.base.errors import Cancelled
from render.base.progress import Clock, StageProgress, WholeClock
from render.base.threads import Cancel
from render.frame import Axis, Frame, LaserCurve
from render.laser_direct.light_group import QUICK_ERROR
from render.light_group import LightGroup, chosen_plan, has_work
from render.products import AIMED, PRODUCTS, QUICK, ambient_look, expected_plan
from render.run import Memory, Run, never
from render.scan_plan import ScanPlan
from render.scene.scene import Scene
from render.scene.settings import RenderSettings
from render.truth.laser_curve import laser_curve
from render.truth.sheet_bias import with_sheet_bias
from render.world.embree import RayScene
from render.world.material_checks import check_materials, scene_warnings
from render.world.placed import PlacedScene
from render.world.placement_checks import check_placement
from render.world.world import World

Products = Sequence[LightGroup[Any]]
LOOK_SECONDS = 0.02
"""Between two questions whether the render is cancelled."""
AIM = "where errors matter"
"""Stage in which the goal is asked."""
AIMING = ("direct", "indirect")
"""Light groups that decide where errors matter."""
BUILD_WORK = 10.0
"""Rays that take as long as the acceleration structure of one triangle."""


def refine(
    world: World,
    scene: Scene,
    *,
    settings: RenderSettings | None = None,
    step: int = 0,
    axis: Axis = "rows",
    run: Run = Run(),
    progress: StageProgress | None = None,
) -> Iterator[Frame]:
    """Frames of a world placed for `step`, each usable and better than the one before; the last is the final one.

    `Frame.ambient` and `Frame.truth` are None until their turn comes; `Frame.quality` has the estimated error of each
    light group so far. progress: of the whole. Raises InputError, Cancelled.
    """
    settings = settings or RenderSettings()
    products = (QUICK, *PRODUCTS) if settings.laser_error < QUICK_ERROR else PRODUCTS
    work = sum(product.work(scene, settings) for product in products if has_work(product, scene, settings))
    clock = WholeClock(max(work + _build_work(world), 1.0), progress)
    return frames(PlacedScene(world, scene, step), settings, run, clock, products, axis=axis)


def frames(
    placed: PlacedScene,
    settings: RenderSettings,
    run: Run,
    clock: Clock | WholeClock,
    products: Products = PRODUCTS,
    *,
    axis: Axis = "rows",
    scan: ScanPlan | None = None,
) -> Iterator[Frame]:
    """As `refine`; scan: what was decided for all frames. Raises InputError, Cancelled.

    `run.goal` hears of the frame once the direct light is there, with a coarse look at the ambient light, again of each
    laser's reflected light as it becomes known, and of all light that comes before other that it aims;
    `Frame.importance` is what the last aimed light was rendered by.
    """
    world, scene, step = placed.world, placed.scene, placed.step
    goal = run.goal if settings.goal is not None and scene.lasers else None
    run = _begun(replace(run, goal=goal, memory=run.memory or Memory(one_frame=True)))
    with clock.stage("acceleration structure", _build_work(world)):
        check_placement(world, scene, step)
        run.stop()
        check_materials(world, scene)
        plan = expected_plan(scene, settings)
        if scan is not None:
            plan = replace(plan, pilot_steps=scan.pilot_steps, frame_count=scan.frame_count)
        warnings = scene_warnings(world, scene, step)
        known = {} if scan is None else scan.foretold
        frame = Frame(step, (), None, (), None, plan, warnings=warnings, foretold=known)
        rays = _rays(world, run.cancelled)
    look: Float32 | None = None
    follows = run.lessons is not None and run.lessons.given
    ray_start, embree_start = rays.rays, rays.seconds
    with clock.stage("exact line", 0):
        frame = replace(frame, curves=_curves(placed, axis, run.threads))
    shown, waiting = frame, [product for product in products if has_work(product, scene, settings)]
    if goal is not None:
        last = max(i for i, product in enumerate(waiting) if product.group == "direct")
        waiting.insert(last + 1, AIMED)
    for i, product in enumerate(waiting):
        with clock.stage(product.stage, product.work(scene, settings)) as report:
            later = sum(other.parts(scene) for other in waiting[i + 1 :])
            part = replace(run, progress=report, later=later)
            seen = frame if look is None or frame.ambient is not None else replace(frame, ambient=look)
            if scan is None:
                chosen, foretold = chosen_plan(product, placed, settings, seen, part)
                if foretold > 0.0:
                    frame = replace(frame, foretold={**frame.foretold, product.group: foretold})
            else:
                chosen = scan.plans[product.group]
            frame = replace(frame, plan=frame.plan.with_steps(product.group, chosen.steps))
            for estimate in product.estimates(placed, settings, chosen, replace(seen, plan=frame.plan), part):
                frame = frame.with_estimate(product.field, estimate)
                frame.check(shown)
                counts = {RAYS: float(rays.rays - ray_start), EMBREE_SECONDS: rays.seconds - embree_start}
                shown = frame = replace(frame, seconds=clock.so_far(), counts=counts)
                with clock.shown():
                    yield frame
        look = None if frame.ambient is not None and not follows else look
        if goal is not None and product.group in AIMING and aimed_later(waiting[i + 1 :], product):
            with clock.stage(AIM, 0):
                if not follows:
                    if look is None and frame.ambient is None:
                        look = ambient_look(placed, settings, run)
                    seen = frame if frame.ambient is not None else replace(frame, ambient=look)
                    frame = replace(frame, importance=goal(seen))
                elif frame.importance is None:
                    # by the light of the block's first frame; of light much like it asking again tells nothing more
                    look, reflected = run.taught("ambient"), run.taught("laser_indirect") or ()
                    frame = replace(frame, importance=goal(replace(frame, ambient=look, laser_indirect=reflected)))
    if frame is not shown:
        # nothing was left to do but to say so
        yield replace(frame, seconds=clock.so_far())


def aimed_later(later: Products, product: LightGroup[Any]) -> bool:
    """Light is to come whose errors matter more in some places than in others, and what this one adds is there."""
    if product == AIMED:
        return False
    groups = [other.group for other in later if other != AIMED]
    return product.group not in groups and (AIMED in later or "indirect" in groups or "ambient" in groups)


def _begun(run: Run) -> Run:
    """The run of a frame whose time begins now, and stands still while a person holds the render."""
    deadline = Deadline(run.seconds)
    cancelled = run.cancelled if run.cancelled is never else deadline.pausing(run.cancelled)
    return replace(run, deadline=deadline, cancelled=cancelled)


def _build_work(world: World) -> float:
    return BUILD_WORK * len(world.triangles)


def _rays(world: World, cancelled: Cancel) -> RayScene:
    """The scene for ray queries. Raises Cancelled, and leaves embree, which cannot stop halfway, to end alone."""
    if cancelled is never or "rays" in vars(world):
        return world.rays
    built: Future[RayScene] = Future()

    def build() -> None:
        try:
            built.set_result(world.rays)
        except BaseException as error:
            built.set_exception(error)

    threading.Thread(target=build, name="embree", daemon=True).start()
    while not built.done():
        if cancelled():
            raise Cancelled
        wait((built,), LOOK_SECONDS)
    return built.result()


def _curves(placed: PlacedScene, axis: Axis, threads: int | None) -> tuple[LaserCurve, ...]:
    return tuple(with_sheet_bias(laser_curve(*laser, axis, threads), *laser, threads) for laser in placed.lasers)
