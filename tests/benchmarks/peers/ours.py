"""Blazer Studio on one scene, in a process of its own: an image for each effort, and its time.

    python -m peers.ours SCENE SEED FOLDER BUDGET...

Each image is rendered anew, from nothing but the loaded scene; efforts rise until one takes longer than the last
budget.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np
from peers import scenes
from peers.clock import THREADS, cpu_seconds, keep_to, leave

BALL_SEGMENTS = 2048
"""Ours has no exact ball: one of 0.1 um deviation instead."""


def our_scene(setting: scenes.Setting):
    """Scene and world of ours for a setting."""
    from render.camera import Camera
    from render.laser import Divergence, LineLaser
    from render.mesh import Mesh
    from render.pose import Pose
    from render.scene import Rig, Scene, SceneObject
    from render.shape import Plane
    from render.world import place_meshes

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
    world = place_meshes(scene, [Mesh(p.vertices.astype(np.float64), p.triangles) for p in setting.parts])
    return scene, world


def material(m: scenes.Material):
    from render import material as ours

    if m.kind == "diffuse":
        return ours.Lambertian(albedo=m.albedo)
    if m.kind == "metal":
        return conductor(m)
    return ours.Glass(index=m.n)


def conductor(m: scenes.Material):
    """A metal of the scene's own index: the table's iron is given it in this process."""
    from render.material import Conductor
    from render.material_rows import metals

    metals()["iron"] |= {"wavelength_nm": [200.0, 2000.0], "n": [m.n, m.n], "k": [m.k, m.k]}
    return Conductor(metal="iron", roughness=m.alpha)


def efforts(name: str):
    """(target error of the direct light, of the indirect light or None), rising."""
    if name == "s1":
        return [(target, None) for target in (0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 0.0005, 0.0002)]
    return [(0.5 * target, target) for target in (0.6, 0.3, 0.15, 0.08, 0.04, 0.02, 0.01, 0.005)]


def image(scene, world, targets, seed: int) -> np.ndarray:
    """All light of the laser in one image (h, w): the one place that knows how ours renders."""
    from render.bidirectional import indirect_image
    from render.direct import direct_image

    parts = (world, scene.camera, scene.lasers[0], scene.T_world_camera(), scene.T_world_laser(0))
    direct, indirect = targets
    out = direct_image(*parts, target=direct, seed=seed, threads=THREADS).radiance
    if indirect is None:
        return out
    more = indirect_image(*parts, target=indirect, most_paths=1 << 30, seed=seed, threads=THREADS)
    return out + more.radiance


def main() -> None:
    name, seed, folder, *budgets = sys.argv[1:]
    keep_to()
    scene, world = our_scene(scenes.setting(name, BALL_SEGMENTS))
    steps = efforts(name)
    # compiles, and builds the acceleration structure
    image(scene, world, steps[0], 0)
    for step, targets in enumerate(steps):
        start, wall = cpu_seconds(), time.perf_counter()
        out = image(scene, world, targets, 1 + int(seed) + 1000 * step)
        spent, wall = cpu_seconds() - start, time.perf_counter() - wall
        leave(Path(folder), out, spent, wall=wall, target=targets[1] or targets[0])
        if spent > float(budgets[-1]):
            break


if __name__ == "__main__":
    main()
