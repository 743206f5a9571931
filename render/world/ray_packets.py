"""Packets of 16, 8 or 4 rays through Embree's own functions: four times faster than single rays if coherent.

The structures are those of Embree 4's `rtcore_ray.h` and `rtcore_common.h`, `width` values of each field in a row. The
functions are passed as addresses at run time, so that compiled kernels can be cached.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import llvmlite.ir
import numba
import numpy as np
from numba.core import types
from numpy.typing import NDArray

from render.base.arrays import Float32

Int32 = NDArray[np.int32]

COHERENT, ALL_FEATURES = 1 << 16, 0xFFFFFFFF
_NONE = np.uint32(0xFFFFFFFF)
_ARGUMENTS = np.zeros((2, 16), np.uint32)
"""RTCIntersectArguments or RTCOccludedArguments: flags, features, no callbacks; row 1 is for coherent rays."""
_ARGUMENTS[:, 1], _ARGUMENTS[1, 0] = ALL_FEATURES, COHERENT


class Packets(NamedTuple):
    """Rays a packet, and the addresses of a committed scene and of Embree's functions for packets of that width."""

    width: int
    """Rays a packet: 4, 8 or 16."""
    scene: int
    intersect: int
    occluded: int
    arguments: int = _ARGUMENTS[0].ctypes.data
    """Address of the arguments for any rays."""
    coherent: int = _ARGUMENTS[1].ctypes.data
    """Address of the arguments for coherent rays."""


@numba.extending.intrinsic
def _call(typing: Any, function: Any, valid: Any, scene: Any, rays: Any, arguments: Any) -> Any:
    """Call function(valid, scene, rays, arguments), where all five are addresses."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        word = llvmlite.ir.IntType(64)
        kind = llvmlite.ir.FunctionType(llvmlite.ir.VoidType(), [word] * 4)
        builder.call(builder.inttoptr(values[0], kind.as_pointer()), values[1:])
        return context.get_dummy_value()

    return types.void(*[types.int64] * 5), generate


class Buffer(NamedTuple):
    """Memory of one packet, aligned to 64 bytes, and the mask of its valid rays."""

    values: Float32
    words: NDArray[np.uint32]
    """Memory of `values`, read as integers."""
    valid: Int32
    """(width,) -1 for a valid ray, else 0."""
    values_at: int
    """Address of `values`."""
    valid_at: int
    """Address of `valid`."""


def buffer(width: int) -> Buffer:
    """Memory for one call; threads must not share it. Made in Python, since numba is slow to compile slices."""
    raw = np.zeros(25 * width + 16, np.float32)
    skip = (-raw.ctypes.data % 64) // 4
    values, valid = raw[skip : skip + 24 * width], raw[skip + 24 * width : skip + 25 * width].view(np.int32)
    return Buffer(values, values.view(np.uint32), valid, values.ctypes.data, valid.ctypes.data)


@numba.njit(nogil=True, cache=True)
def _fill(to: Buffer, width: int, first: int, origins: Float32, towards: Float32, far: Float32) -> int:
    """Copy rays from `first` on into a packet; origins (n, 3) or (1, 3). Returns how many are valid."""
    count = min(width, towards.shape[0] - first)
    shared = origins.shape[0] == 1
    for j in range(width):
        to.valid[j] = -1 if j < count else 0
        r = first + min(j, count - 1)
        for axis in range(3):
            to.values[axis * width + j] = origins[0 if shared else r, axis]
            to.values[(4 + axis) * width + j] = towards[r, axis]
        to.values[8 * width + j] = far[r]
        # tnear, time; mask; id, flags
        to.values[3 * width + j] = to.values[7 * width + j] = 0.0
        to.words[9 * width + j] = _NONE
        to.words[10 * width + j] = to.words[11 * width + j] = 0
    return count


@numba.njit(nogil=True, cache=True)
def intersect_packets(
    packets: Packets, room: Buffer, origins: Float32, directions: Float32, far: Float32, triangle: Int32
) -> None:
    """First hits of (n,) rays -> triangle (n,), or -1, and far (n,), in place."""
    width = packets.width
    for first in range(0, directions.shape[0], width):
        count = _fill(room, width, first, origins, directions, far)
        for j in range(width):
            # geomID and instID, which follow Ng, u, v and primID
            room.words[18 * width + j] = room.words[19 * width + j] = _NONE
        _call(packets.intersect, room.valid_at, packets.scene, room.values_at, packets.arguments)
        for j in range(count):
            far[first + j] = room.values[8 * width + j]
            missed = room.words[18 * width + j] == _NONE
            triangle[first + j] = -1 if missed else np.int32(room.words[17 * width + j])


@numba.njit(nogil=True, cache=True)
def occluded_packets(
    packets: Packets, room: Buffer, origins: Float32, directions: Float32, far: Float32, blocked: NDArray[np.bool_]
) -> None:
    """Whether anything is hit before far (n,) -> blocked (n,)."""
    width = packets.width
    for first in range(0, directions.shape[0], width):
        count = _fill(room, width, first, origins, directions, far)
        _call(packets.occluded, room.valid_at, packets.scene, room.values_at, packets.arguments)
        for j in range(count):
            # Embree sets tfar to minus infinity where a ray is occluded
            blocked[first + j] = room.values[8 * width + j] < 0.0
