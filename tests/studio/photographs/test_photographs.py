"""The line in image files of a real scanner, by the command line: every kind of file, and every kind of bad one."""

from __future__ import annotations

import csv
import json
import os
import zlib
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import OpenEXR
import pytest
from click.testing import CliRunner, Result
from PIL import Image

import main
from tests.analysis.line.line_images import expected, exposed

ROWS, WIDTH = 120, 240
CENTRE = 90 + 0.3 * np.arange(ROWS)


def call(*arguments: object) -> Result:
    return CliRunner().invoke(main.cli, ["extract", *map(str, arguments), "--quiet"])


def counts(seed: int = 0, background: float = 15.0) -> Any:
    return exposed(expected(WIDTH, CENTRE, 3000, 1.5, background), 3, np.random.default_rng(seed))


def eight_bit(electrons: Any, gain: float = 0.07) -> Any:
    return np.clip(np.round(electrons * gain), 0, 255).astype(np.uint8)


def table(path: Path) -> list[dict[str, str]]:
    with path.open() as file:
        return list(csv.DictReader(file))


def error_of(path: Path, axis: str = "u") -> float:
    rows = table(path)
    assert len(rows) == ROWS and all(row["flag"] == "OK" for row in rows)
    return float(np.sqrt(np.mean((np.array([float(row[axis]) for row in rows]) - CENTRE) ** 2)))


def green(electrons: Any) -> Any:
    image = np.zeros((*electrons.shape, 3), np.uint8)
    image[..., 1] = eight_bit(electrons)  # OpenCV's order is B, G, R
    return image


def test_every_kind_of_file_gives_the_line(tmp_path: Path) -> None:
    electrons = counts()
    images = {
        "mono.png": eight_bit(electrons),
        "deep.png": np.clip(np.round(electrons * 10), 0, 65535).astype(np.uint16),
        "float.tiff": electrons.astype(np.float32),
        "colour.png": green(electrons),
        "turned.png": np.ascontiguousarray(eight_bit(electrons).T),
    }
    for name, image in images.items():
        assert cv2.imwrite(str(tmp_path / name), image)
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {"Y": electrons.astype(np.float32)}).write(str(tmp_path / "deep.exr"))
    for name, bound in (("mono", 0.025), ("deep", 0.02), ("float", 0.02)):
        done = call(*tmp_path.glob(f"{name}.*"))
        assert done.exit_code == 0, done.output
        assert error_of(tmp_path / f"{name}_line.csv") < bound
    assert error_of(tmp_path / "deep_2_line.csv") < 0.02  # the EXR and the PNG of one name
    assert call(tmp_path / "colour.png", "--laser", "green").exit_code == 0
    assert error_of(tmp_path / "colour_line.csv") < 0.025
    assert call(tmp_path / "turned.png", "--axis", "columns").exit_code == 0
    assert error_of(tmp_path / "turned_line.csv", "v") < 0.025


def test_a_laser_off_image_takes_the_ambient_light_away(tmp_path: Path) -> None:
    pattern = 800 + 700 * np.sin(np.arange(WIDTH) / 3.0) * np.ones((ROWS, 1))
    rng = np.random.default_rng(1)
    mean = expected(WIDTH, CENTRE, 900, 1.5, 0.0)
    for name, light in (("on", pattern + mean), ("off", pattern)):
        cv2.imwrite(str(tmp_path / f"{name}.png"), np.round(exposed(light, 3, rng) * 10).astype(np.uint16))
    assert call(tmp_path / "on.png", "--off", tmp_path / "off.png", "--out", tmp_path / "a").exit_code == 0
    assert error_of(tmp_path / "a" / "on_line.csv") < 0.12
    swapped = call(tmp_path / "off.png", "--off", tmp_path / "on.png")
    assert swapped.exit_code == 2 and "brighter" in swapped.stderr


def test_saturation_survives_the_subtraction(tmp_path: Path) -> None:
    electrons = exposed(expected(WIDTH, CENTRE, 12000, 1.5, 15.0), 3, np.random.default_rng(2))
    dark = exposed(np.full((ROWS, WIDTH), 15.0), 3, np.random.default_rng(3))
    cv2.imwrite(str(tmp_path / "on.png"), eight_bit(electrons))
    cv2.imwrite(str(tmp_path / "off.png"), eight_bit(dark))
    done = call(tmp_path / "on.png", "--off", tmp_path / "off.png", "--json")
    assert json.loads(done.stdout)["images"][0]["flags"] == {"SATURATED": ROWS}


def bad_images(folder: Path) -> dict[str, str]:
    """Name -> what the message must hold."""
    good = eight_bit(counts())
    images: dict[str, tuple[Any, str]] = {
        "black.png": (np.zeros_like(good), "black"),
        "white.png": (np.full_like(good, 255), "saturated all over"),
        "grey.png": (np.full_like(good, 77), "same everywhere"),
        "nan.tiff": (np.full(good.shape, np.nan, np.float32), "finite"),
        "one_bit.png": (np.where(good > 20, np.uint8(255), np.uint8(0)), "black and white, without the line's profile"),
    }
    for name, (image, _) in images.items():
        assert cv2.imwrite(str(folder / name), image)
    (folder / "text.png").write_text("not an image")
    (folder / "empty.tiff").write_bytes(b"")
    (folder / "damaged.exr").write_bytes(b"v/1\x01 damaged")
    for name in ("pages.tiff", "pages.gif"):
        page = Image.fromarray(good)
        page.save(folder / name, save_all=True, append_images=[Image.fromarray(good[::-1].copy())] * 2)
    os.mkfifo(folder / "pipe.png")
    (folder / "linked.png").symlink_to(folder / "pipe.png")
    (folder / "folder.png").mkdir()
    with open(folder / "sparse.tiff", "wb") as file:
        file.truncate(2**30)
    OpenEXR.File({}, {name: np.ones((4, 4), np.float32) for name in ("a", "b")}).write(str(folder / "layers.exr"))
    told = {name: text for name, (_, text) in images.items()}
    return told | {
        "text.png": "not an image",
        "empty.tiff": "not an image",
        "damaged.exr": "cannot be read; found no header of an EXR; allowed: a whole, valid file",
        "missing.png": "no such image",
        "pages.tiff": "several pages; found 3; allowed: one; save each page as an image of its own",
        "pages.gif": "several pages; found 2",
        "pipe.png": "not a regular file; found a device or a pipe",
        "linked.png": "not a regular file",
        "folder.png": "the image is a folder",
        "sparse.tiff": "too big; found 1073741824 bytes; allowed: 536870912 bytes",
        "layers.exr": "no image of its own; found a, b",
    }


def test_a_damaged_image_is_told_in_our_words_alone(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    whole = cv2.imencode(".png", eight_bit(counts()))[1].tobytes()
    start = whole.index(b"IDAT") + 4
    size = int.from_bytes(whole[start - 8 : start - 4], "big")
    data = whole[start : start + 40] + b"\xff" * (size - 40)
    crc = zlib.crc32(b"IDAT" + data).to_bytes(4, "big")
    (tmp_path / "bad.png").write_bytes(whole[:start] + data + crc + whole[start + size + 4 :])
    ended = call(tmp_path / "bad.png")
    # libpng writes past Python's streams
    assert (ended.exit_code, capfd.readouterr().err) == (2, "")
    assert "the image is damaged" in ended.stderr


def test_one_bad_image_does_not_stop_the_others_and_is_named(tmp_path: Path) -> None:
    bad = bad_images(tmp_path)
    for name in ("first.png", "last.png"):
        cv2.imwrite(str(tmp_path / name), eight_bit(counts()))
    files = [tmp_path / "first.png", *(tmp_path / name for name in bad), tmp_path / "last.png"]
    done = call(*files, "--json")
    assert done.exit_code == 2 and "Traceback" not in done.output
    answer = json.loads(done.stdout)
    assert [Path(row["image"]).name for row in answer["images"]] == ["first.png", "last.png"]
    told = {Path(row["image"]).name: row["message"] for row in answer["errors"]}
    assert told.keys() == bad.keys()
    for name, text in bad.items():
        assert name in told[name] and text in told[name]
        assert told[name] in done.stderr
    assert sorted(path.name for path in tmp_path.glob("*.csv")) == ["first_line.csv", "last_line.csv"]


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["--laser", "green"], "no such channel"),
        (["--method", "magic"], "likelihood"),
        (["--peaks", "0"], "extraction.peaks"),
        (["--off", "small.png"], "another size"),
        (["--off", "deep.png"], "another type"),
        (["--off", "none.png"], "none.png"),
    ],
)
def test_what_does_not_fit_the_image_is_named(arguments: list[str], text: str, tmp_path: Path) -> None:
    good = eight_bit(counts())
    cv2.imwrite(str(tmp_path / "a.png"), good)
    cv2.imwrite(str(tmp_path / "small.png"), good[:50])
    cv2.imwrite(str(tmp_path / "deep.png"), good.astype(np.uint16))
    arguments = [str(tmp_path / word) if word.endswith(".png") else word for word in arguments]
    done = call(tmp_path / "a.png", *arguments)
    assert done.exit_code == 2 and text in done.stderr and "Traceback" not in done.output
    assert not list(tmp_path.glob("*.csv"))


def test_what_says_less_of_the_position_than_a_guess_is_not_found(tmp_path: Path) -> None:
    across = np.abs(np.arange(WIDTH) - CENTRE[:, None])
    thresholded = np.where(across < 2.2, 255, 0).astype(np.uint8)
    thresholded[0, 0] = 128  # not only black and white
    cv2.imwrite(str(tmp_path / "a.png"), thresholded)
    done = call(tmp_path / "a.png", "--json")
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)["images"][0]["found"] == 0
    assert {row["flag"] for row in table(tmp_path / "a_line.csv")} == {"NOT_CONVERGED"}
