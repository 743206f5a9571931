"""What the render panel's job does, apart from the panel."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from PySide6.QtCore import QObject

from render.base.threads import Cancel
from render.frame import Frame
from render.run import Run
from render.world.world import World, build_world
from studio.project.project import Project
from studio.qt.core.render import Render
from studio.qt.core.session import Session
from studio.runtime.jobs import Progress
from studio.runtime.place_words import in_words
from studio.scan.kernel_warm_up import all_compiled, begin, needed, warm_up
from studio.scan.render_goal import goal_of

MOST_SECONDS, LOOK_SECONDS = 3.0, 0.05
"""That light waits for figures, and between two questions whether it is cancelled."""


def render_frames(
    project: Project,
    root: Path,
    step: int,
    world: World | None,
    run: Run,
    progress: Progress,
    take: Callable[[World, Frame], None],
    measured: Callable[[Cancel], None],
) -> None:
    """Prepare kernels, load what is not loaded and refine; every frame goes to `take`. Raises InputError, Cancelled.

    run: with the project's seed, whatever its own. measured: returns when figures of the last frame are there; they go
    before the reflected light, which takes longest and moves them least, unless the time is limited.
    """
    from render.progressive import refine  # takes a while: not before something is rendered

    # what is compiled is loaded where it is called: most projects need a part of it
    for_line, for_all = ((), ()) if all_compiled() else needed(project)
    # what the live picture waits for goes first
    begin(("look",))
    warm_up(for_line, lambda stage, done: progress(stage, 0.0), run.cancelled)
    begin(for_all)
    if world is None:
        progress("loading meshes", 0.0)
        world = build_world(project.scene, root, step)
    waits = run.seconds is None
    for frame in refine(
        world,
        project.scene,
        settings=project.render_settings,
        step=step,
        axis=project.extraction.axis,
        run=replace(run, seed=project.seed, goal=goal_of(project, run.threads)),
        progress=progress,
    ):
        take(world, frame)
        # the line is there before the kernels of all other light
        warm_up(for_all, lambda stage, done: progress(stage, 0.0), run.cancelled)
        if waits and frame.truth is not None and not frame.awaits_ambient:
            waits = False
            measured(run.cancelled)


class FirstFigures(QObject):
    """Waits for the first figures of a render, and warns once of what is wrong with it, as `inspect` does."""

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self.session = session
        self._render: Render | None = None
        self._told: set[str] = set()
        self._there = threading.Event()
        self._there.set()
        session.measured.connect(self._measured)

    def of(self, render: Render | None) -> None:
        """They are of this one, or of one that is to come."""
        if render is None:
            self._told.clear()
        self._render = render
        self._there.clear()

    def wait(self, cancelled: Cancel) -> None:
        """On the job's thread, for as long as somebody may be measuring. Raises nothing."""
        end = time.monotonic() + MOST_SECONDS
        while self.session.measures and not cancelled() and time.monotonic() < end:
            if self._there.wait(LOOK_SECONDS):
                return

    def warn(self, texts: Sequence[str]) -> None:
        """Of what was not told yet of this render."""
        for text in texts:
            if text not in self._told:
                self._told.add(text)
                self.session.message.emit("warning", in_words(text))

    def _measured(self) -> None:
        render = self.session.shown
        if render is not None and render is self._render:
            self._there.set()
            self._render = None
            self.warn(render.doubts)


def can_go_on(render: Render | None) -> bool:
    """It was stopped early, and what it takes to go on is there."""
    return render is not None and not render.final and render.state is not None
