"""What is exported of a scan is of all its steps while the figures on the screen are, and says what it is of."""

from __future__ import annotations

import csv
import json
import shutil
from collections.abc import Iterator
from html import unescape
from pathlib import Path

import pytest
from PIL import Image
from PySide6.QtGui import QDesktopServices
from PySide6.QtWidgets import QMainWindow
from pytestqt.qtbot import QtBot

from analysis.gauges.gauge import Gauge
from studio.project.document import Document
from studio.project.project import Project
from studio.qt.core.actions import Actions
from studio.qt.core.jobs import JobRunner
from studio.qt.core.report_opener import OLD, open_report
from studio.qt.core.scan_steps import scan_steps
from studio.qt.core.session import Session
from studio.qt.render.develop_panel import DevelopPanel
from studio.qt.results.export_actions import ExportActions
from studio.qt.results.heads import measured_otherwise
from studio.qt.results.results_panel import ResultsPanel
from studio.qt.results.scan_again import KEY, ScanAgain
from studio.qt.results.scan_bar import ScanBar
from studio.qt.shell.file_actions import _scanned
from studio.runtime.jobs import Job
from studio.runtime.preferences import PreferencesFile
from studio.scan.scan_folder import open_folder
from tests.studio.scan_of_steps import small_scan

FLATNESS = Gauge(name="top", kind="flatness", regions=((-0.1, 0.1),))


@pytest.fixture(scope="module")
def scanned(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    return small_scan(tmp_path_factory.mktemp("steps"))


class Bench:
    """A scan that is looked at, with its bar and the export menu."""

    def __init__(self, scanned: tuple[Path, Path], folder: Path, qtbot: QtBot) -> None:
        file, results = scanned
        self.session = Session(Document(Project.load(file), file))
        scan_steps(self.session).show(open_folder(results))
        qtbot.waitUntil(lambda: self.session.shown is not None)
        self.panel = DevelopPanel(self.session)
        qtbot.addWidget(self.panel)
        with qtbot.waitSignal(self.session.measured):
            self.panel.refresh()
        window = QMainWindow()
        qtbot.addWidget(window)
        self.window, self.runner, self.bar = window, JobRunner(window), ScanBar(self.session)
        qtbot.addWidget(self.bar)
        self.told: list[tuple[str, str]] = []
        self.session.message.connect(lambda level, text: self.told.append((level, text)))
        preferences = PreferencesFile(folder / "preferences.json")
        self.exports = ExportActions(window, self.session, self.runner, preferences, Actions(window))
        self.exports.whole = lambda: self.bar.whole

    def write(self, key: str, path: Path, qtbot: QtBot) -> Path:
        with qtbot.waitSignal(self.runner.finished):
            self.exports.write(key, path)
        return path

    def close(self) -> None:
        self.panel.close()
        self.runner.close()
        scan_steps(self.session).close()


@pytest.fixture
def bench(scanned: tuple[Path, Path], tmp_path: Path, qtbot: QtBot) -> Iterator[Bench]:
    made = Bench(scanned, tmp_path, qtbot)
    yield made
    made.close()


def steps_of(file: Path) -> set[str]:
    with open(file, newline="") as text:
        return {row["step"] for row in csv.DictReader(text)}


def test_points_are_of_all_steps_or_of_the_one_that_is_asked_for(bench: Bench, tmp_path: Path, qtbot: QtBot) -> None:
    assert steps_of(bench.write("export_csv", tmp_path / "all.csv", qtbot)) == {"0", "1", "2"}
    assert bench.told[-1][1].endswith("of all 3 steps") or "of all 3 steps\n" in bench.told[-1][1]
    bench.bar.scope.setCurrentIndex(1)
    assert steps_of(bench.write("export_csv", tmp_path / "one.csv", qtbot)) == {"0"}
    assert "of step 1 of 3" in bench.told[-1][1]


def test_a_report_is_of_all_steps_with_the_measures_of_now(
    bench: Bench, tmp_path: Path, qtbot: QtBot, quick_reports: None
) -> None:
    """A step's verdict alone read "within tolerance" where the scan's own was not decided."""
    bench.session.set(("measures",), (FLATNESS,))
    before = sorted(file.name for file in bench.bar.whole.found.folder.iterdir())  # type: ignore[union-attr]
    text = unescape(bench.write("export_html", tmp_path / "all.html", qtbot).read_text())
    assert "3 frames" in text and "needs 3 steps" not in text and "top" in text
    assert before == sorted(file.name for file in bench.bar.whole.found.folder.iterdir())  # type: ignore[union-attr]
    bench.bar.scope.setCurrentIndex(1)
    text = unescape(bench.write("export_html", tmp_path / "one.html", qtbot).read_text())
    assert "This is step 1 of 3 in scan alone." in text


@pytest.fixture
def stages(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, float]]:
    """What jobs tell of themselves, in its order."""
    told: list[tuple[str, float]] = []
    tell = Job._progress

    def listen(job: Job[object], stage: str, done: float) -> None:
        told.append((stage, done))
        tell(job, stage, done)

    monkeypatch.setattr(Job, "_progress", listen)
    return told


def check_told_by_frames(told: list[tuple[str, float]]) -> None:
    """Of each of three frames, in a share of the whole that never goes back: from it the time left is told."""
    frames = list(dict.fromkeys(stage.split(":")[0] for stage, _ in told if stage.startswith("frame ")))
    assert frames == ["frame 1 of 3", "frame 2 of 3", "frame 3 of 3"]
    shares = [done for _, done in told]
    assert shares == sorted(shares) and len(set(shares)) > 3


def test_a_report_or_a_film_of_all_steps_tells_at_which_frame_it_is(
    bench: Bench, tmp_path: Path, qtbot: QtBot, quick_reports: None, stages: list[tuple[str, float]]
) -> None:
    bench.write("export_html", tmp_path / "all.html", qtbot)
    check_told_by_frames(stages)
    assert any(stage == "report" for stage, _ in stages)
    stages.clear()
    bench.write("export_film", tmp_path / "all.mp4", qtbot)
    check_told_by_frames(stages)


def test_the_logo_lies_beside_the_project_of_now_and_not_where_the_scan_was_run(
    scanned: tuple[Path, Path], tmp_path: Path, qtbot: QtBot, quick_reports: None
) -> None:
    """A template that was scanned has its meshes in the program's own folder, and is saved elsewhere later."""
    file = tmp_path / "saved" / "steps.json"
    shutil.copytree(scanned[0].parent, file.parent)
    Image.new("RGB", (8, 4), "teal").save(file.parent / "logo.png")
    bench = Bench((file, scanned[1]), tmp_path, qtbot)
    bench.session.set(("delivery", "logo"), "logo.png")
    assert 'alt="Logo"' in bench.write("export_html", tmp_path / "all.html", qtbot).read_text()
    bench.bar.scope.setCurrentIndex(1)
    assert 'alt="Logo"' in bench.write("export_html", tmp_path / "one.html", qtbot).read_text()
    assert not [text for _, text in bench.told if "The logo" in text]
    bench.close()


def test_a_report_that_is_older_than_a_tolerance_says_so_when_it_is_opened(
    scanned: tuple[Path, Path], tmp_path: Path, qtbot: QtBot, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It said "no tolerance was given" to who had just given one."""
    shutil.copytree(scanned[1], tmp_path / "scan")
    (tmp_path / "scan" / "report.html").write_text("as it was")
    manifest = tmp_path / "scan" / "scan.json"
    manifest.write_text(json.dumps({**json.loads(manifest.read_text()), "report": ["report.html"]}))
    bench = Bench((scanned[0], tmp_path / "scan"), tmp_path, qtbot)
    monkeypatch.setattr(QDesktopServices, "openUrl", lambda url: True)
    bench.told.clear()
    bench.bar.report.click()
    assert OLD not in [text for _, text in bench.told]
    bench.session.set(("delivery", "upper"), 1e-4)
    bench.bar.report.click()
    assert bench.told[-1] == ("warning", OLD)
    bench.told.clear()
    open_report(bench.session, tmp_path / "scan" / "report.html")
    assert bench.told[-1] == ("warning", OLD), "from the panel of the motion as well"
    bench.told.clear()
    open_report(bench.session, tmp_path / "another" / "report.html")
    assert OLD not in [text for _, text in bench.told], "nothing is known of another scan"
    bench.close()


def test_a_scan_is_measured_again_with_the_measures_of_now(
    scanned: tuple[Path, Path], tmp_path: Path, qtbot: QtBot, stages: list[tuple[str, float]]
) -> None:
    """A flatness that was added after the scan is read off its frames, and nothing is rendered."""
    file, folder = tmp_path / "project" / "steps.json", tmp_path / "scan"
    shutil.copytree(scanned[0].parent, file.parent)
    shutil.copytree(scanned[1], folder)
    bench = Bench((file, folder), tmp_path, qtbot)
    again = ScanAgain(bench.session, bench.runner, bench.exports.actions)
    bench.session.set(("measures",), (FLATNESS,))
    before, frames = bench.session.shown, {path: path.stat().st_mtime_ns for path in folder.glob("frame_*")}
    assert again.actions[KEY].isEnabled()
    again.actions[KEY].trigger()
    qtbot.waitUntil(lambda: bench.session.shown is not before and bench.session.shown is not None)
    check_told_by_frames(stages)
    assert bench.session.renders == [bench.session.shown] and bench.session.shown.scan is not None
    (kept,) = open_folder(folder).manifest["measures"]
    assert kept["name"] == "top" and kept["value"] is not None
    assert {path: path.stat().st_mtime_ns for path in folder.glob("frame_*")} == frames
    assert not measured_otherwise(bench.session, bench.session.shown)
    bench.session.set(("sensor", "bits"), 8)
    assert measured_otherwise(bench.session, bench.session.shown)
    shown = bench.session.shown
    again.actions[KEY].trigger()
    qtbot.waitUntil(lambda: bench.session.shown is not shown)
    assert not measured_otherwise(bench.session, bench.session.shown)
    # asked for twice: the second is of a folder that the first may have written
    bench.session.set(("sensor", "bits"), 10)
    shown = bench.session.shown
    again.actions[KEY].trigger()
    again.actions[KEY].trigger()
    qtbot.waitUntil(lambda: not bench.runner.busy and bench.session.shown is not shown)
    assert not measured_otherwise(bench.session, bench.session.shown)
    panel = ResultsPanel(bench.session)
    qtbot.addWidget(panel)
    qtbot.waitUntil(lambda: panel.part.told.text().startswith("Of step 1 of 3; flatness of all steps together."))
    panel.close()
    # opened again, where the project's file is another by now, it has what it was measured with
    file.unlink()
    assert _scanned(open_folder(folder)).project.measures == (FLATNESS,)
    bench.close()
