"""Keeps None, True and False alive: PySide6 6.12 counts on Python 3.12, in which they cannot die.

Built for the stable ABI of 3.12, it returns them without taking a reference. On Python 3.11 every call of a Qt function
then loses one, and after some minutes the program would end with "deallocating None". PySide6 6.11 is not affected.
"""

from __future__ import annotations

import ctypes
import sys

FOR_EVER = 1 << 40
"""References to spare: a thousand lost in a millisecond, for 35 years."""


def keep_alive() -> None:
    """Give the constants references that nobody holds. Once is enough; from Python 3.12 on, nothing to do."""
    if sys.implementation.name != "cpython" or sys.version_info >= (3, 12):
        return
    for constant in (None, True, False, NotImplemented, Ellipsis):
        if sys.getrefcount(constant) < FOR_EVER // 2:
            # the count is the first field of every object
            ctypes.c_ssize_t.from_address(id(constant)).value += FOR_EVER
