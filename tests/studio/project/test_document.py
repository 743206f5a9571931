"""The document: every edit can be undone, a drag is one edit, and a failed save leaves everything as it was."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

import pytest

from render.base.errors import InputError
from render.scene.lights import PointLight
from render.scene.shape import Box, Sphere
from studio.editing import scene_edits
from studio.project.document import HISTORY, Document, replaced, value_at
from studio.project.project import Project
from studio.project.templates import template_folder

POWER = ("scene", "rig", "lasers", 0, "power")


@pytest.fixture
def document(tmp_path: Path) -> Document:
    project = Project.load(template_folder("scan") / "project.json")
    project = project.save(tmp_path / "project.json")
    return Document(project, tmp_path / "project.json")


class TestUndo:
    def test_an_edit_is_undone_and_redone_whole(self, document: Document) -> None:
        before = document.project
        document.set(POWER, 0.05, "change power")
        after = document.project
        assert (document.undo_label, document.redo_label) == ("change power", None)
        document.undo()
        assert document.project == before
        assert (document.undo_label, document.redo_label) == (None, "change power")
        document.redo()
        assert document.project == after

    def test_any_run_of_edits_is_undone_step_by_step_to_the_beginning_and_redone_to_the_end(
        self, document: Document
    ) -> None:
        choose = random.Random(3)
        edits: list[Any] = [
            scene_edits.add_laser,
            lambda p: scene_edits.add_primitive(p, Box),
            lambda p: scene_edits.add_primitive(p, Sphere),
            lambda p: scene_edits.add_light(p, PointLight),
            lambda p: scene_edits.duplicate(p, ("scene", "objects", 0)),
            lambda p: scene_edits.remove(p, ("scene", "objects", 0)),
            lambda p: scene_edits.move(p, ("scene", "objects", 0), 1),
            lambda p: (replaced(p, POWER, choose.uniform(0.001, 0.1)), ()),
            lambda p: (replaced(p, ("sensor", "bits"), choose.choice((8, 10))), ()),
        ]
        states = [document.project]
        for number in range(40):
            document.apply(f"edit {number}", choose.choice(edits)(document.project)[0])
            if document.project != states[-1]:
                states.append(document.project)
        for state in reversed(states[:-1]):
            document.undo()
            assert document.project == state
        assert document.undo_label is None
        for state in states[1:]:
            document.redo()
            assert document.project == state
        assert document.redo_label is None

    def test_a_new_edit_after_an_undo_forgets_what_was_undone(self, document: Document) -> None:
        document.set(POWER, 0.05)
        document.undo()
        document.set(POWER, 0.07)
        assert document.redo_label is None
        document.redo()
        assert value_at(document.project, POWER) == 0.07

    def test_undo_and_redo_with_nothing_to_do_tell_nobody(self, document: Document) -> None:
        told: list[int] = []
        document.listeners.append(lambda: told.append(1))
        document.undo()
        document.redo()
        document.set(POWER, value_at(document.project, POWER))
        assert told == []
        assert document.undo_label is None

    def test_the_history_forgets_the_oldest_edits(self, document: Document) -> None:
        for i in range(HISTORY + 20):
            document.set(POWER, 0.001 * (i + 1))
        steps = 0
        while document.undo_label is not None:
            document.undo()
            steps += 1
        assert steps == HISTORY
        assert value_at(document.project, POWER) == pytest.approx(0.020)


class TestDrags:
    def test_the_steps_of_a_drag_are_one_edit(self, document: Document) -> None:
        before = document.project
        for power in (0.03, 0.04, 0.05):
            document.set(POWER, power, "change power", merge="drag power")
        document.end_merge()
        document.undo()
        assert document.project == before
        assert document.undo_label is None
        document.redo()
        assert value_at(document.project, POWER) == 0.05

    def test_two_drags_of_the_same_value_are_two_edits(self, document: Document) -> None:
        document.set(POWER, 0.03, merge="drag power")
        document.end_merge()
        document.set(POWER, 0.04, merge="drag power")
        document.end_merge()
        document.undo()
        assert value_at(document.project, POWER) == 0.03

    def test_another_edit_in_between_splits_a_drag(self, document: Document) -> None:
        document.set(POWER, 0.03, merge="drag power")
        document.set(("seed",), 9)
        document.set(POWER, 0.04, merge="drag power")
        document.undo()
        document.undo()
        assert value_at(document.project, POWER) == 0.03

    def test_a_drag_after_an_undo_is_a_new_edit(self, document: Document) -> None:
        document.set(POWER, 0.03, merge="drag power")
        document.set(("seed",), 9)
        document.undo()
        document.set(POWER, 0.04, merge="drag power")
        assert document.redo_label is None
        document.undo()
        assert value_at(document.project, POWER) == 0.03


class TestRefusals:
    @pytest.mark.parametrize(
        ("path", "value"),
        [
            (POWER, -1.0),
            (POWER, float("nan")),
            (POWER, "much"),
            (("scene", "rig", "camera", "distortion"), (1.0, 2.0)),
            (("scene", "rig", "camera", "width"), 0),
            (("scene", "objects", 0, "name"), "step block"),
            (("sensor", "colour"), "bayer"),
        ],
    )
    def test_a_bad_value_changes_nothing(self, document: Document, path: Any, value: Any) -> None:
        before = document.project
        with pytest.raises(InputError):
            document.set(path, value)
        assert document.project is before
        assert document.undo_label is None
        assert not document.dirty

    def test_a_path_to_nowhere_is_a_key_error(self, document: Document) -> None:
        for path in (("scene", "objects", 99), ("scene", "moon"), ("scene", "rig", "camera", 3)):
            with pytest.raises(KeyError):
                value_at(document.project, path)


class TestSaving:
    def test_dirty_means_that_no_file_holds_what_is_shown(self, document: Document) -> None:
        assert not document.dirty
        document.set(POWER, 0.05)
        assert document.dirty
        document.undo()
        assert not document.dirty
        document.redo()
        document.save()
        assert not document.dirty
        document.undo()
        assert document.dirty

    def test_a_new_document_is_dirty_until_it_is_saved_somewhere(self, document: Document, tmp_path: Path) -> None:
        new = Document(document.project)
        assert new.dirty
        with pytest.raises(InputError, match="Save as"):
            new.save()
        new.save(tmp_path / "elsewhere" / "new.json")
        assert not new.dirty
        assert new.root == tmp_path / "elsewhere"

    def test_what_is_saved_opens_as_the_same_project(self, document: Document) -> None:
        document.apply("add", scene_edits.add_laser(document.project)[0])
        document.save()
        assert document.path is not None
        assert Project.load(document.path) == document.project

    def test_what_others_write_into_its_file_is_noticed(self, document: Document, tmp_path: Path) -> None:
        document.save(tmp_path / "project.json")
        other = Document(Project.load(tmp_path / "project.json"), tmp_path / "project.json")
        assert not document.changed_on_disk and not other.changed_on_disk
        other.set(("seed",), 7)
        other.save()
        assert document.changed_on_disk and not other.changed_on_disk
        document.save()
        assert not document.changed_on_disk and other.changed_on_disk
        (tmp_path / "project.json").unlink()
        assert not document.changed_on_disk, "saving loses nothing of what is not there"

    def test_a_failing_save_leaves_file_and_document_unharmed(self, document: Document, tmp_path: Path) -> None:
        assert document.path is not None
        text = document.path.read_text(encoding="utf-8")
        document.set(POWER, 0.05, "change power")
        project = document.project
        (tmp_path / "taken").mkdir()
        (tmp_path / "file").write_text("not a folder")
        for target in (tmp_path / "taken", tmp_path / "file" / "project.json"):
            with pytest.raises(InputError):
                document.save(target)
            assert document.project is project
            assert document.path == tmp_path / "project.json"
            assert document.root == tmp_path
            assert document.dirty
            assert document.undo_label == "change power"
        assert document.path.read_text(encoding="utf-8") == text
        assert sorted(file.name for file in tmp_path.iterdir()) == ["file", "project.json", "taken"]
        document.save()
        assert not document.dirty
