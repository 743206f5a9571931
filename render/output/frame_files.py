"""A frame on disk: an OpenEXR of named layers, a PNG as the sensor sees it, and a JSON sidecar.

    laser.<name>.direct.Y    radiance of one laser, W/(m^2 sr)          position.X/Y/Z   m, world frame
    ambient.R/G/B            radiance in bands, W/(m^2 sr)              normal.X/Y/Z     unit, world frame
    depth_z.Z, depth_range.Z m                                          object_id.Y      uint32, 2^32 - 1 for none

All layers are float32 but the object's, compressed without loss (ZIP). The sidecar is written last and holds the EXR's
SHA-256 and its own, so that a set of files of two frames, of half a frame, or with a number changed since, is never
read as one.
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from render.base.counts import OF_GROUPS, counts_from
from render.base.errors import InputError
from render.base.files import atomic_write, check_regular, read_bytes, sha256
from render.frame import Frame, Truth
from render.output.band import BLOCK, coarse_outside, told
from render.output.exr import decode_exr, encode_exr
from render.output.light_record import plan_from, quality_from, quality_of_counts
from render.output.sidecar import (
    AGAIN,
    Record,
    curves_from,
    from_text,
    indirect_layer,
    laser_layer,
    numbers_from,
    safe_name,
    sealed_text,
    sidecar_record,
)
from render.plan import Plan
from render.scene.scene import Scene
from render.sensor.develop import Image
from render.sensor.sensor import Sensor

Layers = dict[str, NDArray[Any]]

TRUTH_LAYERS = {
    "depth_z": ("depth_z.Z",),
    "depth_range": ("depth_range.Z",),
    "position": ("position.X", "position.Y", "position.Z"),
    "normal": ("normal.X", "normal.Y", "normal.Z"),
}
AMBIENT_LAYERS = ("ambient.R", "ambient.G", "ambient.B")
OBJECT_LAYER = "object_id.Y"
AS_FIELDS = 3
"""The first version of the sidecar that holds plan and quality as fields, not as sentences and counts."""
COUNTED_BY_GROUPS = {quantity.what for quantities in OF_GROUPS.values() for quantity in quantities.values()}
"""What versions before that held as counts, and quality has now."""
MAX_SIDECAR_BYTES, MAX_EXR_BYTES = 2**28, 2**32


def write_frame(
    folder: Path,
    stem: str,
    frame: Frame,
    image: Image | None,
    scene: Scene,
    *,
    sensor: Sensor | None = None,
    made_of: dict[str, Any] | None = None,
    band: NDArray[np.bool_] | None = None,
) -> list[Path]:
    """Write stem.exr, stem.png (with an image) and stem.json into the folder; the paths, in that order.

    made_of: what decides the frame's numbers, for the sidecar. band (h, w): all that is kept of its pixels; elsewhere
    it is coarse (`render.output.band`), which the sidecar says and `read_frame` warns of. Characters of the stem and of
    the lasers' names that do not suit a file or a layer are percent-encoded.
    Raises InputError: a file cannot be written, the frame is empty or not of this scene.
    """
    name = safe_name(stem)
    layers = _layers(frame if band is None else coarse_outside(frame, band), scene)
    written = []
    exr = encode_exr(layers)
    written.append(_write(folder / f"{name}.exr", exr))
    if image is not None:
        written.append(_write(folder / f"{name}.png", encode_png(image.pixels)))
    record = {
        **sidecar_record(frame, image, scene, sensor),
        "ambient": frame.ambient is not None,
        "truth": frame.truth is not None,
        "made_of": made_of,
        "band": None if band is None else {"share": float(np.mean(band)), "block": BLOCK},
        "exr_sha256": hashlib.sha256(exr).hexdigest(),
    }
    written.append(_write(folder / f"{name}.json", sealed_text(record).encode()))
    return written


def read_frame(path: Path | str) -> Frame:
    """The frame of a pair of EXR and JSON; path is that of either. Equal bit for bit to the one written.

    Raises InputError: a file is missing, damaged, of a newer version, or not of the same frame as the other.
    """
    sidecar, exr = Path(path).with_suffix(".json"), Path(path).with_suffix(".exr")
    try:
        text = read_bytes(sidecar, MAX_SIDECAR_BYTES, "frame's description").decode()
    except UnicodeDecodeError:
        raise InputError("the frame's description is not UTF-8 text", where=str(sidecar), cure=AGAIN) from None
    record = from_text(text, str(sidecar))
    check_regular(exr, MAX_EXR_BYTES, "frame's image")
    if sha256(exr) != record.get("exr_sha256"):  # before it is read: the wrong file may be of any size
        allowed = f"the file written together with {sidecar.name}"
        raise InputError("the image is damaged or of another frame", where=str(exr), allowed=allowed, cure=AGAIN)
    layers = decode_exr(read_bytes(exr, MAX_EXR_BYTES, "frame's image"), str(exr))
    try:
        return _frame(record, layers)
    except (AttributeError, KeyError, OverflowError, TypeError, ValueError):
        allowed = "step, plan, quality, seconds, counts, and lasers with layer, curve and axis"
        where = str(sidecar)
        raise InputError("the frame's description is damaged", where=where, allowed=allowed, cure=AGAIN) from None


def _layers(frame: Frame, scene: Scene) -> Layers:
    if len(frame.laser_direct) != len(scene.lasers) or len(frame.curves) not in (0, len(scene.lasers)):
        found = f"{len(frame.laser_direct)} laser images, {len(frame.curves)} curves"
        raise InputError("the frame is not of this scene", where="frame", found=found, allowed=f"{len(scene.lasers)}")
    layers = {laser_layer(laser.name): light for laser, light in zip(scene.lasers, frame.laser_direct, strict=True)}
    if frame.laser_indirect:
        pairs = zip(scene.lasers, frame.laser_indirect, strict=True)
        layers |= {indirect_layer(laser_layer(laser.name)): light for laser, light in pairs}
    if frame.ambient is not None:
        layers |= {layer: frame.ambient[..., i] for i, layer in enumerate(AMBIENT_LAYERS)}
    if frame.truth is not None:
        for name, parts in TRUTH_LAYERS.items():
            values = getattr(frame.truth, name)
            layers |= {layer: values[..., i] if len(parts) > 1 else values for i, layer in enumerate(parts)}
        layers[OBJECT_LAYER] = frame.truth.object_id.astype(np.int32).view(np.uint32)
    if not layers:
        raise InputError("the frame is empty", where="frame", allowed="at least one laser, ambient light or truth")
    shapes = {values.shape for values in layers.values()}
    if shapes != {(scene.camera.height, scene.camera.width)}:
        allowed = f"{scene.camera.width} x {scene.camera.height} px"
        raise InputError("the frame is not of this scene", where="frame", found=f"arrays of {shapes}", allowed=allowed)
    return layers


def _frame(record: Record, layers: Layers) -> Frame:
    names = [laser["layer"] for laser in record["lasers"]]
    truth = None
    if record["truth"]:
        parts = {name: [layers[layer] for layer in names] for name, names in TRUTH_LAYERS.items()}
        arrays = {name: np.stack(found, axis=-1) if len(found) > 1 else found[0] for name, found in parts.items()}
        truth = Truth(**arrays, object_id=layers[OBJECT_LAYER].view(np.int32))
    lasers = [str(laser["name"]) for laser in record["lasers"]]
    counts = counts_from(record["counts"], lasers)
    if record["format_version"] < AS_FIELDS:
        plan = Plan(text=tuple(record["plan"].splitlines()))
        quality = quality_of_counts(counts, lasers, (record.get("made_of") or {}).get("targets", {}))
        counts = {quantity: value for quantity, value in counts.items() if quantity.what not in COUNTED_BY_GROUPS}
    else:
        plan, quality = plan_from(record["plan"]), quality_from(record["quality"])
    return Frame(
        step=int(record["step"]),
        laser_direct=tuple(layers[name] for name in names),
        laser_indirect=tuple(layers[indirect_layer(name)] for name in names if indirect_layer(name) in layers),
        ambient=np.stack([layers[layer] for layer in AMBIENT_LAYERS], axis=-1) if record["ambient"] else None,
        curves=curves_from(record),
        truth=truth,
        plan=plan,
        quality=quality,
        warnings=(told(float(record["band"]["share"])),) if record.get("band") is not None else (),
        seconds=numbers_from(record["seconds"]),
        counts=counts,
    )


def black_in_viewers(bits: int) -> str:
    """What a person is to know of PNGs with numbers of so many bits; empty: nothing, they fill the file's."""
    if bits in (8, 16):
        return ""
    return (
        f"{bits}-bit numbers, 0 to {2**bits - 1}, in PNGs of 16 bits: they are the sensor's own, and ordinary viewers, "
        "which take 65535 for white, show them almost black"
    )


def encode_png(pixels: NDArray[np.uint8] | NDArray[np.uint16]) -> bytes:
    """The bytes of a PNG file of (h, w) pixels. InputError: it cannot be one."""
    import cv2

    ordered = pixels if pixels.ndim == 2 else pixels[..., ::-1]
    # OpenCV's own choice, run lengths of differences, takes half the time of any other; noise hardly shrinks further
    done, encoded = cv2.imencode(".png", ordered)
    if not done:
        raise InputError("the image cannot be encoded as PNG", where="image", found=f"{pixels.shape} {pixels.dtype}")
    return encoded.tobytes()


def _write(path: Path, content: bytes | memoryview) -> Path:
    with atomic_write(path) as temporary:
        temporary.write_bytes(content)
    return path
