"""How a render's work is done: one value that goes down to every integrator."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any, Protocol, TypeVar, cast

from numpy.typing import NDArray

from render.base.deadline import Deadline
from render.base.errors import Cancelled
from render.base.threads import Cancel, Progress, map_chunks
from render.frame import Frame
from render.importance import Importance
from render.lessons import Lessons
from render.sampling.random import wrapped

Arrays = dict[str, NDArray[Any]]
Item = TypeVar("Item")


class Sums(Protocol):
    """The sums of a light group under way, which change until its image is done."""

    consistent: bool
    """False while they change: an interruption there would leave half a wave in them."""

    def arrays(self) -> Arrays:
        """What going on later takes."""


class Checkpoint(Protocol):
    """What keeps the sums of each part of a frame, so that a render can go on later."""

    def restore(self, part: str, load: Callable[[Arrays], Item]) -> Item | None:
        """What `load` makes of a saved part; None: nothing of it is there. InputError: it is damaged."""

    def keep(self, part: str, sums: Sums) -> None:
        """Hold on to the sums of a part, which change from then on."""


class Memory:
    """What a frame leaves to those after it, which would find the same: the last value of each part of the light."""

    def __init__(self, *, one_frame: bool = False) -> None:
        """one_frame: nothing is kept that only frames after it would find again."""
        self._kept: dict[str, tuple[object, Any, Any]] = {}
        self.one_frame = one_frame

    def recall(self, part: str, world: object, made_of: Any) -> Any:
        """The value of a part that was made in the very same world, of the equal; None: there is none."""
        kept = self._kept.get(part)
        return kept[2] if kept is not None and kept[0] is world and kept[1] == made_of else None

    def keep(self, part: str, world: object, made_of: Any, value: object, *, for_others: bool = False) -> None:
        """Of a part as of now, in place of the one before; for_others: the frame itself asks for it but once."""
        if not (for_others and self.one_frame):
            self._kept[part] = world, made_of, value


def never() -> bool:
    return False


def unseen(frame: Frame) -> None:
    """Of a frame that nobody looks at before it is done."""


def ignore(done: float) -> None:
    """Progress that nobody watches."""


@dataclass(frozen=True)
class Run:
    """How work is done: nothing here but the seed and the goal changes a number of the finished image."""

    seed: int = 0
    """Any whole number; the same seed gives the same image on any number of threads."""
    threads: int | None = None
    """None: as many as this process may use."""
    progress: Progress = ignore
    """progress(share 0..1) of the work that this value was handed to."""
    cancelled: Cancel = never
    """Called often, from any thread; True raises Cancelled. It may hold the render by not answering: a pause."""
    keep_partial: Cancel = never
    """Called once cancelled: whether the light that is unfinished is wanted, as one more image."""
    seconds: float | None = None
    """Time for the light of a frame, each group with its share; it ends then, whatever its errors. None: no end."""
    checkpoint: Checkpoint | None = None
    """What to go on from, and what keeps the sums under way."""
    memory: Memory | None = None
    """What frames before this one left: the same value for all frames of a scan. None: each is by itself."""
    lessons: Lessons | None = None
    """Of the block of a scan that the frame is in: what its first frame leaves to the others. None: each by itself."""
    deadline: Deadline = Deadline()  # noqa: RUF009, it has no end and does not change
    """Of the frame under way, which `render.progressive` begins from `seconds`."""
    later: int = 0
    """Parts of the frame that come after this one, which have their share of its time as well."""
    watched: bool = True
    """Somebody looks at images before the last of each light: others are made only where a time limit may end it."""
    goal: Callable[[Frame], Importance] | None = None
    """Where errors matter, of a frame as far as it is known; None: everywhere alike."""
    part: str = ""
    """Name of what is rendered, under which the checkpoint keeps it."""

    def shifted(self, offset: int) -> Run:
        """With another seed, for work whose random numbers are to be its own."""
        return replace(self, seed=wrapped(self.seed + offset))

    def between(self, start: float, stop: float) -> Run:
        """Whose progress is that of a part, from start to stop of the whole."""
        report = self.progress
        return replace(self, progress=lambda done: report(start + done * (stop - start)))

    def map(self, work: Callable[[int, int], None], count: int, chunk: int) -> None:
        """`render.base.threads.map_chunks` with these threads, this progress and this way to stop. Raises Cancelled."""
        map_chunks(work, count, chunk, self.threads, self.cancelled, self.progress)

    def stop(self) -> None:
        """Raises Cancelled where it was requested."""
        if self.cancelled():
            raise Cancelled

    def time_is_over(self, left: int = 1) -> Cancel:
        """What says, from now on, whether an equal share of the time is over, for so many parts of this light group."""
        return self.deadline.share(left + self.later)

    def restore(self, load: Callable[[Arrays], Item]) -> Item | None:
        """What `load` makes of this part as it was kept; None: it begins anew. InputError: it is damaged."""
        return None if self.checkpoint is None else self.checkpoint.restore(self.part, load)

    def keep(self, sums: Sums) -> None:
        """Hold on to the sums of this part."""
        if self.checkpoint is not None:
            self.checkpoint.keep(self.part, sums)

    def recall(self, part: str, world: object, made_of: Any) -> Any:
        """As `Memory.recall`."""
        return None if self.memory is None else self.memory.recall(part, world, made_of)

    def leave(self, part: str, world: object, made_of: Any, value: object, *, for_others: bool = False) -> None:
        """As `Memory.keep`."""
        if self.memory is not None:
            self.memory.keep(part, world, made_of, value, for_others=for_others)

    def remembered(self, part: str, world: object, made_of: Any, make: Callable[[], Item]) -> Item:
        """The value of a part that this frame or one before it has made, or what `make` makes of it now."""
        value = self.recall(part, world, made_of)
        if value is None:
            value = make()
            self.leave(part, world, made_of, value)
        return cast(Item, value)

    def taught(self, part: str) -> Any:
        """What the first frame of the block found of a part; None: this is it, or there is no block."""
        return None if self.lessons is None else self.lessons.taught(part)

    @property
    def alone(self) -> bool:
        """What this frame finds is no other frame's."""
        return self.lessons is None and (self.memory is None or self.memory.one_frame)

    @property
    def shows_early(self) -> bool:
        """An image is wanted before the last: to be looked at, or in place of that when the time is over."""
        return self.watched or math.isfinite(self.deadline.end)

    @property
    def teaches(self) -> bool:
        """This is the first frame of a block, and others are taught what it finds."""
        return self.lessons is not None and not self.lessons.given

    def teach(self, part: str, value: object) -> None:
        """Leave what was found of a part to the other frames of the block, if this is its first."""
        if self.lessons is not None:
            self.lessons.teach(part, value)

    def until_over(self, images: Callable[[Run], Iterator[Item]]) -> Iterator[Item]:
        """images(run), whose run the end of the time cancels as well, though not before there is a first image.

        What is unfinished then is kept, and no Cancelled raised but where it was requested.
        """
        begun, over = False, self.time_is_over()

        def cancelled() -> bool:
            return self.cancelled() or (begun and over())

        def keep_partial() -> bool:
            return not self.cancelled() or self.keep_partial()

        try:
            for image in images(replace(self, cancelled=cancelled, keep_partial=keep_partial)):
                begun = True
                yield image
        except Cancelled:
            if self.cancelled():
                raise
