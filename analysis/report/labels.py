"""Where labels of places go in a picture, so that none lies over another or over a place."""

from __future__ import annotations

import math

import numpy as np

from render.base.arrays import Float

TURNS = 16
REACHES = (1.0, 1.6, 2.4, 3.4, 4.6)
"""Times its own size that a label goes from its place, the nearest first."""


def label_places(places: Float, sizes: Float, low: Float, high: Float, gap: float = 4.0) -> Float:
    """(n, 2) places and (n, 2) widths and heights of labels, px -> (n, 2) middles of these, in the order of the labels.

    Each at the first spot about its place, near ones first, where it lies within the box from (2,) low to high, `gap`
    px from all labels before it and from every place; where there is none, at the spot that overlaps them least.
    """
    placed: list[Float] = []
    for i, (place, size) in enumerate(zip(places, sizes, strict=True)):
        best, least = place, math.inf
        for spot in _spots(place, size):
            over = _outside(spot, size, low, high)
            over += sum(_overlap(spot, size, other, sizes[k], gap) for k, other in enumerate(placed[:i]))
            over += sum(_overlap(spot, size, other, np.full(2, gap), gap) for other in places)
            if over < least:
                best, least = spot, over
            if over == 0.0:
                break
        placed.append(best)
    return np.array(placed).reshape(-1, 2)


def _spots(place: Float, size: Float) -> Float:
    """(m, 2) middles of a label that is to stand about a place, on ellipses of its own shape."""
    turn = 2.0 * math.pi * np.arange(TURNS) / TURNS + math.pi / 4.0
    ring = np.column_stack([np.cos(turn) * (0.5 * size[0] + 8.0), np.sin(turn) * (0.5 * size[1] + 14.0)])
    return np.asarray(np.concatenate([place + reach * ring for reach in REACHES]))


def _overlap(one: Float, size: Float, other: Float, others: Float, gap: float) -> float:
    """px^2 that two boxes share, one of them larger by the gap."""
    shared = 0.5 * (size + others) + gap - np.abs(one - other)
    return float(np.prod(np.minimum(shared, np.minimum(size, others)))) if np.all(shared > 0.0) else 0.0


def _outside(spot: Float, size: Float, low: Float, high: Float) -> float:
    """px^2 of a label beyond the box."""
    beyond = np.maximum(low - (spot - 0.5 * size), 0.0) + np.maximum(spot + 0.5 * size - high, 0.0)
    return float(beyond @ size[::-1])
