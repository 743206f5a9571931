"""Our own converged image of a scene, for a reference that no fast engine's faults are in.

    python -m peers.converge s2 SECONDS      writes references/s2.npz; processor seconds / 2

Ours may stand for the truth here because independent ways agree with it: light tracing alone (total flux of s2 within
2e-4), Mitsuba's path tracer (every band of 20 rows within its noise); the engine that is judged runs with other seeds.
"""

from __future__ import annotations

import sys

import numpy as np
from peers import scenes
from peers.clock import THREADS, cpu_seconds
from peers.ours import BALL_SEGMENTS, our_scene
from peers.references import FOLDER

from render.run import Run
from render.world.placed import PlacedLaser

DIRECT, SEED = 0.0005, 990_000


def main() -> None:
    from render.laser_direct.integrator import direct_image
    from render.laser_indirect.integrator import indirect_images

    name, seconds = sys.argv[1], float(sys.argv[2])
    scene, world = our_scene(scenes.setting(name, BALL_SEGMENTS))
    parts = (world, scene.camera, scene.lasers[0], scene.T_world_camera(), scene.T_world_laser(0))
    direct = direct_image(*parts, target=DIRECT, run=Run(seed=SEED, threads=THREADS))
    start = cpu_seconds()
    run = Run(seed=SEED, threads=THREADS)
    for indirect in indirect_images(PlacedLaser(*parts), target=0.0, most_paths=1 << 40, run=run):
        print(f"{cpu_seconds() - start:.0f} s: error of the indirect light {indirect.error:.2%}", flush=True)
        if cpu_seconds() - start >= seconds:
            break
    print(f"error of the direct light {direct.error:.3%}")
    np.savez_compressed(FOLDER / f"{name}.npz", img=direct.radiance + indirect.radiance, direct=direct.radiance)


if __name__ == "__main__":
    main()
