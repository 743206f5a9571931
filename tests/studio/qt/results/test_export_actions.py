"""What is exported is of the frame and the settings that the export tells, also while the panels lag behind."""

from __future__ import annotations

import json
import threading
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import cv2
import numpy as np
import pytest
from PySide6.QtWidgets import QMainWindow
from pytestqt.qtbot import QtBot

from analysis.cloud import write_ply
from render.base.errors import InputError
from studio.qt.core.actions import Actions
from studio.qt.core.jobs import RENDER, JobRunner
from studio.qt.core.session import Session
from studio.qt.render.develop_panel import DevelopPanel
from studio.qt.results.export_actions import KINDS, ExportActions
from studio.runtime.preferences import PreferencesFile
from studio.scan.height_map import export_height_map
from studio.scan.scan_results import ScanResults
from tests.studio.qt.small_session import small_session


@pytest.fixture
def measured(qtbot: QtBot) -> tuple[Session, DevelopPanel]:
    session = small_session(rendered=True)
    panel = DevelopPanel(session)
    qtbot.addWidget(panel)
    with qtbot.waitSignal(session.measured, timeout=20_000):
        panel.refresh()
    return session, panel


def export(session: Session, path: Path, qtbot: QtBot, key: str = "export_csv") -> bytes:
    window = QMainWindow()
    qtbot.addWidget(window)
    runner = JobRunner(window)
    preferences = PreferencesFile(path.parent / "preferences.json")
    actions = ExportActions(window, session, runner, preferences, Actions(window))
    assert actions.actions[key].isEnabled()
    with qtbot.waitSignal(runner.finished, timeout=60_000):
        actions.write(key, path)
    runner.close()
    return path.read_bytes()


def test_a_setting_just_changed_is_in_the_exported_points(
    measured: tuple[Session, DevelopPanel], qtbot: QtBot, tmp_path: Path
) -> None:
    session, panel = measured
    before = export(session, tmp_path / "before.csv", qtbot)
    session.set(("sensor", "exposure_time"), 0.3 * session.project.sensor.exposure_time)
    at_once = export(session, tmp_path / "at_once.csv", qtbot)
    qtbot.waitUntil(lambda: not panel.busy)
    assert at_once == export(session, tmp_path / "later.csv", qtbot) != before


def test_light_that_was_refined_since_it_was_measured_is_measured_anew(
    measured: tuple[Session, DevelopPanel], qtbot: QtBot, tmp_path: Path
) -> None:
    session, panel = measured
    render = session.shown
    assert render is not None
    before = export(session, tmp_path / "before.csv", qtbot)
    panel.close()
    render.frame = replace(render.frame, laser_direct=[0.3 * light for light in render.frame.laser_direct])
    assert export(session, tmp_path / "after.csv", qtbot) != before


def test_the_height_map_of_a_scan_is_of_all_its_points(
    measured: tuple[Session, DevelopPanel], qtbot: QtBot, tmp_path: Path
) -> None:
    session, panel = measured
    panel.close()
    render = session.shown
    assert render is not None
    with pytest.raises(InputError, match="single frame"):
        export_height_map(render.scan, tmp_path / "alone.png")
    x, y = (one.ravel() for one in np.meshgrid(np.arange(5.0), np.arange(4.0)))
    write_ply(tmp_path / "points.ply", {"x": x, "y": y, "z": 0.1 * x})
    folder = SimpleNamespace(folder=tmp_path)
    session.shown = replace(
        render, scan=cast(ScanResults, SimpleNamespace(measured=True, found=folder, image_scale=1.0))
    )
    assert export(session, tmp_path / "map.png", qtbot, "export_heightmap").startswith(b"\x89PNG")
    assert json.loads((tmp_path / "map.json").read_text())["points"] == 20


@pytest.mark.parametrize("key", ["export_png", "export_exr"])
def test_images_that_viewers_show_black_are_said_to_be_so_and_hold_the_sensors_numbers(
    measured: tuple[Session, DevelopPanel], qtbot: QtBot, tmp_path: Path, key: str
) -> None:
    session, panel = measured
    told: list[tuple[str, str]] = []
    session.message.connect(lambda level, text: told.append((level, text)))
    export(session, tmp_path / ("a" + KINDS[key][1]), qtbot, key)
    assert session.shown is not None
    written = cv2.imread(str(tmp_path / "a.png"), cv2.IMREAD_UNCHANGED)
    assert np.array_equal(written, session.shown.images[0].pixels) and written.dtype == np.uint16
    assert told[-1][1].splitlines()[-1].startswith("12-bit numbers, 0 to 4095, in PNGs of 16 bits")
    session.set(("sensor", "bits"), 8)  # of the sensor as it is now
    qtbot.waitUntil(lambda: not panel.busy)
    export(session, tmp_path / ("b" + KINDS[key][1]), qtbot, key)
    assert "PNGs" not in told[-1][1]


def exporting(
    measured: tuple[Session, DevelopPanel], qtbot: QtBot, folder: Path
) -> tuple[Session, JobRunner, ExportActions]:
    """What a window exports by, without the panel that measures."""
    session, panel = measured
    panel.close()
    window = QMainWindow()
    qtbot.addWidget(window)
    runner = JobRunner(window)
    return session, runner, ExportActions(window, session, runner, PreferencesFile(folder / "p.json"), Actions(window))


def test_an_export_that_takes_longer_beside_other_work_is_told_at_once(
    measured: tuple[Session, DevelopPanel], qtbot: QtBot, tmp_path: Path
) -> None:
    session, runner, actions = exporting(measured, qtbot, tmp_path)
    told: list[str] = []
    session.message.connect(lambda kind, text: told.append(text))
    go_on = threading.Event()
    runner.run(RENDER, "scan", lambda progress, cancelled: go_on.wait())
    runner.run("export", "export a.csv", lambda progress, cancelled: go_on.wait())
    for name in ("b.csv", "c.csv"):
        actions.write("export_csv", tmp_path / name)
    assert told[0].startswith("b.csv is written after: export a.csv. A message")
    assert told[1].startswith("c.csv is written after: export a.csv, export b.csv. A message")
    go_on.set()
    qtbot.waitUntil(lambda: not runner.busy)
    assert (tmp_path / "b.csv").exists() and (tmp_path / "c.csv").exists(), "none takes another's place"
    assert "b.csv" in told[2] and "c.csv" in told[3]
    go_on.clear()
    runner.run(RENDER, "scan", lambda progress, cancelled: go_on.wait())
    actions.write("export_csv", tmp_path / "d.csv")
    assert told[4].startswith("d.csv is being written beside the scan")
    go_on.set()
    qtbot.waitUntil(lambda: not runner.busy)
    runner.close()


def test_the_name_of_a_file_is_told_once_while_it_is_written(
    measured: tuple[Session, DevelopPanel], qtbot: QtBot, tmp_path: Path
) -> None:
    """ "export a.csv: a.csv", said the status bar."""
    _, runner, actions = exporting(measured, qtbot, tmp_path)
    with qtbot.waitSignal(runner.finished) as ended:
        actions.write("export_csv", tmp_path / "a.csv")
    assert f"{ended.args[0].name}: {ended.args[0].stage}".count("a.csv") == 1
    runner.close()


def test_points_say_their_unit_and_those_of_another_image_scale_are_no_warning(
    measured: tuple[Session, DevelopPanel], qtbot: QtBot, tmp_path: Path
) -> None:
    """The window shows mm, and files are in m; what was written at half the scale was told as a warning."""
    session = measured[0]
    assert all("metres" in KINDS[key][0] for key in KINDS if KINDS[key][2] == "points")
    told: list[tuple[str, str]] = []
    session.message.connect(lambda level, text: told.append((level, text)))
    render = session.shown
    assert render is not None
    render.image_scale = 0.5
    assert render.scanner_scale != 1.0
    places = np.array([line.split() for line in export(session, tmp_path / "p.xyz", qtbot, "export_xyz").splitlines()])
    (level, text), *_ = [one for one in told if "Wrote" in one[1]]
    assert level == "info" and "p.xyz, the points in metres by " in text and "full size" in text.casefold()
    assert np.abs(places.astype(float)).max() < 10.0
