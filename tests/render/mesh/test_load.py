"""Meshes from files: every format gives the same triangles, with their UV, colours and textures."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from render.material.material import FromMesh, Lambertian, Texture
from render.mesh.load import load_mesh, unit_warning
from render.mesh.mesh import Mesh
from render.mesh.texture import srgb_to_linear
from render.scene.scene import SceneObject
from render.scene.shape import Box, MeshFile, Plane, WeldTee

FORMATS = ["ply", "ply_ascii", "stl", "stl_ascii", "obj", "off", "glb", "gltf"]
# Exact in float32, so that every format can bring them back to the last bit.
VERTICES = np.array([[0, 0, 0], [0.25, 0, 0], [0.25, 0.125, 0], [0, 0.125, 0], [0.125, 0.0625, 0.5]])
TRIANGLES = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [0, 2, 1], [0, 3, 2]])
FROM_MESH = Lambertian(albedo=FromMesh())


def thing(path: str, material: Lambertian | None = None, scale: float = 1.0, **shape: object) -> SceneObject:
    shape_file = MeshFile(path=path, **shape)  # type: ignore[arg-type]
    return SceneObject(name="part", shape=shape_file, material=material or Lambertian(), scale=scale)


def write(folder: Path, kind: str, vertices: np.ndarray = VERTICES, triangles: np.ndarray = TRIANGLES) -> str:
    """Name of a mesh file written by trimesh."""
    mesh = trimesh.Trimesh(vertices, triangles, process=False)
    suffix, _, ascii_kind = kind.partition("_")
    path = folder / f"{kind}.{suffix}"
    if kind == "gltf":
        for name, data in mesh.scene().export(file_type="gltf").items():
            (folder / name).write_bytes(data)
        (folder / "model.gltf").rename(path)
    elif kind == "stl_ascii":
        path.write_text(mesh.export(file_type="stl_ascii"))
    elif ascii_kind:
        path.write_bytes(mesh.export(file_type=suffix, encoding="ascii"))
    else:
        mesh.export(path)
    return path.name


def corners(mesh: Mesh) -> np.ndarray:
    return mesh.vertices[mesh.triangles]


def write_obj(folder: Path, body: str, mtl: str = "") -> str:
    (folder / "a.obj").write_text(body)
    if mtl:
        (folder / "a.mtl").write_text(mtl)
    return "a.obj"


QUAD = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"


@pytest.mark.parametrize("kind", FORMATS)
def test_every_format_brings_back_the_triangles(tmp_path: Path, kind: str) -> None:
    mesh = load_mesh(thing(write(tmp_path, kind)), tmp_path)
    assert mesh.vertices.dtype == np.float64 and mesh.triangles.dtype == np.int32
    assert mesh.vertices.flags.c_contiguous and mesh.triangles.flags.c_contiguous
    np.testing.assert_array_equal(corners(mesh), VERTICES[TRIANGLES])
    assert mesh.texture is None and mesh.colour is None and not mesh.smooth_normals


def test_text_formats_keep_float64(tmp_path: Path) -> None:
    name = write_obj(tmp_path, "v 0.123456789012345 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert load_mesh(thing(name), tmp_path).vertices[0, 0] == 0.123456789012345


@pytest.mark.parametrize(("unit", "factor"), [("m", 1.0), ("cm", 0.01), ("mm", 0.001), ("um", 1e-6), ("in", 0.0254)])
def test_unit_and_scale_multiply(tmp_path: Path, unit: str, factor: float) -> None:
    mesh = load_mesh(thing(write(tmp_path, "ply"), unit=unit, scale=3.0), tmp_path)
    np.testing.assert_allclose(mesh.vertices, VERTICES * factor * 3, rtol=1e-15)


def test_scale_multiplies_a_primitive_too(tmp_path: Path) -> None:
    item = SceneObject(name="box", shape=Box(size_x=1, size_y=2, size_z=3), scale=0.5)
    np.testing.assert_array_equal(np.ptp(load_mesh(item, tmp_path).vertices, axis=0), (0.5, 1, 1.5))
    tee = load_mesh(SceneObject(name="tee", shape=WeldTee(triangles=1000)), tmp_path)
    assert len(tee.triangles) > 900


def test_polygons_are_cut_into_triangles_that_cover_them(tmp_path: Path) -> None:
    (tmp_path / "a.off").write_text("OFF\n# a comment\n5 2 0\n0 0 0\n2 0 0\n2 2 0\n0 2 0\n3 1 0\n4 0 1 2 3\n3 1 4 2\n")
    name = write_obj(tmp_path, "v 0 0 0\nv 2 0 0\nv 3 1 0\nv 2 2 0\nv 0 2 0\nf 1 2 3 4 5\n")
    for path, area in (("a.off", 5.0), (name, 5.0)):
        a, b, c = np.moveaxis(corners(load_mesh(thing(path), tmp_path)), 1, 0)
        normals = np.cross(b - a, c - a)
        assert len(normals) == 3 and (normals[:, 2] > 0).all()
        assert normals[:, 2].sum() / 2 == area


def test_parts_of_a_scene_are_merged_where_their_transforms_put_them(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    mesh = trimesh.Trimesh(VERTICES, TRIANGLES, process=False)
    shift = trimesh.transformations.translation_matrix([1, 2, 3])
    turn = trimesh.transformations.rotation_matrix(np.pi / 2, [0, 0, 1])
    scene.add_geometry(mesh, node_name="shifted", transform=shift)
    scene.add_geometry(mesh, node_name="turned", parent_node_name="shifted", transform=turn)
    scene.add_geometry(mesh, node_name="mirrored", transform=np.diag([-1.0, 1.0, 1.0, 1.0]))
    scene.export(tmp_path / "a.glb")
    found = corners(load_mesh(thing("a.glb"), tmp_path))
    assert len(found) == 18
    expected = {
        "shifted": np.add(VERTICES, (1, 2, 3)),
        "turned": np.add(VERTICES @ turn[:3, :3].T, (1, 2, 3)),
        "mirrored": VERTICES * (-1, 1, 1),
    }
    for name, vertices in expected.items():
        order = TRIANGLES[:, ::-1] if name == "mirrored" else TRIANGLES
        assert any(np.abs(found[k : k + 6] - vertices[order]).max() < 1e-6 for k in (0, 6, 12)), name


def test_relative_indices_of_an_obj_count_from_where_they_stand(tmp_path: Path) -> None:
    name = write_obj(tmp_path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 0 0 5\nv 1 0 5\nv 0 1 5\nf -3 -2 -1\n")
    found = corners(load_mesh(thing(name), tmp_path))
    np.testing.assert_array_equal(found[:, :, 2], [[0, 0, 0], [5, 5, 5]])


def test_smooth_normals_are_noticed_only_where_they_differ_from_the_facets(tmp_path: Path) -> None:
    sphere = trimesh.creation.icosphere(subdivisions=2, radius=0.1)
    for kind in ("ply", "obj", "glb"):
        assert sphere.vertex_normals is not None  # made, so that it is exported
        sphere.export(tmp_path / f"s.{kind}", include_normals=True) if kind != "ply" else sphere.export(
            tmp_path / "s.ply", vertex_normal=True
        )
        assert load_mesh(thing(f"s.{kind}"), tmp_path).smooth_normals, kind
    flat = write_obj(tmp_path, QUAD + "vn 0 0 1\nf 1/1/1 2/2/1 3/3/1 4/4/1\n")
    assert not load_mesh(thing(flat), tmp_path).smooth_normals


def test_uv_of_an_obj_belongs_to_corners(tmp_path: Path) -> None:
    # One vertex with two UV: a seam.
    name = write_obj(tmp_path, QUAD + "vt 0.5 0.5\nf 1/1 2/2 3/3\nf 1/5 3/3 4/4\n")
    mesh = load_mesh(thing(name), tmp_path)
    assert mesh.uv is not None and mesh.uv.dtype == np.float32
    expected = {(0, 0): {(0, 0), (0.5, 0.5)}, (1, 1): {(1, 1)}, (1, 0): {(1, 0)}, (0, 1): {(0, 1)}}
    found: dict[tuple[float, ...], set[tuple[float, ...]]] = {}
    for point, uv in zip(corners(mesh).reshape(-1, 3), mesh.uv.reshape(-1, 2), strict=True):
        found.setdefault((point[0], point[1]), set()).add((float(uv[0]), float(uv[1])))
    assert found == expected


@pytest.mark.parametrize("kind", ["obj", "glb", "ply"])
def test_a_textured_file_brings_its_uv_and_its_image(tmp_path: Path, kind: str) -> None:
    codes = np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [188, 188, 188]]], dtype=np.uint8)
    image = Image.fromarray(codes)
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0.5]])
    if kind == "ply":
        mesh = trimesh.Trimesh(VERTICES, TRIANGLES, process=False, visual=trimesh.visual.TextureVisuals(uv=uv))
        data = mesh.export(file_type="ply").replace(b"end_header", b"comment TextureFile wood.png\nend_header")
        (tmp_path / "a.ply").write_bytes(data)
        image.save(tmp_path / "wood.png")
    elif kind == "obj":
        lines = [f"v {x} {y} {z}" for x, y, z in VERTICES] + [f"vt {u} {v}" for u, v in uv]
        lines += ["mtllib a.mtl", "usemtl wood"]
        lines += ["f " + " ".join(f"{i + 1}/{i + 1}" for i in triangle) for triangle in TRIANGLES]
        # Kd is what a viewer without textures shows; an option may stand before the name.
        write_obj(tmp_path, "\n".join(lines), "newmtl wood\nKd 0.8 0.8 0.8\nmap_Kd -s 1 1 1 images\\wood.png\n")
        (tmp_path / "images").mkdir()
        image.save(tmp_path / "images" / "wood.png")
    else:
        material = trimesh.visual.material.PBRMaterial(baseColorTexture=image, baseColorFactor=[255, 255, 255, 255])
        visual = trimesh.visual.TextureVisuals(uv=uv, material=material)
        trimesh.Trimesh(VERTICES, TRIANGLES, process=False, visual=visual).export(tmp_path / "a.glb")
    mesh = load_mesh(thing(f"a.{kind}", FROM_MESH), tmp_path)
    np.testing.assert_allclose(mesh.texture, srgb_to_linear(codes / 255), atol=1e-6)
    assert mesh.uv is not None and mesh.colour is None
    order = [np.abs(VERTICES - point).sum(axis=1).argmin() for point in corners(mesh).reshape(-1, 3)]
    np.testing.assert_allclose(mesh.uv.reshape(-1, 2), uv[order], atol=1e-6)
    # A constant albedo asks for no image, and one of its own replaces the file's.
    assert load_mesh(thing(f"a.{kind}"), tmp_path).texture is None


def test_an_mtl_colour_is_taken_as_written(tmp_path: Path) -> None:
    name = write_obj(tmp_path, "mtllib a.mtl\nusemtl m\n" + QUAD + "f 1 2 3 4\n", "newmtl m\nKd 0.123 0.456 0.789\n")
    assert load_mesh(thing(name, FROM_MESH), tmp_path).colour == (0.123, 0.456, 0.789)
    assert load_mesh(thing(name), tmp_path).colour is None


def test_a_file_without_colour_brings_none(tmp_path: Path) -> None:
    mesh = load_mesh(thing(write(tmp_path, "stl"), FROM_MESH), tmp_path)
    assert mesh.colour is None and mesh.texture is None


def lookup(mesh: Mesh) -> np.ndarray:
    """(t, 3) the texel that each triangle's three corners name, checked to be its exact centre."""
    assert mesh.texture is not None and mesh.uv is not None
    height, width = mesh.texture.shape[:2]
    uv = mesh.uv.astype(np.float64)
    x, y = uv[..., 0] * width - 0.5, (1 - uv[..., 1]) * height - 0.5
    assert (x == np.round(x)).all() and (y == np.round(y)).all()
    assert (np.ptp(uv, axis=1) == 0).all()
    return np.asarray(mesh.texture[y[:, 0].astype(int), x[:, 0].astype(int)])


def test_face_and_vertex_colours_give_each_triangle_its_colour(tmp_path: Path) -> None:
    random = np.random.default_rng(8)
    faces = random.integers(0, 256, (6, 4), dtype=np.uint8)
    trimesh.Trimesh(VERTICES, TRIANGLES, face_colors=faces, process=False).export(tmp_path / "f.ply")
    found = lookup(load_mesh(thing("f.ply", FROM_MESH), tmp_path))
    np.testing.assert_allclose(found, srgb_to_linear(faces[:, :3] / 255), atol=1e-6)

    points = random.integers(0, 256, (5, 4), dtype=np.uint8)
    trimesh.Trimesh(VERTICES, TRIANGLES, vertex_colors=points, process=False).export(tmp_path / "v.ply")
    found = lookup(load_mesh(thing("v.ply", FROM_MESH), tmp_path))
    np.testing.assert_allclose(found, srgb_to_linear(points[:, :3] / 255)[TRIANGLES].mean(axis=1), atol=1e-6)


def test_many_face_colours_still_meet_texel_centres_exactly(tmp_path: Path) -> None:
    sphere = trimesh.creation.icosphere(subdivisions=5, radius=0.1)  # 20480 triangles: five rows of the palette
    colours = np.random.default_rng(9).integers(0, 256, (len(sphere.faces), 4), dtype=np.uint8)
    trimesh.Trimesh(sphere.vertices, sphere.faces, face_colors=colours, process=False).export(tmp_path / "a.ply")
    found = lookup(load_mesh(thing("a.ply", FROM_MESH), tmp_path))
    np.testing.assert_allclose(found, srgb_to_linear(colours[:, :3] / 255), atol=1e-6)


def test_materials_that_differ_are_kept_by_triangle(tmp_path: Path) -> None:
    body = "mtllib a.mtl\n" + QUAD + "usemtl red\nf 1 2 3\nusemtl grey\nf 1 3 4\n"
    name = write_obj(tmp_path, body, "newmtl red\nKd 0.7 0.1 0.1\nnewmtl grey\nKd 0.4 0.4 0.4\n")
    mesh = load_mesh(thing(name, FROM_MESH), tmp_path)
    for triangle, colour in zip(corners(mesh), lookup(mesh), strict=True):
        red = (triangle == (1, 0, 0)).all(axis=1).any()
        np.testing.assert_allclose(colour, (0.7, 0.1, 0.1) if red else (0.4, 0.4, 0.4), atol=1e-7)


def test_several_textures_are_told_and_sampled_at_each_triangle(tmp_path: Path) -> None:
    for name, value in (("a", 255), ("b", 0)):
        Image.fromarray(np.full((4, 4, 3), value, dtype=np.uint8)).save(tmp_path / f"{name}.png")
    body = "mtllib a.mtl\n" + QUAD + "usemtl a\nf 1/1 2/2 3/3\nusemtl b\nf 1/1 3/3 4/4\n"
    name = write_obj(tmp_path, body, "newmtl a\nmap_Kd a.png\nnewmtl b\nmap_Kd b.png\n")
    with pytest.warns(UserWarning, match=r"object 'part': a\.obj: .*several textures"):
        mesh = load_mesh(thing(name, FROM_MESH), tmp_path)
    assert sorted(lookup(mesh)[:, 0].tolist()) == [0, 1]


def test_an_albedo_texture_is_laid_on_a_primitive_and_scaled(tmp_path: Path) -> None:
    Image.fromarray(np.full((2, 3, 3), 188, dtype=np.uint8)).save(tmp_path / "grey.png")
    albedo = Texture(path="grey.png", scale=0.5)
    item = SceneObject(name="p", shape=Plane(), material=Lambertian(albedo=albedo))
    mesh = load_mesh(item, tmp_path)
    assert mesh.texture is not None and mesh.uv is not None and mesh.texture.shape == (2, 3, 3)
    np.testing.assert_allclose(mesh.texture, 0.5 * srgb_to_linear(np.array(188 / 255)), atol=1e-6)
    # An edited image is read anew.
    Image.fromarray(np.full((2, 3, 3), 255, dtype=np.uint8)).save(tmp_path / "grey.png")
    os.utime(tmp_path / "grey.png", ns=(1, 1))
    np.testing.assert_array_equal(load_mesh(item, tmp_path).texture, np.float32(0.5))


def test_a_mesh_is_read_once_and_again_only_when_its_file_changes(tmp_path: Path) -> None:
    name = write(tmp_path, "ply")
    first = load_mesh(thing(name), tmp_path)
    assert load_mesh(thing(name), tmp_path) is first
    write(tmp_path, "ply", VERTICES * 2)
    os.utime(tmp_path / name, ns=(1, 1))
    np.testing.assert_array_equal(load_mesh(thing(name), tmp_path).vertices, VERTICES * 2)


def test_a_size_that_does_not_fit_its_unit_is_worded(tmp_path: Path) -> None:
    name = write(tmp_path, "ply")
    large = thing(name, unit="cm", scale=1e4)
    assert unit_warning(load_mesh(large, tmp_path), large) is None, "a deliberate scale is believed"
    metres = thing(name, scale=100.0)
    assert 'looks like millimetres; set unit to "mm"' in (unit_warning(load_mesh(metres, tmp_path), metres) or "")
    small = thing(name, unit="um")
    assert 'set unit to "m"' in (unit_warning(load_mesh(small, tmp_path), small) or "")
    fine = thing(name)
    assert unit_warning(load_mesh(fine, tmp_path), fine) is None


def test_a_gltf_buffer_and_a_percent_encoded_name_are_found_beside_the_file(tmp_path: Path) -> None:
    (tmp_path / "sub folder").mkdir()
    name = write(tmp_path / "sub folder", "gltf")
    path = tmp_path / "sub folder" / name
    header = json.loads(path.read_text())
    uri = header["buffers"][0]["uri"]
    (path.parent / uri).rename(path.parent / "the buffer.bin")
    header["buffers"][0]["uri"] = "../sub%20folder/the%20buffer.bin"
    path.write_text(json.dumps(header))
    np.testing.assert_array_equal(corners(load_mesh(thing(f"sub folder/{name}"), tmp_path)), VERTICES[TRIANGLES])
