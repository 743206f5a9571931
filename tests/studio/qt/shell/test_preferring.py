"""Preferences asked in the window: remembered, felt at once, and without a limit that nobody may see."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from PySide6.QtWidgets import QDialogButtonBox
from pytestqt.qtbot import QtBot

from render.base.threads import thread_count, use_at_most
from studio.editing import units
from studio.project.document import HISTORY, Document
from studio.qt.core import theme
from studio.qt.shell.preferring import PreferencesDialog, take_units
from studio.qt.shell.window import MainWindow
from studio.runtime.preferences import Preferences, PreferencesFile


@pytest.fixture(autouse=True)
def as_before() -> Iterator[None]:
    yield
    use_at_most(None)
    Document.depth = HISTORY
    units.show_lengths_in("mm")


def test_what_is_chosen_is_remembered_and_felt(window: MainWindow, qtbot: QtBot) -> None:
    window.commands["preferences"].trigger()
    dialog = window.findChild(PreferencesDialog)
    assert dialog is not None
    dialog.threads.setValue(1)
    dialog.scale.setCurrentIndex(dialog.scale.findData("half"))
    dialog.undo.setValue(10)
    dialog.autosave.setChecked(False)
    assert not dialog.every.isEnabled()
    with qtbot.waitSignal(dialog.accepted):
        dialog.accept()
    kept = PreferencesFile(window.preferences.path.parent).values
    assert (kept.threads, kept.image_scale, kept.undo_depth, kept.autosave) == (1, "half", 10, False)
    assert thread_count(None) == 1 and thread_count(3) == 3
    assert window.panels["render"].scale.currentData() == window.panels["motion"].scale.currentData() == 0.5
    session = window.session
    for i in range(15):
        session.set(("seed",), i + 1)
    undone = 0
    while session.document.undo_label is not None:
        session.document.undo()
        undone += 1
    assert undone == 10
    session.set(("seed",), 99)
    window.files.keep()
    assert not window.files.autosave.file.exists()
    window.preferring.change(
        {**{name: getattr(Preferences(), name) for name in ("theme", "length_unit", "threads", "image_scale")},
         "autosave": True, "autosave_every": 30.0, "undo_depth": HISTORY}
    )  # fmt: skip
    window.files.keep()
    assert window.files.autosave.file.exists()


def test_the_theme_is_that_of_the_view_menu(window: MainWindow, qtbot: QtBot) -> None:
    window.commands["theme_dark"].trigger()
    dialog = window.preferring.ask()
    assert dialog.theme.currentText() == "Dark"
    dialog.theme.setCurrentIndex(dialog.theme.findData("light"))
    assert theme.colours() == theme.DARK, "nothing is taken on before OK"
    with qtbot.waitSignal(dialog.accepted):
        dialog.accept()
    assert theme.colours() == theme.LIGHT and window.commands["theme_light"].isChecked()
    assert window.preferences.values.theme == "light"


def test_cancel_changes_nothing_and_defaults_are_shown_first(window: MainWindow) -> None:
    dialog = window.preferring.ask()
    dialog.undo.setValue(77)
    dialog.reject()
    assert window.preferences.values.undo_depth == HISTORY
    window.preferences.change(undo_depth=77, threads=1)
    dialog = window.preferring.ask()
    assert (dialog.undo.value(), dialog.threads.value()) == (77, 1)
    box = dialog.findChild(QDialogButtonBox)
    assert isinstance(box, QDialogButtonBox)
    box.button(QDialogButtonBox.StandardButton.RestoreDefaults).click()
    assert (dialog.undo.value(), dialog.threads.value()) == (HISTORY, 0)
    dialog.reject()
    assert window.preferences.values.undo_depth == 77


def test_the_dialog_fits_on_a_small_screen(window: MainWindow) -> None:
    wanted = window.preferring.ask().sizeHint()
    assert wanted.width() <= 911 and wanted.height() <= 480


@pytest.mark.parametrize(("unit", "shown"), [("mm", 100.0), ("in", 100.0 / 25.4), ("m", 0.1), ("um", 1e5)])
def test_lengths_of_forms_are_in_the_unit_of_the_preferences(unit: str, shown: float) -> None:
    take_units(Preferences(length_unit=unit))  # type: ignore[arg-type]
    length = units.Unit.of("m")
    assert float(length.format(0.1)) == pytest.approx(shown, rel=1e-5) and length.shown == unit.replace("u", "µ")
    # and what is typed without a unit is of it
    assert length.parse("1") == pytest.approx(0.1 / shown, rel=1e-9) and length.parse("1 mm") == 1e-3
