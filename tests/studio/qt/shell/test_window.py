"""The main window: workspaces, menus, files, errors, and what it remembers."""

from __future__ import annotations

import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QApplication,
    QCheckBox,
    QComboBox,
    QLineEdit,
    QMainWindow,
    QPushButton,
    QSpinBox,
)
from pytestqt.qtbot import QtBot

from render.material.material import Texture
from studio.project.autosave import Autosave
from studio.qt.core import theme
from studio.qt.core.actions import COMMANDS, VIEW_KEYS, Command
from studio.qt.core.live_preview import live
from studio.qt.core.render import Render
from studio.qt.shell.fault_notice import FaultNotice, offer
from studio.qt.shell.help import FOLDER, PAGES
from studio.qt.shell.panels import PANELS
from studio.qt.shell.window import MainWindow
from studio.qt.shell.workspaces import WORKSPACES, remembered, restore
from studio.runtime.fault_log import Fault
from studio.runtime.preferences import PreferencesFile
from tests.studio.qt.shell.window_hands import contrast, dialog, until_cancelled
from tests.studio.qt.small_session import small_project as sphere
from tests.studio.qt.small_session import small_render

POWER = ("scene", "rig", "lasers", 0, "power")
KEYS = {
    "setup": Qt.Key.Key_F6,
    "render": Qt.Key.Key_F7,
    "measure": Qt.Key.Key_F8,
    "study": Qt.Key.Key_F12,
    "calibrate": Qt.Key.Key_F3,
    "dataset": Qt.Key.Key_F10,
}


class TestWorkspaces:
    def test_each_shows_its_own_panels(self, window: MainWindow, qtbot: QtBot) -> None:
        for each in WORKSPACES:
            qtbot.keyClick(window, KEYS[each.key])
            assert window.workspace == each.key
            shown = {key for key, dock in window.docks.items() if dock.isVisible()}
            assert shown == {name for column in each.columns for name, _ in column.docks}
            assert window.centralWidget().isVisible() == each.viewport

    def test_panels_stand_as_they_were_left(self, window: MainWindow) -> None:
        window.switch_to("setup")
        window.docks["readout"].hide()
        window.switch_to("measure")
        window.switch_to("setup")
        assert not window.docks["readout"].isVisible()
        window.rearrange()
        assert window.docks["readout"].isVisible()

    @pytest.mark.parametrize("panel", ["nominal", "motion"])
    def test_a_panel_that_a_command_called_goes_with_the_workspace(self, window: MainWindow, panel: str) -> None:
        """It once stood there at every later start as well."""
        window.call_panel(panel)
        assert window.docks[panel].isVisible()
        window.switch_to("measure")
        window.switch_to("setup")
        assert not window.docks[panel].isVisible()

    def test_a_panel_that_a_person_chose_stays(self, window: MainWindow) -> None:
        window.call_panel("render")
        for _ in range(2):  # off, and on again
            window.docks["render"].toggleViewAction().trigger()
        window.switch_to("measure")
        window.switch_to("setup")
        assert window.docks["render"].isVisible()

    def test_the_arrangement_is_there_at_the_next_start(self, own_window: MainWindow, tmp_path: Path) -> None:
        window = own_window
        window.switch_to("render")
        window.docks["log"].show()
        window.resize(1300, 800)
        window.close()
        again = MainWindow(window.session, PreferencesFile(tmp_path / "config"), Autosave(tmp_path / "state"))
        again.show()
        assert again.workspace == "render" and again.docks["log"].isVisible()
        assert again.size() == window.size()
        again.close()
        again.deleteLater()

    def test_panels_are_not_restored_into_a_window_that_is_hidden_and_maximized(
        self, own_window: MainWindow, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """There Qt keeps pointers to docks' places that it frees with the next state: a segmentation fault, later."""
        own_window.showMaximized()
        own_window.switch_to("render")
        own_window.close()
        into: list[tuple[bool, bool]] = []
        real = QMainWindow.restoreState

        def restore(window: QMainWindow, *given: Any) -> bool:
            into.append((window.isVisible(), window.isMaximized()))
            return real(window, *given)

        monkeypatch.setattr(MainWindow, "restoreState", restore)
        again = MainWindow(own_window.session, PreferencesFile(tmp_path / "config"), Autosave(tmp_path / "state"))
        again.show()
        again.switch_to("measure")
        assert again.isMaximized()
        assert len(into) >= 2 and (False, True) not in into
        again.close()
        again.deleteLater()

    def test_a_damaged_arrangement_never_reaches_qt(self, window: MainWindow, monkeypatch: pytest.MonkeyPatch) -> None:
        """It would end in a segmentation fault, at this start and at every other."""
        whole, chance = remembered(window), random.Random(1)
        assert restore(window, whole)
        monkeypatch.setattr(window, "restoreState", lambda *_: pytest.fail("given to Qt"))
        for _ in range(2000):
            at, new = chance.randrange(len(whole)), chr(chance.randrange(256))
            damaged = whole[:at] + new + whole[at + chance.randrange(2) :]
            assert damaged == whole or not restore(window, damaged)
        for text in ("", ":", "00000000:", whole[9:], whole[:-4], "\udcff", 10**5 * "["):
            assert not restore(window, text)

    def test_no_dock_is_ever_taken_out(self, window: MainWindow, monkeypatch: pytest.MonkeyPatch) -> None:
        moved: list[object] = []
        for name in ("addDockWidget", "removeDockWidget", "splitDockWidget", "tabifyDockWidget"):
            monkeypatch.setattr(window, name, lambda *given: moved.append(given))
        for each in WORKSPACES:
            window.switch_to(each.key)
            window.rearrange()
        assert not moved

    def test_every_panel_is_the_real_one(self, window: MainWindow) -> None:
        assert {panel.key: type(window.panels[panel.key]).__name__ for panel in PANELS} == {
            panel.key: panel.name for panel in PANELS
        }


class TestWork:
    """Jobs that a person meets with keys and files."""

    def test_escape_leaves_it_alone_and_says_what_cancels(self, window: MainWindow, qtbot: QtBot) -> None:
        job = window.runner.run("export", "export report.pdf", until_cancelled)
        qtbot.waitUntil(lambda: window.status.job is job)
        with qtbot.waitSignal(window.session.message) as told:
            qtbot.keyClick(window, Qt.Key.Key_Escape)
        assert "Shift+F5" in told.args[1] and not job.cancel_asked
        with qtbot.waitSignal(window.runner.cancelled):
            qtbot.keyClick(window, Qt.Key.Key_F5, Qt.KeyboardModifier.ShiftModifier)

    def test_another_render_is_not_refused_in_silence(self, window: MainWindow, qtbot: QtBot) -> None:
        window.runner.run("render", "scan", until_cancelled)
        with qtbot.waitSignal(window.session.message) as told:
            qtbot.keyClick(window, Qt.Key.Key_F5)
        assert told.args[0] == "warning" and "being rendered" in told.args[1]
        with qtbot.waitSignal(window.runner.cancelled):
            window.runner.cancel("render")
        assert not window.runner.busy, "nor does it wait for the scan to end"

    def test_a_cancelled_export_writes_nothing_and_says_so(
        self, window: MainWindow, qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        from studio.scan import export

        def slow(path: Path, what: export.Exported) -> list[Path]:
            path.write_text("half of it")
            window.runner.cancel("export")
            return [path]

        monkeypatch.setattr(export, "export_points", slow)
        world, frame = small_render()
        window.session.add_render(Render(1, sphere(), world, frame))
        with qtbot.waitSignals([window.runner.cancelled, window.session.message]):
            window.exports.write("export_csv", tmp_path / "out" / "points.csv")
        assert not (tmp_path / "out").exists()
        assert window.panels["log"].as_text().endswith("No file was written")  # type: ignore[attr-defined]


class TestImpossibleMaterial:
    """It is told where it is, and the part stays."""

    MATERIAL = ("scene", "objects", 0, "material")

    @pytest.fixture
    def told(self, window: MainWindow, qtbot: QtBot) -> Iterator[MainWindow]:
        session = window.session
        session.select(self.MATERIAL[:3])
        session.set((*self.MATERIAL, "albedo"), Texture(path="textures/nowhere.png"))
        qtbot.waitUntil(lambda: bool(session.problems))
        yield window
        session.document.undo()
        qtbot.waitUntil(lambda: not session.problems and not live(session).is_loading)
        assert window.panels["inspector"].problem.isHidden()  # type: ignore[attr-defined]

    def test_the_part_stays(self, told: MainWindow) -> None:
        look = live(told.session).look
        assert len(look.placed) == len(told.session.project.scene.visible_objects)

    def test_tree_and_field_are_marked(self, told: MainWindow) -> None:
        item = told.panels["scene"].item(self.MATERIAL[:3])  # type: ignore[attr-defined]
        assert item.foreground(0).color().name() == theme.colours().error.lower()
        assert "nowhere.png" in item.toolTip(0) or "texture" in item.toolTip(0)
        inspector = told.panels["inspector"]
        assert inspector.problem.isVisible() and inspector.problem.wordWrap()  # type: ignore[attr-defined]
        form = inspector.form  # type: ignore[attr-defined]
        marked = [path for path, kind in form.kinds.items() if kind.invalid]
        for path, rows in form.rows.items():
            marked += [path for row in rows for editor, _ in row._parts() if getattr(editor, "invalid", False)]
        assert len(marked) == 1 and marked[0][:4] == self.MATERIAL

    def test_estimates_are_not_passed_off_as_those_of_the_scene(self, told: MainWindow) -> None:
        camera, design = told.panels["camera"], told.panels["readout"]
        assert "not of the scene" in camera.badge.text.text() and camera.badge.isVisible()  # type: ignore[attr-defined]
        assert design.problem.isVisible()  # type: ignore[attr-defined]

    def test_a_long_message_wraps_within_the_window(self, told: MainWindow, qtbot: QtBot) -> None:
        text = "object 'part': material: " + 40 * "why it will not do, " + "choose another"
        told.session.message.emit("error", text)
        whole = told.status.whole
        assert whole.isVisible() and whole.text() == text
        assert told.rect().contains(whole.geometry()) and whole.height() > 2 * whole.fontMetrics().height()
        size = told.panels["scene"].size()
        qtbot.mouseClick(whole, Qt.MouseButton.LeftButton)
        assert not whole.isVisible() and told.docks["log"].isVisible()
        told.docks["log"].hide()
        told.session.message.emit("info", "short")
        assert not whole.isVisible() and told.panels["scene"].size() == size


class TestTheme:
    @pytest.mark.parametrize("choice", ["dark", "light"])
    def test_changes_at_once_and_is_remembered(self, window: MainWindow, choice: theme.Choice) -> None:
        window.commands[f"theme_{choice}"].trigger()
        assert theme.colours() == (theme.DARK if choice == "dark" else theme.LIGHT)
        assert window.preferences.values.theme == choice
        assert PreferencesFile(window.preferences.path.parent).values.theme == choice

    def test_text_stands_out_from_its_ground(self) -> None:
        for c in (theme.DARK, theme.LIGHT):
            for text, ground in ((c.text, c.window), (c.text, c.base), (c.on_accent, c.accent)):
                assert contrast(text, ground) > 4.5
            assert contrast(c.muted, c.window) > 4.5

    @pytest.mark.parametrize("choice", ["dark", "light"])
    def test_empty_controls_can_be_seen(self, window: MainWindow, qtbot: QtBot, choice: theme.Choice) -> None:
        """A box that is not ticked and a field without text are their outline alone (WCAG 2.1: 3 to 1)."""
        window.commands[f"theme_{choice}"].trigger()
        for kind in (QCheckBox, QLineEdit, QSpinBox, QComboBox, QPushButton):
            control = kind()
            qtbot.addWidget(control)
            control.resize(60, 24)
            picture = control.grab().toImage()
            seen = [picture.pixelColor(x, picture.height() // 2).name() for x in range(4)]
            assert max(contrast(colour, theme.colours().window) for colour in seen) > 3.0, kind.__name__


class TestCommands:
    def test_no_shortcut_is_given_twice(self) -> None:
        """Where a menu opens by the same key, neither it nor the command answers."""
        commands = [command for command in COMMANDS if isinstance(command, Command)]
        keys = [key for command in commands for key in command.shortcut.split("; ") if key]
        keys += [f"Alt+{menu[0]}" for menu in {command.menu.split("/")[0] for command in commands}]
        assert len(keys) == len(set(keys))

    def test_every_command_does_something(self, window: MainWindow) -> None:
        for key, action in window.commands.by_key.items():
            assert action.receivers("2triggered(bool)") > 0, key

    def test_undo_and_redo_say_what_they_will_do(self, window: MainWindow, qtbot: QtBot) -> None:
        session = window.session
        assert not window.commands["undo"].isEnabled()
        session.set(POWER, 0.005, "change power")
        assert window.commands["undo"].text() == "&Undo change power"
        qtbot.keyClick(window, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
        assert session.project.scene.lasers[0].power != 0.005
        assert window.commands["redo"].text() == "&Redo change power"
        shift = Qt.KeyboardModifier.ShiftModifier
        for key, held in ((Qt.Key.Key_Z, shift), (Qt.Key.Key_Y, Qt.KeyboardModifier.NoModifier)):
            qtbot.keyClick(window, key, Qt.KeyboardModifier.ControlModifier | held)
            assert session.project.scene.lasers[0].power == 0.005
            session.document.undo()

    def test_the_cheat_sheet_lists_every_shortcut(self) -> None:
        from studio.qt.shell.shortcuts import page

        text = page()
        for command in COMMANDS:
            if isinstance(command, Command) and command.shortcut:
                assert command.text.replace("&", "").rstrip("…") in text
        assert all(f"<b>{key}</b></td><td>{what}</td>" in text for key, what in VIEW_KEYS.items())

    def test_help_has_a_page_for_each_panel_and_its_links_lead_somewhere(
        self, window: MainWindow, qtbot: QtBot
    ) -> None:
        import re

        assert {panel.key for panel in PANELS} <= set(PAGES)
        for key in PAGES:
            text = (FOLDER / f"{key}.md").read_text(encoding="utf-8")
            assert text.startswith("# ")
            for link in re.findall(r"\]\(([^)]+)\)", text):
                assert link.removesuffix(".md") in PAGES
        window.help.open_page("render")
        assert "Laser error" in window.help.text.toPlainText()
        window.help.close()


class TestTour:
    def test_leads_through_the_workspaces_and_is_not_shown_again(self, window: MainWindow, qtbot: QtBot) -> None:
        from studio.qt.shell.tour import STEPS

        window.start_tour()
        assert window.tour is not None
        for step in STEPS:
            assert window.workspace == step.workspace
            assert not step.panel or not window.tour.hole().isNull()
            qtbot.mouseClick(window.tour.next, Qt.MouseButton.LeftButton)
        assert window.tour is None
        assert window.preferences.values.toured

    def test_escape_skips_it(self, window: MainWindow, qtbot: QtBot) -> None:
        window.start_tour()
        assert window.tour is not None
        qtbot.keyClick(window.tour, Qt.Key.Key_Escape)
        assert window.tour is None and window.preferences.values.toured


class TestCrash:
    """What an earlier process left is offered, and in no one's way."""

    @pytest.fixture
    def notice(self, window: MainWindow) -> FaultNotice:
        return offer(window, Fault("2026-11-22 10:31", "Fatal Python error: Segmentation fault\n  in arrange"))

    def test_it_is_shown_among_the_messages(self, window: MainWindow, qtbot: QtBot, notice: FaultNotice) -> None:
        assert notice.isVisible() and QApplication.activeModalWidget() is None
        with qtbot.waitSignal(notice.destroyed):
            qtbot.mouseClick(notice.show_button, Qt.MouseButton.LeftButton)
        assert window.docks["log"].isVisible()
        assert "in arrange" in window.panels["log"].as_text()  # type: ignore[attr-defined]

    def test_it_is_copied_with_the_versions(self, window: MainWindow, qtbot: QtBot, notice: FaultNotice) -> None:
        with qtbot.waitSignal(notice.destroyed):
            qtbot.mouseClick(notice.copy_button, Qt.MouseButton.LeftButton)
        text = QApplication.clipboard().text()
        assert "10:31" in text and "Segmentation fault" in text and "Qt 6" in text

    def test_it_is_put_away(self, qtbot: QtBot, notice: FaultNotice) -> None:
        with qtbot.waitSignal(notice.destroyed):
            qtbot.mouseClick(notice.close_button, Qt.MouseButton.LeftButton)


class TestPreferences:
    def test_the_latest_project_is_first_and_ten_are_kept(self, tmp_path: Path) -> None:
        preferences = PreferencesFile(tmp_path)
        for i in [*range(12), 5]:
            preferences.add_recent(tmp_path / f"{i}.json")
        recent = [Path(text).stem for text in PreferencesFile(tmp_path).values.recent]
        assert recent == ["5", "11", "10", "9", "8", "7", "6", "4", "3", "2"]


def test_without_a_display_the_reason_and_the_way_out_are_told(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from studio.qt.shell.app import open_studio

    monkeypatch.delenv("DISPLAY")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    assert open_studio() == 2
    told = capsys.readouterr().err
    assert "there is no display" in told and "main.py run" in told
    monkeypatch.setenv("DISPLAY", ":98765")
    assert open_studio() == 2
    assert ":98765 does not answer" in capsys.readouterr().err


def test_a_bad_project_on_the_command_line_is_told_over_the_sample(
    qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from studio.qt.shell import app, uncaught_errors

    monkeypatch.setattr(uncaught_errors, "catch_faults", lambda *_: None)  # it would take the place of the test's own
    window = app.start(tmp_path / "gone.json")
    qtbot.waitExposed(window)
    assert window.session.project.name == "Weld seam"
    assert "gone.json" in dialog("trouble").text()
    dialog("trouble").close()
    window.close()
    window.deleteLater()
