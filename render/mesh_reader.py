"""Mesh files by trimesh, with the gaps closed where it would take a damaged or unusual file for a whole one.

Side files (MTL, buffers, images) come only from inside the project folder; nothing is fetched and nothing is run.
"""

from __future__ import annotations

import io
import json
import re
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from render.errors import InputError
from render.files import inside

Float = NDArray[np.float64]

EXTENSIONS = ("ply", "stl", "obj", "glb", "gltf", "off")
MAX_TRIANGLES = 50_000_000
GLTF_EXTENSIONS = ("KHR_materials", "KHR_lights", "EXT_texture_webp")
"""Required extensions that do not change the geometry or its UV."""
GLTF_FLOAT = 5126


@dataclass(frozen=True)
class Part:
    """One geometry of a file, placed: (v, 3) float64 vertices in the file's unit, (t, 3) triangles."""

    vertices: Float
    triangles: NDArray[np.int64]
    normals: Float | None
    """(v, 3) unit vertex normals, where the file brings some that differ from the facets."""
    geometry: Any
    """What trimesh loaded, for its colours."""


class SideFiles:
    """Gives trimesh the files that a mesh file names, from inside the project folder; remembers what was refused."""

    def __init__(self, path: Path, root: Path, where: str) -> None:
        self.root, self.where = root, where
        self.folder = path.parent.relative_to(root.resolve())
        self.refused: list[InputError] = []

    def get(self, name: str) -> bytes:
        """Bytes of a side file, its name taken relative to the mesh file. InputError: absent, or outside."""
        name = name.strip()
        # As written; percent-encoded (glTF); with Windows' separator; after options ("map_Kd -s 1 1 1 wood.png").
        plain = name.replace("\\", "/")
        for spelling in dict.fromkeys((name, unquote(name), plain, plain.split(" ")[-1])):
            try:
                file = inside(self.root, str(self.folder / spelling), self.where)
                if file.is_file():
                    return file.read_bytes()
            except (InputError, OSError):
                continue
        error = InputError(
            "a file that the mesh names is absent, or outside the project folder",
            where=self.where,
            found=name,
            cure="put it beside the mesh",
        )
        self.refused.append(error)
        raise error

    __getitem__ = get


def read_parts(path: Path, root: Path, where: str, *, colours: bool) -> list[Part]:
    """All triangles of a file, placed by its scene graph; polygons are cut into triangles.

    path: inside `root`, of a kind in EXTENSIONS. colours: read materials and textures too.
    InputError: the file is damaged, cut short, or uses a feature that would be read wrongly; or, with colours, a
    material file or image that it names is absent or outside `root`.
    """
    import trimesh

    kind = path.suffix[1:].lower()
    files = SideFiles(path, root, where)
    try:
        if kind in ("gltf", "glb"):
            _check_gltf(_gltf_header(path, kind), where)
        declared = _declared_faces(path, kind)
        check_triangle_count(declared, where)
        with open(path, "rb") as file:
            stream: Any = io.BytesIO(_absolute_indices(file.read(), where)) if kind == "obj" else file
            # A GLB or GLTF keeps its UV with its material, so that those are always read.
            skip = not colours and kind not in ("gltf", "glb")
            options = {"process": False, "use_embree": False, "skip_materials": skip}
            scene = trimesh.load_scene(stream, file_type=kind, resolver=files, **options)
        parts = _placed(scene, where)
        read = sum(len(part.triangles) for part in parts)
        if 0 < read < declared:
            raise ValueError(f"{read} of {declared} faces can be read")
    except InputError:
        raise
    except OSError as error:
        raise InputError("the file cannot be read", where=where, found=error.strerror or error) from error
    except Exception as error:  # a damaged file makes a reader fail in any way
        outside = re.match(r"index (-?\d+) is out of bounds for axis 0 with size (\d+)", str(error))
        if kind == "obj" and outside:
            raise _no_such_vertex(int(outside[1]) + 1, where, f"1 ... {outside[2]}") from error
        raise InputError(
            f"the file cannot be read as {kind.upper()}",
            where=where,
            found=f"{type(error).__name__}: {error}",
            allowed="a whole, valid file",
            cure="export the mesh again, as triangles",
        ) from error
    if colours and files.refused:
        raise files.refused[0]
    return parts


def _placed(scene: Any, where: str) -> list[Part]:
    """Every triangle geometry of a trimesh scene, once for each node that shows it."""
    nodes = [scene.graph[node] for node in scene.graph.nodes_geometry]
    placed = [(np.asarray(matrix, dtype=np.float64), scene.geometry[name]) for matrix, name in nodes]
    if not placed:  # a glTF without a scene
        placed = [(np.eye(4), geometry) for geometry in scene.geometry.values()]
    placed = [(matrix, geometry) for matrix, geometry in placed if len(getattr(geometry, "faces", ()))]
    check_triangle_count(sum(len(geometry.faces) for _, geometry in placed), where)
    parts = []
    for matrix, geometry in placed:
        vertices = np.array(geometry.vertices, dtype=np.float64, subok=False)
        triangles = np.array(geometry.faces, dtype=np.int64, subok=False)
        if vertices.shape[1:] != (3,) or triangles.shape[1:] != (3,):
            raise ValueError(f"vertices {vertices.shape}, triangles {triangles.shape}")
        lowest, highest = int(triangles.min()), int(triangles.max())
        if lowest < 0 or highest >= len(vertices):
            raise _no_such_vertex(lowest if lowest < 0 else highest, where, f"0 ... {len(vertices) - 1}")
        # trimesh makes up vertex normals on request; only those in its cache came from the file.
        normals = np.array(geometry.vertex_normals) if "vertex_normals" in geometry._cache else None
        if normals is not None and not _differs_from_facets(vertices, triangles, normals):
            normals = None
        if not np.array_equal(matrix, np.eye(4)):
            vertices = vertices @ matrix[:3, :3].T + matrix[:3, 3]
            if normals is not None:
                # as planes are: by the inverse transposed
                normals = normals @ np.linalg.inv(matrix[:3, :3])
            if np.linalg.det(matrix[:3, :3]) < 0:  # a mirror turns counter-clockwise into clockwise
                triangles = triangles[:, ::-1]
        if normals is not None:
            normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
        parts.append(Part(vertices, triangles, normals, geometry))
    return parts


def _differs_from_facets(vertices: Float, triangles: NDArray[np.int64], normals: Float) -> bool:
    """Whether any corner's vertex normal is more than 1 degree off its facet's."""
    corners = vertices[triangles]
    facet = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    dot = np.einsum("tk,tck->tc", facet, normals[triangles])
    lengths = np.linalg.norm(facet, axis=1)[:, None] * np.linalg.norm(normals, axis=1)[triangles]
    return bool((dot < np.cos(np.radians(1.0)) * lengths).any())


def check_triangle_count(count: int, where: str) -> None:
    """InputError: more than MAX_TRIANGLES."""
    if count > MAX_TRIANGLES:
        raise InputError(
            "the mesh has too many triangles",
            where=where,
            found=count,
            allowed=f"at most {MAX_TRIANGLES}",
            cure="simplify the mesh, or cut it into the region that the scanner sees",
        )


def _no_such_vertex(index: int, where: str, allowed: str) -> InputError:
    what = "a triangle names a vertex that does not exist"
    return InputError(what, where=where, found=f"index {index}", allowed=allowed, cure="export the mesh again")


def _declared_faces(path: Path, kind: str) -> int:
    """Number of faces that a file says it has: an intact reading has at least as many triangles."""
    if kind in ("gltf", "glb"):  # their readers check every length themselves
        return 0
    with open(path, "rb") as file:
        if kind == "stl":
            header = file.read(84)
            declared = struct.unpack("<I", header[80:])[0] if len(header) == 84 else 0
            if path.stat().st_size == 84 + 50 * declared:
                return int(declared)
            return (header + file.read()).lower().count(b"endfacet")
        if kind == "ply":
            match = re.search(rb"^element\s+face\s+(\d+)", file.read(65536), re.MULTILINE)
            return int(match[1]) if match else 0
        data = file.read()
    if kind == "off":
        match = re.search(rb"OFF(?:\s|#[^\n]*\n)*\d+\s+(\d+)", data)
        return int(match[1]) if match else 0
    return len(re.findall(rb"^f\s", data, re.MULTILINE))


def _absolute_indices(data: bytes, where: str) -> bytes:
    """OBJ text with relative (negative) indices counted from where they stand; trimesh would count from the end."""
    if re.search(rb"^f[^\n]*\s0+(?=[/\s]|\Z)", data, re.MULTILINE):
        raise _no_such_vertex(0, where, "1 or more, as OBJ counts from 1")
    if not re.search(rb"^f[^\n]*-", data, re.MULTILINE):
        return data
    counts = {b"v": 0, b"vt": 0, b"vn": 0}
    lines = data.splitlines()
    for number, line in enumerate(lines):
        words = line.split()
        if words and words[0] in counts:
            counts[words[0]] += 1
        elif words and words[0] == b"f":
            so_far = list(counts.values())
            corners = [
                [
                    b"%d" % (int(index) + 1 + total) if index.startswith(b"-") else index
                    for index, total in zip(word.split(b"/"), so_far, strict=False)
                ]
                for word in words[1:]
            ]
            if any(corner[0].startswith((b"0", b"-")) for corner in corners):
                raise _no_such_vertex(-1, where, "a vertex above the face")
            lines[number] = b"f " + b" ".join(b"/".join(corner) for corner in corners)
    return b"\n".join(lines)


def _gltf_header(path: Path, kind: str) -> dict[str, Any]:
    """The JSON of a GLTF or GLB file."""
    with open(path, "rb") as file:
        if kind == "glb":
            magic, _, _, length, chunk = struct.unpack("<4sII I4s", file.read(20))
            if magic != b"glTF" or chunk != b"JSON":
                raise ValueError("not a GLB file")
            return dict(json.loads(file.read(length)))
        return dict(json.loads(file.read()))


def _check_gltf(header: dict[str, Any], where: str) -> None:
    """Refuse the features of glTF 2.0 that trimesh passes over or misreads."""
    unknown = [name for name in header.get("extensionsRequired", []) if not name.startswith(GLTF_EXTENSIONS)]
    accessors = header.get("accessors", [])
    used = {
        primitive["attributes"].get(name)
        for mesh in header.get("meshes", [])
        for primitive in mesh["primitives"]
        for name in ("POSITION", "TEXCOORD_0")
    } - {None}
    features = [f"extension {name}" for name in unknown]
    features += ["sparse accessor"] * any("sparse" in accessor for accessor in accessors)
    features += ["integer positions or UV"] * any(accessors[i]["componentType"] != GLTF_FLOAT for i in used)
    if features:
        raise InputError(
            "the file uses a glTF feature that is not supported",
            where=where,
            found=features[0],
            cure="export it without compression, quantisation and sparse accessors",
        )
