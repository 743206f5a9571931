"""The lists of chains, against plain dictionaries."""

from __future__ import annotations

from collections import defaultdict

import numpy as np
import pytest

from render.laser_indirect import specular_chains
from render.laser_indirect.clear_light import SPACING, unknown_near
from render.laser_indirect.specular_chains import SEEN, listed_by_cell, lit_chains
from render.run import Run
from tests.render.laser_indirect.test_clear_light import BROAD, FACETED_BALL
from tests.render.laser_indirect.test_integrator import setting
from tests.render.laser_indirect.test_manifold_walk import GLASS, GREY, WALL

RAYS, CELL = 3000, 0.1


def test_a_cell_lists_each_chain_that_comes_near_it_once_by_its_first_ray() -> None:
    rng = np.random.default_rng(3)
    seen = np.zeros(RAYS, SEEN)
    seen["facets"] = rng.integers(0, 4, (RAYS, 1)) * np.ones(seen["facets"].shape[1], np.int32)
    seen["o"], seen["ray"] = rng.uniform(-0.5, 0.5, (RAYS, 3)), np.arange(RAYS)
    expected: dict[tuple[int, ...], dict[bytes, int]] = defaultdict(dict)
    for ray in seen:
        low = np.floor(ray["o"] / CELL - 0.5).astype(int)
        for corner in np.ndindex(2, 2, 2):
            expected[tuple(low + corner)].setdefault(ray["facets"].tobytes(), int(ray["ray"]))
    index = listed_by_cell(seen, np.zeros(3), CELL)
    assert len(index.cells) == len(expected)
    assert index.most == max(map(len, expected.values()))
    mask, half = (1 << specular_chains.BITS) - 1, 1 << (specular_chains.BITS - 1)
    for cell, start, stop in zip(index.cells, index.starts, index.starts[1:], strict=False):
        place = tuple(int(cell >> shift & mask) - half for shift in (2 * specular_chains.BITS, specular_chains.BITS, 0))
        listed = {one["facets"].tobytes(): int(one["ray"]) for one in index.seen[start:stop]}
        assert listed == expected[place]


def test_lists_are_the_same_however_their_rays_are_shared_out(monkeypatch: pytest.MonkeyPatch) -> None:
    _, (world, _, laser, _, pose) = setting([WALL, FACETED_BALL], [GREY, GLASS], laser=BROAD)
    found = []
    for chunk, threads in ((1 << 20, 1), (100, 2)):
        monkeypatch.setattr(specular_chains, "RAYS_A_CHUNK", chunk)
        found.append(lit_chains(world, world.surface, laser, pose, Run(threads=threads)))
    assert len(found[0]) == len(found[1]) > 0
    for one, other in zip(*found, strict=True):
        for name in ("facets", "o", "slopes", "ray"):
            assert np.array_equal(one.seen[name], other.seen[name])


def test_pixels_about_what_is_met_are_found_once_up_to_the_edges() -> None:
    rng = np.random.default_rng(5)
    shape = 40, 60
    known = rng.random(shape) < 0.3
    pixels = rng.choice(known.size, 25, replace=False)
    expected = {
        (row, column)
        for pixel in pixels
        for row in range(pixel // 60 - SPACING, pixel // 60 + SPACING + 1)
        for column in range(pixel % 60 - SPACING, pixel % 60 + SPACING + 1)
        if 0 <= row < 40 and 0 <= column < 60 and not known[row, column]
    }
    before, room = known.copy(), np.empty(known.size, np.int64)
    found = room[: unknown_near(pixels, known, room)]
    assert {divmod(int(one), 60) for one in found} == expected
    assert len(found) == len(expected)
    assert known.sum() == before.sum() + len(expected)
