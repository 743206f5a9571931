"""Bad meshes get one clear message that names the object, the file, what was found and the cure; never a traceback."""

from __future__ import annotations

import json
import os
import struct
import warnings
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import render.mesh.load
import render.mesh.mesh_headers
import render.mesh.trimesh_reader
from render.base.errors import InputError
from render.base.files import sha256
from render.material.material import FromMesh, Lambertian, Texture
from render.mesh.load import load_mesh
from render.mesh.mesh import Mesh
from render.scene.scene import SceneObject
from render.scene.shape import MeshFile, Sphere
from tests.render.damaged import PROGRAM_WORDS

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
VERTICES = np.array([[0, 0, 0], [0.25, 0, 0], [0.25, 0.125, 0], [0, 0.125, 0], [0.125, 0.0625, 0.5]])
TRIANGLES = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [0, 2, 1], [0, 3, 2]])


def thing(path: str, albedo: object = 0.5, scale: float = 1.0, **shape: object) -> SceneObject:
    material = Lambertian(albedo=albedo)  # type: ignore[arg-type]
    return SceneObject(name="part", shape=MeshFile(path=path, **shape), material=material, scale=scale)  # type: ignore[arg-type]


def message(root: Path, path: str, albedo: object = 0.5, **shape: object) -> str:
    """The message that loading gives; it always begins with the object and names the file."""
    with pytest.raises(InputError) as raised:
        load_mesh(thing(path, albedo, **shape), root)
    text = str(raised.value)
    assert text.startswith("object 'part': ") and Path(path).name in text
    assert "\n" not in text
    return text


def message_of_text(root: Path, name: str, text: str | bytes, **options: object) -> str:
    (root / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    return message(root, name, **options)


def test_a_file_that_is_absent_a_folder_or_empty_is_told(tmp_path: Path) -> None:
    text = message(tmp_path, "meshes/part.ply")
    assert "there is no such mesh file" in text and "put the mesh into the project folder" in text
    (tmp_path / "folder.ply").mkdir()
    assert "folder.ply: the mesh file is a folder" in message(tmp_path, "folder.ply")
    assert "the mesh file is empty" in message_of_text(tmp_path, "a.stl", b"")
    os.mkfifo(tmp_path / "pipe.ply")
    assert "not a regular file; found a device or a pipe" in message(tmp_path, "pipe.ply")


@pytest.mark.parametrize("name", ["part.step", "part", "part.ply.zip", "part.drc"])
def test_an_unknown_kind_is_told_with_those_that_are_known(tmp_path: Path, name: str) -> None:
    text = message_of_text(tmp_path, name, TRIANGLE)
    assert "kind is not known" in text and ".ply, .stl, .obj, .glb, .gltf, .off" in text


@pytest.mark.parametrize("path", ["../part.ply", "/etc/passwd", "C:\\part.ply"])
def test_a_path_that_leaves_the_project_folder_is_told(tmp_path: Path, path: str) -> None:
    with pytest.raises(InputError, match=r"object 'part': shape\.path: the path .*copy the file into the project"):
        load_mesh(thing(path), tmp_path)


@pytest.mark.parametrize("kind", render.mesh.trimesh_reader.EXTENSIONS)
def test_a_file_of_another_kind_is_told(tmp_path: Path, kind: str) -> None:
    text = message_of_text(tmp_path, f"a.{kind}", "this is a poem\nabout a laser\n")
    assert "cannot be read as" in text or "no triangles" in text


def test_points_without_faces_are_told(tmp_path: Path) -> None:
    assert "no triangles; found no faces (a point cloud?)" in message_of_text(tmp_path, "a.obj", TRIANGLE)
    trimesh.PointCloud(VERTICES).export(tmp_path / "a.ply")
    assert "no triangles" in message(tmp_path, "a.ply")
    assert "no triangles" in message_of_text(tmp_path, "a.stl", bytes(84))


@pytest.mark.parametrize("value", ["nan", "inf", "-inf"])
def test_vertices_that_are_not_finite_are_told(tmp_path: Path, value: str) -> None:
    text = message_of_text(tmp_path, "a.obj", f"v {value} 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert "not finite; found NaN or infinity in 1 of 3 vertices" in text


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("high.obj", TRIANGLE + "f 1 2 4\n"),
        ("zero.obj", TRIANGLE + "f 0 1 2\n"),
        ("relative.obj", TRIANGLE + "f -4 -2 -1\n"),
        ("high.ply", "PLY 0 1 3"),
        ("negative.ply", "PLY 0 1 -1"),
    ],
)
def test_an_index_without_a_vertex_is_told(tmp_path: Path, name: str, content: str) -> None:
    if content.startswith("PLY"):
        header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        header += "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
        content = header + "0 0 0\n1 0 0\n0 1 0\n3" + content[3:] + "\n"
    text = message_of_text(tmp_path, name, content)
    assert "a triangle names a vertex that does not exist; found index" in text


def test_a_mesh_without_area_is_told_and_a_few_flat_triangles_are_left_out_with_a_warning(tmp_path: Path) -> None:
    line = "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\n"
    assert "found 1 of 1 triangles without area" in message_of_text(tmp_path, "a.obj", line + "f 1 2 3\n")
    (tmp_path / "b.obj").write_text(line + "f 1 2 4\nf 1 2 3\nf 2 3 4\nf 1 1 4\nf 1 3 4\n")
    with pytest.warns(UserWarning, match=r"object 'part': b\.obj: 2 of 5 triangles have no area and were left out"):
        mesh = load_mesh(thing("b.obj"), tmp_path)
    assert len(mesh.triangles) == 3


def test_uv_stays_with_its_triangles_when_flat_ones_are_left_out(tmp_path: Path) -> None:
    text = TRIANGLE + "v 0 0 1\nvt 0 0\nvt 1 0\nvt 0 1\nvt 0.5 0.5\nf 1/1 1/1 2/2\nf 1/1 2/2 3/3\nf 1/4 2/4 4/4\n"
    (tmp_path / "a.obj").write_text(text)
    with pytest.warns(UserWarning, match="1 of 3"):
        mesh = load_mesh(thing("a.obj"), tmp_path)
    assert mesh.uv is not None and len(mesh.uv) == 2
    np.testing.assert_array_equal(mesh.uv[0], [[0, 0], [1, 0], [0, 1]])
    np.testing.assert_array_equal(mesh.uv[1], 0.5)


def test_a_mesh_plainly_in_millimetres_is_told(tmp_path: Path) -> None:
    big = "v 0 0 0\nv 250 0 0\nv 0 100 0\nf 1 2 3\n"
    text = message_of_text(tmp_path, "a.obj", big)
    assert 'it is 250 m across, which looks like millimetres; set unit to "mm"' in text
    assert 'unit "cm" and scale 100' in text
    assert np.ptp(load_mesh(thing("a.obj", unit="mm"), tmp_path).vertices, axis=0)[0] == pytest.approx(0.25)
    assert np.ptp(load_mesh(thing("a.obj", unit="cm", scale=100.0), tmp_path).vertices, axis=0)[0] == 250


def test_a_gigantic_mesh_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = message_of_text(tmp_path, "a.obj", "v 5e8 0 0\nv 500000001 0 0\nv 5e8 1 0\nf 1 2 3\n", unit="mm")
    assert "too large, or too far from its origin; found a coordinate of 5e+05 m" in text
    item = SceneObject(name="ball", shape=Sphere(radius=1.0, segments=8), scale=1e6)
    with pytest.raises(InputError, match="object 'ball': the mesh is too large"):
        load_mesh(item, tmp_path)

    # The header alone tells; nothing of that size is made.
    header = "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nelement face 60000000\n"
    assert "too many triangles; found 60000000" in message_of_text(tmp_path, "a.ply", header + "end_header\n")
    with open(tmp_path / "c.stl", "wb") as file:
        file.truncate(5 * 2**30)
    assert "c.stl: the mesh file is too big; found 5368709120 bytes" in message(tmp_path, "c.stl")

    # A small file that shows one geometry many times.
    scene = trimesh.Scene([trimesh.Trimesh(VERTICES, TRIANGLES, process=False)])
    name = next(iter(scene.geometry))
    for k in range(9):
        scene.graph.update(frame_to=f"copy{k}", geometry=name)
    scene.export(tmp_path / "d.glb")
    monkeypatch.setattr(render.mesh.mesh_headers, "MAX_TRIANGLES", 59)
    assert "too many triangles; found 60" in message(tmp_path, "d.glb")
    (tmp_path / "b.stl").write_bytes(bytes(80) + struct.pack("<I", 61) + bytes(61 * 50))
    assert "too many triangles; found 61" in message(tmp_path, "b.stl")


@pytest.mark.parametrize("kind", ["ply", "ply_ascii", "stl", "stl_ascii", "obj", "off", "glb", "gltf"])
def test_a_file_cut_short_by_a_row_or_more_is_told(tmp_path: Path, kind: str) -> None:
    data = example(kind, tmp_path)
    suffix = kind.split("_")[0]
    shares = (0.1, 0.5, 0.9) if suffix != "obj" else (0.1, 0.4)  # an OBJ does not say how much there should be
    for share in shares:
        text = message_of_text(tmp_path, f"cut.{suffix}", data[: int(len(data) * share)])
        assert "cannot be read as" in text or "no triangles" in text or "names a vertex" in text


def test_an_unsupported_gltf_feature_is_told_instead_of_being_misread(tmp_path: Path) -> None:
    header = json.loads(example("gltf", tmp_path))
    changes: dict[str, dict[str, object]] = {
        "extension KHR_draco_mesh_compression": {"extensionsRequired": ["KHR_draco_mesh_compression"]},
        "extension KHR_mesh_quantization": {"extensionsRequired": ["KHR_mesh_quantization"]},
        "sparse accessor": {
            "accessors": [{**header["accessors"][0], "sparse": {"count": 1}}, *header["accessors"][1:]]
        },
        "integer positions or UV": {"accessors": [{**a, "componentType": 5123} for a in header["accessors"]]},
    }
    for feature, change in changes.items():
        text = message_of_text(tmp_path, "a.gltf", json.dumps({**header, **change}))
        assert f"glTF feature that is not supported; found {feature}" in text
    (tmp_path / "fine.gltf").write_text(json.dumps({**header, "extensionsRequired": ["KHR_materials_unlit"]}))
    assert len(load_mesh(thing("fine.gltf"), tmp_path).triangles) == 6


def test_a_texture_asks_for_uv(tmp_path: Path) -> None:
    text = message_of_text(tmp_path, "a.obj", TRIANGLE + "f 1 2 3\n", albedo=Texture(path="wood.png"))
    assert "the albedo is a texture, but the mesh has no usable UV; found a.obj" in text and "unwrap" in text
    damaged = TRIANGLE + "vt 0 0\nvt nan 1\nvt 1e300 1\nf 1/1 2/2 3/3\n"
    assert "no usable UV" in message_of_text(tmp_path, "b.obj", damaged, albedo=Texture(path="wood.png"))
    assert len(load_mesh(thing("b.obj"), tmp_path).triangles) == 1


def test_an_absent_texture_is_told_with_its_field(tmp_path: Path) -> None:
    item = SceneObject(name="ball", shape=Sphere(segments=8), material=Lambertian(albedo=Texture(path="wood.png")))
    with pytest.raises(InputError, match=r"object 'ball': material\.albedo\.path: wood\.png: the texture is not there"):
        load_mesh(item, tmp_path)
    outside = Lambertian(albedo=Texture(path="../wood.png"))
    with pytest.raises(InputError, match=r"object 'ball': material\.albedo\.path: the path leaves the project"):
        load_mesh(item.model_copy(update={"material": outside}), tmp_path)


@pytest.mark.parametrize("name", ["wood.png", "../secret.png", "/etc/hostname", "http://example.org/wood.png"])
def test_a_side_file_that_is_absent_or_outside_is_told_only_when_it_is_asked_for(tmp_path: Path, name: str) -> None:
    root = tmp_path / "project"
    root.mkdir()
    (tmp_path / "secret.png").write_bytes(b"secret")
    (root / "a.mtl").write_text(f"newmtl m\nmap_Kd {name}\n")
    text = f"mtllib a.mtl\nusemtl m\n{TRIANGLE}vt 0 0\nf 1/1 2/1 3/1\n"
    found = message_of_text(root, "a.obj", text, albedo=FromMesh())
    assert f"a file that the mesh names is absent, or outside the project folder; found {name}" in found
    assert len(load_mesh(thing("a.obj"), root).triangles) == 1


def test_a_damaged_image_in_a_mesh_file_is_told(tmp_path: Path) -> None:
    (tmp_path / "a.mtl").write_text("newmtl m\nmap_Kd wood.png\n")
    good = tmp_path / "good.png"
    from PIL import Image

    Image.fromarray(np.zeros((64, 64, 3), dtype=np.uint8)).save(good)
    (tmp_path / "wood.png").write_bytes(good.read_bytes()[:-40])
    text = f"mtllib a.mtl\nusemtl m\n{TRIANGLE}vt 0 0\nf 1/1 2/1 3/1\n"
    assert "wood.png: the texture cannot be read" in message_of_text(tmp_path, "a.obj", text, albedo=FromMesh())


def test_a_file_that_changed_since_it_was_saved_gives_a_warning(tmp_path: Path) -> None:
    path = tmp_path / "a.obj"
    path.write_text(TRIANGLE + "f 1 2 3\n")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        load_mesh(thing("a.obj", sha256=sha256(path)), tmp_path)
    with pytest.warns(UserWarning, match=r"object 'part': a\.obj: the file has changed since the project was saved"):
        load_mesh(thing("a.obj", sha256="0" * 64), tmp_path)


def example(kind: str, folder: Path) -> bytes:
    """A whole file; glTF keeps its buffer inside, so that one file can be mutated."""
    suffix, _, ascii_kind = kind.partition("_")
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0.5]])
    visual = trimesh.visual.TextureVisuals(uv=uv, material=trimesh.visual.material.PBRMaterial())
    mesh = trimesh.Trimesh(VERTICES, TRIANGLES, process=False, visual=None if suffix in ("stl", "off") else visual)
    if kind == "gltf":
        files = mesh.scene().export(file_type="gltf", embed_buffers=True)
        return bytes(files["model.gltf"])
    if kind == "obj":
        rows = [f"v {x} {y} {z}" for x, y, z in VERTICES] + [f"vt {u} {v}" for u, v in uv]
        return "\n".join(rows + ["f " + " ".join(f"{i + 1}/{i + 1}" for i in t) for t in TRIANGLES]).encode()
    if kind == "stl_ascii":
        return str(mesh.export(file_type="stl_ascii")).encode()
    data = mesh.export(file_type=suffix, encoding="ascii") if ascii_kind else mesh.export(file_type=suffix)
    return data.encode() if isinstance(data, str) else bytes(data)


@st.composite
def damage(draw: st.DrawFn, data: bytes) -> bytes:
    """A file with a few bytes changed, put in or taken out, or cut short."""
    result = bytearray(data)
    for _ in range(draw(st.integers(1, 4))):
        place = draw(st.integers(0, max(0, len(result) - 1)))
        match draw(st.sampled_from(["change", "digit", "insert", "remove", "cut", "double"])):
            case "change":
                result[place : place + 1] = bytes([draw(st.integers(0, 255))])
            case "digit":
                result[place : place + 1] = draw(st.sampled_from([b"9", b"-", b"0", b" ", b"\n", b"nan", b"1e300"]))
            case "insert":
                result[place:place] = draw(st.binary(min_size=1, max_size=6))
            case "remove":
                del result[place : place + draw(st.integers(1, 40))]
            case "cut":
                del result[place:]
            case "double":
                result[place:place] = result[place : place + draw(st.integers(1, 80))]
    return bytes(result)


@pytest.mark.filterwarnings("ignore::UserWarning", "error::RuntimeWarning")
@pytest.mark.parametrize("kind", ["ply", "ply_ascii", "stl", "stl_ascii", "obj", "off", "glb", "gltf"])
def test_a_damaged_file_gives_a_mesh_or_a_message_and_nothing_else(
    kind: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.mktemp(kind)
    data = example(kind, folder)
    name = "a." + kind.split("_")[0]
    path = folder / name
    path.write_bytes(data)
    assert len(load_mesh(thing(name), folder).triangles) == len(TRIANGLES)
    count = 0

    @settings(max_examples=60, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
    @given(damage(data), st.sampled_from([0.5, FromMesh()]))
    def check(damaged: bytes, albedo: object) -> None:
        nonlocal count
        count += 1
        path.write_bytes(damaged)
        os.utime(path, ns=(count, count))  # so that it is not taken for the one before
        try:
            mesh = load_mesh(thing(name, albedo), folder)
        except InputError as error:
            assert f"object 'part': {name}" in str(error)
            assert not PROGRAM_WORDS.search(str(error)), error
            return
        assert_sound(mesh)

    check()


def assert_sound(mesh: Mesh) -> None:
    assert len(mesh.triangles) > 0 and mesh.vertices.shape[1] == 3 and mesh.triangles.shape[1] == 3
    assert np.isfinite(mesh.vertices).all() and np.abs(mesh.vertices).max() <= render.mesh.load.MAX_EXTENT
    assert mesh.triangles.min() >= 0 and mesh.triangles.max() < len(mesh.vertices)
    assert mesh.uv is None or (mesh.uv.shape == (*mesh.triangles.shape, 2) and np.isfinite(mesh.uv).all())


def test_a_count_that_lies_is_told_with_the_length_that_it_asks_for(tmp_path: Path) -> None:
    stl = bytearray(example("stl", tmp_path))
    for count in (0, 5, 7, 2**31):
        stl[80:84] = struct.pack("<I", count)
        text = message_of_text(tmp_path, "a.stl", bytes(stl))
        assert f"found a count of {count} triangles, which take {84 + 50 * count} bytes, in a file of 384" in text
    for kind in ("ply", "ply_ascii"):
        data = example(kind, tmp_path).replace(b"element face 6", b"element face 600")
        text = message_of_text(tmp_path, f"{kind}.ply", data)
        assert "600 of face, which take at least" in text and "point cloud" not in text
    off = example("off", tmp_path).replace(b"5 6 0", b"5 600 0")
    assert "5 vertices and 600 faces in a file of" in message_of_text(tmp_path, "a.off", off)


@pytest.mark.parametrize(
    ("name", "content", "fault"),
    [
        ("a.obj", TRIANGLE + "f 1 2 three\n", "'f 1 2 three' in line 4"),
        ("b.obj", TRIANGLE.replace("0 1 0", "0 1 O") + "f 1 2 3\n", "'v 0 1 O' in line 3"),
        ("a.off", "OFF\n3 1 0\n0 0 0\n1 0 zero\n0 1 0\n3 0 1 2\n", "'1 0 zero' in line 4"),
        ("b.off", "OFF\n4 1 0\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n4 0 1 2\n", "a fault in face 0; allowed: a count"),
    ],
)
def test_a_fault_in_a_text_mesh_is_told_with_its_place(tmp_path: Path, name: str, content: str, fault: str) -> None:
    assert f"found {fault}" in message_of_text(tmp_path, name, content)


def test_a_row_of_a_text_ply_that_says_more_corners_than_it_has_is_told(tmp_path: Path) -> None:
    data = example("ply_ascii", tmp_path)
    start = data.index(b"\n3 ")
    told = message_of_text(tmp_path, "a.ply", data[: start + 1] + b"9" + data[start + 2 :])
    assert "found face 0, which says '9' corners" in told


def test_a_gltf_of_more_parts_than_a_file_may_have_is_told_before_they_are_made(tmp_path: Path) -> None:
    header = json.loads(example("gltf", tmp_path))
    header["nodes"] = [{"mesh": 0}] * 20_000
    text = message_of_text(tmp_path, "a.gltf", json.dumps(header))
    assert "too many parts; found 20000; allowed: at most 10000" in text
    header = json.loads(example("gltf", tmp_path))
    header["accessors"][0] = {"componentType": 5125, "type": "SCALAR", "count": 10**12}
    assert "too many" in message_of_text(tmp_path, "b.gltf", json.dumps(header))


def test_a_file_without_end_beside_the_mesh_is_told(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "a.mtl")
    text = message_of_text(tmp_path, "a.obj", f"mtllib a.mtl\n{TRIANGLE}f 1 2 3\n", albedo=FromMesh())
    assert "a.obj: a.mtl: the file that the mesh names is not a regular file" in text


def test_an_image_that_cannot_be_opened_is_told_where_the_reader_would_go_on_without_it(tmp_path: Path) -> None:
    (tmp_path / "a.mtl").write_text("newmtl m\nKd 0.5 0.5 0.5\nmap_Kd wood.png\n")
    (tmp_path / "wood.png").write_text("rust")
    text = f"mtllib a.mtl\nusemtl m\n{TRIANGLE}vt 0 0\nf 1/1 2/1 3/1\n"
    told = "a.obj: wood.png: the texture cannot be read; found no image"
    assert told in message_of_text(tmp_path, "a.obj", text, albedo=FromMesh())


def test_an_image_within_a_glb_that_cannot_be_opened_is_told(tmp_path: Path) -> None:
    from PIL import Image

    image = Image.fromarray(np.full((8, 8, 3), 99, dtype=np.uint8))
    material = trimesh.visual.material.PBRMaterial(baseColorTexture=image)
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0.5]])
    visual = trimesh.visual.TextureVisuals(uv=uv, material=material)
    data = trimesh.Trimesh(VERTICES, TRIANGLES, process=False, visual=visual).export(file_type="glb")
    (tmp_path / "a.glb").write_bytes(data)
    assert load_mesh(thing("a.glb", FromMesh()), tmp_path).texture is not None
    text = message_of_text(tmp_path, "b.glb", data.replace(b"\x89PNG", b"rust"), albedo=FromMesh())
    assert "b.glb: images[0]: the texture cannot be read; found no image" in text


def test_nothing_of_a_damaged_file_reaches_the_terminal(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    message_of_text(tmp_path, "a.stl", example("stl_ascii", tmp_path).replace(b"vertex 0", b"vertex x", 1))
    message_of_text(tmp_path, "a.ply", example("ply", tmp_path)[:-3])
    assert capfd.readouterr() == ("", "")
