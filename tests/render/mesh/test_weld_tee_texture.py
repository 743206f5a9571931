"""The texture of the tee joint lies where the geometry says, and is the same for the same seed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from render.base.errors import InputError
from render.mesh.texture import load_texture
from render.mesh.weld_tee import section
from render.mesh.weld_tee_texture import weld_tee_mask, weld_tee_texture, write_textures
from render.scene.shape import WeldTee

SHAPE = WeldTee()
SIZE = (512, 256)
V = 1 - (np.arange(SIZE[0]) + 0.5) / SIZE[0]
front = V * section(SHAPE).developed
DESIGN = section(SHAPE)
INNER, OUTER = DESIGN.base_front, DESIGN.base_front + DESIGN.bead_length


def test_the_mask_covers_the_bead_and_a_ground_band_of_the_asked_width_on_each_plate() -> None:
    mask = weld_tee_mask(SHAPE, SIZE)
    assert mask.min() == 0 and mask.max() == 1
    assert (mask[(front > INNER) & (front < OUTER)] == 1).all()
    pixel = DESIGN.developed / SIZE[0]
    for plate in (front < INNER, front > OUTER):
        width = mask[plate].sum(axis=0) * pixel
        assert width.mean() == pytest.approx(SHAPE.ground_band, abs=pixel)
        assert 0.0005 < width.std() < 0.003, "its edge is ragged, not ruled"


def test_rust_is_reddish_the_ground_band_bright_and_the_bead_darker() -> None:
    albedo = weld_tee_texture(SHAPE, SIZE)
    assert albedo.dtype == np.float32 and albedo.shape == (*SIZE, 3)
    rust = albedo[front < INNER - SHAPE.ground_band - 0.006].mean(axis=(0, 1))
    ground = albedo[(front > INNER - SHAPE.ground_band + 0.006) & (front < INNER - 0.001)].mean(axis=(0, 1))
    bead = albedo[(front > INNER + 0.001) & (front < OUTER - 0.001)].mean(axis=(0, 1))
    assert 0.2 < rust[0] < 0.4 and rust[0] > 1.2 * rust[1] > 1.2 * rust[2]
    np.testing.assert_allclose(ground, 0.51, atol=0.02)
    assert (bead > rust[2]).all() and (bead < 0.8 * ground).all()


def test_the_ground_band_is_brushed_along_the_seam() -> None:
    albedo = weld_tee_texture(SHAPE, (512, 512))[..., 1]
    ground = albedo[(np.abs(front - INNER + 0.02) < 0.01)]
    assert np.abs(np.diff(ground, axis=0)).mean() > 5 * np.abs(np.diff(ground, axis=1)).mean()


def test_the_texture_repeats_along_the_seam_without_a_step() -> None:
    albedo = weld_tee_texture(SHAPE, SIZE)
    seam = np.abs(albedo[:, 0] - albedo[:, -1]).mean()
    assert seam < 1.5 * np.abs(np.diff(albedo, axis=1)).mean()


def test_a_seed_decides_the_texture() -> None:
    first = weld_tee_texture(SHAPE, SIZE, seed=5)
    np.testing.assert_array_equal(first, weld_tee_texture(SHAPE, SIZE, seed=5))
    assert not np.array_equal(first, weld_tee_texture(SHAPE, SIZE, seed=6))


def test_a_ground_band_wider_than_the_plates_leaves_no_rust() -> None:
    assert (weld_tee_mask(WeldTee(ground_band=1.0), SIZE) == 1).all()


def test_written_images_read_back_as_the_reflectance(tmp_path: Path) -> None:
    albedo, mask = write_textures(tmp_path / "textures", SHAPE, SIZE)
    read = load_texture(albedo, srgb=True, scale=1.0, where="albedo")
    # Half a step of 8 bit sRGB at its steepest.
    np.testing.assert_allclose(read, weld_tee_texture(SHAPE, SIZE), atol=0.5 / 255 * 2.4)
    read = load_texture(mask, srgb=False, scale=1.0, where="mask")
    np.testing.assert_allclose(read[..., 0], weld_tee_mask(SHAPE, SIZE), atol=0.51 / 255)
    with pytest.raises(InputError):
        write_textures(albedo, SHAPE, SIZE)
