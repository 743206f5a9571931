"""Large arrays go back to the system when they are freed: of the window, and of workers that render by the thousand.

The GNU allocator learns from each freed array to keep such sizes for itself, in an arena for each thread: after some
renders it holds hundreds of megabytes that nobody uses. Fixed limits stop it from learning.
"""

from __future__ import annotations

import contextlib
import ctypes
import gc
import sys

M_TRIM_THRESHOLD, M_MMAP_THRESHOLD, M_ARENA_MAX = -1, -3, -8
LARGE_BYTES = 2 * 2**20
ARENAS = 2


def return_large_blocks() -> None:
    """Once, before the first render; does nothing where the allocator is another one."""
    for option, value in ((M_MMAP_THRESHOLD, LARGE_BYTES), (M_TRIM_THRESHOLD, LARGE_BYTES), (M_ARENA_MAX, ARENAS)):
        _call("mallopt", option, value)


def return_what_is_free() -> None:
    """After much was given up at once: a project is closed, a scan has its frames. Some tens of milliseconds."""
    gc.collect()
    _call("malloc_trim", 0)


def _call(name: str, *arguments: int) -> None:
    if not sys.platform.startswith("linux"):
        return
    with contextlib.suppress(OSError, AttributeError):
        getattr(ctypes.CDLL("libc.so.6"), name)(*arguments)
