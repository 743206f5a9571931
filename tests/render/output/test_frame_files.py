"""A frame written and read again is the same frame, bit for bit; a damaged one is refused with its name."""

from __future__ import annotations

import contextlib
import io
import json
import math
import os
import struct
import subprocess
import sys
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import OpenEXR
import pytest

import render.output.frame_files
from render.base.counts import (
    DIRECT_ERROR,
    RAYS,
    Quantity,
)
from render.base.errors import InputError
from render.base.files import read_bytes
from render.base.pose import Pose
from render.camera.camera import Camera
from render.frame import Frame, LaserCurve, Truth
from render.laser.laser import LineLaser
from render.output.exr import decode_exr
from render.output.frame_files import read_frame, write_frame
from render.output.sidecar import curves_from, safe_name, sealed
from render.plan import GroupQuality, Plan, ThinLens, TransportStep
from render.scene.motion import LinearStage
from render.scene.scene import Rig, Scene, SceneObject
from render.scene.shape import Box
from render.sensor.develop import Image, develop
from render.sensor.sensor import Sensor, SpectralCurve
from tests.render.damaged import PROGRAM_WORDS, damaged_copies

WIDTH, HEIGHT = 61, 40
NAMES = ("blue", "a.b/c\\d ü%", "x" * 100, "日" * 100)


def scene_of(names: tuple[str, ...] = NAMES) -> Scene:
    camera = Camera(width=WIDTH, height=HEIGHT, fx=80, fy=81, cx=30, cy=19.5, distortion=(-0.1, 0.01, 0, 1e-3))
    lasers = tuple(
        LineLaser(name=name, T_rig_laser=Pose(translation=(0.1 + i, 0, 0), rotation=(0, -0.2, 0)))
        for i, name in enumerate(names)
    )
    motion = LinearStage(step=(0, 0.01, 0), steps=10)
    return Scene(rig=Rig(camera=camera, lasers=lasers), objects=(SceneObject(name="box", shape=Box()),), motion=motion)


def curve_of(n: int, axis: str, rng: np.random.Generator) -> LaserCurve:
    values: dict[str, Any] = {name.name: rng.normal(size=n) for name in fields(LaserCurve) if name.name != "axis"}
    values |= {"index": rng.integers(0, HEIGHT, n, dtype=np.int32), "object_id": np.zeros(n, np.int32)}
    values |= {"point": rng.normal(size=(n, 3)) * 1e-7, "segments": rng.normal(size=(2 * n, 2, 3)), "axis": axis}
    if n:
        values["irradiance"][0], values["camera_angle"][-1], values["position"][0] = np.nan, -0.0, np.inf
    return LaserCurve(**values)


PLAN = Plan(
    (
        TransportStep("direct", "direct", True, "always"),
        TransportStep("indirect", "caustic", True, "pilot", math.inf, 0.0),
        TransportStep("indirect", "subsurface", False, "negligible", 0.01, 1e-3),
        TransportStep("ambient", "interreflection", None, "pilot"),
    ),
    negligible=0.02,
    image_size=(WIDTH, HEIGHT),
    laser_clamp=1e-3,
    lens=ThinLens(2.8, None, 0.01, 0.1, 0.5),
    pilot_steps=(0, 4, 9),
    frame_count=10,
)


def quality_of(lasers: list[str]) -> tuple[GroupQuality, ...]:
    """With all that JSON cannot hold as a number."""
    direct = (GroupQuality("direct", name, math.inf, 0.003, 5e6, "samples", lit_pixels=77.0) for name in lasers)
    ambient = GroupQuality("ambient", None, math.nan, 0.01, 1.0, "samples a pixel", 16.0, 2.0, 3.0, 1e-4)
    return (*direct, ambient)


def frame_of(scene: Scene, step: int = 3) -> Frame:
    rng = np.random.default_rng(1)

    def image(*shape: int) -> np.ndarray[Any, np.dtype[np.float32]]:
        values = rng.normal(size=(HEIGHT, WIDTH, *shape)).astype(np.float32)
        values[0, 0], values[0, 1], values[1, 0] = np.nan, np.inf, 1e-42  # a subnormal number as well
        return values

    truth = Truth(image(), image(), image(3), image(3), rng.integers(-1, 4, (HEIGHT, WIDTH), dtype=np.int32))
    count = len(scene.lasers)
    return Frame(
        step=step,
        laser_direct=tuple(image() for _ in range(count)),
        ambient=image(3),
        curves=tuple(curve_of(5 * i, ("rows", "columns")[i % 2], rng) for i in range(count)),
        truth=truth,
        plan=PLAN,
        quality=quality_of([laser.name for laser in scene.lasers]),
        seconds={"laser": 0.1, "curve": 1e-3},
        counts={RAYS: 12345.0, DIRECT_ERROR.of(0): np.inf, Quantity("unknown", "mean"): np.nan},
    )


def same_bits(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    if isinstance(a, tuple):
        return len(a) == len(b) and all(map(same_bits, a, b))
    if isinstance(a, LaserCurve | Truth | Frame):
        return type(a) is type(b) and all(same_bits(getattr(a, f.name), getattr(b, f.name)) for f in fields(a))
    return repr(a) == repr(b)


def image_of(bits: int = 12, **values: Any) -> Image:
    pixels = np.random.default_rng(2).integers(0, 2**bits, (HEIGHT, WIDTH))
    kept: dict[str, Any] = {"gain": 0.4, "black_level": 64.0, "saturation": 4095.0, "read_noise": 2.5, "pattern": None}
    return Image(pixels.astype(np.uint8 if bits == 8 else np.uint16), bits, **(kept | values))


@pytest.fixture
def written(tmp_path: Path) -> list[Path]:
    return write_frame(tmp_path, "frame_0003", frame_of(scene_of()), image_of(), scene_of())


def test_a_frame_is_read_as_it_was_written(tmp_path: Path, written: list[Path]) -> None:
    assert [path.name for path in written] == ["frame_0003.exr", "frame_0003.png", "frame_0003.json"]
    assert sorted(os.listdir(tmp_path)) == sorted(path.name for path in written)
    for path in written:
        assert same_bits(read_frame(path), frame_of(scene_of()))


@pytest.mark.parametrize("left_out", ["ambient", "truth", "curves"])
def test_what_a_frame_has_not_it_has_not_when_read(tmp_path: Path, left_out: str) -> None:
    frame = replace(frame_of(scene_of()), **{left_out: () if left_out == "curves" else None})
    paths = write_frame(tmp_path, "part", frame, None, scene_of())
    assert [path.suffix for path in paths] == [".exr", ".json"]
    assert same_bits(read_frame(paths[0]), frame)


def test_a_frame_without_lasers_is_read_as_it_was_written(tmp_path: Path) -> None:
    scene = scene_of(())
    assert same_bits(read_frame(write_frame(tmp_path, "dark", frame_of(scene), None, scene)[0]), frame_of(scene))


def test_layers_have_the_names_and_types_that_other_programs_expect(written: list[Path]) -> None:
    channels = OpenEXR.File(str(written[0]), separate_channels=True).channels()
    plain = {"ambient.R", "ambient.G", "ambient.B", "depth_z.Z", "depth_range.Z", "object_id.Y", "laser.blue.direct.Y"}
    plain |= {f"{layer}.{axis}" for layer in ("position", "normal") for axis in "XYZ"}
    assert plain < channels.keys()
    assert len(channels) == len(plain) + 3
    assert all(len(name) < 256 and name.isascii() and "/" not in name for name in channels)
    assert "laser.a%2Eb%2Fc%5Cd%20%C3%BC%25.direct.Y" in channels
    assert {name for name, channel in channels.items() if channel.pixels.dtype == np.uint32} == {"object_id.Y"}
    assert channels["object_id.Y"].pixels.max() == 2**32 - 1


@pytest.mark.parametrize("bits", [8, 10, 12, 16])
def test_the_png_holds_the_numbers_of_the_image(tmp_path: Path, bits: int) -> None:
    image = image_of(bits, pattern="RGGB")
    paths = write_frame(tmp_path, "shot", frame_of(scene_of()), image, scene_of())
    png = cv2.imread(str(paths[1]), cv2.IMREAD_UNCHANGED)
    assert png is not None and png.dtype == image.pixels.dtype
    assert np.array_equal(png, image.pixels)
    record = json.loads(paths[2].read_text(encoding="utf-8"))["image"]
    assert (record["bits"], record["pattern"], record["black_level"]) == (bits, "RGGB", 64.0)
    assert "not shifted" in record["stored"]


def test_the_sidecar_is_strict_json_with_the_geometry_of_the_step(tmp_path: Path) -> None:
    def refuse(constant: str) -> None:
        raise AssertionError(constant)

    scene = scene_of()
    sensor = Sensor(efficiency=(SpectralCurve(wavelength_nm=(450,), value=(0.6,)),))
    frame = frame_of(scene)
    image = develop(replace(frame, laser_direct=(np.zeros((HEIGHT, WIDTH), np.float32),) * 4), scene, sensor)
    path = write_frame(tmp_path, "s", frame, image, scene, sensor=sensor)[2]
    record = json.loads(path.read_text(encoding="utf-8"), parse_constant=refuse)
    assert np.array_equal(record["camera"]["K"], scene.camera.matrix)
    assert np.array_equal(record["camera"]["T_world_camera"], scene.T_world_camera(3))
    assert record["camera"]["T_world_camera"][1][3] == pytest.approx(0.03)
    assert record["camera"]["distortion"] == [-0.1, 0.01, 0, 1e-3]
    for i, laser in enumerate(record["lasers"]):
        assert laser["name"] == NAMES[i]
        assert np.array_equal(laser["T_world_laser"], scene.T_world_laser(i, 3))
        assert np.array_equal(laser["plane_camera"], scene.laser_plane(i))
    assert Sensor.model_validate(record["sensor"]) == sensor
    assert record["objects"] == ["box"] and "numpy" in record["versions"]


def test_names_that_differ_stay_apart_as_file_names() -> None:
    names = ["a.b", "a%2Eb", "a/b", "a\\b", "..", "~", "%7E", "x" * 99, "x" * 100, "ü" * 100, "ü" * 99 + "u", "\0", ""]
    safe = [safe_name(name) for name in names]
    assert len(set(safe)) == len(names)
    assert not any(set(name) & set("./\\\0: ") for name in safe) and max(map(len, safe)) <= 80


def test_a_stem_cannot_leave_the_folder(tmp_path: Path) -> None:
    folder = tmp_path / "out"
    for path in write_frame(folder, "../../etc/x", frame_of(scene_of()), None, scene_of()):
        assert path.parent == folder and path.exists()
        assert same_bits(read_frame(path), frame_of(scene_of()))


@pytest.mark.parametrize("suffix", [".exr", ".json"])
@pytest.mark.parametrize("damage", ["missing", "empty", "half", "one byte", "noise"])
def test_a_damaged_file_is_refused_by_name(written: list[Path], suffix: str, damage: str) -> None:
    path = next(path for path in written if path.suffix == suffix)
    content = bytearray(path.read_bytes())
    if damage == "missing":
        path.unlink()
    elif damage == "one byte":
        content[0 if suffix == ".json" else len(content) // 2] ^= 0xFF
        path.write_bytes(content)
    else:
        kept = {"empty": b"", "half": content[: len(content) // 2], "noise": np.random.default_rng(3).bytes(999)}
        path.write_bytes(kept[damage])
    with pytest.raises(InputError, match=f"frame_0003{suffix}"):
        read_frame(written[0])


def mutilations() -> dict[str, Any]:
    def at(*keys: Any, value: Any = None, remove: bool = False) -> Any:
        def change(record: Any) -> Any:
            place = record
            for key in keys[:-1]:
                place = place[key]
            if remove:
                del place[keys[-1]]
            else:
                place[keys[-1]] = value
            return record

        return change

    curve = ("lasers", 1, "curve")
    return {
        "a list": lambda record: [record],
        "newer": at("format_version", value=4),
        "another format": at("format", value="project"),
        "no step": at("step", remove=True),
        "step of text": at("step", value="third"),
        "step too large": at("step", value=[]),
        "no lasers": at("lasers", value=7),
        "laser without layer": at("lasers", 0, "layer", remove=True),
        "unknown layer": at("lasers", 0, "layer", value="laser.red.direct.Y"),
        "short column": at(*curve, "depth_z", value=[1.0]),
        "wrong width": at(*curve, "point", value=[1.0, 2.0]),
        "text in a column": at(*curve, "depth_z", value=["a"] * 5),
        "fractional index": at(*curve, "index", value=[0.5, 1, 2, 3, 4]),
        "huge index": at(*curve, "index", value=[2**40, 1, 2, 3, 4]),
        "wrong axis": at("lasers", 1, "axis", value="diagonal"),
        "plan without steps": at("plan", "steps", value=7),
        "step without reason": at("plan", "steps", 0, "reason", value="because"),
        "plan of sentences": at("plan", value="direct: all of it"),
        "quality of no group": at("quality", 0, "group", value="laser"),
        "quality of text": at("quality", 0, "work", value="much"),
        "no quality": at("quality", remove=True),
        "counts of text": at("counts", value="many"),
        "count of no kind": at("counts", 0, "kind", value="relative error"),
        "count of no laser": at("counts", 0, "laser", value=-1),
    }


def test_a_frame_of_before_does_not_know_what_the_sheet_adds(written: list[Path]) -> None:
    record = json.loads(written[2].read_text(encoding="utf-8"))
    del record["lasers"][1]["curve"]["sheet_bias"]
    curve = curves_from(record)[1]
    np.testing.assert_array_equal(curve.sheet_bias, np.full(len(curve.index), np.nan))


@pytest.mark.parametrize("name", mutilations())
def test_a_wrong_description_is_refused_by_name(written: list[Path], name: str) -> None:
    record = mutilations()[name](json.loads(written[2].read_text(encoding="utf-8")))
    with contextlib.suppress(AttributeError, TypeError):
        record = sealed(record)  # as if it had been written so
    written[2].write_text(json.dumps(record), encoding="utf-8")
    with pytest.raises(InputError, match=r"frame_0003\.json"):
        read_frame(written[2])


@pytest.mark.parametrize("change", ["truth", "pose", "step", "no seal", "NaN"])
def test_a_description_changed_since_it_was_written_is_refused(written: list[Path], change: str) -> None:
    record = json.loads(written[2].read_text(encoding="utf-8"))
    written[2].write_text(json.dumps(record, indent=3), encoding="utf-8")
    assert same_bits(read_frame(written[2]), frame_of(scene_of())), "blanks are no change"
    match change:
        case "truth":
            record["lasers"][1]["curve"]["depth_z"][0] += 0.001
        case "pose":
            record["camera"]["T_world_camera"][0][3] += 0.1
        case "step":
            record["step"] += 1
        case "no seal":
            del record["record_sha256"]
        case "NaN":
            record["lasers"][1]["curve"]["position"][0] = float("nan")
    written[2].write_text(json.dumps(record), encoding="utf-8")
    with pytest.raises(InputError, match=r"frame_0003\.json: the frame's description was changed.*render the"):
        read_frame(written[0])


def test_an_image_of_another_frame_is_refused_before_it_is_read(
    written: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """3 GB of nothing, say: its checksum takes no memory."""
    read = []

    def reading(path: Path, most: int, what: str) -> bytes:
        read.append(path.suffix)
        return read_bytes(path, most, what)

    monkeypatch.setattr(render.output.frame_files, "read_bytes", reading)
    with open(written[0], "r+b") as file:
        file.truncate(1 << 20)
    with pytest.raises(InputError, match="of another frame"):
        read_frame(written[0])
    assert read == [".json"]


def test_no_message_about_a_damaged_frame_is_in_a_librarys_words(written: list[Path]) -> None:
    for path in (written[0], written[2]):
        whole = path.read_bytes()
        for content in damaged_copies(whole, 60, seed=17):
            path.write_bytes(content)
            try:
                decode_exr(content, str(path))  # as for a photograph, which has no checksum
            except InputError as error:
                assert str(path) in str(error) and not PROGRAM_WORDS.search(str(error)), error
            try:
                read_frame(path)
            except InputError as error:
                assert "frame_0003" in str(error) and not PROGRAM_WORDS.search(str(error)), error
        path.write_bytes(whole)


def test_an_exr_of_many_pixels_or_parts_is_refused_before_they_are_made(written: list[Path]) -> None:
    content = bytearray(written[0].read_bytes())
    at = content.index(b"dataWindow\0box2i\0") + 21
    struct.pack_into("<4i", content, at, 0, 0, 2**20, 2**20)
    with pytest.raises(InputError, match=r"too big, or damaged; found 1048577 x 1048577 pixels"):
        decode_exr(bytes(content), "a.exr")
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    pixels = np.ones((4, 4), np.float32)
    parts = [OpenEXR.Part({**header, "name": name}, {"Y": pixels}, name) for name in ("first", "second")]
    stream = io.BytesIO()
    OpenEXR.File(parts).write(stream)
    with pytest.raises(InputError, match=r"b\.exr: the EXR has several parts; found 2; allowed: one; save each part"):
        decode_exr(stream.getvalue(), "b.exr")


def test_the_sidecar_of_another_frame_is_refused(tmp_path: Path, written: list[Path]) -> None:
    frame = frame_of(scene_of())
    frame.laser_direct[0][5, 5] += 1.0
    other = write_frame(tmp_path / "other", "frame_0003", frame, None, scene_of())
    os.replace(other[0], written[0])
    with pytest.raises(InputError, match="another frame"):
        read_frame(written[0])


def test_a_frame_that_is_not_of_the_scene_or_empty_is_not_written(tmp_path: Path) -> None:
    frame = frame_of(scene_of())
    with pytest.raises(InputError, match="not of this scene"):
        write_frame(tmp_path, "x", frame, None, scene_of(("one",)))
    small = replace(frame, laser_direct=(np.zeros((2, 2), np.float32),) * 4)
    with pytest.raises(InputError, match="not of this scene"):
        write_frame(tmp_path, "x", small, None, scene_of())
    with pytest.raises(InputError, match="empty"):
        write_frame(tmp_path, "x", Frame(0, (), None, (), None, ""), None, scene_of(()))
    assert not list(tmp_path.iterdir())


def test_a_full_disk_is_told_and_leaves_nothing(tmp_path: Path) -> None:
    resource = pytest.importorskip("resource")
    script = f"""
import resource, signal, sys
sys.path[:0] = {[str(Path(__file__).parents[3]), str(Path(__file__).parent)]!r}
from test_frame_files import frame_of, scene_of, write_frame, Path
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, resource.RLIM_INFINITY))
write_frame(Path({str(tmp_path / "out")!r}), "x", frame_of(scene_of()), None, scene_of())
"""
    assert resource.RLIMIT_FSIZE is not None
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1"}
    result = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, env=environment)
    assert "InputError" in result.stderr and "allowed: at most 20 kB a file" in result.stderr
    assert list((tmp_path / "out").iterdir()) == []
