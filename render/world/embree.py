"""Ray queries by Embree; the only file that knows Embree and embreex, the package that brings it.

    scene = RayScene(vertices, triangles)                      # the tree is built here, by all threads
    triangle, distance = scene.intersect(origins, directions)  # first hits
    blocked = scene.occluded(origins, directions, far)         # anything nearer than far

Embree works in float32. The scene is shifted to its own centre first, so that coordinates are small, and callers
recompute each hit in float64 from its triangle. Embree is called by its C interface (`rtcore.h`, version 4) through
ctypes, which lets go of the interpreter meanwhile; where that library cannot be opened, embreex traces each ray alone.
"""

from __future__ import annotations

import ctypes
import sys
import threading
import time
import weakref
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import embreex.rtcore_scene
import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from render.base.arrays import Float32
from render.world.ray_packets import Packets, buffer, intersect_packets, occluded_packets

Int32 = NDArray[np.int32]
Mask = NDArray[np.bool_]

CHUNK = 1 << 16
"""Rays a call: enough to hide Python's overhead, few enough to balance the threads and to cancel soon."""
FAR = 1e37
"""Length of a ray without an end."""

_VERSION, _NATIVE = 0, {16: 34, 8: 33, 4: 32}
"""RTC_DEVICE_PROPERTY_VERSION, and RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED, _RAY8_ and _RAY4_."""
_TRIANGLES, _INDEX, _VERTEX, _UINT3, _FLOAT3, _ROBUST = 0, 0, 1, 0x5003, 0x9003, 1 << 2
"""RTC_GEOMETRY_TYPE_TRIANGLE, RTC_BUFFER_TYPE_INDEX, _VERTEX, RTC_FORMAT_UINT3, _FLOAT3, RTC_SCENE_FLAG_ROBUST."""
_OUT_OF_MEMORY = 4
"""RTC_ERROR_OUT_OF_MEMORY."""


class RayScene:
    """A committed triangle scene. Methods release the GIL: call them in chunks from threads."""

    def __init__(self, vertices: NDArray[np.float64], triangles: Int32) -> None:
        """vertices (v, 3) float64 world m, triangles (t, 3) int32, at least one; not copied: leave them as they are.

        MemoryError: there is no room for the tree.
        """
        self.centre = (vertices.min(axis=0) + vertices.max(axis=0)) / 2 if len(vertices) else np.zeros(3)
        # one vertex more than there are, since Embree reads each of them as four floats
        shifted = np.zeros((len(vertices) + 1, 3), np.float32)
        np.subtract(vertices, self.centre, out=shifted[:-1], casting="same_kind")
        # vertices, ray origins and traversal each round to 2^-24 of the extent; 16 of these keep a ray off its surface
        self.surface_offset = 16.0 * 2.0**-24 * float(np.abs(shifted).max())
        self._tree = _tree(shifted, np.ascontiguousarray(triangles, dtype=np.int32))
        self._begin()

    def _begin(self) -> None:
        self._lock = threading.Lock()
        self.seconds = 0.0
        self.rays = 0

    def shifted(self, shift: NDArray[np.float64]) -> RayScene:
        """The same triangles, all moved by (3,) m, on the same tree: rays are relative to the centre, which moves too.

        Of a turn rays would have to be turned back, which for most takes longer than another tree.
        """
        other = object.__new__(RayScene)
        other.centre, other.surface_offset, other._tree = self.centre + shift, self.surface_offset, self._tree
        other._begin()
        return other

    def intersect(
        self, origins: Float32, directions: Float32, far: Float32 | None = None, *, coherent: bool = False
    ) -> tuple[Int32, Float32]:
        """(n, 3) origins (scene-centred), directions, (n,) far (changed in place) -> triangle or -1, distance.

        coherent: neighbouring rays have similar directions, which is faster; the hits are the same.
        ValueError: the rows differ.
        """
        _check(origins, directions, far)
        if far is None:
            far = np.full(len(directions), FAR, np.float32)
        with self._timed(len(origins)):
            return self._tree.intersect(origins, np.ascontiguousarray(directions), far, coherent), far

    def from_point(self, origin: NDArray[np.float64], directions: Float32) -> Int32:
        """World origin (3,), (n, 3) directions, neighbours similar -> (n,) first triangle or -1."""
        start = (origin - self.centre).astype(np.float32)
        return self.intersect(np.broadcast_to(start, directions.shape), directions, coherent=True)[0]

    def occluded(self, origins: Float32, directions: Float32, far: Float32, *, coherent: bool = False) -> Mask:
        """(n, 3) origins (scene-centred), directions, (n,) far (overwritten) -> (n,) something is hit before far.

        ValueError: the rows differ.
        """
        _check(origins, directions, far)
        with self._timed(len(origins)):
            return self._tree.occluded(np.ascontiguousarray(origins), np.ascontiguousarray(directions), far, coherent)

    @contextmanager
    def _timed(self, rays: int) -> Iterator[None]:
        start = time.perf_counter()
        yield
        elapsed = time.perf_counter() - start
        with self._lock:
            self.seconds += elapsed
            self.rays += rays


class Tree:
    """Embree's BVH over one mesh, queried by packets of the processor's width.

    One BVH holds all objects, moving or not. One an object (instances, or Embree's two-level builder) would save the
    rebuild for those at rest, 0.3 s of CPU time for a million triangles. But the BVHs of two objects are traversed one
    after the other: incoherent shadow rays took 1.2 to 2.0 times as long in the templates `scan`, `sphere` and
    `glass_ball`.
    """

    def __init__(self, library: Library, shifted: Float32, triangles: Int32, width: int | None = None) -> None:
        """shifted (v + 1, 3), of which the last is padding, triangles (t, 3), both kept and not copied.

        width: 4, 8 or 16 rays a packet; None: the processor's. MemoryError: there is no room for the tree.
        """
        functions, device = library.functions, library.device
        self._arrays = shifted, triangles
        scene = functions.rtcNewScene(device)
        # the scene is released with this object, but not at the program's end, when rays may still be under way
        weakref.finalize(self, functions.rtcReleaseScene, scene).atexit = False
        # robust traversal: no ray slips between two triangles that share an edge
        functions.rtcSetSceneFlags(scene, _ROBUST)
        mesh = functions.rtcNewGeometry(device, _TRIANGLES)
        for kind, form, array, count in (
            (_VERTEX, _FLOAT3, shifted, len(shifted) - 1),
            (_INDEX, _UINT3, triangles, len(triangles)),
        ):
            functions.rtcSetSharedGeometryBuffer(mesh, kind, 0, form, array.ctypes.data, 0, array.strides[0], count)
        functions.rtcCommitGeometry(mesh)
        functions.rtcAttachGeometry(scene, mesh)
        functions.rtcReleaseGeometry(mesh)
        functions.rtcCommitScene(scene)
        library.check()
        width = width or library.width
        intersect, occluded = (_address(functions, f"{name}{width}") for name in ("rtcIntersect", "rtcOccluded"))
        self._packets = Packets(width, scene, intersect, occluded)

    def intersect(self, origins: Float32, directions: Float32, far: Float32, coherent: bool) -> Int32:
        """(n, 3) origins and directions -> (n,) first triangle or -1; far (n,) becomes its distance."""
        triangle = np.empty(len(directions), np.int32)
        # a single shared origin; copied, since kernels would be compiled again for a read-only array
        origins = origins[:1].copy() if origins.strides[0] == 0 else np.ascontiguousarray(origins)
        intersect_packets(self._for(coherent), buffer(self._packets.width), origins, directions, far, triangle)
        return triangle

    def occluded(self, origins: Float32, directions: Float32, far: Float32, coherent: bool) -> Mask:
        """(n, 3) origins and directions -> (n,) whether anything is hit before far (n,)."""
        blocked = np.empty(len(origins), np.bool_)
        occluded_packets(self._for(coherent), buffer(self._packets.width), origins, directions, far, blocked)
        return blocked

    def _for(self, coherent: bool) -> Packets:
        return self._packets._replace(arguments=self._packets.coherent) if coherent else self._packets


class EmbreexTree:
    """As `Tree`, by embreex's own interface: single rays, and a build that holds the GIL."""

    def __init__(self, shifted: Float32, triangles: Int32) -> None:
        """As `Tree`."""
        self._scene = EmbreeScene(robust=True)
        self._mesh = TriangleMesh(self._scene, shifted[:-1], triangles)
        # builds the tree, which must happen before any thread traces
        self._scene.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))

    def intersect(self, origins: Float32, directions: Float32, far: Float32, coherent: bool) -> Int32:
        """As `Tree.intersect`."""
        triangle: Int32 = self._scene.run(origins, directions, dists=far, output=True)["primID"]
        return triangle

    def occluded(self, origins: Float32, directions: Float32, far: Float32, coherent: bool) -> Mask:
        """As `Tree.occluded`."""
        return np.asarray(self._scene.run(origins, directions, dists=far, query="OCCLUDED") == 0)


class Library(NamedTuple):
    """The opened Embree library: its functions, and the one device of all scenes."""

    functions: ctypes.CDLL
    device: int
    """Handle of the device."""
    width: int
    """Rays a packet that the processor supports natively: 4, 8 or 16."""

    def check(self) -> None:
        """Raise the error of this thread since the last check: MemoryError, RuntimeError."""
        code = self.functions.rtcGetDeviceError(self.device)
        if code:
            text = self.functions.rtcGetErrorString(code).decode()
            raise (MemoryError if code == _OUT_OF_MEMORY else RuntimeError)(f"Embree: {text}")


@lru_cache(maxsize=1)
def library() -> Library | None:
    """The Embree library in embreex's package; None: it cannot be opened, or is not of version 4."""
    word, number, size = ctypes.c_void_p, ctypes.c_uint, ctypes.c_size_t
    # on Windows a module does not re-export the functions of the libraries it is linked with
    beside = Path(embreex.__file__).parents[1] / "embreex.libs"
    names = [str(path) for path in beside.glob("embree4*.dll")] if sys.platform == "win32" else []
    try:
        found = ctypes.CDLL(next(iter(names), embreex.rtcore_scene.__file__))
        for name, result, arguments in (
            ("rtcNewDevice", word, [ctypes.c_char_p]),
            ("rtcGetDeviceProperty", ctypes.c_ssize_t, [word, ctypes.c_int]),
            ("rtcGetDeviceError", ctypes.c_int, [word]),
            ("rtcGetErrorString", ctypes.c_char_p, [ctypes.c_int]),
            ("rtcNewScene", word, [word]),
            ("rtcSetSceneFlags", None, [word, ctypes.c_int]),
            ("rtcCommitScene", None, [word]),
            ("rtcReleaseScene", None, [word]),
            ("rtcNewGeometry", word, [word, ctypes.c_int]),
            (
                "rtcSetSharedGeometryBuffer",
                None,
                [word, ctypes.c_int, number, ctypes.c_int, word, size, size, size],
            ),
            ("rtcCommitGeometry", None, [word]),
            ("rtcAttachGeometry", number, [word, word]),
            ("rtcReleaseGeometry", None, [word]),
        ):
            getattr(found, name).restype, getattr(found, name).argtypes = result, arguments
        device = found.rtcNewDevice(None)
    except (OSError, AttributeError):
        return None
    if not device or found.rtcGetDeviceProperty(device, _VERSION) // 10000 != 4:
        return None
    native = [width for width, property in _NATIVE.items() if found.rtcGetDeviceProperty(device, property) > 0]
    return Library(found, device, native[0] if native else 4)


def _tree(shifted: Float32, triangles: Int32) -> Tree | EmbreexTree:
    opened = library()
    return Tree(opened, shifted, triangles) if opened is not None and works() else EmbreexTree(shifted, triangles)


@lru_cache(maxsize=1)
def works() -> bool:
    """Whether the library returns the same hits as embreex, tested once on three triangles."""
    opened = library()
    if opened is None:
        return False
    corners = np.array([[0, 0, 1], [1, 0, 1], [0, 1, 1], [0, 0, 2], [2, 0, 2], [0, 2, 2], [0, 0, 0]], np.float32)
    mesh = corners, np.array([[0, 1, 2], [1, 2, 0], [3, 4, 5]], np.int32)
    towards = np.array([[x, y, 1.0] for x in np.linspace(-0.1, 1.0, 7) for y in np.linspace(-0.1, 1.0, 5)], np.float32)
    origins, limit = np.zeros_like(towards), np.full(len(towards), 1.5, np.float32)
    answers = []
    for tree in (Tree(opened, *mesh), EmbreexTree(*mesh)):
        far = np.full(len(towards), FAR, np.float32)
        hit = tree.intersect(origins, towards, far, False) >= 0
        answers.append((hit, far, tree.occluded(origins, towards, limit.copy(), False)))
    (hit, far, blocked), (its_hit, its_far, its_blocked) = answers
    return np.array_equal(hit, its_hit) and np.allclose(far, its_far) and np.array_equal(blocked, its_blocked)


def _address(functions: ctypes.CDLL, name: str) -> int:
    return ctypes.cast(getattr(functions, name), ctypes.c_void_p).value or 0


def _check(origins: Float32, directions: Float32, far: Float32 | None) -> None:
    """ValueError: the shapes differ; Embree would read out of bounds."""
    n = len(origins)
    if origins.shape != (n, 3) or directions.shape != (n, 3) or (far is not None and far.shape != (n,)):
        far_shape = None if far is None else far.shape
        raise ValueError(f"rays: origins {origins.shape}, directions {directions.shape}, far {far_shape} do not match")
