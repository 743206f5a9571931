"""Mesh files as trimesh reads them rightly: their polygons cut into triangles, OBJ's relative indices counted.

trimesh cuts every polygon into a fan, which fills the notch of a concave one.
"""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float
from render.base.errors import InputError
from render.mesh.mesh_headers import EXPORT, PlyElement, bad_line, damaged, ply_header
from render.mesh.polygons import ear_cut, fan, fan_covers

Int = NDArray[np.int64]

MAX_CORNERS = 5000
"""Largest number of corners of a polygon that a fan does not triangulate: the time grows with its square."""
FLATNESS = 0.01
"""Deviation from its plane, as a fraction of a polygon's size, above which its shape depends on the triangulation."""
PLY_TYPES = {
    **{"i1": "char", "u1": "uchar", "i2": "short", "u2": "ushort", "i4": "int", "u4": "uint"},
    **{"f2": "float16", "f4": "float", "f8": "double", "i8": "int64", "u8": "uint64"},
}


def as_triangles(data: bytes, kind: str, where: str) -> bytes:
    """A mesh file's bytes with every polygon of an OBJ, OFF or PLY cut into triangles that cover it.

    InputError: a polygon crosses itself or names a vertex that does not exist, or the file is damaged. A warning tells
    of polygons that are not flat.
    """
    match kind:
        case "obj":
            return _obj(data, where)
        case "off":
            return _off(data, where)
        case "ply":
            return _ply(data, where)
        case _:
            return data


@dataclass(frozen=True)
class Cut:
    """Triangles of m polygons, polygon after polygon."""

    owner: Int
    """(t,) polygon of each triangle."""
    corners: Int
    """(t, 3) indices into the flat list of all polygons' corners."""
    plain: NDArray[np.bool_]
    """(m,) whether a polygon's triangles are the fan around its first corner."""


def cut(vertices: Float, flat: Int, sizes: Int, where: str) -> Cut:
    """Cut m polygons of sizes[k] corners, 3 or more; flat: the vertices of all of them, one after the other.

    InputError: a vertex that does not exist, or a polygon that crosses itself.
    """
    starts, first = np.cumsum(sizes) - sizes, np.cumsum(sizes - 2) - (sizes - 2)
    owner = np.repeat(np.arange(len(sizes)), sizes - 2)
    corners = np.empty((len(owner), 3), dtype=np.int64)
    plain = np.ones(len(sizes), dtype=np.bool_)
    bent = 0
    for size in np.unique(sizes).tolist():
        members = np.flatnonzero(sizes == size)
        step = max(1, 2**18 // size)  # in pieces, to bound the memory
        for some in (members[start : start + step] for start in range(0, len(members), step)):
            points = vertices[flat[starts[some, None] + np.arange(size)]]
            triangles, plain[some] = _cut(points)
            bent += int((_bend(points) > FLATNESS).sum()) if size > 3 else 0
            bad = np.flatnonzero((triangles < 0).any(axis=(1, 2)))
            if len(bad):
                raise InputError(
                    "a polygon of the mesh cannot be cut into triangles",
                    where=where,
                    found=f"face {some[bad[0]]}, of {size} corners, which crosses or touches itself",
                    allowed=f"edges that meet only at corners; {MAX_CORNERS} corners where it is concave",
                    cure=f"{EXPORT}, as triangles",
                )
            corners[first[some, None] + np.arange(size - 2)] = triangles + starts[some, None, None]
    if bent:
        warnings.warn(
            f"{where}: {bent} polygons are not flat; their shape depends on how they are cut into triangles",
            stacklevel=2,
        )
    return Cut(owner, corners, plain)


def _cut(points: Float) -> tuple[Int, NDArray[np.bool_]]:
    """(m, n - 2, 3) triangles of polygons of n corners, (m, n, 3), -1 where one crosses itself; (m,) plain fans."""
    count, size = points.shape[:2]
    triangles = np.repeat(fan(size)[None], count, axis=0)
    plain = fan_covers(points) if size > 3 else np.ones(count, dtype=np.bool_)
    left = np.flatnonzero(~plain)
    for turned in range(1, min(size, 8)):  # a concave quadrilateral has a corner that sees all of it, as most have
        seen = fan_covers(np.roll(points[left], -turned, axis=1))
        triangles[left[seen]] = (fan(size) + turned) % size
        left = left[~seen]
    for k in left:
        found = ear_cut(points[k]) if size <= MAX_CORNERS else None
        triangles[k] = -1 if found is None else found
    return triangles, plain


def no_such_vertex(index: int, where: str, allowed: str) -> InputError:
    """A face names a vertex that is not there."""
    what = "a triangle names a vertex that does not exist"
    return InputError(what, where=where, found=f"index {index}", allowed=allowed, cure=EXPORT)


def _bend(points: Float) -> Float:
    """(m,) how far the corners of polygons, (m, n, 3), are from their planes, in parts of their size."""
    spokes = points - points.mean(axis=1, keepdims=True)
    normal = np.cross(spokes, np.roll(spokes, -1, axis=1)).sum(axis=1)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0.0)
    height = np.abs(np.einsum("mnc,mc->mn", spokes, normal)).max(axis=1)
    size = np.linalg.norm(spokes, axis=2).max(axis=1)
    return np.asarray(np.divide(height, size, out=np.zeros_like(height), where=size > 0.0))


def _checked(flat: Int, count: int, where: str, base: int = 0) -> None:
    """InputError: an index that is not of `count` vertices; base: what the file counts from."""
    for index in (int(flat.min(initial=0)), int(flat.max(initial=0))):
        if len(flat) and not 0 <= index < count:
            raise no_such_vertex(index + base, where, f"{base} ... {count - 1 + base}")


def _obj(data: bytes, where: str) -> bytes:
    """Also with relative (negative) indices counted from where they stand; trimesh would count from the end."""
    if b"\\" in data:
        data = re.sub(rb"\\\r?\n", b" ", data)
    if re.search(rb"^[ \t]+[a-z]", data, re.MULTILINE):
        data = re.sub(rb"^[ \t]+", b"", data, flags=re.MULTILINE)
    if re.search(rb"^f[^\n]*#", data, re.MULTILINE):
        data = re.sub(rb"^(f[^\n#]*)#[^\n]*", rb"\1", data, flags=re.MULTILINE)
    if re.search(rb"^f[^\n]*\s[+-]?0+(?=[/\s]|\Z)", data, re.MULTILINE):
        raise no_such_vertex(0, where, "1 or more, as OBJ counts from 1")
    negative = re.search(rb"^f[^\n]*-", data, re.MULTILINE) is not None
    polygons = re.search(rb"^f([ \t]+\S+){4}", data, re.MULTILINE) is not None
    lines = data.splitlines() if negative or polygons else []
    if negative:
        _count_absolutely(lines, where)
    if not polygons:
        return b"\n".join(lines) if negative else data
    rows = [line.split()[1:4] for line in lines if line[:2] in (b"v ", b"v\t")]
    numbers = [k for k, line in enumerate(lines) if line[:2] in (b"f ", b"f\t") and len(line.split()) > 4]
    faces = [lines[k].split()[1:] for k in numbers]
    try:
        vertices = np.array(rows, dtype=np.float64).reshape(-1, 3)
        flat = np.array([corner.partition(b"/")[0] for face in faces for corner in face]).astype(np.int64) - 1
    except (OverflowError, ValueError):
        fault = bad_line(data, "obj")
        raise damaged("obj", where, fault, "v with three numbers, f with whole numbers") from None
    _checked(flat, len(vertices), where, base=1)
    sizes = np.array([len(face) for face in faces], dtype=np.int64)
    found = cut(vertices, flat, sizes, where)
    if found.plain.all():  # as trimesh cuts them
        return b"\n".join(lines) if negative else data
    starts = np.cumsum(sizes) - sizes
    places = np.searchsorted(found.owner, np.arange(len(sizes) + 1))
    for k in np.flatnonzero(~found.plain).tolist():
        triangles = (found.corners[places[k] : places[k + 1]] - starts[k]).tolist()
        lines[numbers[k]] = b"\n".join(b"f " + b" ".join(faces[k][i] for i in triangle) for triangle in triangles)
    return b"\n".join(lines)


def _count_absolutely(lines: list[bytes], where: str) -> None:
    """Replace the relative indices of OBJ lines, in place."""
    so_far = {b"v": 0, b"vt": 0, b"vn": 0}
    for number, line in enumerate(lines):
        words = line.split()
        if words and words[0] in so_far:
            so_far[words[0]] += 1
        elif words and words[0] == b"f" and b"-" in line:
            counts = list(so_far.values())
            corners = [_absolute(word, counts) for word in words[1:]]
            if any(corner.startswith((b"0", b"-")) for corner in corners):
                raise no_such_vertex(-1, where, "a vertex above the face")
            lines[number] = b"f " + b" ".join(corners)


def _absolute(corner: bytes, counts: list[int]) -> bytes:
    """ "-1/-2" -> "8/7" where there are 8 vertices and 8 UV so far."""
    if b"-" not in corner:
        return corner
    indices = zip(corner.split(b"/"), counts, strict=False)
    return b"/".join(b"%d" % (int(i) + 1 + count) if i[1:].isdigit() and i[:1] == b"-" else i for i, count in indices)


def _off(data: bytes, where: str) -> bytes:
    text = re.sub(rb"#[^\n]*", b"", data)
    head, _, body = text.partition(b"OFF")
    lines = [line for line in body.splitlines() if line.strip()]
    place, allowed = "the line of counts", "the numbers of vertices, faces and edges"
    try:
        vertices, faces = (int(word) for word in lines[0].split()[:2])
        written = lines[1 + vertices : 1 + vertices + faces]
        if len(written) == faces and all(line.split(None, 1)[0] == b"3" for line in written):
            return data
        points, polygons = np.empty((vertices, 3)), []
        allowed = "three numbers"
        for k in range(vertices):
            place = f"vertex {k}"
            points[k] = [float(word) for word in lines[1 + k].split()[:3]]
        allowed = "a count and so many whole numbers"
        for k in range(faces):
            place = f"face {k}"
            corners, *indices = lines[1 + vertices + k].split()
            polygons.append(np.array([int(indices[i]) for i in range(int(corners))], dtype=np.int64))
    except (IndexError, OverflowError, ValueError):
        raise damaged("off", where, f"a fault in {place}", allowed) from None
    polygons = [polygon for polygon in polygons if len(polygon) > 2]
    flat, sizes = _flat(polygons)
    _checked(flat, vertices, where)
    found = cut(points, flat, sizes, where)
    if found.plain.all():  # as trimesh cuts them
        return data
    made = [b"3 %d %d %d" % tuple(triangle) for triangle in flat[found.corners].tolist()]
    return b"\n".join([head + b"OFF", b"%d %d 0" % (vertices, len(made)), *lines[1 : 1 + vertices], *made])


def _flat(polygons: Sequence[Int]) -> tuple[Int, Int]:
    """All corners, one after the other, and how many each has."""
    flat = np.concatenate([np.empty(0, dtype=np.int64), *polygons]).astype(np.int64)
    return flat, np.array([len(polygon) for polygon in polygons], dtype=np.int64)


def _ply(data: bytes, where: str) -> bytes:
    from trimesh.exchange.ply import load_ply

    text, elements, start = ply_header(data, where)
    if not any(element.name == "face" and element.rows for element in elements):
        return data
    if text and _only_text_triangles(data[start:], elements, where):
        return data
    try:
        raw = load_ply(io.BytesIO(data), skip_materials=True)["metadata"]["_ply_raw"]
    except (IndexError, KeyError, TypeError, ValueError):
        fault = "a row that is not of its properties" if text else "more or fewer bytes than its header says"
        allowed = "rows as the header says" if text else "bytes as the header says, all faces of as many corners"
        raise damaged("ply", where, fault, allowed) from None
    names = [name for name in ("vertex_indices", "vertex_index") if name in raw["face"]["properties"]]
    if not names or "vertex" not in raw:
        raise damaged("ply", where, "faces without vertex_indices", "property list uchar int vertex_indices")
    indices = raw["face"]["data"][names[0]]
    if not text and indices["f1"].shape[1:] == (3,) and (indices["f0"] == 3).all():
        return data
    points, _ = _columns(raw["vertex"])
    scalars, lists = _columns(raw["face"])
    polygons = lists[names[0]]
    kept = np.flatnonzero([len(polygon) > 2 for polygon in polygons])
    flat, sizes = _flat([polygons[number] for number in kept])
    vertices = np.stack([points[axis] for axis in "xyz"], axis=1).astype(np.float64)
    _checked(flat, len(vertices), where)
    found = cut(vertices, flat, sizes, where)
    owner = kept[found.owner]
    columns: list[tuple[str, NDArray[Any]]] = [(name, values[owner]) for name, values in scalars.items()]
    made = {names[0]: flat[found.corners].astype(np.int32)}
    if "texcoord" in lists:
        uv = np.concatenate([np.reshape(lists["texcoord"][number], (-1, 2)) for number in kept])
        made["texcoord"] = uv[found.corners].reshape(-1, 6)
    image = re.search(rb"^comment[ \t]+TextureFile[^\n]*\n", data[:start], re.MULTILINE | re.IGNORECASE)
    header = b"ply\nformat binary_little_endian 1.0\n" + (image[0] if image else b"")
    header += b"element vertex %d\n" % len(vertices) + _properties(list(points.items()))
    header += b"element face %d\n" % len(owner) + _properties(columns)
    for name, values in made.items():
        header += f"property list uchar {PLY_TYPES[values.dtype.str[1:]]} {name}\n".encode()
        columns += [(f"{name} count", np.full(len(owner), values.shape[1], dtype=np.uint8)), (name, values)]
    return header + b"end_header\n" + _rows(list(points.items())) + _rows(columns)


def _only_text_triangles(body: bytes, elements: Sequence[PlyElement], where: str) -> bool:
    """Whether every face of a text PLY has three corners. InputError: one has fewer numbers than it says."""
    lines = body.splitlines()
    for element in elements:
        if element.name == "face":
            break
        del lines[: element.rows]
    only = True
    for number, line in enumerate(lines[: element.rows], 1):
        words = line.split()
        corners = words[element.before_list] if len(words) > element.before_list else b""
        if not corners.isdigit() or len(words) - element.before_list <= int(corners):
            told = corners.decode("latin-1")[:20]
            found = f"face {number - 1}, which says {told!r} corners, with {len(words)} numbers in its row"
            raise damaged("ply", where, found, "counts that fit their rows")
        only = only and corners == b"3"
    return only


def _columns(element: dict[str, Any]) -> tuple[dict[str, NDArray[Any]], dict[str, list[Int]]]:
    """The numbers and the lists of an element that trimesh read. ValueError: lists that do not fit their counts."""
    scalars: dict[str, NDArray[Any]] = {}
    lists: dict[str, list[Int]] = {}
    for name, kind in element["properties"].items():
        values = element["data"][name]
        if "(" not in kind:
            scalars[name] = np.asarray(values).reshape(element["length"])
        elif getattr(values, "dtype", None) is not None and values.dtype.names:  # binary: counts and values
            if (values["f0"] != values["f1"].shape[1]).any():
                raise ValueError("lists of several lengths")
            lists[name] = list(values["f1"])
        else:
            lists[name] = [np.atleast_1d(value) for value in values]
    return scalars, lists


def _properties(columns: Sequence[tuple[str, NDArray[Any]]]) -> bytes:
    return b"".join(f"property {PLY_TYPES[values.dtype.str[1:]]} {name}\n".encode() for name, values in columns)


def _rows(columns: Sequence[tuple[str, NDArray[Any]]]) -> bytes:
    """Columns as packed rows, little-endian."""
    fields = [(name, values.dtype.newbyteorder("<"), values.shape[1:]) for name, values in columns]
    rows = np.empty(len(columns[0][1]), dtype=fields)
    for name, values in columns:
        rows[name] = values
    return rows.tobytes()
