"""Textures arrive as linear reflectance, or with one clear message."""

from __future__ import annotations

import io
import os
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image, ImageFile

import render.mesh.texture
from render.base.errors import InputError
from render.mesh.texture import linear_reflectance, linear_to_srgb, load_texture, srgb_to_linear

CODES = np.random.default_rng(3).integers(0, 256, (5, 7, 3), dtype=np.uint8)


def load(path: Path, *, srgb: bool = True, scale: float = 1.0) -> np.ndarray:
    return load_texture(path, srgb=srgb, scale=scale, where="object 'part': material.albedo.path")


def test_the_srgb_curve_has_the_values_of_the_standard_and_inverts() -> None:
    # IEC 61966-2-1: the toe meets the power law at 0.04045, and mid grey 0.5 is 0.2140 linear.
    assert srgb_to_linear(np.array(0.5)) == pytest.approx(0.21404, abs=1e-5)
    below, above = srgb_to_linear(np.array([0.04045, 0.0404501]))
    assert above - below == pytest.approx(0, abs=1e-7)
    values = np.linspace(0, 1, 1001)
    np.testing.assert_allclose(linear_to_srgb(srgb_to_linear(values)), values, atol=1e-6)


@pytest.mark.parametrize("bits", [8, 16])
def test_codes_span_zero_to_one(bits: int) -> None:
    codes = np.array([0, 2**bits - 1], dtype=f"uint{bits}")
    for srgb in (True, False):
        np.testing.assert_array_equal(linear_reflectance(codes, srgb=srgb), [0, 1])


@pytest.mark.parametrize("suffix", ["png", "bmp", "tiff", "webp"])
def test_an_image_is_decoded_in_rgb_with_row_0_at_the_top(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a.{suffix}"
    Image.fromarray(CODES).save(path, **({"lossless": True} if suffix == "webp" else {}))
    texture = load(path)
    assert texture.dtype == np.float32 and texture.flags.c_contiguous
    np.testing.assert_allclose(texture, srgb_to_linear(CODES / 255), atol=1e-7)
    np.testing.assert_allclose(load(path, srgb=False, scale=0.5), CODES / 255 * 0.5, atol=1e-7)


def test_sixteen_bits_are_kept(tmp_path: Path) -> None:
    codes = np.random.default_rng(4).integers(0, 65536, (4, 6, 3), dtype=np.uint16)
    cv2.imwrite(str(tmp_path / "a.png"), codes[:, :, ::-1])
    np.testing.assert_allclose(load(tmp_path / "a.png", srgb=False), codes / 65535, atol=1e-7)


def test_grey_becomes_rgb_and_alpha_is_dropped(tmp_path: Path) -> None:
    Image.fromarray(CODES[..., 0]).save(tmp_path / "grey.png")
    grey = load(tmp_path / "grey.png", srgb=False)
    np.testing.assert_allclose(grey, np.repeat(CODES[..., :1] / 255, 3, axis=2), atol=1e-7)
    Image.fromarray(np.dstack([CODES, CODES[..., 0]])).save(tmp_path / "alpha.png")
    np.testing.assert_allclose(load(tmp_path / "alpha.png", srgb=False), CODES / 255, atol=1e-7)


def test_a_camera_s_orientation_tag_does_not_turn_a_texture(tmp_path: Path) -> None:
    exif = Image.Exif()
    exif[0x0112] = 6
    Image.fromarray(CODES).save(tmp_path / "a.jpg", exif=exif)
    assert load(tmp_path / "a.jpg").shape == (5, 7, 3)


def test_a_texture_that_is_absent_or_a_folder_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"object 'part': material\.albedo\.path: the texture is not there.*rust\.png"):
        load(tmp_path / "rust.png")
    with pytest.raises(InputError, match="the texture is a folder"):
        load(tmp_path)


@pytest.mark.parametrize("suffix", ["png", "jpg", "tiff", "bmp"])
def test_an_image_cut_short_anywhere_is_told(tmp_path: Path, suffix: str, monkeypatch: pytest.MonkeyPatch) -> None:
    # as WeasyPrint leaves it
    monkeypatch.setattr(ImageFile, "LOAD_TRUNCATED_IMAGES", True)
    path = tmp_path / f"a.{suffix}"
    Image.fromarray(np.random.default_rng(5).integers(0, 256, (40, 40, 3), dtype=np.uint8)).save(path)
    data = path.read_bytes()
    for share in (0.0, 0.01, 0.3, 0.8):
        path.write_bytes(data[: int(len(data) * share)])
        with pytest.raises(InputError, match=f"a.{suffix}: the texture cannot be read"):
            load(path)


def test_text_is_not_an_image(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_text("rust")
    with pytest.raises(InputError, match=r"cannot be read.*allowed: a whole PNG"):
        load(tmp_path / "a.png")


def test_an_image_with_too_many_pixels_is_told_before_it_is_decoded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Image.fromarray(CODES).save(tmp_path / "a.png")
    monkeypatch.setattr(render.mesh.texture, "MAX_PIXELS", 34)
    with pytest.raises(InputError, match="7 x 5 pixels; allowed: at most 34"):
        load(tmp_path / "a.png")


def test_mutated_images_give_a_texture_or_a_message() -> None:
    buffer = io.BytesIO()
    Image.fromarray(CODES).save(buffer, format="png")
    data = bytearray(buffer.getvalue())
    random = np.random.default_rng(6)
    for _ in range(200):
        mutated = bytearray(data)
        for place in random.integers(0, len(data), 3):
            mutated[place] = random.integers(0, 256)
        try:
            texture = render.mesh.texture.decode_texture(bytes(mutated), srgb=True, scale=1.0, where="x")
        except InputError:
            continue
        assert texture.ndim == 3 and texture.shape[2] == 3 and np.isfinite(texture).all()


def test_an_image_of_several_pages_is_refused(tmp_path: Path) -> None:
    pages = [Image.fromarray(np.full((4, 4), value, dtype=np.uint8)) for value in (0, 200)]
    for name in ("a.tiff", "a.gif", "a.png"):
        pages[0].save(tmp_path / name, save_all=True, append_images=pages[1:])
        with pytest.raises(
            InputError, match=rf"{name}: the image has several pages; found 2; allowed: one; save the one"
        ):
            load(tmp_path / name)


def test_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.png")
    with pytest.raises(InputError, match=r"pipe\.png: the texture is not a regular file"):
        load(tmp_path / "pipe.png")
