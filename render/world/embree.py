"""Embree answers "what does this ray hit"; the only file that knows embreex.

Embree works in float32. The scene is shifted to its own centre first, so that coordinates are small, and callers
recompute each hit in float64 from its triangle.
"""

from __future__ import annotations

import ctypes
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property, lru_cache

import embreex.rtcore_scene
import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from render.world.ray_packets import Packets, buffer, intersect_packets, occluded_packets

Float32 = NDArray[np.float32]
Int32 = NDArray[np.int32]

PIECE = 1 << 13
"""Triangles that embreex is given at a time, where it must not hold the interpreter for long."""
WHOLE = 1 << 16
"""Triangles that it is given at once otherwise: below, nobody sees the pause."""
CHUNK = 1 << 16
"""Rays a call: long enough to hide Python's share, short enough to share work and to cancel."""


FAR = 1e37
"""How far rays go that have no end, as embreex has it."""
_VERSION, _NATIVE = 0, {4: 32, 8: 33, 16: 34}
"""RTC_DEVICE_PROPERTY_VERSION, and RTC_DEVICE_PROPERTY_NATIVE_RAY4_SUPPORTED and so on."""


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
        self._starts = np.array([*pieces, 0], dtype=np.int32)
        self._lock = threading.Lock()
        self.seconds = 0.0
        self.rays = 0
        commit(self._scene)
        # commits it where that could not: must happen before any thread traces
        self._scene.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))

    @cached_property
    def _packets(self) -> Packets | None:
        return packets_of(self._scene) if packets_work() else None

    def intersect(
        self, origins: Float32, directions: Float32, far: Float32 | None = None, *, coherent: bool = False
    ) -> tuple[Int32, Float32]:
        """(n, 3) origins (scene-centred), directions, (n,) far (changed in place) -> triangle or -1, distance.

        coherent: each ray goes much as those before and after it, which is quicker. The same hits.
        """
        _check(origins, directions, far)
        with self._timed(len(origins)):
            if self._packets is not None:
                return self._intersect_packets(_for(self._packets, coherent), origins, directions, far)
            hit = self._scene.run(origins, directions, dists=far, output=True)
        triangle: Int32 = hit["primID"]
        if len(self._meshes) > 1:
            # a miss is -1 in both, and the last of `_starts` is 0
            triangle += self._starts[hit["geomID"]]
        return triangle, hit["tfar"]

    def from_point(self, origin: NDArray[np.float64], directions: Float32) -> Int32:
        """World origin (3,), (n, 3) directions, neighbours much alike -> (n,) first triangle or -1."""
        start = (origin - self.centre).astype(np.float32)
        return self.intersect(np.broadcast_to(start, directions.shape), directions, coherent=True)[0]

    def occluded(
        self, origins: Float32, directions: Float32, far: Float32, *, coherent: bool = False
    ) -> NDArray[np.bool_]:
        """(n, 3) origins (scene-centred), directions, (n,) far (overwritten) -> (n,) something is hit before far."""
        _check(origins, directions, far)
        with self._timed(len(origins)):
            if self._packets is not None:
                blocked = np.empty(len(origins), np.bool_)
                room, origins = buffer(self._packets.width), np.ascontiguousarray(origins)
                packets = _for(self._packets, coherent)
                occluded_packets(packets, room, origins, np.ascontiguousarray(directions), far, blocked)
                return blocked
            hit = self._scene.run(origins, directions, dists=far, query="OCCLUDED")
        return np.asarray(hit == 0)

    def _intersect_packets(
        self, packets: Packets, origins: Float32, directions: Float32, far: Float32 | None
    ) -> tuple[Int32, Float32]:
        triangle = np.empty(len(directions), np.int32)
        if far is None:
            far = np.full(len(directions), FAR, np.float32)
        # of one point; copied, since for what cannot be written to kernels would be compiled again
        origins = origins[:1].copy() if origins.strides[0] == 0 else np.ascontiguousarray(origins)
        room = buffer(packets.width)
        intersect_packets(packets, room, origins, np.ascontiguousarray(directions), far, self._starts, triangle)
        return triangle, far

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
    """Build the scene's tree without holding the interpreter, as embreex would; False: embreex has to do it."""
    fields, build = _fields_of(scene), _library()
    if fields is None or build is None or not fields.scene:
        return False
    build.rtcCommitScene(fields.scene)
    scene.is_committed = 1
    return True


def _for(packets: Packets, coherent: bool) -> Packets:
    return packets._replace(arguments=packets.coherent) if coherent else packets


@lru_cache(maxsize=1)
def packets_work() -> bool:
    """Embree's functions for many rays find what embreex finds: tried out once, on three triangles."""
    scene = EmbreeScene(robust=True)
    corners = np.array([[0, 0, 1], [1, 0, 1], [0, 1, 1], [0, 0, 2], [2, 0, 2], [0, 2, 2]], np.float32)
    meshes = [TriangleMesh(scene, corners, np.array(some, np.int32)) for some in ([[0, 1, 2]], [[1, 2, 0], [3, 4, 5]])]
    towards = np.array([[x, y, 1.0] for x in np.linspace(-0.1, 1.0, 7) for y in np.linspace(-0.1, 1.0, 5)], np.float32)
    origins, far = np.zeros_like(towards), np.full(len(towards), 1.5, np.float32)
    hit = scene.run(origins, towards, output=True)
    shadow = scene.run(origins, towards, dists=far.copy(), query="OCCLUDED") == 0
    packets = packets_of(scene)
    if packets is None or not meshes:
        return False
    triangle, blocked = np.empty(len(towards), np.int32), np.empty(len(towards), np.bool_)
    distance = np.full(len(towards), FAR, np.float32)
    room = buffer(packets.width)
    intersect_packets(packets, room, origins, towards, distance, np.zeros(3, np.int32), triangle)
    occluded_packets(packets, room, origins, towards, far, blocked)
    return (
        bool(np.array_equal(triangle >= 0, hit["primID"] >= 0))
        and bool(np.allclose(distance, hit["tfar"]))
        and bool(np.array_equal(blocked, shadow))
    )


def packets_of(scene: EmbreeScene, widths: tuple[int, ...] = (16, 8, 4)) -> Packets | None:
    """Embree's functions for as many rays as the processor does at once, for a committed scene; None: not to be had."""
    fields, library = _fields_of(scene), _library()
    if fields is None or library is None or not fields.scene:
        return None
    device = library.rtcGetSceneDevice(fields.scene)
    version = library.rtcGetDeviceProperty(device, _VERSION)
    native = [width for width in widths if library.rtcGetDeviceProperty(device, _NATIVE[width]) > 0]
    library.rtcReleaseDevice(device)
    if version // 10000 != 4 or not native:
        return None
    functions = (getattr(library, f"{name}{native[0]}") for name in ("rtcIntersect", "rtcOccluded"))
    return Packets(native[0], fields.scene, *(ctypes.cast(one, ctypes.c_void_p).value or 0 for one in functions))


class _SceneFields(ctypes.Structure):
    """Of an EmbreeScene, behind what every Python object has."""

    _fields_ = (("scene", ctypes.c_void_p), ("is_committed", ctypes.c_int), ("device", ctypes.c_void_p))


def _fields_of(scene: EmbreeScene) -> _SceneFields | None:
    """What is in the object, or None if it is not as expected.

    The pointer to embree's scene is where embreex's own `rtcore_scene.pxd` says, against which other extensions are
    compiled: first in the object, then `is_committed`. That this is so is tried out before it is believed.
    """
    first = object.__basicsize__
    if type(scene).__basicsize__ != first + ctypes.sizeof(_SceneFields):
        return None
    fields, before = _SceneFields.from_address(id(scene) + first), scene.is_committed
    for value in (1 - before, before):
        scene.is_committed = value
        if fields.is_committed != value:
            return None
    return fields


@lru_cache(maxsize=1)
def _library() -> ctypes.CDLL | None:
    """Embree itself, the library that embreex is linked with; ctypes lets the interpreter go while it works."""
    try:
        found = ctypes.CDLL(embreex.rtcore_scene.__file__)
        for name, result, arguments in (
            ("rtcCommitScene", None, [ctypes.c_void_p]),
            ("rtcGetSceneDevice", ctypes.c_void_p, [ctypes.c_void_p]),
            ("rtcReleaseDevice", None, [ctypes.c_void_p]),
            ("rtcGetDeviceProperty", ctypes.c_ssize_t, [ctypes.c_void_p, ctypes.c_int]),
        ):
            getattr(found, name).restype, getattr(found, name).argtypes = result, arguments
    except (OSError, AttributeError):
        return None
    return found


def _check(origins: Float32, directions: Float32, far: Float32 | None) -> None:
    """embreex reads out of bounds when the rows differ, so that is checked here."""
    n = len(origins)
    if origins.shape != (n, 3) or directions.shape != (n, 3) or (far is not None and far.shape != (n,)):
        far_shape = None if far is None else far.shape
        raise ValueError(f"rays: origins {origins.shape}, directions {directions.shape}, far {far_shape} do not match")
