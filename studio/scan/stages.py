"""The stages of a scan: render, develop, extract, triangulate, compare; each timed, its progress reported."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from analysis.error import Errors, compare
from analysis.line.result import Line
from analysis.line.settings import Method
from analysis.triangulate import Points, triangulate
from render.base.errors import Cancelled
from render.base.progress import Clock as RenderClock
from render.base.threads import Cancel
from render.frame import Frame
from render.run import Run, never, unseen
from render.scene.motion import NoMotion
from render.scene.settings import DepthGoal
from render.sensor.develop import Image
from render.sensor.sensor import Sensor
from render.world.placed import PlacedScene
from render.world.world import World, build_world
from studio.project.found_motion import measured_pose, motion_error
from studio.project.project import Project
from studio.runtime.console import FRAMES, StageProgress
from studio.scan.exposure import expose
from studio.scan.line_extraction import extract_line
from studio.scan.render_goal import goal_of, undecided_rows
from studio.scan.spacetime_window import Passing, along_time

if TYPE_CHECKING:
    from render.scan_plan import ScanPlan

JUDGING = "rows that hang on little"
"""Stage in which rows are looked for that noise as small as the goal decides."""


@dataclass(frozen=True)
class Measurement:
    """What one laser's image of one frame gave, by one method."""

    step: int
    laser: int
    image: Image
    line: Line
    points: Points
    errors: Errors


@dataclass
class Clock:
    """Wall time by stage, and progress of the stages."""

    progress: StageProgress
    cancelled: Cancel
    seconds: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def stage(self, name: str) -> Iterator[Callable[[float], None]]:
        """Time a stage under its name. Cancelled: it was requested before the stage began."""
        if self.cancelled():
            raise Cancelled
        self.progress(name, 0.0)
        start = time.perf_counter()
        yield lambda done: self.progress(name, min(done, 0.999))
        self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start
        self.progress(name, 1.0)

    def frames(self, count: int) -> Iterator[int]:
        """0..count - 1, reported as the progress of FRAMES where there are several."""
        for i in range(count):
            if count > 1:
                self.progress(FRAMES, i / count)
            yield i
        if count > 1:
            self.progress(FRAMES, 1.0)


def scaled(project: Project, image_scale: float) -> Project:
    """The same project with `image_scale` times the pixels a side, exposed so that the image is about as bright.

    The pixels grow as the image shrinks, and with them the light of each; the exposure time takes that back.
    """
    if image_scale == 1.0:
        return project
    scene = project.scene.scaled(image_scale)
    sensor, calibration = (
        scaled_sensor(project.sensor, image_scale),
        project.calibration.scaled(image_scale, scene.camera),
    )
    return project.model_copy(update={"scene": scene, "sensor": sensor, "calibration": calibration})


def scaled_sensor(sensor: Sensor, image_scale: float) -> Sensor:
    """The sensor of `scaled`."""
    return sensor.model_copy(update={"exposure_time": sensor.exposure_time * image_scale**2})


def validated(project: Project, where: str) -> Project:
    """The project, of whose numbers some were worked out. InputError: one is beyond its limits."""
    return Project.from_data(project.model_dump(mode="json"), where)


def step_world(project: Project, root: Path, step: int, before: World | None) -> World:
    """The placed triangles of a step; the ones before where the objects stand still."""
    return before if before is not None and not _objects_move(project) else build_world(project.scene, root, step)


def moved_world(project: Project, step: int, first: World) -> World:
    """The placed triangles of a step, from those of step 0; nothing is read or built again."""
    if step == 0 or not _objects_move(project):
        return first
    motion = project.scene.motion
    return first.moved(motion.displacement(step) @ np.linalg.inv(motion.displacement(0)))


def _objects_move(project: Project) -> bool:
    motion = project.scene.motion
    return not isinstance(motion, NoMotion) and motion.moves == "objects"


def render_step(
    project: Project,
    world: World,
    step: int,
    clock: Clock,
    run: Run = Run(),
    *,
    refined: Callable[[Frame], None] = unseen,
    scan: ScanPlan | None = None,
) -> Frame:
    """Radiance and truth of one step, with the project's seed; stopped by the run, or unless it can be by the clock.

    refined: hears of every frame as it gets better, the last is the result. scan: the plan of a whole scan.
    """
    from render.progressive import frames  # takes a while, and a window opens before anything is rendered

    cancelled = clock.cancelled if run.cancelled is never else run.cancelled
    goal, watched = goal_of(project, run.threads), refined is not unseen
    run = replace(run, seed=project.seed, cancelled=cancelled, goal=goal, watched=watched)
    placed, watch = PlacedScene(world, project.scene, step), RenderClock(clock.progress)
    for frame in frames(placed, project.render_settings, run, watch, axis=project.extraction.axis, scan=scan):
        refined(frame)
    if project.render.goal is not None and step == 0:
        frame = _judged(project, frame, project.render.goal, clock, run.threads)
        refined(frame)
    for name, spent in frame.seconds.items():
        clock.seconds[name] = clock.seconds.get(name, 0.0) + spent
    return frame


def _judged(project: Project, frame: Frame, goal: DepthGoal, clock: Clock, threads: int | None) -> Frame:
    """The frame with what is undecided in its rows, once for a scan: it takes about five extractions."""
    if not any(one.of == "line" for one in frame.quality):
        return frame
    with clock.stage(JUDGING):
        found = {
            laser.name: undecided_rows(project, goal, frame, i, threads) for i, laser in enumerate(project.scene.lasers)
        }
    quality = (
        replace(one, undecided=found[one.laser]) if one.group == "direct" and one.laser in found else one
        for one in frame.quality
    )
    return replace(frame, quality=tuple(quality))


def develop_step(
    project: Project, frame: Frame, clock: Clock, threads: int | None, laser_power: Sequence[float] | None = None
) -> list[Image]:
    """One image for each laser: they fire one after the other, so that no line hides another.

    laser_power: W of each, in place of the scene's, which the frame was rendered with.
    """
    frame.check()  # it may come from a file
    with clock.stage("sensor"):
        return [develop_laser(project, frame, i, threads, laser_power) for i in range(len(project.scene.lasers))]


def develop_laser(
    project: Project,
    frame: Frame,
    laser: int,
    threads: int | None = None,
    laser_power: Sequence[float] | None = None,
    *,
    noise: bool = True,
) -> Image:
    """The image while one laser fires; laser_power as in `develop_step`."""
    powers = [one.power for one in project.scene.lasers] if laser_power is None else laser_power
    alone = [value if laser == k else 0.0 for k, value in enumerate(powers)]
    return expose(project, frame, alone, laser, noise=noise, threads=threads)


def measure_step(
    project: Project,
    frame: Frame,
    world: World,
    images: list[Image],
    clock: Clock,
    threads: int | None,
    method: Method | None = None,
    passing: Passing | None = None,
) -> list[Measurement]:
    """Line, points and errors of every laser's image, by the project's method or another.

    passing: the frames around this one, where the line is to be measured along time.
    """
    found = []
    for i, image in enumerate(images):
        with clock.stage("line extraction"):
            line = extract_line(project, image, i, threads, method)
            if passing is not None:
                line = along_time(project, line, passing, i, threads)
        with clock.stage("triangulation"):
            points = triangulate_line(project, line, i, frame.step)
        with clock.stage("comparison with the truth"):
            errors = compare_points(project, frame, world, points, line, i)
        found.append(Measurement(frame.step, i, image, line, points, errors))
    return found


def triangulate_line(project: Project, line: Line, laser: int, step: int) -> Points:
    """Points of one laser's line at a step; in the world by the motion that was found, where the project has one."""
    scene, found = project.scene, project.calibration
    points = triangulate(
        line,
        found.camera_of(scene.camera),
        found.plane(laser, scene.laser_plane(laser)),
        T_rig_camera=scene.camera.T_rig_camera.matrix,
        T_world_camera=measured_pose(scene, found.motion, step),
        calibration_covariance=found.covariance(laser),
    )
    return replace(points, motion=motion_error(scene, found.motion, step, points.camera))


def compare_points(project: Project, frame: Frame, world: World, points: Points, line: Line, laser: int) -> Errors:
    """Errors of one laser's points against the truth of a frame; world: placed for its step."""
    pose = measured_pose(project.scene, project.calibration.motion, frame.step)
    return compare(points, line, frame.curves[laser], world.vertices, world.triangles, pose)
