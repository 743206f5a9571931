"""Blazer Studio on one scene, in a process of its own: an image for each effort, and its time.

    python -m peers.ours SCENE SEED FOLDER BUDGET...

An image at each refinement, until the last budget is spent: nothing is known beforehand but the loaded scene.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from peers import scenes
from peers.clock import THREADS, cpu_seconds, keep_to, leave

from render.run import Run
from render.world.placed import PlacedLaser

BALL_SEGMENTS = 512
"""As ours cuts its own spheres finely: 0.75 um off the exact one, shaded with its normals as the peers' ball is."""


def our_scene(setting: scenes.Setting):
    """Scene and world of ours for a setting."""
    from render.base.pose import Pose
    from render.camera.camera import Camera
    from render.laser.laser import Divergence, LineLaser
    from render.mesh.mesh import Mesh
    from render.scene.scene import Rig, Scene, SceneObject
    from render.scene.shape import Plane
    from render.world.world import place_meshes

    w, h = scenes.WIDTH, scenes.HEIGHT
    camera = Camera(width=w, height=h, fx=scenes.FOCAL, fy=scenes.FOCAL, cx=(w - 1) / 2, cy=(h - 1) / 2)
    laser = LineLaser(
        power=scenes.POWER,
        fan_angle=scenes.FAN,
        fan_profile="constant",
        sheet=Divergence(full_angle=scenes.DIVERGENCE),
        T_rig_laser=Pose(translation=tuple(scenes.T_WORLD_LASER[:3, 3]), rotation=(0.0, scenes.TURN, 0.0)),
    )
    # the shapes only hold the places of the meshes below
    objects = tuple(SceneObject(name=p.name, shape=Plane(), material=material(p.material)) for p in setting.parts)
    scene = Scene(rig=Rig(camera=camera, lasers=(laser,)), objects=objects)
    meshes = [
        Mesh(p.vertices.astype(np.float64), p.triangles, normals=None if p.smooth is None else p.smooth[p.triangles])
        for p in setting.parts
    ]
    return scene, place_meshes(scene, meshes)


def material(m: scenes.Material):
    from render.material import material as ours

    if m.kind == "diffuse":
        return ours.Lambertian(albedo=m.albedo)
    if m.kind == "metal":
        return conductor(m)
    return ours.Glass(index=m.n)


def conductor(m: scenes.Material):
    """A metal of the scene's own index: the table's iron is given it in this process."""
    from render.material.conductor import metals
    from render.material.material import Conductor

    metals()["iron"] |= {"wavelength_nm": [200.0, 2000.0], "n": [m.n, m.n], "k": [m.k, m.k]}
    return Conductor(metal="iron", roughness=m.alpha)


DIRECT_ERRORS = (0.05, 0.01, 0.001, 0.0002)
"""Asked of s1, which has nothing but direct light, one render each."""
DIRECT_BELOW = 0.01
"""Asked of the direct light under reflections, whose own error is watched."""


def images(scene, world, name: str, seed: int) -> Iterator[np.ndarray]:
    """All light of the laser (h, w), ever better: the one place that knows how ours renders."""
    from render.laser_direct.integrator import direct_image
    from render.laser_indirect.integrator import indirect_images

    parts = (world, scene.camera, scene.lasers[0], scene.T_world_camera(), scene.T_world_laser(0))
    if name == "s1":
        for target in DIRECT_ERRORS:
            yield direct_image(*parts, target=target, run=Run(seed=seed, threads=THREADS)).radiance
        return
    direct = direct_image(*parts, target=DIRECT_BELOW, run=Run(seed=seed, threads=THREADS)).radiance
    run = Run(seed=seed, threads=THREADS)
    for indirect in indirect_images(PlacedLaser(*parts), target=0.0, most_paths=1 << 40, run=run):
        yield direct + indirect.radiance


def main() -> None:
    name, seed, folder, *budgets = sys.argv[1:]
    keep_to()
    scene, world = our_scene(scenes.setting(name, BALL_SEGMENTS))
    # compiles, and builds the acceleration structure
    for _ in zip(range(len(DIRECT_ERRORS)), images(scene, world, name, 0), strict=False):
        pass
    source, spent, wall = images(scene, world, name, 1 + int(seed)), 0.0, 0.0
    while spent < float(budgets[-1]):
        start, clock = cpu_seconds(), time.perf_counter()
        out = next(source, None)
        took, clock = cpu_seconds() - start, time.perf_counter() - clock
        if out is None:
            break
        # s1's are rendered anew each, the others' refined
        spent, wall = (took, clock) if name == "s1" else (spent + took, wall + clock)
        leave(Path(folder), out, spent, wall=wall)


if __name__ == "__main__":
    main()
