"""The inspector's choices: another kind, a file, a preset, an entry added to a list."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QApplication, QLineEdit, QToolButton, QToolTip
from pytestqt.qtbot import QtBot

from analysis.gauges.gauge import Gauge
from render.laser.laser import Waist
from render.material.material import Texture
from render.scene.motion import LinearStage
from render.scene.shape import MeshFile
from studio.editing.placement import working_distance
from studio.preview.estimates import BLURRED_PX
from studio.preview.readouts import readouts
from studio.project.calibration import CalibratedCamera, Calibration
from studio.qt.core.live_preview import live
from studio.qt.core.session import Session
from studio.qt.scene import mesh_importer
from studio.qt.scene.inspector import Inspector
from tests.studio.qt.scene.inspector_hands import CAMERA, LASER, field, type_into
from tests.studio.qt.shell.window_hands import choose_file


def tools(inspector: Inspector) -> list[QToolButton]:
    return [tool for tool in inspector.form.findChildren(QToolButton) if tool.isVisible()]


def click_tool(qtbot: QtBot, inspector: Inspector, tip: str) -> None:
    """The first one with this tip."""
    qtbot.waitUntil(lambda: any(tool.toolTip() == tip for tool in tools(inspector)))
    qtbot.mouseClick(next(tool for tool in tools(inspector) if tool.toolTip() == tip), Qt.MouseButton.LeftButton)


class TestKinds:
    def choose(self, qtbot: QtBot, inspector: Inspector, path: Any, label: str) -> None:
        chooser = inspector.form.kinds[path]
        index = chooser.findText(label)
        chooser.setFocus()
        # as the list does when an entry is clicked
        chooser.setCurrentIndex(index)
        chooser.activated.emit(index)

    def test_a_sheet_becomes_focused(self, qtbot: QtBot, session: Session, inspector: Inspector) -> None:
        self.choose(qtbot, inspector, (*LASER, "sheet"), "Focused")
        assert session.project.scene.lasers[0].sheet == Waist()
        assert field(inspector, *LASER, "sheet", "radius").suffix == "µm"
        session.document.undo()
        assert field(inspector, *LASER, "sheet", "full_angle").text() == "1.15"

    def test_poses_are_added_and_removed(self, qtbot: QtBot, session: Session, inspector: Inspector) -> None:
        path = ("scene", "motion")
        session.select(path)
        self.choose(qtbot, inspector, path, "List of poses")
        type_into(qtbot, field(inspector, *path, "poses", 0, axis=0), "10")
        click_tool(qtbot, inspector, "Add a pose like the last one")
        type_into(qtbot, field(inspector, *path, "poses", 1, axis=0), "25")
        assert [pose.translation[0] for pose in session.project.scene.motion.poses] == [0.010, 0.025]
        click_tool(qtbot, inspector, "Remove this pose")
        assert [pose.translation[0] for pose in session.project.scene.motion.poses] == [0.025]
        qtbot.waitUntil(lambda: any("Add a pose" in tool.toolTip() for tool in tools(inspector)))
        assert not [tool for tool in tools(inspector) if tool.toolTip() == "Remove this pose"]  # one must stay
        session.document.undo()
        assert session.project.scene.frame_count == 2

    def test_motion_shape_and_filter(self, qtbot: QtBot, session: Session, inspector: Inspector) -> None:
        session.select(("scene", "motion"))
        self.choose(qtbot, inspector, ("scene", "motion"), "Turntable")
        assert session.project.scene.motion.kind == "turntable"
        self.choose(qtbot, inspector, ("scene", "motion"), "Linear stage")
        stage = session.project.scene.motion
        assert abs(np.dot(stage.step, session.project.scene.T_world_laser(0)[:3, 0])) > 0.6e-3, "across the line"
        session.select(("scene", "objects", 1))
        self.choose(qtbot, inspector, ("scene", "objects", 1, "shape"), "Sphere")
        assert session.project.scene.objects[1].shape.kind == "sphere"
        session.select(("sensor",))
        self.choose(qtbot, inspector, ("sensor", "band_pass"), "Band pass")
        assert session.project.sensor.band_pass is not None
        assert field(inspector, "sensor", "band_pass", "centre_nm").text() == "450"

    def test_a_motion_that_does_not_go_with_a_measure_is_refused(
        self, qtbot: QtBot, session: Session, inspector: Inspector
    ) -> None:
        stage = LinearStage(step=(0.001, 0.0, 0.0), steps=9)
        session.set(("scene", "motion"), stage)
        session.set(("measures",), (Gauge(kind="radius", step=5, regions=((0.0, 0.01),)),))
        session.select(("scene", "motion"))
        with qtbot.waitSignal(session.message, check_params_cb=lambda level, text: level == "error"):
            self.choose(qtbot, inspector, ("scene", "motion"), "Nothing moves")
        assert session.project.scene.motion == stage

    def test_a_mesh_file_is_chosen_copied_and_used(
        self, qtbot: QtBot, session: Session, inspector: Inspector, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        outside = tmp_path.parent / f"{tmp_path.name}-outside" / "part.stl"
        outside.parent.mkdir()
        trimesh.creation.box((100, 50, 20)).export(outside)
        choose_file(monkeypatch, outside)
        monkeypatch.setattr(mesh_importer, "may_copy", lambda *_: True)
        session.select(("scene", "objects", 1))
        self.choose(qtbot, inspector, ("scene", "objects", 1, "shape"), "Mesh file")
        qtbot.waitUntil(lambda: isinstance(session.project.scene.objects[1].shape, MeshFile))
        shape = session.project.scene.objects[1].shape
        assert (shape.path, shape.unit) == ("meshes/part.stl", "mm")
        qtbot.waitUntil(lambda: not mesh_importer.running)
        self.place_and_replace(qtbot, session, inspector, outside, monkeypatch)

    def place_and_replace(
        self,
        qtbot: QtBot,
        session: Session,
        inspector: Inspector,
        outside: Path,
        monkeypatch: pytest.MonkeyPatch,
    ) -> None:
        """A click for each: the longest side up, on the ground, and another file with pose and material as they are."""
        bar = inspector.mesh_bar
        qtbot.waitUntil(lambda: bar.ground.isEnabled())
        assert bar.told.text().startswith("100 x 50 x 20 mm")
        floor = session.project.scene.objects[0].name
        assert f"May stand in {floor}: their boxes overlap" in bar.told.text()
        bar.axes["-x"].trigger()
        qtbot.waitUntil(lambda: bar.ground.isEnabled() and bar.up.text().startswith("-x"))
        said: list[str] = []
        session.message.connect(lambda level, text: said.append(text))
        height = session.project.scene.objects[1].T_world_object.translation[2]
        for _ in range(2):
            qtbot.mouseClick(bar.ground, Qt.MouseButton.LeftButton)
        placed = session.project.scene.objects[1]
        assert placed.T_world_object.translation[2] == pytest.approx(0.05, abs=1e-9)
        moved = f"moved {1e3 * abs(0.05 - height):.4g} mm {'up' if height < 0.05 else 'down'}"
        assert moved in said[-2] and "stood on the ground already" in said[-1]
        qtbot.waitUntil(lambda: "May stand in" not in bar.told.text())
        # of another unit it stands where it stood, and one undo takes unit and place back
        unit = field(inspector, "scene", "objects", 1, "shape", "unit")
        unit.setCurrentIndex(unit.findText("in"))
        unit.activated.emit(unit.currentIndex())
        larger = session.project.scene.objects[1]
        assert larger.shape.unit == "in" and larger.T_world_object.translation[2] == pytest.approx(25.4 * 0.05)
        session.document.undo()
        assert session.project.scene.objects[1] == placed
        qtbot.waitUntil(lambda: bar.ground.isEnabled())
        trimesh.creation.icosphere(1, 10.0).export(outside.with_name("ball.stl"))
        choose_file(monkeypatch, outside.with_name("ball.stl"))
        qtbot.mouseClick(bar.replace, Qt.MouseButton.LeftButton)
        qtbot.waitUntil(lambda: session.project.scene.objects[1].shape.path == "meshes/ball.stl")
        qtbot.waitUntil(lambda: not mesh_importer.running)
        assert session.project.scene.objects[1].model_copy(update={"shape": placed.shape}) == placed
        session.document.undo()
        assert session.project.scene.objects[1] == placed
        self.scale_to_fit(qtbot, session, inspector)
        session.select(("scene", "objects", 0))
        assert not bar.isVisible()

    def scale_to_fit(self, qtbot: QtBot, session: Session, inspector: Inspector) -> None:
        """The new size of a part is told, as what is measured is another one now."""
        bar, told = inspector.mesh_bar, []
        before = session.project.scene.objects[1]
        qtbot.waitUntil(lambda: bar.fit.isEnabled() and bar.told.text().startswith("100 x 50 x 20 mm"))
        session.message.connect(lambda level, text: told.append((level, text)))
        qtbot.mouseClick(bar.fit, Qt.MouseButton.LeftButton)
        assert not isinstance(QApplication.focusWidget(), QLineEdit), "no key is typed into the next field"
        by = session.project.scene.objects[1].scale / before.scale
        sizes = f"100 mm became {100 * by:.4g} mm; it still stands on the ground"
        expected = f"{before.name} is scaled by {by:.3g}: {sizes}; Ctrl+Z takes it back"
        assert by != 1.0 and told == [("info", expected)]
        assert bar.fit.text() == "Scale to fit" and "Changes its size" in bar.fit.toolTip()
        session.document.undo()
        assert session.project.scene.objects[1] == before

    def test_a_file_dialog_that_is_cancelled_changes_nothing(
        self, qtbot: QtBot, session: Session, inspector: Inspector, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        before = session.project
        choose_file(monkeypatch, "")
        session.select(("scene", "objects", 1))
        for part, label in (("shape", "Mesh file"), ("material", None)):
            path = ("scene", "objects", 1, part)
            if label is None:
                path, label = (*path, "albedo"), "Image"
            self.choose(qtbot, inspector, path, label)
            assert session.project is before
            assert inspector.form.kinds[path].currentText() != label

    def test_an_image_becomes_the_albedo(
        self, qtbot: QtBot, session: Session, inspector: Inspector, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        (tmp_path / "wood.png").write_bytes(b"png")
        choose_file(monkeypatch, tmp_path / "wood.png")
        session.select(("scene", "objects", 1))
        self.choose(qtbot, inspector, ("scene", "objects", 1, "material", "albedo"), "Image")
        assert session.project.scene.objects[1].material.albedo == Texture(path="wood.png")


class TestMenus:
    def test_a_list_offers_to_add_to_it(self, session: Session, inspector: Inspector) -> None:
        session.select(("scene", "lights"))
        entries = {action.text(): action for action in inspector.add.menu().actions()}
        assert inspector.add.isVisible() and list(entries) == ["Point light", "Panel light"]
        entries["Point light"].trigger()
        assert session.selection == ("scene", "lights", 1)
        assert inspector.title.text() == "lamp"

    def test_a_preset_is_one_edit_and_tells_its_source(
        self, qtbot: QtBot, session: Session, inspector: Inspector
    ) -> None:
        before, told = session.project, []
        session.message.connect(lambda level, text: told.append(text))
        action = next(entry for entry in inspector.presets.menu().actions() if "660" in entry.text())
        assert "Typical" in action.toolTip()
        action.trigger()
        assert session.project.scene.lasers[0].wavelength_nm == 660.0
        assert field(inspector, *LASER, "wavelength_nm").text() == "660"
        assert "Typical" in told[-1]
        session.document.undo()
        assert session.project == before

    def test_a_lens_preset_is_focused_on_the_line_that_it_sees(
        self, qtbot: QtBot, session: Session, inspector: Inspector
    ) -> None:
        """Focused far away it blurred the line over 40 px."""
        qtbot.waitUntil(lambda: not live(session).is_loading)
        session.select(CAMERA)
        before, told = session.project, []
        session.message.connect(lambda level, text: told.append(text))
        action = next(entry for entry in inspector.presets.menu().actions() if "12 mega" in entry.text())
        action.trigger()
        live(session).refresh()
        found = readouts(live(session).look, 0)
        lens = session.project.scene.camera.lens
        assert found.distance is not None and lens.focus_distance is not None and found.blur_px is not None
        assert found.distance.low < lens.focus_distance < found.distance.high
        assert found.blur_px.high < BLURRED_PX
        assert session.project.scene.camera.focal_length == pytest.approx(0.025)
        assert f"focused at {1e3 * lens.focus_distance:.4g} mm. " in told[-1]
        session.document.undo()
        assert session.project == before
        # without a line, where the laser's sheet meets the camera's axis
        for i in range(len(before.scene.objects)):
            session.set(("scene", "objects", i, "visible"), False)
        action.trigger()
        meets = working_distance(before.scene)
        assert session.project.scene.camera.lens.focus_distance == pytest.approx(meets, rel=1e-3)

    def test_a_preset_that_is_refused_is_told_as_such_with_the_way_out(
        self, session: Session, inspector: Inspector
    ) -> None:
        """Its description followed the refusal at once, as if it were applied."""
        camera = session.project.scene.camera
        own = CalibratedCamera(**{name: getattr(camera, name) for name in ("width", "height", "fx", "fy", "cx", "cy")})
        session.set(("calibration",), Calibration(camera=own))
        session.select(("sensor",))
        before, told = session.project, []
        session.message.connect(lambda level, text: told.append((level, text)))
        action = next(entry for entry in inspector.presets.menu().actions() if "IMX174" in entry.text())
        action.trigger()
        assert session.project is before and [level for level, _ in told] == ["error"]
        assert told[0][1] == (
            f"{action.text()} is not taken, nothing has changed: the project's calibration is of a camera of "
            f"{camera.width} x {camera.height} px, and the project's would have 1920 x 1200 px: "
            "Calibrate > Remove it from the project, or calibrate anew"
        )

    def test_the_tip_of_a_preset_goes_with_its_menu(self, qtbot: QtBot, session: Session, inspector: Inspector) -> None:
        """It stayed over the camera's view for seconds."""
        session.select(("sensor",))
        menu = inspector.presets.menu()
        menu.popup(inspector.mapToGlobal(QPoint(20, 20)))
        place = menu.actionGeometry(menu.actions()[0]).center()
        qtbot.mouseMove(menu, place + QPoint(3, 0))
        qtbot.mouseMove(menu, place)
        qtbot.waitUntil(QToolTip.isVisible)
        qtbot.keyClick(menu, Qt.Key.Key_Escape)
        qtbot.waitUntil(lambda: not QToolTip.isVisible())
        assert not menu.toolTipsVisible(), "nor does one come that was waited for"

    def test_only_items_with_presets_have_the_menu(self, session: Session, inspector: Inspector) -> None:
        items = (LASER, CAMERA, ("sensor",), ("scene", "objects", 0), ("scene", "motion"), ())
        shown = {path: (session.select(path), inspector.presets.isVisible())[1] for path in items}
        assert list(shown.values()) == [True, True, True, True, False, False]
