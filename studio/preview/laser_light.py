"""What a project's lasers alone light at its first step, rendered as finely as it takes to be looked at."""

from __future__ import annotations

from pathlib import Path

from render.base.arrays import Float32
from render.frame import Frame
from render.run import Run
from render.scene.lights import Environment
from render.scene.motion import NoMotion
from render.sensor.develop import expected_electrons
from render.world.material_checks import check_materials
from render.world.placement_checks import check_placement
from render.world.world import World, build_world
from studio.project.project import Project

PROBE_ERROR = 0.05
"""Relative error of the light that is rendered to look at; ample for figures that are called about."""
PROBE_REFLECTED = 0.3
"""The same of reflected light."""


def laser_electrons(project: Project, root: Path, laser: int, threads: int | None = None) -> Float32:
    """Electrons of a laser's light at step 0, its scan lines along the first axis. InputError: as `inspect`."""
    frame = of_lasers(project, build_world(project.scene, root, 0), threads)
    return light_of(project, frame, laser, project.scene.lasers[laser].power)


def of_lasers(project: Project, world: World, threads: int | None) -> Frame:
    """What the lasers alone light at step 0."""
    from render.render import render_world  # this takes a while: a window opens without it

    scene = project.scene
    check_placement(world, scene, 0)
    check_materials(world, scene)
    dark = scene.model_copy(update={"lights": (), "environment": Environment(), "motion": NoMotion()})
    probe = {"laser_error": PROBE_ERROR, "indirect_error": PROBE_REFLECTED, "light_paths": 1 << 20}
    depth = project.sensor.needs_depth(scene.camera.lens.model)
    settings = project.render.model_copy(update={**probe, "truth_images": depth})
    return render_world(world, dark, settings=settings, axis=project.extraction.axis, run=Run(threads=threads))


def light_of(project: Project, frame: Frame, i: int, own_power: float) -> Float32:
    """Electrons of one laser's light, its scan lines along the first axis."""
    power = [own_power if k == i else 0.0 for k in range(len(frame.curves))]
    light_alone = project.sensor.model_copy(update={"dark_current": 0.0})
    electrons = expected_electrons(frame, project.scene, light_alone, laser_power=power)
    return electrons if frame.curves[i].axis == "rows" else electrons.T
