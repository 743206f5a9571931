"""The blocks of a scan's frames, of which the first teaches the others (`render.lessons`).

Which they are follows from the project alone, and what is taught from the project and its seed: a first frame that is
found in the folder is rendered once more, for its lessons, as soon as another frame of its block is rendered.
"""

from __future__ import annotations

import threading
from dataclasses import replace

from render.base.threads import Cancel
from render.lessons import Lessons
from render.world.world import World
from studio.scan.options import Scan
from studio.scan.stages import Clock, moved_world, render_step

FRAMES = 16
"""Most frames of a block. With as many a first frame, which takes about three times as long, costs an eighth of all."""


def first_of_block(step: int, frame_count: int) -> int:
    """The first frame of the block that a step is in; all blocks are as long, but for the last."""
    blocks = -(-frame_count // FRAMES)
    length = -(-frame_count // blocks)
    return step // length * length


class Blocks:
    """The lessons of a scan's blocks, each there from when it is needed first to when its frames are done."""

    def __init__(self, scan: Scan, first: World) -> None:
        """first: the world of step 0."""
        self._scan, self._first = scan, first
        self._lock = threading.Lock()
        self._kept: dict[int, tuple[threading.Lock, Lessons]] = {}

    def first_of(self, step: int) -> int:
        """The first frame of a step's block."""
        return first_of_block(step, self._scan.project.scene.frame_count)

    def own(self, step: int) -> Lessons | None:
        """What the first frame of a block is to leave its lessons in; None: there is no other frame.

        `give` them once it is done.
        """
        return None if self._alone else self._of(step)[1]

    def given(self, step: int, cancelled: Cancel) -> Lessons | None:
        """What a frame is taught that is not the first of its block; None: nothing. Raises as `render_step`."""
        if self._alone:
            return None
        first = self.first_of(step)
        lock, lessons = self._of(first)
        with lock:
            if not lessons.given:
                self._render(first, lessons, cancelled)
                lessons.give()
        return lessons

    def forget(self, step: int) -> None:
        """All frames before a step are done."""
        with self._lock:
            for first in [first for first in self._kept if first < self.first_of(step)]:
                del self._kept[first]

    @property
    def _alone(self) -> bool:
        """Each frame is by itself: what is known when its time is over depends on the machine."""
        scan = self._scan
        return scan.options.seconds is not None or scan.project.render.goal is None or scan.plan is None

    def _of(self, first: int) -> tuple[threading.Lock, Lessons]:
        with self._lock:
            return self._kept.setdefault(first, (threading.Lock(), Lessons()))

    def _render(self, first: int, lessons: Lessons, cancelled: Cancel) -> None:
        scan = self._scan
        project, quiet = scan.rendered, Clock(lambda stage, done: None, cancelled)
        world = moved_world(project, first, self._first)
        run = replace(scan.run, cancelled=cancelled, lessons=lessons)
        render_step(project, world, first, quiet, run, scan=scan.plan)
