"""Frames that a search asks for again and again, step by step, kept by the worker that rendered them."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from dataclasses import fields

import numpy as np

from studio.notebook.frame import RenderedFrame

MOST_BYTES = 256 << 20
"""Of a worker's frames, beside the one at work."""

_frames: OrderedDict[Hashable, tuple[RenderedFrame, float]] = OrderedDict()


def rendered(key: Hashable, render: Callable[[], tuple[RenderedFrame, float]]) -> tuple[RenderedFrame, float]:
    """The frame of a key with the processor seconds that it took when it was rendered."""
    found = _frames.pop(key, None) or render()
    _frames[key] = found
    while len(_frames) > 1 and sum(map(_size, _frames.values())) > MOST_BYTES:
        _frames.popitem(last=False)
    return found


def forget() -> None:
    """Of another study, whose meshes may have changed."""
    _frames.clear()


def _size(kept: tuple[RenderedFrame, float]) -> int:
    frame, _ = kept
    truth = [] if frame.truth is None else [getattr(frame.truth, one.name) for one in fields(frame.truth)]
    return sum(np.asarray(image).nbytes for image in (*frame.light, *truth))
