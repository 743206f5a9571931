"""How often a pass tries what, and which camera paths it has."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numba
import numpy as np

from render.base.arrays import Float, Float32, Int
from render.laser_indirect.guiding import Guide
from render.laser_indirect.photon_emission import FanDistribution
from render.sampling.random import uniform

DRAWN = 256
"""Pixels that are passed over together where they have no camera path."""


class AlikePixels(NamedTuple):
    """Pixels whose random numbers follow from those of the scan line that is measured on them, all others' from their
    own."""

    pixel: Int
    """(m,) in order."""
    line: Int
    """(m,) the scan line of each."""
    lines: int
    """Scan lines, which keys of other pixels come after; 0: nothing is keyed, each path has numbers of its own."""


NO_KEYS = AlikePixels(np.zeros(0, np.int32), np.zeros(0, np.int32), 0)


class DrawnPaths(NamedTuple):
    """The camera paths of a pass."""

    pixels: Int
    """(n,) that have any."""
    keys: Int
    """(n,) the numbers that their random numbers follow from; (0,): from those of the paths."""
    starts: Int
    """(n + 1,) the number of each pixel's first path."""


@dataclass(frozen=True)
class Sampling:
    """How often a pass tries what; decided by earlier passes only, so that each pass is unbiased."""

    light_paths: int
    fan: FanDistribution
    camera_paths: Float32
    """(pixels,) expected."""
    active: Int
    """The pixels that may have a camera path, in order."""
    guide: Guide
    alike: AlikePixels = NO_KEYS

    @cached_property
    def _blocks(self) -> Float:
        """As `block_paths` says, for all passes that sample like this."""
        return np.asarray(block_paths(self.camera_paths, self.active, self.alike))

    def drawn(self, seed: int) -> DrawnPaths:
        """The camera paths of a pass."""
        return draw_camera_paths(self.camera_paths, self.active, self.alike, self._blocks, seed)


@numba.njit(nogil=True, cache=True)
def block_paths(camera_paths: Float32, active: Int, alike: AlikePixels) -> Float:
    """Expected camera paths (blocks,) of each DRAWN pixels of the active ones; infinite where some of them are alike,
    so that none of these is passed over."""
    out = np.zeros((active.shape[0] + DRAWN - 1) // DRAWN)
    for i in range(active.shape[0]):
        out[i // DRAWN] += camera_paths[active[i]]
    for k in range(alike.pixel.shape[0]):
        i = np.searchsorted(active, alike.pixel[k])
        if i < active.shape[0] and active[i] == alike.pixel[k]:
            out[i // DRAWN] = np.inf
    return out


@numba.njit(nogil=True, cache=True)
def draw_camera_paths(camera_paths: Float32, active: Int, alike: AlikePixels, blocks: Float, seed: int) -> DrawnPaths:
    """The camera paths of a pass, where some pixels may have any; blocks: as `block_paths` sums them.

    Their expected number is rounded up or down at random, so that its mean is kept: together where pixels are alike;
    all others by one running sum, whose whole numbers they are the steps of (systematic sampling, Madow and Madow
    1944).
    """
    pixels, starts = np.empty(active.shape[0], np.int32), np.empty(active.shape[0] + 1, np.int32)
    keyed = alike.lines > 0
    keys = np.empty(active.shape[0] if keyed else 0, np.int32)
    n = drawn = k = 0
    starts[0] = 0
    carried = uniform(seed, 0, 0, 92)
    for block in range(blocks.shape[0]):
        if carried + blocks[block] < 1.0:
            carried += blocks[block]
            continue
        for i in range(block * DRAWN, min((block + 1) * DRAWN, active.shape[0])):
            pixel = active[i]
            while k < alike.pixel.shape[0] and alike.pixel[k] < pixel:
                k += 1
            key = pixel + alike.lines
            if k < alike.pixel.shape[0] and alike.pixel[k] == pixel:
                key = alike.line[k]
                count = int(camera_paths[pixel] + uniform(seed, key, 0, 92))
            else:
                carried += camera_paths[pixel]
                if carried < 1.0:
                    continue
                count = int(carried)
                carried -= count
            if count > 0:
                pixels[n] = pixel
                if keyed:
                    keys[n] = key
                drawn += count
                n += 1
                starts[n] = drawn
    return DrawnPaths(pixels[:n], keys[: n if keyed else 0], starts[: n + 1])
