"""Polygons of mesh files become triangles that cover them: notches stay open, crossings are refused."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

from render.base.errors import InputError
from render.material.material import FromMesh, Lambertian
from render.mesh.file_colours import palette
from render.mesh.load import load_mesh
from render.mesh.mesh import Mesh
from render.mesh.polygons import ear_cut, fan, fan_covers
from render.scene.scene import SceneObject
from render.scene.shape import MeshFile
from tests.render.damaged import PROGRAM_WORDS, damaged_copies

DART = [(0.6, 0.0), (0.2, 0.2), (0.0, 0.6), (0.0, 0.0)]
"""Concave where no fan from its first corner covers it; 0.12 m^2."""
SPIRAL = [(0.0, 0.0), (0.5, 0.0), (0.5, 0.4), (0.1, 0.4), (0.1, 0.2), (0.2, 0.2)]
SPIRAL += [(0.2, 0.3), (0.4, 0.3), (0.4, 0.1), (0.0, 0.1)]
"""A coil that no corner sees all of; 0.13 m^2."""
CROSSED = [(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)]
STAR = [(np.cos(4 * np.pi * k / 5), np.sin(4 * np.pi * k / 5)) for k in range(5)]


def area(corners: np.ndarray) -> float:
    a, b, c = np.moveaxis(np.asarray(corners, dtype=np.float64), 1, 0)
    normals = np.cross(b - a, c - a)
    return float(np.linalg.norm(normals, axis=1).sum() / 2)


def shoelace(points: list[tuple[float, float]]) -> float:
    x, y = np.array(points).T
    return float(abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2)


def text(kind: str, points: list[tuple[float, float]]) -> str:
    """One polygon and a triangle beside it, as a file."""
    vertices = [(x, y, 0.0) for x, y in points] + [(5.0, 0.0, 0.0), (6.0, 0.0, 0.0), (5.0, 1.0, 0.0)]
    n = len(points)
    rows = "\n".join(f"{x} {y} {z}" for x, y, z in vertices)
    polygon, beside = list(range(n)), [n, n + 1, n + 2]
    if kind == "obj":
        faces = ["f " + " ".join(str(i + 1) for i in face) for face in (polygon, beside)]
        return "v " + rows.replace("\n", "\nv ") + "\n" + "\n".join(faces) + "\n"
    faces = [f"{len(face)} " + " ".join(map(str, face)) for face in (polygon, beside)]
    if kind == "off":
        return f"OFF\n{n + 3} 2 0\n{rows}\n" + "\n".join(faces) + "\n"
    header = f"ply\nformat ascii 1.0\nelement vertex {n + 3}\n" + "".join(f"property double {a}\n" for a in "xyz")
    header += "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
    return header + rows + "\n" + "\n".join(faces) + "\n"


def binary_ply(points: list[tuple[float, float]]) -> bytes:
    """Two polygons of that outline, each of a colour, one 1 m above the other."""
    n = len(points)
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {2 * n}\n"
    header += "".join(f"property double {a}\n" for a in "xyz") + "element face 2\n"
    header += "".join(f"property uchar {name}\n" for name in ("red", "green", "blue"))
    header += "property list uchar int vertex_indices\nend_header\n"
    vertices = np.array([(x, y, z) for z in (0.0, 1.0) for x, y in points])
    row = np.dtype([("colour", "u1", 3), ("count", "u1"), ("index", "<i4", n)])
    faces = np.array([((255, 0, 0), n, range(n)), ((0, 0, 255), n, range(n, 2 * n))], dtype=row)
    return header.encode() + vertices.tobytes() + faces.tobytes()


def read(folder: Path, name: str, content: str | bytes, material: Lambertian | None = None) -> Mesh:
    (folder / name).write_bytes(content.encode() if isinstance(content, str) else content)
    item = SceneObject(name="part", shape=MeshFile(path=name), material=material or Lambertian())
    return load_mesh(item, folder)


@pytest.mark.parametrize("kind", ["obj", "off", "ply"])
@pytest.mark.parametrize("outline", [DART, DART[1:] + DART[:1], SPIRAL, SPIRAL[::-1], SPIRAL[4:] + SPIRAL[:4]])
def test_the_notch_of_a_polygon_stays_open(tmp_path: Path, kind: str, outline: list[tuple[float, float]]) -> None:
    mesh = read(tmp_path, f"a.{kind}", text(kind, outline))
    assert len(mesh.triangles) == len(outline) - 2 + 1
    corners = mesh.vertices[mesh.triangles]
    assert area(corners) == pytest.approx(shoelace(outline) + 0.5, rel=1e-12)
    turns = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2]
    beside = corners[:, :, 0].min(axis=1) >= 5.0
    assert len(set(np.sign(turns[~beside]))) == 1, "every triangle turns as its polygon does"


@pytest.mark.parametrize("kind", ["obj", "off", "ply"])
@pytest.mark.parametrize("outline", [CROSSED, STAR], ids=["figure of eight", "star"])
def test_a_polygon_that_crosses_itself_is_refused(
    tmp_path: Path, kind: str, outline: list[tuple[float, float]]
) -> None:
    with pytest.raises(InputError, match=rf"a\.{kind}: a polygon of the mesh .*face 0, of {len(outline)} corners"):
        read(tmp_path, f"a.{kind}", text(kind, outline))


def test_polygons_of_a_binary_ply_keep_their_colours(tmp_path: Path) -> None:
    mesh = read(tmp_path, "a.ply", binary_ply(DART), Lambertian(albedo=FromMesh()))
    assert area(mesh.vertices[mesh.triangles]) == pytest.approx(2 * 0.12, rel=1e-12)
    below = mesh.vertices[mesh.triangles][:, 0, 2] == 0.0
    expected = palette(np.where(below[:, None], (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)).astype(np.float32))
    np.testing.assert_array_equal(mesh.texture, expected.texture)


def test_uv_stays_with_the_corners_of_a_concave_polygon(tmp_path: Path) -> None:
    vertices = "".join(f"v {x} {y} 0\nvt {x} {y}\n" for x, y in DART)
    mesh = read(tmp_path, "a.obj", vertices + "f -4/-4 -3/-3 -2/-2 -1/-1\n")
    assert mesh.uv is not None
    np.testing.assert_allclose(mesh.uv, mesh.vertices[mesh.triangles][:, :, :2], atol=1e-7)
    assert area(mesh.vertices[mesh.triangles]) == pytest.approx(0.12, rel=1e-12)


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("size", ["1e200", "1e308"])
def test_a_polygon_beyond_all_bounds_is_told_without_a_word_of_the_reader(tmp_path: Path, size: str) -> None:
    content = f"OFF\n4 1 0\n0 0 0\n{size} 0 0\n{size} {size} 1\n0 {size} 0\n4 0 1 2 3\n"
    with pytest.raises(InputError, match=r"object 'part': a\.off"):
        read(tmp_path, "a.off", content)


def test_a_polygon_that_is_not_flat_is_told(tmp_path: Path) -> None:
    bent = "v 0 0 0\nv 1 0 0.2\nv 1 1 0\nv 0 1 0.2\nf 1 2 3 4\n"
    with pytest.warns(UserWarning, match=r"object 'part': a\.obj: 1 polygons are not flat"):
        assert len(read(tmp_path, "a.obj", bent).triangles) == 2
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read(tmp_path, "b.obj", bent.replace("0.2", "1e-4"))


def test_obj_lines_that_go_on_and_lines_that_are_indented_are_read(tmp_path: Path) -> None:
    mesh = read(tmp_path, "a.obj", "v 0 0 0\n  v 1 0 0\nv 0 \\\n1 0\nv 1 1 0\nf 1 2\\\n 3 # corner\n\tf 2 4 3\n")
    assert area(mesh.vertices[mesh.triangles]) == 1.0


def test_random_polygons_are_covered_exactly() -> None:
    random = np.random.default_rng(31)
    for _ in range(200):
        count = int(random.integers(4, 30))
        angle = np.sort(random.uniform(0, 2 * np.pi, count))
        if np.diff(np.append(angle, angle[0] + 2 * np.pi)).max() > 3.0:
            continue  # such an outline may cross itself
        outline = random.uniform(0.1, 1.0, count)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
        points = np.column_stack([outline, np.zeros(count)]) @ turn
        covered = bool(fan_covers(points[None])[0])
        triangles = fan(count) if covered else ear_cut(points)
        assert triangles is not None and len(triangles) == count - 2
        assert area(points[triangles]) == pytest.approx(shoelace([tuple(p) for p in outline]), rel=1e-9)
        if not covered:
            assert area(points[fan(count)]) > shoelace([tuple(p) for p in outline])


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("kind", ["obj", "relative.obj", "off", "ply", "binary.ply"])
def test_a_damaged_file_of_polygons_gives_a_mesh_or_a_message_in_plain_words(tmp_path: Path, kind: str) -> None:
    whole = binary_ply(SPIRAL) if kind == "binary.ply" else text(kind.rpartition(".")[2], SPIRAL).encode()
    if kind == "relative.obj":
        whole = "".join(f"v {x} {y} 0\nvt {x} {y}\n" for x, y in DART).encode() + b"f -4/-4 -3/-3 -2/-2 -1/-1\n"
    outcomes = set()
    for number, content in enumerate(damaged_copies(whole, 80, seed=5)):
        try:
            mesh = read(tmp_path, f"{number}.{kind}", content)
        except InputError as error:
            assert f"object 'part': {number}.{kind}" in str(error)
            assert not PROGRAM_WORDS.search(str(error)), error
            outcomes.add("told")
        else:
            assert np.isfinite(mesh.vertices).all() and mesh.triangles.max() < len(mesh.vertices)
            outcomes.add("read")
    assert outcomes == {"told", "read"}
