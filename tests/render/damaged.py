"""Files with a few bytes changed, and the words that a message about them must not have."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

PROGRAM_WORDS = re.compile(
    r"Error\b|Exception|NoneType|numpy|ndarray|shape |dtype|broadcast|out of bounds|codec|\(\)|argument|python_buffer"
)
"""Of the program's libraries rather than of the file."""


def damaged_copies(whole: bytes, count: int, seed: int) -> Iterator[bytes]:
    """Copies with one to four places changed, doubled, taken out, or cut short."""
    random = np.random.default_rng(seed)
    digits = [b"9", b"-", b"0", b" ", b"\n", b"nan", b"1e300", b"/", b"99999999"]
    for _ in range(count):
        content = bytearray(whole)
        for _ in range(random.integers(1, 5)):
            place = int(random.integers(0, max(1, len(content))))
            match random.integers(0, 5):
                case 0:
                    content[place : place + 1] = random.bytes(1)
                case 1:
                    content[place : place + 1] = digits[random.integers(0, len(digits))]
                case 2:
                    del content[place : place + int(random.integers(1, 40))]
                case 3:
                    content[place:place] = content[place : place + int(random.integers(1, 80))]
                case 4 if random.random() < 0.3:
                    del content[place:]
        yield bytes(content)
