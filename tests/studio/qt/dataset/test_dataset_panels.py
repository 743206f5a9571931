"""The Dataset workspace: a recipe opened, its ranges dragged, its scenes looked at, its images made."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel
from pytestqt.qtbot import QtBot

from render.base.errors import InputError
from studio.dataset.recipe import Draw, Recipe, ready_made
from studio.dataset.run import Wanted, make_dataset
from studio.qt.core.jobs import JobRunner
from studio.qt.core.live_preview import live
from studio.qt.core.session import Session, one_of
from studio.qt.dataset.contact_panel import ContactPanel
from studio.qt.dataset.dataset_work import DatasetWork
from studio.qt.dataset.draw_row import DrawRow
from studio.qt.dataset.large_picture import LANE, LargePicture
from studio.qt.dataset.recipe_panel import RecipePanel
from studio.runtime.workers import Engine
from studio.study.draft import spec_of
from studio.study.study import Study, parts_of
from studio.study.study_file import write_study
from tests.studio.qt.small_session import small_session

SMALL = Recipe(
    name="small",
    base="plane",
    image_scale=0.05,
    images=2,
    set={"render.transport": "direct", "render.laser_error": 0.05, "render.ambient_samples": 1},
    draw=(
        Draw(field="scene.objects[0].T_world_object.rotation[0]", low=-0.3, high=0.3),
        Draw(field="scene.rig.lasers[0].power", kind="logarithmic", low=0.002, high=0.05),
        Draw(field="sensor.speckle", kind="choice", values=("off", "polarised")),
    ),
)


class Desk:
    """The panels of the workspace with a recipe of few and small scenes."""

    def __init__(self, folder: Path) -> None:
        self.session: Session = small_session()
        self.runner = JobRunner(self.session)
        self.work = one_of(DatasetWork, self.session)
        self.work.engine, self.work.shown = Engine(workers=1), 3
        self.file = folder / "small.json"
        self.file.write_text(SMALL.model_dump_json())
        self.panel, self.sheet = RecipePanel(self.session, self.runner), ContactPanel(self.session)
        self.work.load(self.file)

    @property
    def ready(self) -> bool:
        return not self.work.drawing and len(self.work.pictures) == self.work.shown

    def close(self) -> None:
        for panel in (self.panel, self.sheet):
            panel.close()
        self.work.close()
        self.runner.close()
        live(self.session).close()


@pytest.fixture
def desk(qtbot: QtBot, tmp_path: Path) -> Iterator[Desk]:
    made = Desk(tmp_path)
    for widget in (made.panel, made.sheet):
        qtbot.addWidget(widget)
        widget.resize(600, 600)
        widget.show()
    qtbot.waitExposed(made.sheet)
    yield made
    made.close()


def test_every_ready_made_recipe_has_a_row_for_each_field(desk: Desk, qtbot: QtBot) -> None:
    for name in ready_made():
        desk.work.load(name)
        assert not desk.work.problem
        assert [row.draw.field for row in desk.panel.rows] == [one.field for one in desk.work.recipe.draw]
        assert desk.panel.name.text() == desk.work.recipe.name
        qtbot.waitUntil(lambda: not any(row.isHidden() for row in desk.panel.rows))
        shown = [row for row in desk.panel.findChildren(DrawRow) if not row.isHidden()]
        assert len(shown) == len(desk.panel.rows)


def test_rows_say_what_has_the_field_and_its_unit(desk: Desk) -> None:
    rotation, power, speckle = desk.panel.rows
    assert rotation.name.text() == "plane: Rotation vector x" and rotation.boxes[1].text() == "17.2 deg"
    assert power.name.text() == "laser: Power" and power.boxes[0].suffix() == " mW"
    assert not speckle.boxes  # one of several things has no range


def test_dragged_ranges_are_those_of_the_scenes(desk: Desk, qtbot: QtBot) -> None:
    qtbot.waitUntil(lambda: desk.ready)
    before = desk.work.pictures[0].curves[0].position
    slider = desk.panel.rows[0].slider
    low, high = slider.value()
    slider.setValue((low, low + (high - low) // 4))
    draw = desk.work.recipe.draw[0]
    assert draw.low == -0.3 and draw.high == pytest.approx(-0.15, abs=2e-3)
    qtbot.waitUntil(lambda: desk.ready and desk.work.pictures[0].curves[0].position is not before)
    assert len(desk.work.pictures[0].curves[0].position) and not desk.work.problem


def test_a_range_that_cannot_be_is_told_and_changes_nothing(desk: Desk) -> None:
    low, high = desk.panel.rows[0].boxes
    low.setValue(30.0)
    low.editingFinished.emit()
    assert "low below high" in desk.work.problem and not desk.sheet.problem.isHidden()
    assert desk.work.recipe == SMALL
    assert high.value() > 17.0


def test_pictures_stand_side_by_side_within_the_sheet(desk: Desk, qtbot: QtBot) -> None:
    qtbot.waitUntil(lambda: desk.ready)
    places = [desk.sheet.sheet.place(k) for k in range(desk.work.shown)]
    assert all(desk.sheet.sheet.rect().toRectF().adjusted(-1, -1, 1, 1).contains(place) for place in places)
    assert not any(places[k].intersects(other) for k in range(3) for other in places[k + 1 :])


def test_the_sheet_is_said_to_be_a_preview(desk: Desk, qtbot: QtBot) -> None:
    """With two scenes to be made it said "24 of 24 scenes"."""
    qtbot.waitUntil(lambda: desk.ready)
    assert desk.sheet.told.text().startswith("Preview: the first 3 scenes of the recipe")
    assert "gloss and curves are rougher than in the images" in desk.sheet.told.text()
    there = dict(desk.work.pictures)
    desk.panel.scenes.setValue(2)  # fewer draw nothing anew, and no scene is shown that will not be there
    assert desk.sheet.told.text().startswith("Preview: the 2 scenes.") and not desk.work.drawing
    desk.panel.scenes.setValue(30)
    assert desk.work.pictures == there and desk.sheet.told.text().startswith("Preview: the first 3 scenes")


def test_values_of_a_choice_have_names_and_units(desk: Desk) -> None:
    desk.work.load("primitives")
    told = [" ".join(label.text() for label in row.findChildren(QLabel)) for row in desk.panel.rows]
    (shapes,) = [text for text in told if "sphere" in text]
    assert "step block; sphere, radius 30 mm; " in shapes and "cylinder, radius 20 mm, length 150 mm" in shapes
    (surfaces,) = [text for text in told if "lambertian" in text]
    assert "lambertian, albedo 0.1; " in surfaces and "conductor, metal steel, roughness 0.1" in surfaces
    assert any("405 nm, 450 nm" in text for text in told)


def test_images_are_made_stopped_and_gone_on_with(desk: Desk, qtbot: QtBot, tmp_path: Path,
                                                 monkeypatch: pytest.MonkeyPatch) -> None:  # fmt: skip
    folder = tmp_path / "images"
    monkeypatch.setattr("studio.qt.dataset.recipe_panel.ask_results_folder", lambda *_: folder)
    desk.panel.scenes.setValue(2)
    desk.panel.ask_and_run()
    qtbot.waitUntil(lambda: not desk.work.running)
    assert desk.work.made() == 4 and not desk.work.problem
    assert desk.panel.told.text() == (
        f"4 images of 2 scenes, {desk.work.kind}; 4 are there; a higher number of scenes makes more"
    )
    assert not desk.panel.foot.run.isEnabled() and "Every image is there" in desk.panel.foot.run.toolTip()
    desk.panel.scenes.setValue(3)
    assert desk.panel.foot.run.text() == "Go on" and desk.panel.foot.run.isEnabled()
    desk.panel.ask_and_run()
    qtbot.waitUntil(lambda: not desk.work.running)
    assert desk.work.made() == 6


def test_the_size_and_bits_of_the_images_stand_beside_their_number(desk: Desk) -> None:
    assert desk.work.base is not None
    camera = desk.work.base.scene.camera
    small = f"{round(0.05 * camera.width)} x {round(0.05 * camera.height)} px, 12 bit"
    assert desk.panel.told.text() == f"200 images of 100 scenes, {small}"
    add_field(desk, "sensor.bits")
    assert desk.panel.told.text().endswith("px, 8 to 16 bit")


def test_images_that_were_written_are_shown_with_the_line_of_their_labels(
    desk: Desk, qtbot: QtBot, tmp_path: Path
) -> None:
    assert desk.sheet.choice.isHidden()
    told: list[str] = []
    desk.session.message.connect(lambda level, text: told.append(text))
    desk.work.choose_count(2)
    desk.work.choose_folder(tmp_path / "images")
    desk.work.start()
    qtbot.waitUntil(lambda: desk.work.shows_written)
    assert "4 images in" in told[-1] and "12-bit numbers, 0 to 4095" in told[-1]
    assert not desk.sheet.choice.isHidden() and desk.sheet.choice.currentIndex() == 1
    assert desk.sheet.told.text().startswith("The first 3 images of the folder images, as written")
    picture = desk.work.written[0]
    first = cv2.imread(str(tmp_path / "images/images/00000/00000000.png"), cv2.IMREAD_UNCHANGED)
    assert picture.values.shape == first.shape and picture.values.max() == 1.0
    assert np.argmax(picture.values) == np.argmax(first)
    (curve,) = picture.curves
    brightest = first.argmax(axis=1)[curve.index.astype(int)]
    assert np.median(np.abs(brightest - curve.position)) < 1.5
    desk.sheet.choice.setCurrentIndex(0)
    desk.sheet.choice.activated.emit(0)
    assert desk.sheet.told.text().startswith("Preview: ") and desk.work.on_sheet is desk.work.pictures
    desk.sheet.choice.activated.emit(1)
    assert desk.work.shows_written
    desk.panel.seed.setValue(7)  # the scenes of the recipe as it is now
    assert not desk.work.shows_written and not desk.sheet.choice.isHidden()


def test_a_damaged_image_of_the_folder_is_left_out(desk: Desk, qtbot: QtBot, tmp_path: Path) -> None:
    folder = tmp_path / "images"
    make_dataset(desk.work.recipe, desk.work.root, Wanted(1), folder, engine=Engine(workers=1))
    (folder / "images/00000/00000000.png").write_bytes(b"no image")
    desk.work.choose_folder(folder)
    qtbot.waitUntil(lambda: bool(desk.work.written))
    assert [one.number for one in desk.work.written] == [1]


def test_a_folder_of_another_recipe_is_told(desk: Desk, qtbot: QtBot, tmp_path: Path) -> None:
    desk.work.choose_folder(tmp_path)  # which holds the recipe's file
    desk.work.start()
    qtbot.waitUntil(lambda: not desk.work.running)
    assert "not empty" in desk.work.problem
    assert desk.file.read_text() == SMALL.model_dump_json()


def test_a_saved_recipe_is_what_was_shown(desk: Desk, tmp_path: Path) -> None:
    desk.work.set_range(0, -0.1, 0.2)
    desk.panel.images.setValue(5)
    file = tmp_path / "mine.json"
    assert desk.work.save(file)
    assert Recipe.load(file)[0] == desk.work.recipe
    assert (desk.work.recipe.images, desk.work.recipe.draw[0].high) == (5, 0.2)


def test_the_size_of_the_images_is_chosen_and_told(desk: Desk) -> None:
    """There was no field for it, and images came at half of the scanner's size."""
    before = desk.panel.told.text()
    desk.panel.image_size.setValue(10)
    assert desk.work.recipe.image_scale == 0.1
    assert desk.panel.told.text() != before and " px" in desk.panel.told.text()
    desk.work.set_recipe(image_scale=0.5)
    assert desk.panel.image_size.value() == 50


def test_a_recipe_or_a_study_never_replaces_a_project(desk: Desk, tmp_path: Path) -> None:
    """Groove the recipe and groove the project had one name in one folder, and the project was gone."""
    file = tmp_path / "groove.json"
    desk.session.document.save(file)
    text = file.read_text()
    assert not desk.work.save(file)
    assert "would replace a project" in desk.work.problem and file.read_text() == text
    desk.work.begin_with_project()
    assert not desk.work.save(file) and file.read_text() == text
    sweep = {"name": "power", "vary": [{"field": "scene.rig.lasers[0].power", "values": [0.01]}]}
    with pytest.raises(InputError, match="the study would replace a project"):
        write_study(file, Study.model_validate({"base": "plane", "sweeps": [sweep]}), desk.session.document, {})
    assert file.read_text() == text


def test_the_open_project_becomes_a_recipe_field_by_field(desk: Desk, qtbot: QtBot, tmp_path: Path) -> None:
    desk.session.document.save(tmp_path / "part.json")
    desk.work.begin_with_project()
    assert desk.work.recipe.base == "part.json" and not desk.panel.rows
    assert "Nothing is drawn yet" in desk.panel.about.text()
    for field in ("scene.rig.lasers[0].power", "sensor.speckle", "sensor.bits"):
        add_field(desk, field)
    power, speckle, bits = desk.work.recipe.draw
    now = desk.session.document.project.scene.lasers[0].power
    assert power.kind == "logarithmic" and power.low < now < power.high
    assert speckle.kind == "choice" and "polarised" in speckle.values
    assert bits.kind in ("choice", "integer")
    desk.panel.rows[2].remove.click()
    assert [row.draw.field for row in desk.panel.rows] == ["scene.rig.lasers[0].power", "sensor.speckle"]
    qtbot.waitUntil(lambda: desk.ready)
    assert not desk.work.problem
    other = tmp_path / "elsewhere"
    other.mkdir()
    assert not desk.work.save(other / "mine.json") and "part.json" in desk.work.problem
    assert not list(other.iterdir())
    assert desk.work.save(tmp_path / "mine.json")
    assert Recipe.load(tmp_path / "mine.json") == (desk.work.recipe, tmp_path)


def test_a_field_is_drawn_once(desk: Desk) -> None:
    add_field(desk, "scene.rig.lasers[0].power")
    assert desk.work.recipe == SMALL
    add_field(desk, "render.laser_error")  # which the recipe had fixed
    assert [one.field for one in desk.work.recipe.draw[3:]] == ["render.laser_error"]
    assert "render.laser_error" not in desk.work.recipe.set


def test_a_project_that_was_never_saved_has_no_file_to_name(desk: Desk) -> None:
    told = []
    desk.session.message.connect(lambda level, text: told.append(text))
    desk.work.begin_with_project()
    assert desk.work.recipe == SMALL
    assert told == ["Save the project first: its recipe names the project's file"]


def test_the_menu_of_fields_is_that_of_the_recipe_s_project(desk: Desk) -> None:
    menu = desk.panel.add.menu()
    menu.aboutToShow.emit()
    assert "plane" in [action.text() for action in menu.actions()]


def add_field(desk: Desk, field: str) -> None:
    """As its entry in the menu does."""
    assert desk.work.base is not None
    spec = spec_of(desk.work.base, field)
    assert spec is not None
    desk.work.add(tuple(parts_of(field)), spec)


def test_a_double_click_shows_a_picture_large_with_its_line(desk: Desk, qtbot: QtBot, tmp_path: Path) -> None:
    sheet = desk.sheet.sheet
    qtbot.waitUntil(lambda: desk.ready)
    opened: list[LargePicture] = []
    sheet.opened.connect(lambda picture: opened.append(desk.sheet.findChildren(LargePicture)[-1]))

    def open_first() -> LargePicture:
        qtbot.mouseDClick(sheet, Qt.MouseButton.LeftButton, pos=sheet.place(1).center().toPoint())
        large = opened[-1]
        qtbot.waitUntil(lambda: large.runner.job(LANE) is None)
        return large

    large = open_first()
    assert large.isVisible() and large.windowTitle().startswith("Scene 1 of ")
    assert desk.work.base is not None
    camera = desk.work.base.scene.camera
    whole = round(0.05 * camera.width), round(0.05 * camera.height)
    assert large.view.item.size == whole and "as a run renders it" in large.told.text()
    x, y = large.line.getData()
    assert len(x) > 3 and x.max() < whole[0] and y.max() < whole[1]
    large.with_line.setChecked(False)
    assert not large.line.isVisible()
    large.close()
    desk.work.choose_count(2)
    desk.work.choose_folder(tmp_path / "images")
    desk.work.start()
    qtbot.waitUntil(lambda: desk.work.shows_written)
    written = open_first()
    assert written.windowTitle().startswith("Image 1 of ") and written.told.text().startswith(
        f"{whole[0]} x {whole[1]}"
    )
    written.close()
