"""A frame of which a band is kept: the same inside, means of blocks outside, and it says so."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from render.output.band import BLOCK, HALF_WIDTH, band_about, block_means
from render.output.frame_files import read_frame, write_frame
from tests.render.output.test_frame_files import frame_of, scene_of


def test_a_band_reaches_as_far_on_either_side_of_each_point_and_no_farther() -> None:
    points = (np.array([20.0, 20.0, np.nan]), np.array([100.2, 3.0, 50.0]))
    band = band_about((40, 300), "rows", [points])
    inside = np.flatnonzero(band[20])
    near_edge, far = inside[inside < 60], inside[inside >= 60]
    assert near_edge[0] == 0 and near_edge[-1] == 3 + HALF_WIDTH
    assert far[0] == 100 - HALF_WIDTH and far[-1] == 100 + HALF_WIDTH
    assert band[18].any() and band[22].any() and not band[17].any() and not band[23].any()
    assert np.array_equal(band_about((300, 40), "columns", [points]), band.T)


def test_means_of_blocks_hold_the_light_of_each_block_also_where_the_image_cuts_it() -> None:
    light = np.random.default_rng(1).random((3 * BLOCK + 5, 2 * BLOCK + 3, 3)).astype(np.float32)
    means = block_means(light, np.ones(light.shape[:2], bool))
    for rows in (slice(0, BLOCK), slice(3 * BLOCK, None)):
        for columns in (slice(BLOCK, 2 * BLOCK), slice(2 * BLOCK, None)):
            block = light[rows, columns].reshape(-1, 3)
            assert np.allclose(means[rows, columns].reshape(-1, 3), block.mean(axis=0, dtype=np.float64), rtol=1e-6)


def test_inside_the_band_no_bit_differs_and_outside_it_is_told(tmp_path: Path) -> None:
    scene = scene_of()
    frame = frame_of(scene)
    band = np.zeros(frame.shape, bool)
    band[5:30, 10:50] = True
    write_frame(tmp_path, "frame", frame, None, scene, band=band)
    read = read_frame(tmp_path / "frame.json")
    assert frame.truth is not None and read.truth is not None
    pairs = [
        *zip(frame.laser_direct, read.laser_direct, strict=True),
        (frame.ambient, read.ambient),
        (frame.truth.depth_z, read.truth.depth_z),
        (frame.truth.normal, read.truth.normal),
        (frame.truth.object_id, read.truth.object_id),
    ]
    for before, after in pairs:
        assert before[band].tobytes() == after[band].tobytes()
    assert np.isnan(read.truth.depth_z[~band]).all() and (read.truth.object_id[~band] == -1).all()
    assert np.array_equal(read.ambient[~band], block_means(frame.ambient, ~band)[~band], equal_nan=True)
    assert [curve.position.tobytes() for curve in read.curves] == [curve.position.tobytes() for curve in frame.curves]
    (told,) = read.warnings
    assert f"{band.mean():.0%}" in told
