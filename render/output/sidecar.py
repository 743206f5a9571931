"""The JSON beside a frame's images: geometry, exact line, sensor and versions, as plain numbers and arrays.

All units are SI and wavelengths nm. JSON has no NaN: it is written as null, and an infinity as the string "Infinity".
"""

from __future__ import annotations

import hashlib
import json
import platform
from importlib import metadata
from typing import Any
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from render.base.counts import counts_record
from render.base.errors import InputError
from render.frame import Frame, LaserCurve
from render.output.light_record import plan_record, quality_record
from render.scene.scene import Scene
from render.sensor.develop import Image
from render.sensor.sensor import Sensor

Record = dict[str, Any]

FORMAT, FORMAT_VERSION = "blazer-frame", 3
READABLE = (1, 2, FORMAT_VERSION)
"""Version 1 had the kind of a count in its name alone; version 2 the plan in sentences, and quality as counts."""
CURVE_SHAPES: dict[str, tuple[int, ...]] = {
    "index": (-1,),
    "position": (-1,),
    "point": (-1, 3),
    "depth_z": (-1,),
    "depth_range": (-1,),
    "object_id": (-1,),
    "camera_angle": (-1,),
    "laser_angle": (-1,),
    "irradiance": (-1,),
    "segments": (-1, 2, 3),
    "sheet_bias": (-1,),
}
INTEGERS = ("index", "object_id")
SEAL = "record_sha256"
AGAIN = "render the frame again"
PACKAGES = ("blazer-studio", "embreex", "numba", "numpy", "OpenEXR")
LONGEST_NAME = 80


def safe_name(name: str) -> str:
    """A name of any characters as plain ASCII without dots or slashes, for layers and files; one to one."""
    escaped = quote(name, safe="").replace(".", "%2E").replace("~", "%7E")
    if len(escaped) <= LONGEST_NAME:
        return escaped
    return f"{escaped[: LONGEST_NAME - 17]}~{hashlib.sha256(name.encode()).hexdigest()[:16]}"


def laser_layer(name: str) -> str:
    """EXR channel of a laser's direct light."""
    return f"laser.{safe_name(name)}.direct.Y"


def indirect_layer(layer: str) -> str:
    """EXR channel of the same laser's indirect light."""
    return layer.removesuffix("direct.Y") + "indirect.Y"


def sidecar_record(frame: Frame, image: Image | None, scene: Scene, sensor: Sensor | None) -> Record:
    """Everything about a frame but its pixels."""
    camera, step = scene.camera, frame.step
    curves: tuple[LaserCurve | None, ...] = frame.curves or (None,) * len(scene.lasers)
    return {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "versions": _versions(),
        "step": step,
        "plan": plan_record(frame.plan),
        "quality": quality_record(frame.quality),
        "seconds": {name: _plain(value) for name, value in frame.seconds.items()},
        "counts": counts_record(frame.counts, _plain),
        "camera": {
            "width": camera.width,
            "height": camera.height,
            "pixel_centres": "integer coordinates; the image spans -0.5 to width - 0.5",
            "K": _plain(camera.matrix),
            "distortion": list(camera.distortion),
            "pixel_pitch": camera.pixel_pitch,
            "lens": camera.lens.model_dump(mode="json"),
            "T_world_camera": _plain(scene.T_world_camera(step)),
        },
        "lasers": [
            {
                "name": laser.name,
                "layer": laser_layer(laser.name),
                "power": laser.power,
                "wavelength_nm": laser.wavelength_nm,
                "T_world_laser": _plain(scene.T_world_laser(i, step)),
                "plane_camera": _plain(scene.laser_plane(i)),
                "curve": None if curve is None else {name: _plain(getattr(curve, name)) for name in CURVE_SHAPES},
                "axis": None if curve is None else curve.axis,
            }
            for i, (laser, curve) in enumerate(zip(scene.lasers, curves, strict=True))
        ],
        "objects": [item.name for item in scene.visible_objects],
        "image": None if image is None else _image_record(image),
        "sensor": None if sensor is None else sensor.model_dump(mode="json"),
    }


def sealed(record: Record) -> Record:
    """The record with the SHA-256 of its own text, so that a number changed in it later is noticed."""
    entries = {key: value for key, value in record.items() if key != SEAL}
    return {**entries, SEAL: _hash(_lines(entries))}


def sealed_text(record: Record) -> str:
    """The text of the record sealed; half of its making is the numbers of the exact line, which are written once."""
    lines = _lines({key: value for key, value in record.items() if key != SEAL})
    return _joined([*lines, *_lines({SEAL: _hash(lines)})])


def to_text(record: Record) -> str:
    """JSON text, one line for each entry of the record and for each laser."""
    return _joined(_lines(record))


def _lines(record: Record) -> list[str]:
    """Each entry of the record as JSON."""
    lines = []
    for key, value in record.items():
        if key == "lasers" and value:
            text = "[\n" + ",\n".join(json.dumps(one, ensure_ascii=False, allow_nan=False) for one in value) + "\n]"
        else:
            text = json.dumps(value, ensure_ascii=False, allow_nan=False)
        lines.append(f"{json.dumps(key)}: {text}")
    return lines


def _joined(lines: list[str]) -> str:
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _hash(lines: list[str]) -> str:
    return hashlib.sha256(_joined(lines).encode()).hexdigest()


def from_text(text: str, where: str) -> Record:
    """The record in a text. InputError: not JSON, not a frame's sidecar, a newer one, or changed since written."""
    try:
        record = json.loads(text)
    except json.JSONDecodeError as error:
        place = f"{where}, line {error.lineno}, column {error.colno}"
        raise InputError("the frame's description is not JSON", where=place, cure=AGAIN) from None
    except (ValueError, RecursionError):
        reason = "a number too long, or lists nested too deeply"
        raise InputError("the frame's description is not JSON", where=where, found=reason, cure=AGAIN) from None
    if not isinstance(record, dict) or record.get("format") != FORMAT:
        found = record.get("format") if isinstance(record, dict) else type(record).__name__
        raise InputError("not a frame's description", where=where, found=found, allowed=f'"format": "{FORMAT}"')
    if record.get("format_version") not in READABLE:
        found, cure = record.get("format_version"), "open it with the version that wrote it, or a newer one"
        raise InputError(
            "unknown version",
            where=f"{where}: format_version",
            found=found,
            allowed=f"1 to {FORMAT_VERSION}",
            cure=cure,
        )
    if not _is_whole(record):
        allowed = "numbers as they were written together with its image"
        raise InputError("the frame's description was changed or damaged", where=where, allowed=allowed, cure=AGAIN)
    return record


def _is_whole(record: Record) -> bool:
    try:
        return bool(sealed(record)[SEAL] == record.get(SEAL))
    except (TypeError, ValueError):  # NaN, half characters, lists in place of objects
        return False


def curves_from(record: Record) -> tuple[LaserCurve, ...]:
    """The exact line of each laser. KeyError, TypeError, ValueError: the record is damaged."""
    return tuple(_curve(laser) for laser in record["lasers"] if laser["curve"] is not None)


def numbers_from(values: Any) -> dict[str, float]:
    """Named numbers, as `Frame.seconds` has them. AttributeError, TypeError, ValueError: damaged."""
    return {str(name): float("nan") if value is None else float(value) for name, value in values.items()}


def _curve(laser: Record) -> LaserCurve:
    axis, columns = laser["axis"], laser["curve"]
    if axis not in ("rows", "columns"):
        raise ValueError(f"axis {axis!r} is neither rows nor columns")
    # frames of before do not say
    columns = {"sheet_bias": [None] * len(columns["index"])} | columns
    arrays: dict[str, Any] = {name: _array(name, columns[name]) for name in CURVE_SHAPES}
    if len({len(array) for name, array in arrays.items() if name != "segments"}) != 1:
        raise ValueError("the curve's arrays differ in length")
    return LaserCurve(axis=axis, **arrays)


def _array(name: str, values: Any) -> NDArray[Any]:
    dtype = np.int32 if name in INTEGERS else np.float64
    array = np.asarray(values, dtype=dtype).reshape(CURVE_SHAPES[name])
    if name in INTEGERS and not all(type(value) is int for value in values):
        raise ValueError(f"{name} is not of integers")
    return array


def _plain(values: Any) -> Any:
    """A number or array as JSON can hold it."""
    array = np.asarray(values)
    if array.dtype.kind != "f" or np.isfinite(array).all():
        return array.tolist()
    held = array.astype(object)
    held[np.isnan(array)] = None
    held[np.isposinf(array)], held[np.isneginf(array)] = "Infinity", "-Infinity"
    return held.tolist()


def _image_record(image: Image) -> Record:
    return {
        "stored": "PNG, RGB: a photograph, its colours, tone and compression as the camera makes them"
        if image.processed
        else "PNG, 16 bits a pixel where the sensor has more than 8; numbers not shifted; Bayer: raw mosaic",
        "bits": image.bits,
        "gain": image.gain,
        "black_level": image.black_level,
        "saturation": image.saturation,
        "read_noise": image.read_noise,
        "pattern": image.pattern,
    }


def _versions() -> dict[str, str]:
    found = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:  # run from a folder that is not installed
            continue
    return found
