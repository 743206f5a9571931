"""A scan of 2,000 frames of 2048 rows, measured and reported: memory after 200, 1,000 and 2,000 frames.

    python tests/benchmarks/bench_memory.py [frames]      default: 2000

Bar: from 200 frames on within 5 %. The frames are narrow and their light is rendered once, so that it takes minutes
and not hours; what is kept of a frame depends on its rows alone.
"""

from __future__ import annotations

import sys
import tempfile
import time
from contextlib import closing
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from render.base.pose import Pose
from render.camera.camera import Camera
from render.laser.laser import LineLaser
from render.scene.motion import LinearStage
from render.scene.scene import Rig, Scene, SceneObject
from render.scene.settings import RenderSettings
from render.scene.shape import Plane
from render.world.world import build_world
from studio.project.project import Project
from studio.scan.kernel_warm_up import SENSOR
from studio.scan.measuring import Measuring
from studio.scan.stages import Clock, develop_step, render_step
from studio.scan.summary import summarise

BAR = 0.05
ROWS, WIDTH = 2048, 64
NOISES = 4
"""Images of different noise, in turn."""


def memory() -> float:
    """MB that the process holds now."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096 / 1e6


def narrow(frames: int) -> Project:
    """A wall 0.8 m away that moves along itself, and a line down the middle of a narrow image."""
    camera = Camera(width=WIDTH, height=ROWS, fx=4800, fy=4800, cx=-60, cy=(ROWS - 1) / 2, pixel_pitch=3.45e-6)
    pose = Pose(translation=(0.2, 0.0, 0.0), rotation=(0.0, -0.226893, 0.0))
    wall = SceneObject(name="wall", shape=Plane(width=2.0, height=2.0), T_world_object=Pose(translation=(0, 0, 0.8)))
    motion = LinearStage(moves="rig", step=(1e-5, 0.0, 0.0), steps=frames)
    scene = Scene(
        rig=Rig(camera=camera, lasers=(LineLaser(power=5e-4, fan_angle=0.6, T_rig_laser=pose),)),
        objects=(wall,),
        motion=motion,
    )
    return Project(
        name="long", scene=scene, sensor=SENSOR, render=RenderSettings(transport="direct", truth_images=False)
    )


def main() -> int:
    frames = int(sys.argv[1]) if len(sys.argv) > 1 else 2000
    project = narrow(frames)
    clock = Clock(lambda stage, done: None, lambda: False)
    world = build_world(project.scene, Path(), 0)
    frame = render_step(project, world, 0, clock)
    noisy = [project.model_copy(update={"seed": seed}) for seed in range(NOISES)]
    images = [develop_step(one, frame, clock, None) for one in noisy]
    began, held = time.perf_counter(), {}
    with tempfile.TemporaryDirectory() as name, closing(Measuring(project, Path(name), clock, None, frames)) as done:
        for step in range(frames):
            done.add(replace(frame, step=step), world, images[step % NOISES])
            if step + 1 in (frames // 10, frames // 2, frames):
                held[step + 1] = memory()
                print(
                    f"after {step + 1} frames: {held[step + 1]:.0f} MB, {time.perf_counter() - began:.0f} s", flush=True
                )
        done.finish()
        done.write_points(Path(name))
        row = summarise(done.record)[0]
        print(f"{row['points']} points, {row['sampled_scan_lines']} of {row['scan_lines']} scan lines in the sample")
        done.write_reports(Path(name), world, logo_folder=Path(name), notes=())
        print(f"after points and report: {memory():.0f} MB, {time.perf_counter() - began:.0f} s")
        if len(sys.argv) > 2:
            for path in Path(name).glob("report.*"):
                Path(sys.argv[2], path.name).write_bytes(path.read_bytes())
    grown = max(held.values()) / min(held.values()) - 1.0
    print(f"grown by {grown:.1%}, bar {BAR:.0%}")
    return 0 if grown <= BAR else 1


if __name__ == "__main__":
    sys.exit(main())
