"""A mesh that was read in too large a unit is around the camera, which is told; a room or a bench beside it is none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from render.base.pose import Pose
from render.material.material import Glass
from render.scene.scene import SceneObject
from render.scene.shape import Box, MeshFile
from studio.preview.inside import Inside, all_directions, inside
from studio.preview.inspection import inspect
from studio.preview.preview import Preview
from studio.project.document import replaced
from studio.project.project import Project

OBJECTS = ("scene", "objects")
AHEAD = Pose(translation=(0.0, 0.0, 0.8))


def holed(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """Without one face in eight, as scans of parts are: closed bodies are an error of the render."""
    mesh.update_faces(np.arange(len(mesh.faces)) % 8 > 0)
    return mesh


def found(folder: Path, mesh: trimesh.Trimesh, item: dict[str, object] | None = None) -> list[Inside]:
    """Of a part about the camera of the plane, with the mesh as its file."""
    return inside(Preview(1).look(around(folder, mesh, item), folder))


def around(folder: Path, mesh: trimesh.Trimesh, item: dict[str, object] | None = None) -> Project:
    mesh.export(folder / "part.ply")
    project = Project.load("plane")
    place = Pose(translation=tuple(project.scene.T_world_camera()[:3, 3]))
    shape = MeshFile(path="part.ply", unit="m")
    part = SceneObject(**{"name": "part", "shape": shape, "T_world_object": place, **(item or {})})
    return replaced(project, OBJECTS, (*project.scene.objects, part))


def test_a_part_that_is_around_camera_and_laser_is_told(tmp_path: Path) -> None:
    one = found(tmp_path, holed(trimesh.creation.icosphere(4, 1.5)))[0]
    assert one.enclosed and one.told == (
        "the camera and laser are inside part: they see and light nothing but its inner side; unless that is the room, "
        "is its unit or scale another?"
    )


def test_in_the_unit_that_it_was_made_in_it_is_around_nothing(tmp_path: Path) -> None:
    """It stands before the camera then."""
    mesh = holed(trimesh.creation.icosphere(4, 1.5))
    item = {"T_world_object": Pose.from_matrix(Project.load("plane").scene.T_world_camera()) @ AHEAD}
    assert found(tmp_path, mesh, item)[0].enclosed
    assert found(tmp_path, mesh, {**item, "shape": MeshFile(path="part.ply", unit="mm")}) == []


def test_a_part_around_the_camera_alone_names_no_laser(tmp_path: Path) -> None:
    baseline = np.linalg.norm(Project.load("plane").scene.T_camera_laser(0)[:3, 3])
    one = found(tmp_path, holed(trimesh.creation.icosphere(4, 0.5 * baseline)))[0]
    assert one.enclosed and one.who == ("the camera",) and "it sees nothing" in one.told


def test_a_bench_with_a_wall_has_its_box_around_the_camera_and_is_not(tmp_path: Path) -> None:
    bench, wall = trimesh.creation.box((3.0, 3.0, 0.1)), trimesh.creation.box((3.0, 0.1, 3.0))
    for mesh, place in ((bench, (0.0, 0.0, -1.0)), (wall, (0.0, 1.0, 0.0))):
        mesh.apply_translation(place)
    one = found(tmp_path, trimesh.util.concatenate([bench, wall]))[0]
    assert not one.enclosed and one.of("it") == "the camera and laser are within the box around it"


def test_shapes_of_the_program_and_water_are_no_mistakes(tmp_path: Path) -> None:
    mesh = trimesh.creation.icosphere(4, 1.5)
    assert found(tmp_path, mesh, {"material": Glass()}) == []
    assert found(tmp_path, mesh, {"shape": Box(size_x=3.0, size_y=3.0, size_z=3.0)}) == []


def test_inspect_warns_of_it(tmp_path: Path) -> None:
    view = inspect(around(tmp_path, holed(trimesh.creation.icosphere(4, 1.5))), tmp_path)
    assert any("inside part" in text for text in view.warnings)


def test_all_directions_are_looked_in_alike() -> None:
    directions = all_directions(512).astype(float)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0, atol=1e-6)
    # of an even distribution the mean is zero and the second moment a third in each axis
    np.testing.assert_allclose(directions.mean(axis=0), 0.0, atol=5e-3)
    assert directions.T @ directions / 512 == pytest.approx(np.eye(3) / 3.0, abs=5e-3)
