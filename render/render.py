"""One frame of a scene: the light groups, each apart, and the truth."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from render.ambient_plan import choose_ambient, expected_ambient, has_ambient, planned_images
from render.checks import check_placement
from render.curve import laser_curve
from render.direct import direct_image
from render.frame import Axis, Frame
from render.material_checks import check_materials, scene_warnings
from render.plan import indirect_light
from render.scene import Scene
from render.settings import RenderSettings
from render.threads import Cancel
from render.truth import truth_images
from render.world import World, build_world

StageProgress = Callable[[str, float], None]


def render(
    scene: Scene,
    root: Path,
    *,
    settings: RenderSettings | None = None,
    step: int = 0,
    axis: Axis = "rows",
    seed: int = 0,
    threads: int | None = None,
    progress: StageProgress | None = None,
    cancelled: Cancel | None = None,
) -> Frame:
    """Load the meshes below `root` and render one step. Raises InputError, Cancelled."""
    world = build_world(scene, root, step)
    return render_world(
        world,
        scene,
        settings=settings,
        step=step,
        axis=axis,
        seed=seed,
        threads=threads,
        progress=progress,
        cancelled=cancelled,
    )


def render_world(
    world: World,
    scene: Scene,
    *,
    settings: RenderSettings | None = None,
    step: int = 0,
    axis: Axis = "rows",
    seed: int = 0,
    threads: int | None = None,
    progress: StageProgress | None = None,
    cancelled: Cancel | None = None,
) -> Frame:
    """Render a world placed for `step`; `axis` is the scan axis of the exact line. Raises InputError, Cancelled."""
    settings = settings or RenderSettings()
    camera, T_world_camera = scene.camera, scene.T_world_camera(step)
    seconds: dict[str, float] = {}
    counts: dict[str, float] = {}

    @contextmanager
    def stage(name: str) -> Iterator[Callable[[float], None] | None]:
        start = time.perf_counter()
        if progress is not None:
            progress(name, 0.0)
        yield None if progress is None else lambda done: progress(name, done)
        seconds[name] = seconds.get(name, 0.0) + time.perf_counter() - start
        if progress is not None:
            progress(name, 1.0)

    with stage("acceleration structure"):
        check_placement(world, scene, step)
        check_materials(world, scene)
        warnings = scene_warnings(world, scene, step)
        rays = world.rays
    ray_start, embree_start = rays.rays, rays.seconds
    curves, direct = [], []
    for i, laser in enumerate(scene.lasers):
        T_world_laser = scene.T_world_laser(i, step)
        with stage("exact line"):
            curves.append(laser_curve(world, camera, laser, T_world_camera, T_world_laser, axis, threads))
        with stage("laser light") as report:
            image = direct_image(
                world,
                camera,
                laser,
                T_world_camera,
                T_world_laser,
                target=settings.laser_error,
                seed=seed + i,
                threads=threads,
                cancelled=cancelled,
                progress=report,
            )
        direct.append(image.radiance)
        counts[f"relative error, {laser.name}"] = image.error
        counts[f"lit pixels, {laser.name}"] = image.pixels
        counts[f"samples, {laser.name}"] = image.samples
    with stage("reflected laser light") as report:
        plan, indirect, tallies = indirect_light(
            world,
            scene,
            settings,
            tuple(direct),
            step=step,
            seed=seed,
            threads=threads,
            cancelled=cancelled,
            progress=report,
        )
    counts |= tallies
    truth = ambient = None
    if settings.truth_images:
        with stage("truth images") as report:
            truth = truth_images(world, camera, T_world_camera, threads=threads, cancelled=cancelled, progress=report)
    lines = expected_ambient(scene, settings)
    if has_ambient(scene):
        with stage("ambient light") as report:
            chosen = choose_ambient(world, scene, settings, step=step, seed=seed, cancelled=cancelled)
            lines = chosen.lines
            for exposed, tallies in planned_images(
                world,
                scene,
                settings,
                chosen,
                step=step,
                seed=seed,
                threads=threads,
                cancelled=cancelled,
                progress=report,
            ):
                ambient = exposed.radiance
                counts |= tallies
    counts["rays"] = rays.rays - ray_start
    counts["seconds in embree, all threads"] = rays.seconds - embree_start
    return Frame(
        step=step,
        laser_direct=tuple(direct),
        ambient=ambient,
        curves=tuple(curves),
        truth=truth,
        laser_indirect=indirect,
        plan="\n".join((*plan.lines, *lines)),
        warnings=warnings,
        seconds=seconds,
        counts=counts,
    )
