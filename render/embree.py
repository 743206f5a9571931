"""Embree answers "what does this ray hit"; the only file that knows embreex.

Embree works in float32. The scene is shifted to its own centre first, so that coordinates are small, and callers
recompute each hit in float64 from its triangle.
"""

from __future__ import annotations

import ctypes
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import lru_cache

import embreex.rtcore_scene
import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

Float32 = NDArray[np.float32]
Int32 = NDArray[np.int32]

PIECE = 1 << 13
"""Triangles that embreex is given at a time, where it must not hold the interpreter for long."""
WHOLE = 1 << 16
"""Triangles that it is given at once otherwise: below, nobody sees the pause."""
CHUNK = 1 << 16
"""Rays a call: long enough to hide Python's share, short enough to share work and to cancel."""


class RayScene:
    """A committed triangle scene. Methods release the GIL: call them in chunks from threads."""

    def __init__(self, vertices: NDArray[np.float64], triangles: Int32, *, gently: bool = False) -> None:
        """vertices (v, 3) float64 world m, triangles (t, 3) int32, at least one.

        gently: hand even few triangles over piece by piece: each call of embreex holds the interpreter, half a second
        for a million. The same hits, a little more memory.
        """
        self.centre = (vertices.min(axis=0) + vertices.max(axis=0)) / 2 if len(vertices) else np.zeros(3)
        shifted = np.ascontiguousarray(vertices - self.centre, dtype=np.float32)
        extent = float(np.abs(shifted).max()) if len(shifted) else 0.0
        # vertices, origin and traversal each round to 2^-24 of the extent; a ray from a surface starts this far off it
        self.surface_offset = 16.0 * 2.0**-24 * extent
        # robust traversal: no ray slips between two triangles that share an edge
        self._scene = EmbreeScene(robust=True)
        triangles = np.ascontiguousarray(triangles, dtype=np.int32)
        in_pieces = gently or len(triangles) > WHOLE
        pieces = range(0, len(triangles), PIECE if in_pieces else max(len(triangles), 1))
        self._meshes = [self._add(shifted, triangles, start, len(pieces) == 1, pieces.step) for start in pieces]
        self._starts = np.array(pieces, dtype=np.int32)
        self._lock = threading.Lock()
        self.seconds = 0.0
        self.rays = 0
        commit(self._scene)
        # commits it where that could not: must happen before any thread traces
        self._scene.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))

    def intersect(self, origins: Float32, directions: Float32, far: Float32 | None = None) -> tuple[Int32, Float32]:
        """(n, 3) origins (scene-centred), directions, (n,) far (changed in place) -> triangle or -1, distance."""
        _check(origins, directions, far)
        with self._timed(len(origins)):
            hit = self._scene.run(origins, directions, dists=far, output=True)
        triangle = hit["primID"]
        if len(self._meshes) > 1:
            found = triangle >= 0
            triangle[found] += self._starts[hit["geomID"][found]]
        return triangle, hit["tfar"]

    def from_point(self, origin: NDArray[np.float64], directions: Float32) -> Int32:
        """World origin (3,), (n, 3) directions -> (n,) first triangle or -1."""
        start = (origin - self.centre).astype(np.float32)
        return self.intersect(np.broadcast_to(start, directions.shape), directions)[0]

    def occluded(self, origins: Float32, directions: Float32, far: Float32) -> NDArray[np.bool_]:
        """(n, 3) origins (scene-centred), directions, (n,) far (overwritten) -> (n,) something is hit before far."""
        _check(origins, directions, far)
        with self._timed(len(origins)):
            hit = self._scene.run(origins, directions, dists=far, query="OCCLUDED")
        return np.asarray(hit == 0)

    def _add(self, vertices: Float32, triangles: Int32, start: int, whole: bool, count: int) -> TriangleMesh:
        if whole:
            return TriangleMesh(self._scene, vertices, triangles)
        used, index = np.unique(triangles[start : start + count], return_inverse=True)
        return TriangleMesh(self._scene, vertices[used], index.reshape(-1, 3).astype(np.int32))

    @contextmanager
    def _timed(self, rays: int) -> Iterator[None]:
        start = time.perf_counter()
        yield
        elapsed = time.perf_counter() - start
        with self._lock:
            self.seconds += elapsed
            self.rays += rays


def commit(scene: EmbreeScene) -> bool:
    """Build the scene's tree without holding the interpreter, as embreex would; False: embreex has to do it.

    The pointer to embree's scene is where embreex's own `rtcore_scene.pxd` says, against which other extensions are
    compiled: first in the object, then `is_committed`. That this is so is tried out before it is believed.
    """
    first = object.__basicsize__
    if type(scene).__basicsize__ != first + ctypes.sizeof(_SceneFields):
        return False
    fields = _SceneFields.from_address(id(scene) + first)
    for value in (1, 0):
        scene.is_committed = value
        if fields.is_committed != value:
            return False
    build = _rtc_commit_scene()
    if build is None or not fields.scene:
        return False
    build(fields.scene)
    scene.is_committed = 1
    return True


class _SceneFields(ctypes.Structure):
    """Of an EmbreeScene, behind what every Python object has."""

    _fields_ = (("scene", ctypes.c_void_p), ("is_committed", ctypes.c_int), ("device", ctypes.c_void_p))


@lru_cache(maxsize=1)
def _rtc_commit_scene() -> Callable[[int], None] | None:
    """Embree's own function, from the library that embreex is linked with; ctypes lets the interpreter go meanwhile."""
    try:
        found = ctypes.CDLL(embreex.rtcore_scene.__file__).rtcCommitScene
    except (OSError, AttributeError):
        return None
    found.argtypes, found.restype = [ctypes.c_void_p], None
    return found


def _check(origins: Float32, directions: Float32, far: Float32 | None) -> None:
    """embreex reads out of bounds when the rows differ, so that is checked here."""
    n = len(origins)
    if origins.shape != (n, 3) or directions.shape != (n, 3) or (far is not None and far.shape != (n,)):
        far_shape = None if far is None else far.shape
        raise ValueError(f"rays: origins {origins.shape}, directions {directions.shape}, far {far_shape} do not match")
