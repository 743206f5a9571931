"""What a scan keeps of its frames: all, a band, nothing; and what can be done with each afterwards."""

from __future__ import annotations

import json
import threading
from pathlib import Path

import numpy as np
import pytest

from analysis.cloud import read_ply
from render.base.errors import Cancelled, InputError
from render.output.frame_files import read_frame
from studio.project.document import replaced
from studio.project.project import Project
from studio.scan import frame_writer, scan_folder
from studio.scan.options import Listener
from studio.scan.reconstruct import reconstruct_folder
from studio.scan.scan_results import read_results
from studio.scan.stages import Clock
from tests.studio.small_scan import contents, scan, small_project


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return small_project(tmp_path_factory.mktemp("project"))


@pytest.fixture(scope="module")
def whole(file: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("whole")
    scan(file, out)
    return out


@pytest.fixture(scope="module")
def band(file: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("band")
    scan(file, out, frames="band")
    return out


@pytest.fixture(scope="module")
def bare(file: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("bare")
    scan(file, out, frames="none")
    return out


def again(folder: Path, out: Path) -> dict:
    found = scan_folder.open_folder(folder)
    clock = Clock(lambda stage, done: None, lambda: False)
    return reconstruct_folder(found, found.project, found.root, out, clock, report=False, threads=1)


def test_the_points_are_the_same_whatever_is_kept(whole: Path, band: Path, bare: Path) -> None:
    for name in ("points.ply", "points.csv"):
        assert (band / name).read_bytes() == (bare / name).read_bytes() == (whole / name).read_bytes()


def test_a_band_measures_again_to_the_same_points_and_says_what_it_is(whole: Path, band: Path, tmp_path: Path) -> None:
    """Here the blocks' means tell the background as well as its pixels do: the ground is even."""
    result = again(band, tmp_path)
    points, before = read_ply(tmp_path / "points.ply"), read_ply(whole / "points.ply")
    assert np.array_equal(points["row"], before["row"])
    assert np.array_equal(points["step"], before["step"])
    moved = np.abs(points["u"] - before["u"])
    assert np.nanmax(moved) < 1e-3  # px; noise moves a point by some hundredths
    assert any("kept as a band" in note for note in result["notes"])
    assert not list(band.glob("*.png"))
    assert json.loads((band / "scan.json").read_text())["frames_kept"] == "band"


def test_a_band_holds_all_that_the_line_lit(whole: Path, band: Path) -> None:
    """The laser's light within three sigma of its line is in the frame as it was rendered."""
    for step in range(2):
        a, b = (read_frame(folder / f"frame_{step:04d}.json") for folder in (whole, band))
        lit = a.laser_direct[0] > 0.01 * a.laser_direct[0].max()
        assert lit.any() and np.array_equal(a.laser_direct[0][lit], b.laser_direct[0][lit])


def test_a_scan_without_frames_is_told_apart_from_a_broken_one(bare: Path, tmp_path: Path) -> None:
    assert not list(bare.glob("frame_*"))
    manifest = json.loads((bare / "scan.json").read_text())
    assert manifest["frames"] == [] and manifest["frame_count"] == 2 and manifest["results"][0]["points"] > 0
    with pytest.raises(InputError, match="kept none of its frames"):
        again(bare, tmp_path)
    with pytest.raises(InputError, match="kept none of its frames"):
        read_results(scan_folder.open_folder(bare))


def test_what_cannot_be_done_without_frames_is_refused_before_anything_is_computed(file: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="goes on from the frames"):
        scan(file, tmp_path / "out", frames="none", resume=True)
    with pytest.raises(InputError, match="leaves nothing"):
        scan(file, tmp_path / "out", frames="none", measure=False)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("stop", ["asked", "by Ctrl-C"])
def test_a_stopped_scan_without_frames_says_that_nothing_is_kept(file: Path, tmp_path: Path, stop: str) -> None:
    """It said that no file was left half-written, which left one to look for the points of what was done."""
    measured: list[int] = []

    def each(result) -> None:
        measured.append(result.step)
        if stop == "by Ctrl-C":
            raise KeyboardInterrupt

    listener = Listener(cancelled=lambda: bool(measured), measured=each)
    with pytest.raises(Cancelled, match=r"nothing is kept.*1 of 2 were measured.*--resume has nothing.*--frames band"):
        scan(file, tmp_path / "out", listener, frames="none")
    assert measured == [0] and not list((tmp_path / "out").glob("points.*"))


def test_frames_of_a_band_are_gone_on_with_as_a_band_and_rendered_anew_for_all(
    file: Path, whole: Path, band: Path, tmp_path: Path
) -> None:
    for kept, reference in (("band", band), ("all", whole)):
        out = tmp_path / kept
        scan(file, out, frames="band")
        done = scan(file, out, frames=kept, resume=True)
        frames = {name: data for name, data in contents(out).items() if name.startswith("frame")}
        assert frames == {name: data for name, data in contents(reference).items() if name.startswith("frame")}
        assert any("kept as a band" in note for note in done.manifest["notes"]) == (kept == "band")


def test_another_frame_is_taken_while_one_is_written_and_only_one(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first frame's writer waits until the second is rendered: for ever, if nothing went beside it."""
    rendered, write, order = threading.Event(), frame_writer.write_frame, []

    def waiting(folder: Path, stem: str, *arguments, **options) -> list[Path]:
        assert rendered.wait(60.0)
        order.append(stem)
        return write(folder, stem, *arguments, **options)

    monkeypatch.setattr(frame_writer, "write_frame", waiting)
    seen: list[int] = []

    def refined(frame) -> None:
        seen.append(frame.step)
        if frame.step == 1:
            rendered.set()

    scan(file, tmp_path, Listener(refined=refined), measure=False)
    assert order == ["frame_0000", "frame_0001"] and seen[-1] == 1


def test_a_frame_that_cannot_be_written_ends_the_scan_with_its_message(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(folder: Path, stem: str, *arguments, **options) -> list[Path]:
        raise InputError("the file cannot be written", where=str(folder / stem), found="No space left on device")

    monkeypatch.setattr(frame_writer, "write_frame", full)
    with pytest.raises(InputError, match=r"frame_0000: the file cannot be written, found: No space|No space left"):
        scan(file, tmp_path)
    assert not (tmp_path / "scan.json").exists()
    assert Project.load(tmp_path / "scan_project.json").name == "small"


def test_no_truth_of_pixels_is_rendered_for_frames_that_are_not_kept(file: Path, tmp_path: Path) -> None:
    """But where the sensor's defocus needs their depth."""
    project = replaced(Project.load(file), ("render", "truth_images"), True)
    out_of_focus = replaced(project, ("sensor", "defocus"), True)
    for chosen, kept, wanted in ((project, "none", False), (out_of_focus, "none", True), (project, "all", True)):
        seen: list[bool] = []
        listener = Listener(refined=lambda frame, seen=seen: seen.append(frame.truth is not None))
        scan(file, tmp_path / f"{kept}{wanted}", listener, project=chosen, frames=kept, steps=1)
        assert seen[-1] == wanted, (kept, wanted)


def test_the_rate_of_profiles_is_told_of_the_work_before_the_report(whole: Path) -> None:
    manifest = json.loads((whole / "scan.json").read_text())
    spent = sum(seconds for name, seconds in manifest["seconds"].items() if name != "all")
    assert manifest["profiles_per_second"] == pytest.approx(2 / spent, rel=1e-6)
