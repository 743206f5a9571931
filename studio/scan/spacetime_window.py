"""A moving scan measured along time: each frame waits until those around it are there."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.line.result import Line
from analysis.line.series import spacetime_moving
from analysis.line.series.hdr import fuse
from render.base.errors import InputError
from render.frame import Frame
from render.scene.motion import NoMotion
from render.scene.scene import Scene
from render.sensor.develop import Image
from render.world.world import World
from studio.project.project import Project
from studio.scan.line_extraction import noise_model


@dataclass(frozen=True)
class Taken:
    """One frame as it waits: without its radiance, which only its images still need."""

    frame: Frame
    world: World
    images: list[Image]


@dataclass(frozen=True)
class Passing:
    """The frames around one, in order, and which of them it is."""

    taken: tuple[Taken, ...]
    at: int


class Sweep:
    """Hands frames on as they come, or, where lines are measured along time, once their neighbours are there."""

    def __init__(self, project: Project) -> None:
        self.waits = project.extraction.spacetime
        if self.waits and isinstance(project.scene.motion, NoMotion):
            raise InputError(
                "along time only a moving scan can be measured, and nothing moves",
                where="extraction.spacetime",
                cure="give the scene a motion, or switch it off",
            )
        self._taken: deque[Taken] = deque(maxlen=2 * spacetime_moving.MOST + 1)
        self._next = 0
        """Place in `_taken` of the frame to hand on next."""

    def add(self, frame: Frame, world: World, images: list[Image]) -> Iterator[tuple[Taken, Passing | None]]:
        """Another frame; yields those that can be measured now."""
        if not self.waits:
            yield Taken(frame, world, images), None
            return
        light = replace(frame, laser_direct=(), laser_indirect=(), ambient=None, truth=None)
        if len(self._taken) == self._taken.maxlen:
            self._next -= 1
        self._taken.append(Taken(light, world, images))
        if len(self._taken) - self._next > spacetime_moving.MOST:
            yield self._hand_on()

    def finish(self) -> Iterator[tuple[Taken, Passing | None]]:
        """Those that waited for frames that never came."""
        while self._next < len(self._taken):
            yield self._hand_on()

    def _hand_on(self) -> tuple[Taken, Passing | None]:
        at = self._next
        self._next += 1
        return self._taken[at], Passing(tuple(self._taken), at)


def surface_motion(scene: Scene, start: int, step: int) -> NDArray[np.float64]:
    """(4, 4): a point of the moving parts, from the camera's frame at `start` to that at `step`."""
    before = scene.T_world_camera(start)
    if not isinstance(scene.motion, NoMotion) and scene.motion.moves == "objects":
        before = scene.motion.displacement(step) @ np.linalg.inv(scene.motion.displacement(start)) @ before
    return np.asarray(np.linalg.inv(scene.T_world_camera(step)) @ before)


def along_time(project: Project, line: Line, passing: Passing, laser: int, threads: int | None = None) -> Line:
    """One laser's line measured along time. InputError: as `analysis.line.series.spacetime_moving.along_time`, or a
    Bayer sensor.
    """
    scene, images = project.scene, [taken.images[laser] for taken in passing.taken]
    here = passing.taken[passing.at].frame.step
    if images[0].pattern is not None:
        raise InputError(
            "along time only mono images can be followed", where="extraction.spacetime", found="a Bayer sensor"
        )
    noise, variances = noise_model(images[0], project, laser), None
    frames: list[NDArray[Any]] = [image.pixels for image in images]
    if images[0].shorter:
        fused = []
        for image in images:
            series = (image, *image.shorter)
            fused.append(fuse([one.pixels for one in series], [one.exposure_time for one in series], noise))
        frames, variances, noise = [f.electrons for f in fused], [f.variance for f in fused], fused[0].noise
    moves = np.stack([surface_motion(scene, here, taken.frame.step) for taken in passing.taken])
    plane = scene.laser_plane(laser)
    sweep = spacetime_moving.Sweep(frames, passing.at, moves, plane, scene.camera, noise, variances)
    found = spacetime_moving.along_time(line, sweep, threads)
    return replace(found, note="; ".join(filter(None, (line.note, "measured along time"))))
