"""Image files: every number type and layout that a camera or an editor may write, and damaged ones."""

from __future__ import annotations

import io
import struct
import zlib
from random import Random
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.mutations.damage import damaged

Image = NDArray[np.uint16]
FORMATS = (
    "png-8", "png-16", "png-1", "png-palette", "png-rgb", "png-rgb-16", "png-rgba", "png-la", "png-animated",
    "png-interlaced", "tiff-8", "tiff-16", "tiff-float", "tiff-nan", "tiff-double", "tiff-signed", "tiff-pages",
    "tiff-cmyk", "tiff-lab", "tiff-lzw", "tiff-32", "jpeg", "jpeg-rgb", "jpeg-cmyk", "jpeg-turned", "bmp", "bmp-1",
    "bmp-palette", "gif", "gif-animated", "webp", "jp2", "pgm", "hdr", "ico", "exr", "exr-half", "exr-rgb",
    "exr-named", "exr-nan", "exr-uint", "svg", "text", "declared", "declared-zero", "bomb", "flat", "saturated",
    "black", "tiny", "narrow", "wide",
)  # fmt: skip
SUFFIX = {
    "jpeg": "jpg",
    **dict.fromkeys(("declared", "bomb", "flat", "saturated", "black", "tiny", "narrow", "wide", "text"), "png"),
}


def mutated(image: Image, rng: Random) -> tuple[str, bytes]:
    """(suffix, content) of an image of some format, half of them damaged."""
    name = rng.choice(FORMATS)
    content = encoded(name, image)
    if rng.random() < 0.5:
        content = damaged(content, rng)
        if content[:4] == b"\x89PNG" and rng.random() < 0.5:
            content = with_checksums(content)
    family = name.split("-")[0]
    suffix = SUFFIX.get(family, family)
    if rng.random() < 0.08:
        suffix = rng.choice(("png", "tiff", "jpg", "bmp", "exr", "gif", "PNG", "tif", "dat"))
    return suffix, content


def encoded(name: str, image: Image) -> bytes:
    """One of FORMATS. image: (h, w) uint16, the line on its darker ground."""
    import cv2
    from PIL import Image as Pillow

    family, _, variant = name.partition("-")
    eight = (image >> max(int(image.max()).bit_length() - 8, 0)).astype(np.uint8)
    if family == "exr":
        return _exr(variant, image)
    grey = Pillow.fromarray(eight)
    rgb = Pillow.merge("RGB", (grey, Pillow.new("L", grey.size, 3), Pillow.new("L", grey.size, 5)))
    same: dict[str, NDArray[Any]] = {
        "flat": np.full_like(image, 7), "saturated": np.full_like(image, 65535), "black": np.zeros_like(image),
        "tiny": image[:1, :1], "narrow": image[:, :3], "wide": image[:2],
    }  # fmt: skip
    arrays: dict[str, NDArray[Any]] = {
        "png-16": image, "tiff-16": image, "tiff-float": image.astype(np.float32),
        "tiff-double": image.astype(np.float64), "tiff-signed": image.astype(np.int16) - 300,
        "png-rgb-16": np.stack([image] * 3, axis=2), "jp2": eight, "hdr": _in_colour(image), "pgm": eight,
    }  # fmt: skip
    if name in same or name in arrays or name == "tiff-nan":
        array = {**same, **arrays}.get(name, np.where(image > image.mean(), np.nan, 1.0).astype(np.float32))
        suffix = {"tiff": "tiff", "jp2": "jp2", "hdr": "hdr", "pgm": "pgm"}.get(family, "png")
        return bytes(cv2.imencode(f".{suffix}", array)[1])
    if family == "declared":
        return _declared(30_000 if variant == "" else 0)
    if family == "bomb":
        return _bomb()
    if family == "text":
        return b"this is no image\n"
    if family == "svg":
        return b'<svg xmlns="http://www.w3.org/2000/svg" width="9" height="9"><image href="/etc/passwd"/></svg>'
    flipped = grey.transpose(Pillow.Transpose.FLIP_LEFT_RIGHT)
    turned = Pillow.Exif()
    turned[0x0112] = 6
    chosen: dict[str, tuple[Any, str, dict[str, Any]]] = {
        "png-8": (grey, "PNG", {}), "png-1": (grey.convert("1"), "PNG", {}),
        "png-palette": (rgb.convert("P"), "PNG", {}), "png-rgb": (rgb, "PNG", {}),
        "png-rgba": (rgb.convert("RGBA"), "PNG", {}), "png-la": (grey.convert("LA"), "PNG", {}),
        "png-animated": (grey, "PNG", {"save_all": True, "append_images": [flipped]}),
        "png-interlaced": (grey, "PNG", {"optimize": True}), "tiff-8": (grey, "TIFF", {}),
        "tiff-pages": (grey, "TIFF", {"save_all": True, "append_images": [flipped] * 3}),
        "tiff-cmyk": (rgb.convert("CMYK"), "TIFF", {}), "tiff-lab": (Pillow.new("LAB", grey.size), "TIFF", {}),
        "tiff-lzw": (grey, "TIFF", {"compression": "tiff_lzw"}), "tiff-32": (grey.convert("I"), "TIFF", {}),
        "jpeg": (grey, "JPEG", {"quality": 95}), "jpeg-rgb": (rgb, "JPEG", {}),
        "jpeg-cmyk": (rgb.convert("CMYK"), "JPEG", {}), "jpeg-turned": (grey, "JPEG", {"exif": turned}),
        "bmp": (grey, "BMP", {}), "bmp-1": (grey.convert("1"), "BMP", {}),
        "bmp-palette": (rgb.convert("P"), "BMP", {}), "gif": (grey, "GIF", {}),
        "gif-animated": (grey, "GIF", {"save_all": True, "append_images": [flipped]}),
        "webp": (rgb, "WEBP", {"lossless": True}), "ico": (grey, "ICO", {}),
    }  # fmt: skip
    picture, kind, options = chosen[name]
    stream = io.BytesIO()
    picture.save(stream, kind, **options)
    return stream.getvalue()


def exr_channels(content: bytes) -> dict[str, NDArray[Any]]:
    """The channels of an EXR file by name."""
    import OpenEXR

    channels = OpenEXR.File(io.BytesIO(content), separate_channels=True).channels()
    return {name: np.array(channel.pixels) for name, channel in channels.items()}


def exr_file(channels: dict[str, NDArray[Any]]) -> bytes:
    """An EXR file of channels of one size."""
    import OpenEXR

    stream = io.BytesIO()
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {name: np.ascontiguousarray(values) for name, values in channels.items()}).write(stream)
    return stream.getvalue()


def other_channels(content: bytes, rng: Random) -> bytes:
    """A whole EXR file whose channels hold other values, or are lost, added or exchanged."""
    channels = exr_channels(content)
    for _ in range(rng.choice((1, 1, 2))):
        name = rng.choice(sorted(channels))
        values = channels[name]
        change = rng.choice(
            ("nan", "inf", "huge", "negative", "zero", "lose", "exchange", "add", "half", "uint", "crop", "noise")
        )
        odd = {"nan": np.nan, "inf": np.inf, "huge": 3e38, "negative": -1.0, "zero": 0.0}
        if change in odd and values.dtype != np.uint32:
            part = (
                np.ones(values.shape, dtype=bool)
                if rng.random() < 0.5
                else np.indices(values.shape).sum(axis=0) % 7 == 0
            )
            channels[name] = np.where(part, odd[change], values).astype(values.dtype)
        elif change == "lose" and len(channels) > 1:
            del channels[name]
        elif change == "exchange":
            other = rng.choice(sorted(channels))
            channels[name], channels[other] = channels[other], channels[name]
        elif change == "add":
            channels[rng.choice(("extra", "R", "Y", "a.b.c", "laser.x.direct.Y"))] = values.copy()
        elif change == "half" and values.dtype == np.float32:
            channels[name] = np.clip(values, -6e4, 6e4).astype(np.float16)
        elif change == "uint":
            channels[name] = np.nan_to_num(values).astype(np.uint32)
        elif change == "crop":
            channels = {key: array[: max(1, len(array) // 2)] for key, array in channels.items()}
        elif change == "noise" and values.dtype != np.uint32:
            channels[name] = np.frombuffer(rng.randbytes(values.nbytes), dtype=values.dtype).reshape(values.shape)
    return exr_file(channels)


def with_checksums(content: bytes) -> bytes:
    """A PNG whose chunks say what they hold, so that a damaged one is looked into."""
    out, at = content[:8], 8
    while at + 12 <= len(content):
        (length,) = struct.unpack(">I", content[at : at + 4])
        chunk = content[at + 4 : at + 8 + length]
        out += content[at : at + 4] + chunk + struct.pack(">I", zlib.crc32(chunk))
        at += 12 + length
    return out


def _exr(variant: str, image: Image) -> bytes:
    values = image.astype(np.float32) / max(int(image.max()), 1)
    holes = np.where(image > image.mean(), np.nan, values).astype(np.float32)
    return exr_file(
        {
            "": {"Y": values},
            "half": {"Y": values.astype(np.float16)},
            "rgb": dict.fromkeys("RGB", values),
            "named": {"a.Y": values, "b.Y": values},
            "nan": {"Y": holes},
            "uint": {"Y": image.astype(np.uint32)},
        }[variant]
    )


def _in_colour(image: Image) -> NDArray[np.float32]:
    return np.stack([image] * 3, axis=2).astype(np.float32) / 4095


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _declared(side: int) -> bytes:
    """A PNG of a few bytes that says it is of so many pixels a side."""
    header = struct.pack(">IIBBBBB", side, side, 16, 2, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + _chunk(b"IHDR", header)
        + _chunk(b"IDAT", zlib.compress(bytes(99)))
        + _chunk(b"IEND", b"")
    )


def _bomb() -> bytes:
    """A whole PNG of 60 megapixels in 58 kB."""
    side = 7_745
    packer = zlib.compressobj(9)
    row = bytes(side + 1)
    data = b"".join(packer.compress(row) for _ in range(side)) + packer.flush()
    header = struct.pack(">IIBBBBB", side, side, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + _chunk(b"IHDR", header) + _chunk(b"IDAT", data) + _chunk(b"IEND", b"")
