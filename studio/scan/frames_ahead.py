"""The frames of a scan in their order, of small images some at once: each on its share of the threads.

Much of a small frame is done by one thread while the others wait. Frames know of each other what the first of their
block teaches (`blocks.py`), which is therefore rendered before the frames of the block before it. What is rendered does
not depend on how many are at once.
"""

from __future__ import annotations

import threading
from collections.abc import Generator, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import closing
from dataclasses import dataclass, replace
from itertools import islice

from render.base.threads import Cancel, thread_count
from render.checkpoint import RenderState
from render.frame import Frame
from render.lessons import Lessons
from render.run import unseen
from render.world.world import World
from studio.scan.blocks import Blocks
from studio.scan.interrupt import stop_on_interrupt
from studio.scan.options import Scan
from studio.scan.resume import frame_of_step
from studio.scan.stages import Clock, moved_world

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
    camera, blocks = scan.project.scene.camera, Blocks(scan, first)
    at_once = min(thread_count(scan.options.threads), PIXELS_AT_ONCE // (camera.width * camera.height), count)
    if at_once > 1 and scan.options.seconds is None:
        with closing(_at_once(scan, first, count, at_once, blocks)) as frames:
            yield from frames
        return
    for step in range(count):
        world = moved_world(scan.project, step, first)
        yield _rendered(scan, world, step, blocks)
        blocks.forget(step + 1)


def _rendered(scan: Scan, world: World, step: int, blocks: Blocks) -> Rendered:
    """One frame, taught by the first of its block, or its teacher."""
    asked: list[Lessons | None] = []

    def lessons() -> Lessons | None:
        own = blocks.first_of(step) == step
        asked.append(blocks.own(step) if own else blocks.given(step, scan.clock.cancelled))
        return asked[0]

    frame, state = frame_of_step(scan, world, step, lessons)
    for one in asked:
        if one is not None:
            one.give()
    return Rendered(frame, world, state)


def _order(count: int, blocks: Blocks) -> Iterator[int]:
    """Frames as they are begun: the first of a block before those of the block before it."""
    for step in range(count):
        first = blocks.first_of(step)
        if step == 0:
            yield 0
        if step == first:
            after = next((later for later in range(step + 1, count) if blocks.first_of(later) == later), None)
            if after is not None:
                yield after
        else:
            yield step


def _at_once(scan: Scan, first: World, count: int, at_once: int, blocks: Blocks) -> Generator[Rendered, None, None]:
    """As `rendered_frames`. Those under way end with the iterator, and keep what was done of them."""
    threads, ended, awaited = thread_count(scan.options.threads), threading.Event(), 0
    futures: dict[int, Future[tuple[Rendered, Clock]]] = {}
    several = blocks.first_of(count - 1) > 0

    def render(step: int, cancelled: Cancel) -> tuple[Rendered, Clock]:
        def progress(stage: str, done: float) -> None:
            if step == awaited:
                scan.clock.progress(stage, done)

        teacher, clock = blocks.first_of(step), Clock(progress, lambda: ended.is_set() or cancelled())
        # of a single block all others wait for the first
        options = replace(scan.options, threads=threads if step == 0 and not several else threads // at_once)
        part = replace(scan, clock=clock, options=options, refined=unseen)
        world = moved_world(scan.project, step, first)
        if teacher != step and (under_way := futures.get(teacher)) is not None:
            wait((under_way,))
        return _rendered(part, world, step, blocks), clock

    with ThreadPoolExecutor(at_once, "frame") as pool, stop_on_interrupt(scan.clock.cancelled) as cancelled:
        try:
            order = _order(count, blocks)
            for step in range(count):
                # one more than are rendered, as a first frame of the next block may be waiting
                awaited = step
                for begun in islice(order, max(at_once + 1 - len(futures), 0)):
                    futures[begun] = pool.submit(render, begun, cancelled)
                found, clock = futures[step].result()
                del futures[step]
                blocks.forget(step + 1)
                # of the wall time each of them has its share
                for stage, seconds in clock.seconds.items():
                    scan.clock.seconds[stage] = scan.clock.seconds.get(stage, 0.0) + seconds / at_once
                scan.refined(found.frame)
                yield found
        finally:
            ended.set()
