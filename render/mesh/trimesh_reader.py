"""Mesh files by trimesh, with the gaps closed where it would take a damaged or unusual file for a whole one.

Side files (MTL, buffers, images) come only from inside the project folder; nothing is fetched and nothing is run.
"""

from __future__ import annotations

import io
import logging
import re
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float
from render.base.errors import InputError
from render.base.files import inside, read_bytes
from render.mesh.mesh_headers import (
    EXPORT,
    MAX_FILE_BYTES,
    MAX_PARTS,
    bad_line,
    check_triangle_count,
    damaged,
    declared_faces,
    embedded_images,
    gltf_header,
)
from render.mesh.mesh_polygons import as_triangles, no_such_vertex
from render.mesh.texture import image_size

EXTENSIONS = ("ply", "stl", "obj", "glb", "gltf", "off")
IMAGES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp", ".gif", ".tga")


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
    """Gives trimesh the files that a mesh file names, from inside a folder; remembers what was refused."""

    def __init__(self, path: Path, root: Path, where: str) -> None:
        self.root, self.where = root, where
        self.folder = path.resolve().parent.relative_to(root.resolve())
        self.refused: list[InputError] = []
        self.bytes_left = MAX_FILE_BYTES

    def get(self, name: str) -> bytes:
        """Bytes of a side file, its name taken relative to the mesh file. InputError: absent, outside, too big."""
        try:
            spelling, file = self.find(name)
            data = read_bytes(file, self.bytes_left, "file that the mesh names", f"{self.where}: {spelling}")
        except InputError as error:
            self.refused.append(error)
            raise
        self.bytes_left -= len(data)
        if file.suffix.lower() in IMAGES:
            self.check_image(data, spelling)
        return data

    __getitem__ = get

    def find(self, name: str) -> tuple[str, Path]:
        """The name as it is to be spelled, and where the file is. InputError: absent, or outside."""
        name = name.strip()
        # As written; percent-encoded (glTF); with Windows' separator; after options ("map_Kd -s 1 1 1 wood.png").
        plain = name.replace("\\", "/")
        for spelling in dict.fromkeys((name, unquote(name), plain, plain.split(" ")[-1])):
            try:
                file = inside(self.root, str(self.folder / spelling), self.where)
                if spelling and file.exists() and not file.is_dir():
                    return spelling, file
            except (InputError, OSError, ValueError):
                continue
        raise InputError(
            "a file that the mesh names is absent, or outside the project folder",
            where=self.where,
            found=name,
            cure="put it beside the mesh",
        )

    def check_image(self, data: bytes, name: str) -> None:
        """Remember an image that cannot be opened; trimesh would go on without it."""
        try:
            image_size(data, f"{self.where}: {name}")
        except InputError as error:
            self.refused.append(error)


def side_files(path: Path, root: Path) -> list[str]:
    """Names, relative to a mesh file, of the files below `root` that reading it takes: materials, buffers, images.

    What cannot be read names none; reading the mesh tells why.
    """
    files = SideFiles(path, root, str(path))
    kind, names = path.suffix[1:].lower(), []
    try:
        if kind == "gltf":
            header = gltf_header(read_bytes(path, MAX_FILE_BYTES), kind, str(path))
            uris = [entry.get("uri", "data:") for entry in (*header.get("buffers", ()), *header.get("images", ()))]
            names = [uri for uri in uris if not uri.startswith("data:")]
        elif kind == "ply":
            names = _words_after(rb"comment[ \t]+TextureFile", read_bytes(path, MAX_FILE_BYTES)[:65536])
        elif kind == "obj":
            names = _words_after(b"mtllib", read_bytes(path, MAX_FILE_BYTES))
            for library in list(names):
                names += _words_after(rb"(?:map_\w+|bump|disp)", files.get(library))
    except (AttributeError, InputError, TypeError):
        pass
    found = []
    for name in names:
        with suppress(InputError):
            found.append(files.find(name)[0])
    return list(dict.fromkeys(found))


def _words_after(keyword: bytes, data: bytes) -> list[str]:
    """What stands after a keyword on each line that begins with it."""
    lines = re.findall(rb"^[ \t]*" + keyword + rb"[ \t]+([^\n]+)", data, re.MULTILINE | re.IGNORECASE)
    return [line.decode("utf-8", "replace").strip() for line in lines[:MAX_PARTS]]


@np.errstate(over="ignore", divide="ignore", invalid="ignore")  # coordinates beyond all bounds are refused in words
def read_parts(path: Path, where: str, files: SideFiles, *, colours: bool) -> list[Part]:
    """All triangles of a file, placed by its scene graph; polygons are cut into triangles.

    path: of a kind in EXTENSIONS. colours: read materials and textures too; `files.refused` then tells which it lacks.
    InputError: the file is damaged, cut short, too large, without triangles, or uses a feature that would be read
    wrongly.
    """
    import trimesh

    logging.getLogger("trimesh").setLevel(logging.CRITICAL)  # it prints tracebacks of what is told here in words
    kind = path.suffix[1:].lower()
    data = read_bytes(path, MAX_FILE_BYTES, "mesh file", where)
    if not data:
        raise InputError("the mesh file is empty", where=where, cure=EXPORT)
    try:
        declared = declared_faces(data, kind, where)
        if colours and kind in ("gltf", "glb"):
            for name, image in embedded_images(data, kind, where).items():
                files.check_image(image, name)
        # A GLB or GLTF keeps its UV with its material, so that those are always read.
        skip = not colours and kind not in ("gltf", "glb")
        options = {"process": False, "use_embree": False, "skip_materials": skip}
        stream: Any = io.BytesIO(as_triangles(data, kind, where))
        scene = trimesh.load_scene(stream, file_type=kind, resolver=files, **options)
        parts = _placed(scene, where)
    except InputError:
        raise
    except MemoryError:
        cure = "simplify the mesh, or cut it into the region that the scanner sees"
        found = f"{len(data)} bytes"
        raise InputError("not enough memory to read the mesh", where=where, found=found, cure=cure) from None
    except Exception as error:  # a damaged file makes a reader fail in any way, in words of its own
        outside = re.match(r"index (-?\d+) is out of bounds for axis 0 with size (\d+)", str(error))
        if kind == "obj" and outside:
            raise no_such_vertex(int(outside[1]) + 1, where, f"1 ... {outside[2]}") from error
        raise damaged(kind, where, bad_line(data, kind)) from error
    read = sum(len(part.triangles) for part in parts)
    if read < declared:
        raise damaged(kind, where, bad_line(data, kind) or f"{declared} faces of which {read} can be read")
    if not parts:
        # of an OBJ without faces trimesh keeps no vertices, without which its header is refused
        points = kind == "obj" or any(len(getattr(one, "vertices", ())) for one in scene.geometry.values())
        told = "no faces (a point cloud?)" if points else "neither vertices nor faces"
        cure = "mesh the points first, or export the faces too" if points else EXPORT
        raise InputError("the mesh has no triangles", where=where, found=bad_line(data, kind) or told, cure=cure)
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
            raise no_such_vertex(lowest if lowest < 0 else highest, where, f"0 ... {len(vertices) - 1}")
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
    """Whether any corner's vertex normal is more than 0.1 degrees off its facet's, which three digits may be."""
    corners = vertices[triangles]
    facet = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    dot = np.einsum("tk,tck->tc", facet, normals[triangles])
    lengths = np.linalg.norm(facet, axis=1)[:, None] * np.linalg.norm(normals, axis=1)[triangles]
    return bool((dot < np.cos(np.radians(0.1)) * lengths).any())
