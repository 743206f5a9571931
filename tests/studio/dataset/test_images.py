"""Images and labels: exact, whole, and the same bytes in shards, after a stop and on two processes."""

from __future__ import annotations

import io
import json
import shutil
import tarfile
from pathlib import Path

import cv2
import h5py
import numpy as np
import pytest

from render.base.errors import InputError
from render.output.exr import decode_exr
from studio.dataset.contact_sheet import write_contact_sheet
from studio.dataset.folder import images_in, opened
from studio.dataset.formats import FORMATS, run_lengths, write_format
from studio.dataset.image_kind import image_kind, notes_of_depth
from studio.dataset.images import rendered
from studio.dataset.labels import OCCLUDED, VISIBLE, line_states
from studio.dataset.recipe import Draw, Recipe, base_of
from studio.dataset.run import Wanted, make_dataset
from studio.dataset.scenes import drawn_scene
from studio.dataset.torch_dataset import FolderImages, LiveImages
from studio.preview.preview import Preview
from studio.runtime.workers import Engine
from studio.study.cells import Shard

HERE = Engine(workers=1)
RECIPE = Recipe(
    base="plane",
    image_scale=0.1,
    images=2,
    maps=("objects", "depth", "laser"),
    set={"render.transport": "direct", "render.laser_error": 0.02},
    draw=(
        Draw(field="scene.objects[0].T_world_object.rotation[0]", low=-0.3, high=0.3),
        Draw(field="sensor.exposure_time", low=0.001, high=0.01),
    ),
)
SCENES = 4


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("dataset") / "whole"
    make_dataset(RECIPE, Path(), Wanted(SCENES), folder, engine=HERE)
    for name in FORMATS:
        write_format(opened(folder), images_in(folder), name)
    return folder


def contents(folder: Path) -> dict[str, bytes]:
    made = ("images", "labels", "objects", "maps", "index.csv", "card.md", "dataset.json")
    files = (file for file in sorted(folder.rglob("*")) if file.is_file())
    named = {file.relative_to(folder).as_posix(): file for file in files}
    return {name: file.read_bytes() for name, file in named.items() if name.startswith(made)}


def test_three_shards_put_together_are_the_same_bytes(whole: Path, tmp_path: Path) -> None:
    shards = [tmp_path / str(k) for k in (1, 2, 3)]
    for k, folder in enumerate(shards):
        make_dataset(RECIPE, Path(), Wanted(SCENES, Shard(k + 1, 3)), folder, engine=HERE)
    result = make_dataset(RECIPE, Path(), Wanted(SCENES, sources=shards), tmp_path / "all", engine=HERE)
    assert result.made == 0 and contents(tmp_path / "all") == contents(whole)


def test_the_card_says_what_the_images_are_and_that_viewers_show_them_black(whole: Path) -> None:
    image = cv2.imread(str(whole / "images/00000/00000000.png"), cv2.IMREAD_UNCHANGED)
    card = (whole / "card.md").read_text()
    assert f"- image size and depth: {image.shape[1]} x {image.shape[0]} px, 12 bit\n" in card
    assert (
        image.dtype == np.uint16 and image.max() <= 4095 and "- 12-bit numbers, 0 to 4095, in PNGs of 16 bits" in card
    )
    drawn = RECIPE.model_copy(update={"draw": (Draw(field="sensor.bits", kind="choice", values=(8, 10, 16)),)})
    base = opened(whole).base
    assert image_kind(drawn, base).endswith("px, 8 to 16 bit")
    assert [note.split()[0] for note in notes_of_depth(drawn, base)] == ["10-bit"]


@pytest.mark.parametrize("change", [{"files": {"../../stolen.png": "0"}}, {"rejected": None}, {"scene": "first"}, {}])
def test_labels_of_another_folder_lead_nowhere_and_are_whole(whole: Path, tmp_path: Path, change: dict) -> None:
    shard = tmp_path / "shard"
    shutil.copytree(whole, shard)
    (tmp_path / "stolen.png").write_bytes(b"not of the dataset")
    labels = next((shard / "labels").rglob("*.json"))
    record = json.loads(labels.read_text())
    for name, value in change.items():
        record[name] = record[name] | value if isinstance(value, dict) else value
    if not change:
        del record["split"]
    labels.write_text(json.dumps(record))
    with pytest.raises(InputError, match="labels are damaged"):
        make_dataset(RECIPE, Path(), Wanted(SCENES, sources=[shard]), tmp_path / "all" / "of" / "it", engine=HERE)
    assert not list((tmp_path / "all").rglob("stolen.png"))


def test_what_a_stop_left_out_is_made_and_the_rest_stays(whole: Path, tmp_path: Path) -> None:
    make_dataset(RECIPE, Path(), Wanted(2), tmp_path, engine=HERE)
    (tmp_path / "labels/00000/00000001.json").unlink()
    (tmp_path / "images/00000/00000001.png").write_bytes(b"half")
    assert make_dataset(RECIPE, Path(), Wanted(SCENES), tmp_path, engine=HERE).made == 3
    assert contents(tmp_path) == contents(whole)


def test_what_a_kill_left_half_written_goes_and_files_of_others_stay(whole: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    shutil.copytree(whole, out)
    left = [out / "maps" / "00000" / ".00000005.453549b0.exr", out / ".index.0123abcd.csv"]
    kept = out / "images" / "00000" / ".notes.453549b0.png"
    for path in (*left, kept):
        path.write_bytes(b"half")
    make_dataset(RECIPE, Path(), Wanted(SCENES), out, engine=HERE)
    assert kept.read_bytes() == b"half"
    kept.unlink()
    assert not any(path.exists() for path in left)
    assert contents(out) == contents(whole)


def test_two_processes_give_the_same_bytes(whole: Path, tmp_path: Path) -> None:
    make_dataset(RECIPE, Path(), Wanted(SCENES), tmp_path, engine=Engine(workers=2))
    assert contents(tmp_path) == contents(whole)


def test_another_recipe_or_a_full_folder_is_refused_and_nothing_changes(whole: Path, tmp_path: Path) -> None:
    before = contents(whole)
    with pytest.raises(InputError, match="another dataset"):
        make_dataset(RECIPE.model_copy(update={"seed": 1}), Path(), Wanted(1), whole, engine=HERE)
    assert contents(whole) == before
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(InputError, match=r"not empty.*mine\.txt"):
        make_dataset(RECIPE, Path(), Wanted(1), tmp_path, engine=HERE)


def test_labels_hold_the_exact_line_and_the_floor_of_its_noise(whole: Path) -> None:
    pixels, labels = FolderImages(whole)[0]
    laser = labels["lasers"][0]
    assert pixels.shape == (labels["height"], labels["width"])
    rows, exact = np.array(laser["index"]), np.array(laser["position"])
    # the maximum of the blurred image lies by the exact line, row by row
    smooth = cv2.GaussianBlur(pixels.astype(np.float32), (1, 9), 0)
    assert np.median(np.abs(smooth[rows].argmax(axis=1) - exact)) < 1.0
    assert laser["states"].count("1") == len(set(laser["index"]))
    floor = np.array([np.nan if one is None else one for one in laser["sigma_floor"]])
    assert np.all((floor > 1e-4) & (floor < 1.0))
    exr = decode_exr((whole / "maps/00000/00000000.exr").read_bytes(), "map")
    assert exr["direct0.Y"][rows].max() > 0 and np.nanmin(exr["depth.Z"]) > 0.1
    depth = exr["depth.Z"][rows, np.round(exact).astype(int)]
    assert np.nanmax(np.abs(depth - np.array(laser["depth_z"]))) < 2e-3


def test_scan_lines_whose_line_is_hidden_are_told_apart_from_those_without_one() -> None:
    recipe = Recipe(base="step_block", image_scale=0.1)
    scene = drawn_scene(recipe, base_of(recipe, Path()), Path(), 0, Preview(1))
    frame = rendered(scene)
    states = line_states(frame.curves[0], scene.look, 0)
    seen = np.unique(frame.curves[0].index)
    assert np.array_equal(np.flatnonzero(states == VISIBLE), seen)
    # the table and the block fill the image: every scan line within the fan is seen or hidden
    first, last = seen[0], seen[-1]
    assert np.all(states[first : last + 1] != 0) or np.any(states == OCCLUDED)


def test_run_lengths_give_the_mask_back() -> None:
    mask = np.random.default_rng(0).random((13, 17)) < 0.3
    for one in (mask, np.zeros((3, 4), bool), np.ones((3, 4), bool)):
        runs = run_lengths(one)
        values = np.repeat(np.arange(len(runs)) % 2, runs).astype(bool)
        assert np.array_equal(values.reshape(one.shape, order="F"), one)


def test_formats_hold_the_exact_positions(whole: Path) -> None:
    labels = FolderImages(whole)[0][1]
    exact = dict(zip(labels["lasers"][0]["index"], labels["lasers"][0]["position"], strict=True))
    lines = [json.loads(line) for file in whole.glob("tusimple_*.json") for line in file.read_text().splitlines()]
    mine = next(line for line in lines if line["raw_file"].endswith("00000000.png"))
    lane = dict(zip(mine["h_samples"], mine["lanes"][0], strict=True))
    assert all(lane[row] == pytest.approx(at, abs=1e-6) for row, at in exact.items())
    pairs = np.array((whole / "culane/00000/00000000.lines.txt").read_text().split(), float).reshape(-1, 2)
    assert {int(v): u for u, v in pairs.tolist()} == pytest.approx(exact, abs=1e-6)
    polygon = np.array((whole / "yolo/00000/00000000.txt").read_text().split()[1:], float).reshape(-1, 2)
    middle = polygon[:, 0].mean() * labels["width"] - 0.5
    assert middle == pytest.approx(np.mean(list(exact.values())), abs=0.01)
    coco = [json.loads(file.read_text()) for file in whole.glob("annotations_*.json")]
    assert sum(len(part["images"]) for part in coco) == sum(len(part["annotations"]) for part in coco) == 2 * SCENES
    with h5py.File(whole / "dataset.h5") as file:
        group = file["00000000"]
        assert np.array_equal(group["image"][:], FolderImages(whole)[0][0])
        assert dict(zip(group["laser0/index"][:].tolist(), group["laser0/position"][:].tolist(), strict=True)) == exact
    names = []
    for archive in whole.glob("webdataset/*.tar"):
        with tarfile.open(archive) as opened_archive:
            names += opened_archive.getnames()
            member = opened_archive.extractfile(opened_archive.getnames()[1])
            assert member is not None and "lasers" in json.load(io.TextIOWrapper(member))
    assert len(names) == 4 * SCENES


def test_a_split_is_by_scene_and_read_back(whole: Path) -> None:
    parts = [FolderImages(whole, split) for split in ("train", "validation", "test")]
    assert sum(map(len, parts)) == 2 * SCENES
    scenes = [{part[i][1]["scene"] for i in range(len(part))} for part in parts]
    assert not scenes[0] & scenes[1] and not scenes[0] & scenes[2] and not scenes[1] & scenes[2]
    with pytest.raises(InputError, match="no such split"):
        FolderImages(whole, "all")


def test_images_rendered_as_they_are_asked_for_are_those_of_the_folder(whole: Path, tmp_path: Path) -> None:
    file = tmp_path / "recipe.json"
    file.write_text(RECIPE.model_dump_json())
    live = iter(LiveImages(file))
    stored = FolderImages(whole)
    for k in range(2):
        assert np.array_equal(next(live)[0], stored[k][0])


def test_a_contact_sheet_shows_the_first_scenes(tmp_path: Path) -> None:
    path = write_contact_sheet(RECIPE, Path(), tmp_path / "contact.png", scenes=3)
    sheet = cv2.imread(str(path))
    assert sheet is not None and sheet.std() > 10
