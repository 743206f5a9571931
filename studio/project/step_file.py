"""The parts of a STEP file as closed meshes of a stated chord, by OpenCASCADE in a process of its own."""

from __future__ import annotations

import importlib
import importlib.util
import math
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float
from render.base.errors import InputError
from render.base.files import atomic_write, check_regular, read_bytes
from render.mesh.mesh_headers import MAX_FILE_BYTES, MAX_PARTS, check_triangle_count

STEP_EXTENSIONS = ("step", "stp")
LEAST_CHORD, LARGEST_CHORD = 5e-7, 1e-4
"""m. Below the first a part of 0.1 m is rounded by its single-precision vertices as well."""
PATIENCE = 300.0
"""Seconds for one file."""
DARKEST = 0.02
"""A part that is drawn black still reflects."""
LARGEST_TURN = math.radians(45.0)
"""Of a surface within a facet. A normal that is farther off is undefined, as at the tip of a cone."""
SOLID = re.compile(rb"=\s*(?:MANIFOLD_SOLID_BREP|BREP_WITH_VOIDS|FACETED_BREP)\s*\(")
QUICK, THOROUGH = "delabella", "watson"
"""Triangulations of OpenCASCADE. The first is up to eight times quicker and makes the same facets, but may leave a face
without any: then a part is open, or missing if the face is all of it, and the second is asked.
"""
CONVERT = """
import sys
sys.modules["trimesh"] = None  # cascadio extends it where it is there, which would take longer to load than cascadio
import cascadio
source, target, chord_mm = sys.argv[1:]
cascadio.step_to_glb(source, target, tol_linear=float(chord_mm))
"""


@dataclass(frozen=True)
class Part:
    """One part of an assembly, where the assembly has it."""

    name: str
    vertices: Float
    """(v, 3) m, each place once."""
    triangles: NDArray[np.int64]
    """(t, 3)."""
    normals: Float
    """(t, 3, 3) unit normals of the true surface at the corners of its facets."""
    colour: tuple[float, float, float] | None
    """Linear reflectance, mean over the part's faces; None: the file has none."""
    closed: bool
    model: str
    """Of the parts that are copies of one, the same."""


def is_step(file: Path) -> bool:
    """By its suffix."""
    return file.suffix[1:].lower() in STEP_EXTENSIONS


def read_step(file: Path, chord: float) -> list[Part]:
    """The parts of a STEP file (ISO 10303-21), in m by the file's own unit.

    chord: how far facets may be off the true surface, m; taken into LEAST_CHORD ... LARGEST_CHORD. OpenCASCADE runs
    apart, so that a file on which it crashes costs an error and not the program. InputError: cascadio is not
    installed, the file is no STEP file, or has no surfaces, too many triangles or parts.
    """
    if importlib.util.find_spec("cascadio") is None:
        cure = 'install it: pip install "blazer-studio[step]"; or export the part as STL or PLY'
        raise InputError("cascadio, which reads STEP files, is not installed", where=str(file), cure=cure)
    check_regular(file, MAX_FILE_BYTES, "STEP file")
    text = read_bytes(file, MAX_FILE_BYTES, "STEP file")
    if b"ISO-10303-21" not in text[:4096]:
        raise InputError("this is not a STEP file", where=str(file), allowed="a file that begins with ISO-10303-21")
    solids = len(SOLID.findall(text))
    del text
    chord_mm = repr(float(np.clip(chord, LEAST_CHORD, LARGEST_CHORD)) * 1e3)
    deadline = time.monotonic() + PATIENCE
    try:
        parts = _converted(file, chord_mm, QUICK, PATIENCE)
    except InputError:
        parts = []
    if not parts or not all(part.closed for part in parts) or _shells(parts) < solids:
        parts = _converted(file, chord_mm, THOROUGH, max(deadline - time.monotonic(), 1.0))
    return parts


def _shells(parts: Sequence[Part]) -> int:
    """How many pieces of surface do not touch, in parts that are no copies of one another."""
    from scipy.sparse import coo_array  # takes a while: not before a file is read
    from scipy.sparse.csgraph import connected_components

    models = {part.model: part for part in parts}
    return sum(
        connected_components(coo_array((np.ones(len(t)), (t[:, 0], t[:, 1])), shape=(n, n)), directed=False)[0]
        for t, n in ((part.triangles[:, [0, 1, 1, 2]].reshape(-1, 2), len(part.vertices)) for part in models.values())
    )


def _converted(file: Path, chord_mm: str, triangulation: str, patience: float) -> list[Part]:
    """The parts as one triangulation makes them, within `patience` seconds. InputError: as read_step."""
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / "parts.glb"
        command = [sys.executable, "-c", CONVERT, str(file.resolve()), str(made), chord_mm]
        try:
            code = _run_beside_imports(command, folder, triangulation, patience)
        except subprocess.TimeoutExpired:
            cure = "export a simpler part, or a mesh"
            found = f"not read within {PATIENCE:g} s"
            raise InputError("the STEP file takes too long", where=str(file), found=found, cure=cure) from None
        if code != 0 or not made.is_file() or made.stat().st_size == 0:
            raise _damaged(file, f"OpenCASCADE ended with code {code}")
        data = read_bytes(made, MAX_FILE_BYTES, "mesh of the STEP file", str(file))
    return parts_of(data, str(file))


def _run_beside_imports(command: list[str], folder: str, triangulation: str, patience: float) -> int:
    """The exit code of a command; what reads its result, slow to load, is loaded meanwhile. TimeoutExpired."""
    quiet, environment = subprocess.DEVNULL, {**os.environ, "CSF_MeshAlgo": triangulation}
    with subprocess.Popen(command, stdout=quiet, stderr=quiet, cwd=folder, env=environment) as process:
        try:
            importlib.import_module("trimesh")
            return process.wait(patience)
        finally:
            process.kill()


def parts_of(data: bytes, where: str) -> list[Part]:
    """The parts of a GLB file as OpenCASCADE writes it, by name, faces of several colours put together again."""
    import io

    import trimesh

    try:
        stream: Any = io.BytesIO(data)
        scene = trimesh.load_scene(stream, file_type="glb", process=False)
    except Exception as error:  # a reader fails in any way, in words of its own
        raise _damaged(Path(where), "no readable mesh") from error
    parents = scene.graph.transforms.parents
    faces: dict[str, list[tuple[Float, Any]]] = {}
    models: dict[str, list[str]] = {}
    for node in scene.graph.nodes_geometry:
        matrix, name = scene.graph[node]
        geometry = scene.geometry[name]
        if len(getattr(geometry, "faces", ())):
            # trimesh hangs the faces of each colour below the node of their part
            owner = parents[node] if geometry.metadata.get("from_gltf_primitive") else node
            faces.setdefault(owner, []).append((np.asarray(matrix, dtype=np.float64), geometry))
            models.setdefault(owner, []).append(name)
    if not faces:
        raise _damaged(Path(where), "no surfaces")
    if len(faces) > MAX_PARTS:
        raise InputError(
            "the assembly has too many parts", where=where, found=str(len(faces)), allowed=f"at most {MAX_PARTS}"
        )
    check_triangle_count(sum(len(one.faces) for several in faces.values() for _, one in several), where)
    return [_part(str(name), several, " ".join(models[name])) for name, several in sorted(faces.items())]


def _part(name: str, faces: Sequence[tuple[Float, Any]], model: str) -> Part:
    import trimesh

    corners, turned, colours = [], [], []
    for _, geometry in faces:
        # places are told apart before they are moved, as rounding would part those that faces share
        local = np.asarray(geometry.vertices)[np.asarray(geometry.faces)]
        corners.append(local)
        # trimesh makes up normals that the file lacks
        turned.append(np.asarray(geometry.vertex_normals)[np.asarray(geometry.faces)])
        factor = getattr(getattr(geometry.visual, "material", None), "baseColorFactor", None)
        if factor is not None:
            area = float(np.linalg.norm(np.cross(local[:, 1] - local[:, 0], local[:, 2] - local[:, 0]), axis=1).sum())
            colours.append((area, np.asarray(factor[:3], dtype=np.float64) / 255.0))
    together = np.concatenate(corners).reshape(-1, 3)
    places, at = np.unique(together, axis=0, return_inverse=True)
    triangles = np.asarray(at.reshape(-1, 3), dtype=np.int64)
    a, b, c = triangles.T
    kept = (a != b) & (b != c) & (c != a)
    triangles, normals = triangles[kept], np.concatenate(turned)[kept]
    matrix = faces[0][0]
    if np.linalg.det(matrix[:3, :3]) < 0.0:  # a mirror turns counter-clockwise into clockwise
        triangles, normals = triangles[:, ::-1], normals[:, ::-1]
    vertices = places @ matrix[:3, :3].T + matrix[:3, 3]
    normals = _of_surface(normals @ np.linalg.inv(matrix[:3, :3]), vertices[triangles])
    colour = None
    if colours and sum(area for area, _ in colours) > 0.0:
        mean = np.average([one for _, one in colours], axis=0, weights=[area for area, _ in colours])
        red, green, blue = np.clip(mean, DARKEST, 1.0).round(4).tolist()
        colour = (red, green, blue)
    closed = bool(trimesh.Trimesh(places, triangles, process=False).is_watertight)
    return Part(name, vertices, triangles, normals, colour, closed, model)


def _of_surface(normals: Float, corners: Float) -> Float:
    """(t, 3, 3) normals of facets with these corners, of unit length; the facet's own where they are undefined."""
    facets = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        facets = facets / np.linalg.norm(facets, axis=2, keepdims=True)
        unit = normals / np.linalg.norm(normals, axis=2, keepdims=True)
    near = (unit * facets).sum(axis=2, keepdims=True) >= math.cos(LARGEST_TURN)
    return np.asarray(np.where(near, unit, facets))


def write_parts(parts: Sequence[Part], folder: Path, made: list[Path]) -> list[Path]:
    """Each part as a PLY in mm in a folder that is new; `made` grows by what was written. InputError: cannot be.

    A place has a vertex for each normal that its facets have there.
    """
    import trimesh

    files = []
    for part in parts:
        stem = re.sub(r"[^\w \-]+", "_", part.name).strip()[:80] or "part"
        number, target = 1, folder / f"{stem}.ply"
        while target in files:
            number += 1
            target = folder / f"{stem} {number}.ply"
        both = np.concatenate([part.vertices[part.triangles] * 1e3, part.normals], axis=2).astype(np.float32)
        vertices, at = np.unique(both.reshape(-1, 6), axis=0, return_inverse=True)
        mesh = trimesh.Trimesh(vertices[:, :3], at.reshape(-1, 3), vertex_normals=vertices[:, 3:], process=False)
        data = mesh.export(file_type="ply", vertex_normal=True)
        with atomic_write(target) as temporary:
            temporary.write_bytes(data)
        files.append(target)
        made.append(target)
    return files


def _damaged(file: Path, found: str) -> InputError:
    cure = "export it again as AP214 or AP242 with solids, or export a mesh (STL, PLY)"
    return InputError("no parts can be read from the STEP file", where=str(file), found=found, cure=cure)
