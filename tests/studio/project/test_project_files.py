"""A project that is saved elsewhere takes every file along that it names."""

from __future__ import annotations

from pathlib import Path

import pytest

from analysis.line.settings import ExtractionSettings
from analysis.report.delivery import Delivery
from render.base.errors import InputError
from render.camera.camera import Camera
from render.material.material import Blend, Coated, Lambertian, Texture
from render.scene.scene import Rig, Scene, SceneObject
from render.scene.shape import MeshFile, Plane
from studio.project.project import Project
from studio.project.project_files import carry, missing_files, named_files

SHINY = Blend(
    base=Lambertian(albedo=Texture(path="images/rust.png")),
    over=Coated(albedo=Texture(path="images/paint.png")),
    mask=Texture(path="images/ground.png"),
)
RIG = Rig(camera=Camera(width=4, height=4, fx=4, fy=4, cx=1.5, cy=1.5))
SCENE = Scene(
    rig=RIG,
    objects=(
        SceneObject(name="part", shape=MeshFile(path="meshes/part.ply"), material=SHINY),
        SceneObject(name="table", shape=Plane(), visible=False, material=Lambertian(albedo=Texture(path="wood.png"))),
    ),
)
FILES = {"images/rust.png", "images/paint.png", "images/ground.png", "meshes/part.ply", "wood.png"}


@pytest.fixture
def root(tmp_path: Path) -> Path:
    for name in FILES:
        file = tmp_path / "from" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(name)
    return tmp_path / "from"


def test_every_texture_of_a_blend_is_taken_along(root: Path, tmp_path: Path) -> None:
    written = carry(Project(scene=SCENE), root, tmp_path / "to")
    assert {file.relative_to(tmp_path / "to").as_posix() for file in written} == FILES
    assert all(file.read_text() == file.relative_to(tmp_path / "to").as_posix() for file in written)


def test_a_chooser_s_weights_and_their_card_are_taken_along(root: Path, tmp_path: Path) -> None:
    for name in ("mine.onnx", "mine.json"):
        (root / name).write_text(name)
    project = Project(scene=SCENE, extraction=ExtractionSettings(select="learned", chooser="mine.onnx"))
    written = {file.name for file in carry(project, root, tmp_path / "to")}
    assert {"mine.onnx", "mine.json"} <= written
    assert (tmp_path / "to" / "mine.onnx").read_text() == "mine.onnx"


def test_each_file_is_named_by_its_field() -> None:
    found = named_files(SCENE, "scene")
    assert found["images/ground.png"] == "scene.objects[0].material.mask.path"
    assert found["images/paint.png"] == "scene.objects[0].material.over.albedo.path"


def test_a_missing_file_of_a_visible_object_is_told(root: Path) -> None:
    for name in ("images/rust.png", "wood.png"):
        (root / name).unlink()
    assert [(i, file.name) for i, file in missing_files(SCENE, root)] == [(0, "rust.png")]


def test_another_file_in_the_way_stops_before_anything_is_copied(root: Path, tmp_path: Path) -> None:
    other = tmp_path / "to" / "wood.png"
    other.parent.mkdir()
    other.write_text("something else")
    with pytest.raises(InputError, match="in the way"):
        carry(Project(scene=SCENE), root, tmp_path / "to")
    assert [file.name for file in (tmp_path / "to").rglob("*") if file.is_file()] == ["wood.png"]
    assert other.read_text() == "something else"


def test_a_path_that_leaves_the_folder_is_refused(root: Path, tmp_path: Path) -> None:
    away = Scene(rig=RIG, objects=(SceneObject(name="part", shape=MeshFile(path="../part.ply")),))
    with pytest.raises(InputError):
        carry(Project(scene=away), root, tmp_path / "to")


def test_a_logo_outside_of_the_folder_keeps_nobody_from_saving(root: Path, tmp_path: Path) -> None:
    (tmp_path / "logo.png").write_text("elsewhere")
    for logo, taken in (("../logo.png", set()), ("wood.png", {"wood.png"})):
        project = Project(scene=Scene(rig=RIG), delivery=Delivery(logo=logo))
        to = tmp_path / logo.replace("/", "-")
        to.mkdir()
        assert {str(file.relative_to(to)) for file in carry(project, root, to)} == taken
