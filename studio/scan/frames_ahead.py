"""The frames of a scan in their order, of small images some at once: each on its share of the threads.

Much of a small frame is done by one thread while the others wait; frames know nothing of each other. What is rendered
does not depend on how many are at once.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Generator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass, replace

from render.base.threads import Cancel, thread_count
from render.checkpoint import RenderState
from render.frame import Frame
from render.world.world import World
from studio.scan.interrupt import stop_on_interrupt
from studio.scan.options import Scan
from studio.scan.resume import frame_of_step
from studio.scan.stages import Clock, step_world

PIXELS_AT_ONCE = 3_000_000
"""Of the frames that are rendered at once: their memory is that of one large frame."""


@dataclass(frozen=True)
class Rendered:
    """A frame, the world that it shows, and its state, for `settle` once it is written."""

    frame: Frame
    world: World
    state: RenderState


def rendered_frames(scan: Scan, first: World, count: int) -> Generator[Rendered, None, None]:
    """Frames 0 .. count; first: the world of the first. As `frame_of_step`, whose errors are raised in their order.

    Where several are rendered at once, `scan.refined` hears of each when it is done.
    """
    camera = scan.project.scene.camera
    at_once = min(thread_count(scan.options.threads), PIXELS_AT_ONCE // (camera.width * camera.height), count)
    if at_once > 1 and scan.options.seconds is None:
        with closing(_at_once(scan, first, count, at_once)) as frames:
            yield from frames
        return
    world = first
    for step in range(count):
        world = world if step == 0 else step_world(scan.project, scan.begun.root, step, world)
        frame, state = frame_of_step(scan, world, step)
        yield Rendered(frame, world, state)


def _at_once(scan: Scan, first: World, count: int, at_once: int) -> Generator[Rendered, None, None]:
    """As `rendered_frames`. Those under way end with the iterator, and keep what was done of them."""
    options = replace(scan.options, threads=thread_count(scan.options.threads) // at_once)
    ended, awaited = threading.Event(), 0

    def render(step: int, cancelled: Cancel) -> tuple[Rendered, Clock]:
        def progress(stage: str, done: float) -> None:
            if step == awaited:
                scan.clock.progress(stage, done)

        clock = Clock(progress, lambda: ended.is_set() or cancelled())
        part = replace(scan, clock=clock, options=options, refined=lambda frame: None)
        world = first if step == 0 else step_world(scan.project, scan.begun.root, step, first)
        frame, state = frame_of_step(part, world, step)
        return Rendered(frame, world, state), clock

    with ThreadPoolExecutor(at_once, "frame") as pool, stop_on_interrupt(scan.clock.cancelled) as cancelled:
        try:
            ahead: deque[Future[tuple[Rendered, Clock]]] = deque()
            for step in range(count + at_once):
                if step < count:
                    ahead.append(pool.submit(render, step, cancelled))
                if step >= at_once:
                    awaited = step - at_once
                    found, clock = ahead.popleft().result()
                    # of the wall time each of them has its share
                    for stage, seconds in clock.seconds.items():
                        scan.clock.seconds[stage] = scan.clock.seconds.get(stage, 0.0) + seconds / at_once
                    scan.refined(found.frame)
                    yield found
        finally:
            ended.set()
