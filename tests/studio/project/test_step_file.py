"""STEP files become closed meshes in the file's unit, as near to the true surfaces as asked, placed as one assembly."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest
import trimesh

from render.base.errors import InputError
from render.mesh.load import load_mesh
from render.scene.scene import SceneObject
from render.scene.shape import MeshFile
from studio.editing.scene_edits import OBJECTS, add_parts
from studio.project.document import value_at
from studio.project.mesh_import import import_step
from studio.project.project import Project
from studio.project.step_file import Part, parts_of, read_step
from studio.project.templates import template_folder
from tests.studio.project.step_text import BOX, glb, pin

needs_cascadio = pytest.mark.skipif(importlib.util.find_spec("cascadio") is None, reason="cascadio is not installed")
RED, BLUE = (0.6, 0.0, 0.2), (0.0, 0.0, 1.0)


def volume(part: Part) -> float:
    return float(trimesh.Trimesh(part.vertices, part.triangles, process=False).volume)


def two_boxes() -> bytes:
    """One in two colours, and the same again, mirrored and moved by 0.1 m."""
    in_x = np.ptp(BOX[:, :, 0], axis=1) == 0.0
    matrix = np.diag([-1.0, 1.0, 1.0, 1.0])
    matrix[0, 3] = 0.1
    nodes = [{"name": "lid", "mesh": 0}, {"name": "copy", "mesh": 0, "matrix": matrix.T.ravel().tolist()}]
    return glb({"box": [(BOX[in_x], RED), (BOX[~in_x], BLUE)]}, nodes)


def test_faces_of_several_colours_are_one_closed_part_where_the_assembly_has_it() -> None:
    copy, lid = parts_of(two_boxes(), "boxes")
    assert [lid.name, copy.name] == ["lid", "copy"] and lid.closed and copy.closed
    assert len(lid.vertices) == 8 and len(lid.triangles) == 12
    assert volume(lid) == pytest.approx(48e-6, rel=1e-6) and volume(copy) == pytest.approx(48e-6, rel=1e-6)
    assert copy.vertices[:, 0].min() == pytest.approx(0.09, rel=1e-6)
    # 24 of 44 cm^2 are red; a byte holds a colour to 1 / 510
    assert lid.colour == pytest.approx((0.6 * 24 / 44, 0.02, (0.2 * 24 + 20) / 44), abs=1 / 500)


def test_a_part_with_a_gap_is_told() -> None:
    (part,) = parts_of(glb({"box": [(BOX[1:], RED)]}, [{"name": "box", "mesh": 0}]), "box")
    assert not part.closed


def test_parts_are_objects_that_stand_to_each_other_as_in_the_assembly(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    parts = parts_of(two_boxes(), "boxes")
    monkeypatch.setattr("studio.project.mesh_import.read_step", lambda file, chord: parts)
    meshes = import_step(tmp_path / "boxes.step", tmp_path, 1e-5)
    again = import_step(tmp_path / "boxes.step", tmp_path, 1e-5)
    assert [mesh.path for mesh in meshes] == ["meshes/boxes/copy.ply", "meshes/boxes/lid.ply"]
    assert again[0].path == "meshes/boxes 2/copy.ply"

    project = Project.load(template_folder("plane") / "project.json")
    made, path = add_parts(project, meshes)
    copy, lid = value_at(made, OBJECTS)[-2:]
    assert (lid.name, copy.name) == ("lid", "copy") and path == (*OBJECTS, len(made.scene.objects) - 1)
    assert lid.T_world_object == copy.T_world_object
    assert lid.material.albedo == parts[1].colour and lid.shape.unit == "mm"
    twice, _ = add_parts(made, meshes)
    assert [item.name for item in twice.scene.objects[-2:]] == ["copy 2", "lid 2"]


def test_a_single_part_is_called_as_its_file_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """ "base_interface_AP214" was in the tree, and nothing that was called as the file that had been chosen."""
    parts = parts_of(glb({"box": [(BOX, RED)]}, [{"name": "base_interface_AP214", "mesh": 0}]), "box")
    monkeypatch.setattr("studio.project.mesh_import.read_step", lambda file, chord: parts)
    (mesh,) = import_step(tmp_path / "housing.step", tmp_path, 1e-5)
    assert (mesh.name, mesh.path) == ("housing", "meshes/housing/housing.ply")
    made, path = add_parts(Project.load(template_folder("plane") / "project.json"), [mesh])
    assert value_at(made, path).name == "housing"


def test_without_cascadio_the_cure_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"cascadio.*not installed.*blazer-studio\[step\]"):
        read_step(tmp_path / "part.step", 1e-5)


@needs_cascadio
@pytest.mark.parametrize("unit", ["mm", "m"])
def test_a_pin_has_its_size_in_the_units_of_its_file_and_facets_within_the_chord(tmp_path: Path, unit: str) -> None:
    file, size = tmp_path / "pin.step", 1e-3 if unit == "mm" else 1.0
    radius, height = 0.01, 0.04
    file.write_text(pin(radius / size, height / size, unit))
    for chord in (5e-5, 5e-6):
        (part,) = read_step(file, chord)
        assert part.closed and part.name == "pin"
        assert np.ptp(part.vertices[:, 2]) == pytest.approx(height, rel=1e-6)
        faces = part.vertices[part.triangles]
        sides = faces[np.ptp(faces[:, :, 2], axis=1) > 0.0]
        middles = 0.5 * (sides + np.roll(sides, 1, axis=1))[:, :, :2]
        off = radius - np.linalg.norm(middles, axis=2)
        assert 0.1 * chord < off.max() <= chord * 1.001
        assert volume(part) == pytest.approx(np.pi * radius**2 * height, rel=2.0 * chord / radius)
        red, green, blue = part.colour or (0.0, 0.0, 0.0)
        assert red > 0.5 and max(green, blue) < 0.1


@needs_cascadio
def test_a_pin_is_shaded_by_its_true_surface(tmp_path: Path) -> None:
    """The mean of the facets about a corner bends a flat face beside small fillets."""
    file, project = tmp_path / "pin.step", tmp_path / "project"
    file.write_text(pin(10.0, 40.0, "mm"))
    (made,) = import_step(file, project, 1e-5)
    item = SceneObject(name="pin", shape=MeshFile(path=made.path, unit="mm"), crease_angle=0.5)
    mesh = load_mesh(item, project)
    assert mesh.normals is not None and mesh.smooth_normals
    corners = mesh.vertices[mesh.triangles]
    flat = np.ptp(corners[:, :, 2], axis=1) == 0.0
    up = np.where(corners[flat][:, :, 2] > 0.02, 1.0, -1.0)
    np.testing.assert_allclose(mesh.normals[flat], np.stack([0.0 * up, 0.0 * up, up], axis=-1), atol=1e-6)
    radial = corners[~flat] * (100.0, 100.0, 0.0)
    np.testing.assert_allclose(mesh.normals[~flat], radial, atol=1e-5)


@pytest.mark.parametrize("undefined", [(0.0, 0.0, 0.0), (np.nan, np.nan, np.nan), "inwards"])
def test_an_undefined_normal_is_that_of_its_facet(undefined: tuple[float, ...] | str) -> None:
    """OpenCASCADE writes any at the tip of a cone."""
    facet = np.cross(BOX[:, 1] - BOX[:, 0], BOX[:, 2] - BOX[:, 0])
    facet /= np.linalg.norm(facet, axis=1, keepdims=True)
    leaning = facet + 0.2 * np.roll(facet, 1, axis=1)
    given = np.stack([facet, leaning, -facet if undefined == "inwards" else np.broadcast_to(undefined, (12, 3))], 1)
    mirror = np.diag([-1.0, 1.0, 1.0, 1.0])
    nodes = [{"name": "box", "mesh": 0}, {"name": "copy", "mesh": 0, "matrix": mirror.T.ravel().tolist()}]
    box, copy = parts_of(glb({"box": [(BOX, RED)]}, nodes, given), "boxes")
    expected = np.stack([facet, leaning / np.linalg.norm(leaning, axis=1, keepdims=True), facet], axis=1)
    np.testing.assert_allclose(box.normals, expected, atol=1e-6)
    np.testing.assert_allclose(copy.normals, expected[:, ::-1] * (-1.0, 1.0, 1.0), atol=1e-6)


@pytest.mark.parametrize("lacks", ["a face", "a part", "everything"])
def test_what_the_quick_triangulation_leaves_out_is_asked_of_the_thorough_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lacks: str
) -> None:
    """A face without facets leaves its part open, or missing where the part has no other face."""
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: object())
    nodes = [{"name": "box", "mesh": 0}, {"name": "ball", "mesh": 1}, {"name": "box again", "mesh": 0}]
    whole = parts_of(glb({"box": [(BOX, RED)], "ball": [(BOX, RED)]}, nodes), "boxes")
    quick = {
        "a face": parts_of(glb({"box": [(BOX[1:], RED)], "ball": [(BOX, RED)]}, nodes), "boxes"),
        "a part": parts_of(glb({"box": [(BOX, RED)]}, [nodes[0], nodes[2]]), "boxes"),
    }
    asked: list[str] = []

    def converted(file: Path, chord_mm: str, triangulation: str, patience: float) -> list[Part]:
        asked.append(triangulation)
        if triangulation == "watson":
            return whole
        if lacks == "everything":
            raise InputError("OpenCASCADE ended")
        return quick[lacks]

    monkeypatch.setattr("studio.project.step_file._converted", converted)
    file = tmp_path / "part.step"
    file.write_text("ISO-10303-21;\n#1=MANIFOLD_SOLID_BREP('box',#2);\n#3=MANIFOLD_SOLID_BREP('ball',#4);\n")
    assert read_step(file, 1e-5) == whole and asked == ["delabella", "watson"]
    quick[lacks] = whole
    if lacks != "everything":
        assert read_step(file, 1e-5) == whole and asked[2:] == ["delabella"]


@needs_cascadio
def test_both_triangulations_make_the_same_facets(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "pin.step"
    file.write_text(pin(10.0, 40.0, "mm"))
    (quick,) = read_step(file, 5e-6)
    monkeypatch.setattr("studio.project.step_file.QUICK", "watson")
    (thorough,) = read_step(file, 5e-6)
    assert np.array_equal(quick.vertices, thorough.vertices) and len(quick.triangles) == len(thorough.triangles)


@needs_cascadio
@pytest.mark.parametrize("text", ["solid pin", "ISO-10303-21;\nrubbish", "ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n"])
def test_what_is_no_step_file_leaves_a_message_and_no_files(tmp_path: Path, text: str) -> None:
    file = tmp_path / "part.stp"
    file.write_text(text)
    with pytest.raises(InputError, match="STEP file"):
        import_step(file, tmp_path / "project", 1e-5)
    assert not (tmp_path / "project").exists()
