"""OpenEXR files in memory, read within stated limits."""

from __future__ import annotations

import io
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from render.base.errors import InputError

MAX_VALUES = 2**30
"""Of all channels together; 4 GB as float32, some twenty layers of a 50 Mpx frame."""


def encode_exr(layers: Mapping[str, NDArray[Any]]) -> memoryview:
    """The bytes of an EXR of (h, w) channels by name: float32, or uint32 where they are so.

    Through memory: the library's own file writing says nothing of a full disk.
    """
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    channels = {
        name: np.ascontiguousarray(values, dtype=values.dtype if values.dtype == np.uint32 else np.float32)
        for name, values in layers.items()
    }
    stream = io.BytesIO()
    OpenEXR.File(header, channels).write(stream)
    return stream.getbuffer()


def decode_exr(content: bytes, where: str, most: int = MAX_VALUES) -> dict[str, NDArray[Any]]:
    """The channels of an EXR by name, (h, w) each.

    InputError: damaged, of several parts, or of more than `most` values, which its header tells before they are made.
    """
    import OpenEXR

    try:
        header = OpenEXR.File(io.BytesIO(content), header_only=True)
        low, high = header.header()["dataWindow"]
        width, height = (int(last) - int(first) + 1 for first, last in zip(low, high, strict=True))
        parts, channels = len(header.parts), len(header.header()["channels"])
    except MemoryError:
        raise
    except Exception as error:  # the library raises several kinds on damaged data, in words of its own
        raise _damaged(where, "no header of an EXR") from error
    if parts > 1:
        cure = "save each part as an image of its own"
        raise InputError("the EXR has several parts", where=where, found=parts, allowed="one", cure=cure)
    if width < 1 or height < 1 or width * height * channels > most:
        found = f"{width} x {height} pixels of {channels} channels"
        raise InputError("the EXR is too big, or damaged", where=where, found=found, allowed=f"1 to {most} values")
    try:
        layers = OpenEXR.File(io.BytesIO(content), separate_channels=True).channels()
        return {name: np.ascontiguousarray(channel.pixels) for name, channel in layers.items()}
    except MemoryError:
        raise
    except Exception as error:
        raise _damaged(where, "pixels that are cut short or damaged") from error


def _damaged(where: str, found: str) -> InputError:
    return InputError("the EXR cannot be read", where=where, found=found, allowed="a whole, valid file")
