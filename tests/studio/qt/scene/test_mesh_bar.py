"""A mesh file that is around the camera, mostly of another unit, is told once, and beside its buttons."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFileDialog
from pytestqt.qtbot import QtBot

from render.base.pose import Pose
from render.scene.motion import NoMotion, Turntable
from render.scene.scene import SceneObject
from render.scene.shape import MeshFile
from studio.qt.core.live_preview import live
from studio.qt.core.session import Session
from studio.qt.scene.inspector import Inspector
from studio.qt.scene.mesh_bar import replace_mesh

OBJECTS = ("scene", "objects")
UNIT = (*OBJECTS, 1, "shape", "unit")


@pytest.fixture
def part(session: Session, inspector: Inspector, qtbot: QtBot) -> list[str]:
    """A ball of 2 m, in mm, before the camera is selected; what is told of it."""
    mesh = trimesh.creation.icosphere(4, 1.0)
    mesh.update_faces(np.arange(len(mesh.faces)) % 8 > 0)
    folder = session.document.root
    mesh.export(Path(folder) / "ball.ply")
    pose = Pose.from_matrix(session.project.scene.T_world_camera()) @ Pose(translation=(0.0, 0.0, 0.3))
    ball = SceneObject(name="ball", shape=MeshFile(path="ball.ply", unit="mm"), T_world_object=pose)
    session.set(OBJECTS, (session.project.scene.objects[0], ball))
    session.select((*OBJECTS, 1))
    told: list[str] = []
    session.message.connect(lambda level, text: told.append(text) if level == "warning" else None)
    qtbot.waitUntil(lambda: "2 x 2 x 2 mm" in inspector.mesh_bar.told.text())
    return told


def test_in_too_large_a_unit_it_is_said_to_be_around_the_camera(
    session: Session, inspector: Inspector, part: list[str], qtbot: QtBot
) -> None:
    bar = inspector.mesh_bar
    assert "nside" not in bar.told.text() and not part
    session.set(UNIT, "m")
    qtbot.waitUntil(lambda: "The camera and laser are inside it" in bar.told.text())
    assert "is its unit or scale another?" in bar.told.text()
    assert len(part) == 1 and part[0].startswith("the camera and laser are inside ball: they see and light nothing")
    session.set((*OBJECTS, 1, "material", "albedo"), 0.3)
    qtbot.waitUntil(lambda: live(session).look.project is session.project and not live(session).is_loading)
    assert len(part) == 1, "it is told when it comes about, not again and again"
    session.document.undo()
    session.document.undo()
    qtbot.waitUntil(lambda: "inside" not in bar.told.text() and "2 x 2 x 2 mm" in bar.told.text())


def test_over_the_turntable_and_on_top_of_another_part_by_a_click_each(
    session: Session, inspector: Inspector, part: list[str], qtbot: QtBot
) -> None:
    bar, told = inspector.mesh_bar, []
    session.message.connect(lambda _, text: told.append(text))
    session.set(("scene", "motion"), Turntable(centre=(0.05, -0.02, 0.0)))
    qtbot.mouseClick(bar.centre, Qt.MouseButton.LeftButton)
    assert session.project.scene.objects[1].T_world_object.translation[:2] == pytest.approx((0.05, -0.02), abs=1e-6)
    assert "the middle of its box over the turntable's axis point; Ctrl+Z takes it back" in told[-1]
    qtbot.mouseClick(bar.centre, Qt.MouseButton.LeftButton)
    assert "ball stood over the turntable's axis point already" in told[-1]
    qtbot.mouseClick(bar.top, Qt.MouseButton.LeftButton)
    assert "its lowest point to the top of what is below it, or to the ground" in told[-1]
    session.document.undo()
    session.set(("scene", "motion"), NoMotion())
    qtbot.mouseClick(bar.centre, Qt.MouseButton.LeftButton)
    assert session.project.scene.objects[1].T_world_object.translation[:2] == pytest.approx((0.0, 0.0), abs=1e-6)


def test_what_is_on_top_of_a_plane_that_leans_is_not_said_to_stand_in_it(
    session: Session, inspector: Inspector, part: list[str], qtbot: QtBot
) -> None:
    bar, floor = inspector.mesh_bar, session.project.scene.objects[0]
    session.set((*OBJECTS, 0, "T_world_object"), Pose(rotation=(0.2, 0.1, 0.0)))
    session.set((*OBJECTS, 1, "T_world_object"), Pose(rotation=(0.3, 0.5, 0.7)))
    session.select((*OBJECTS, 1))
    said = f"May stand in {floor.name}: their boxes overlap"
    qtbot.waitUntil(lambda: said in bar.told.text())
    qtbot.mouseClick(bar.top, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: live(session).look.project is session.project and not live(session).is_loading)
    assert bar.told.text().startswith("2 x 2 x 2 mm") and "May stand in" not in bar.told.text()


def test_a_file_takes_the_place_of_any_object_s_shape(
    session: Session, inspector: Inspector, monkeypatch: pytest.MonkeyPatch, qtbot: QtBot
) -> None:
    """A newcomer could not put a part in the place of the sample's."""
    file = Path(session.document.root) / "block.stl"
    trimesh.creation.box(extents=(40.0, 30.0, 20.0)).export(file)
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_: (str(file), ""))
    session.select((*OBJECTS, 0))
    before = session.project.scene.objects[0]
    assert not isinstance(before.shape, MeshFile)
    replace_mesh(session, inspector)
    qtbot.waitUntil(lambda: isinstance(session.project.scene.objects[0].shape, MeshFile), timeout=10_000)
    after = session.project.scene.objects[0]
    assert (after.T_world_object, after.material) == (before.T_world_object, before.material)
    # of a part that was scaled the file has another size than is said of it
    told: list[tuple[str, str]] = []
    session.message.connect(lambda level, text: told.append((level, text)))
    session.set((*OBJECTS, 0, "scale"), 0.5)
    replace_mesh(session, inspector)
    qtbot.waitUntil(lambda: any(level == "warning" for level, _ in told), timeout=10_000)
    assert "0.5, stays, and makes 20 x 15 x 10 mm of block.stl" in told[-1][1]


def test_where_no_object_is_selected_it_says_what_to_do(session: Session, inspector: Inspector) -> None:
    told: list[str] = []
    session.message.connect(lambda _, text: told.append(text))
    session.select(())
    replace_mesh(session, inspector)
    assert told == ["select an object first: the mesh takes the place of its shape"]
