"""Bytes gone wrong: cut, flipped, moved, overwritten, with other numbers in them."""

from __future__ import annotations

import re
import struct
from random import Random

WORDS = tuple(struct.pack("<I", value) for value in (0, 1, 2**16, 2**28, 2**31 - 1, 2**31, 2**32 - 1))
FLOATS = tuple(struct.pack("<f", value) for value in (float("nan"), float("inf"), -1e38, 1e-45, 1e20))
NUMBERS = (
    b"nan", b"-nan", b"inf", b"1e999", b"1e308", b"-1", b"0", b"4", b"99999999", b"2147483648",
    b"99999999999999999999", b"1.5", b"", b"x", b"1e-320", b"1 2", b"0x10",
)  # fmt: skip


def damaged(content: bytes, rng: Random) -> bytes:
    """The content, damaged in one to four ways; half of them near its beginning, where headers are."""
    data = bytearray(content)
    ways = (_cut, _flip, _overwrite, _drop, _insert, _repeat, _exchange, _word, _number, _number)
    for way in rng.choices(ways, k=rng.choices((1, 2, 4), (6, 2, 1))[0]):
        if data:
            way(data, rng)
    if rng.random() < 0.02:
        return b""
    return bytes(data)


def _where(data: bytearray, rng: Random) -> int:
    share = rng.random()
    return int(len(data) * (share**4 if rng.random() < 0.5 else share))


def _cut(data: bytearray, rng: Random) -> None:
    del data[_where(data, rng) :]


def _flip(data: bytearray, rng: Random) -> None:
    for _ in range(rng.choice((1, 1, 2, 8, 64))):
        data[_where(data, rng)] ^= 1 << rng.randrange(8)


def _overwrite(data: bytearray, rng: Random) -> None:
    start, length = _where(data, rng), rng.choice((1, 4, 16, 256))
    filler = rng.choice((b"\0" * length, b"\xff" * length, rng.randbytes(length)))
    data[start : start + length] = filler[: max(0, len(data) - start)]


def _drop(data: bytearray, rng: Random) -> None:
    start = _where(data, rng)
    del data[start : start + rng.choice((1, 3, 12, 100, 1000))]


def _insert(data: bytearray, rng: Random) -> None:
    start = _where(data, rng)
    data[start:start] = rng.choice((b"\0", b"\n", b" nan ", b"\xff\xfe", rng.randbytes(7), b"\x1b[2J", b"-"))


def _repeat(data: bytearray, rng: Random) -> None:
    start = _where(data, rng)
    data[start:start] = data[start : start + rng.choice((1, 10, 200))] * rng.choice((1, 3, 50))


def _exchange(data: bytearray, rng: Random) -> None:
    a, b, length = _where(data, rng), _where(data, rng), rng.choice((1, 4, 12, 100))
    first, second = data[a : a + length], data[b : b + length]
    if abs(a - b) >= length and len(first) == len(second):
        data[a : a + length], data[b : b + length] = second, first


def _word(data: bytearray, rng: Random) -> None:
    """Four bytes that mean an extreme number, in either order."""
    start, word = _where(data, rng), rng.choice(WORDS + FLOATS)
    data[start : start + 4] = rng.choice((word, word[::-1]))[: max(0, len(data) - start)]


def _number(data: bytearray, rng: Random) -> None:
    """One of the numbers of a text."""
    numbers = list(re.finditer(rb"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?", data[:200_000]))
    if numbers:
        share = rng.random()
        chosen = numbers[int(len(numbers) * (share**4 if rng.random() < 0.5 else share))]
        data[chosen.start() : chosen.end()] = rng.choice(NUMBERS)
