"""Triangles in blocks with bounding boxes, so that the cut of a million of them with a plane visits only those near it.

A block is a run of triangles in the file's order. Most files keep neighbours together; one that does not costs time,
but gives the same result.
"""

from __future__ import annotations

import numba
import numpy as np

from render.base.arrays import Float, Int

BLOCK = 64
"""Triangles a block."""


@numba.njit(nogil=True, cache=True)
def block_boxes(vertices: Float, triangles: Int) -> Float:
    """(v, 3), (t, 3) -> (b, 6) centre and half size of the box around each run of BLOCK triangles."""
    count = (triangles.shape[0] + BLOCK - 1) // BLOCK
    boxes = np.empty((count, 6))
    for b in range(count):
        for axis in range(3):
            low, high = np.inf, -np.inf
            for t in range(b * BLOCK, min((b + 1) * BLOCK, triangles.shape[0])):
                for corner in range(3):
                    x = vertices[triangles[t, corner], axis]
                    low, high = min(low, x), max(high, x)
            boxes[b, axis], boxes[b, 3 + axis] = (low + high) / 2.0, (high - low) / 2.0
    return boxes


@numba.njit(nogil=True, cache=True)
def crossing_in_blocks(vertices: Float, triangles: Int, boxes: Float, T_laser_object: Float, side: Float) -> Int:
    """As `render.truth.laser_curve.sheet_side` and `crossing_triangles`: (m,) triangles with vertices on both sides of
    the sheet.

    `side` (v,) is filled for the vertices of all blocks that the plane meets.
    """
    a, b, c, d = T_laser_object[0, 0], T_laser_object[0, 1], T_laser_object[0, 2], T_laser_object[0, 3]
    capacity = 4096
    out = np.empty(capacity, dtype=np.int32)
    count = 0
    for k in range(boxes.shape[0]):
        box = boxes[k]
        reach = abs(a) * box[3] + abs(b) * box[4] + abs(c) * box[5]
        # a margin far above the rounding of the sums and far below the size of any triangle
        reach += 1e-12 * (abs(box[0]) + abs(box[1]) + abs(box[2]) + abs(d))
        if abs(a * box[0] + b * box[1] + c * box[2] + d) > reach:
            continue
        first_triangle = k * BLOCK
        last_triangle = min(first_triangle + BLOCK, triangles.shape[0])
        if count + BLOCK > capacity:
            capacity *= 2
            more = np.empty(capacity, dtype=np.int32)
            # copied by a loop: a slice takes numba two seconds longer to compile
            for i in range(count):
                more[i] = out[i]
            out = more
        for t in range(first_triangle, last_triangle):
            ahead = 0
            for corner in range(3):
                v = triangles[t, corner]
                side[v] = a * vertices[v, 0] + b * vertices[v, 1] + c * vertices[v, 2] + d
                if side[v] >= 0.0:
                    ahead += 1
            if 0 < ahead < 3:
                out[count] = t
                count += 1
    return out[:count].copy()
