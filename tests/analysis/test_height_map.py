"""Heights on a grid: exact on planes, with the sigma that repeated clouds show, and nothing over a gap."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from analysis.cloud import Cloud
from analysis.height_map import HEIGHT, UNMEASURED, HeightMap, decoded, encoded, height_map, within
from render.base.errors import InputError

ROWS, STEPS, SIGMA = 40, 12, 2e-5


def scan(length: float = 1.0) -> Cloud:
    """Scan lines 0.3 mm apart, slanted in y, and steps of 1 mm."""
    row, step = (one.ravel() for one in np.meshgrid(np.arange(ROWS), np.arange(STEPS)))
    x, y = 3e-4 * row, 1e-3 * step + 1e-5 * row
    z = 0.1 + 0.2 * x - 0.3 * y
    return {
        "x": x, "y": y, "z": z, "sigma_random": np.full(len(x), SIGMA),
        "correlation_length": np.full(len(x), length), "row": row.astype(np.int32),
        "laser": np.zeros(len(x), dtype=np.int32), "step": step.astype(np.int32),
    }  # fmt: skip


def places(made: HeightMap) -> tuple[np.ndarray, np.ndarray]:
    rows, columns = made.heights.shape
    x = made.x + made.pitch * np.arange(columns)
    y = made.y - made.pitch * np.arange(rows)
    return np.meshgrid(x, y)


def test_a_plane_stays_a_plane_and_has_a_cell_for_each_point() -> None:
    made = height_map(scan())
    x, y = places(made)
    known = np.isfinite(made.heights)
    assert known.sum() == pytest.approx(ROWS * STEPS, rel=0.1)
    assert np.abs(made.heights - (0.1 + 0.2 * x - 0.3 * y))[known].max() < 1e-12


def test_a_hole_along_a_profile_has_no_heights_however_far_apart_the_steps_are() -> None:
    """Over a groove whose bottom the last step did not see, flank was joined to flank: 6 mm too high."""
    cloud, middle = scan(), 3e-4 * ROWS / 2
    wide = cloud | {"y": 5.0 * cloud["y"], "z": np.abs(cloud["x"] - middle)}
    seen = (wide["step"] < STEPS - 1) | (np.abs(wide["row"] - ROWS / 2) > 10)
    made = height_map({name: column[seen] for name, column in wide.items()}, 3e-4)
    x, y = places(made)
    known, last = np.isfinite(made.heights), np.abs(y - 5e-3 * (STEPS - 1)) < 4e-4
    assert not known[last & (np.abs(x - middle) < 2e-3)].any() and known[last & (np.abs(x - middle) > 4e-3)].any()
    assert known[np.abs(y - 5e-3 * (STEPS - 2)) < 4e-4].mean() > 0.9
    assert np.abs(made.heights - np.abs(x - middle))[known].max() < 1.5e-3


@pytest.mark.parametrize("pitch", [None, 2e-4, 1.3e-3])
def test_every_point_of_a_plane_is_in_a_cell_with_a_height_in_the_first_and_the_last_scan_line_too(
    pitch: float | None,
) -> None:
    """Scan lines waver by micrometres, and the cells of the first lay beside all triangles: its column was empty."""
    row, step = (one.ravel() for one in np.meshgrid(np.arange(150), np.arange(6)))
    x, y = 8e-3 * step + 1e-5 * np.sin(7.0 * row + step), 5e-4 * row
    z = 0.1 + 0.2 * x - 0.3 * y
    cloud = {"x": x, "y": y, "z": z, "sigma_random": np.full(len(x), SIGMA), "row": row, "step": step}
    made = height_map(cloud | {"laser": np.zeros(len(x), dtype=np.int32), "correlation_length": np.ones(len(x))}, pitch)
    assert made.points_without == made.points_steep == made.steep == 0
    x, y = places(made)
    known = np.isfinite(made.heights)
    assert known[:-1].all() and np.abs(made.heights - (0.1 + 0.2 * x - 0.3 * y))[known].max() < 1e-9
    assert made.unmeasured == np.count_nonzero(~known), "beyond the end of the scan lines, between two of them"
    assert made.x < 1e-4 and x.max() > 40e-3 - 0.51 * made.pitch


@pytest.mark.parametrize("length", [1.0, 4.0])
def test_sigma_and_correlation_of_cells_are_those_of_repeated_clouds(length: float) -> None:
    cloud, trials = scan(length=length), 40
    r = (length - 1.0) / (length + 1.0)
    rng = np.random.default_rng(3)
    drawn = []
    for _ in range(trials):
        noise = rng.standard_normal((STEPS, ROWS))
        for k in range(1, ROWS):
            noise[:, k] = r * noise[:, k - 1] + np.sqrt(1.0 - r**2) * noise[:, k]
        noisy = cloud | {"z": cloud["z"] + SIGMA * noise.ravel()}
        drawn.append(height_map(noisy, 4e-4).heights)
    made, errors = height_map(cloud, 4e-4), np.array(drawn)
    errors = errors - made.heights
    spread = np.sqrt((errors**2).mean(axis=0))
    # the median over eight hundred cells that hang together: as sharp as fifty of them at least
    slack = chi2.ppf([1e-4, 1.0 - 1e-4], 50 * trials) / (50 * trials)
    ratio = np.nanmedian(spread) ** 2 / made.sigma_cells**2
    assert slack[0] < ratio < slack[1]
    beside = (errors[:, :, :-1] * errors[:, :, 1:]).mean(axis=0) / (spread[:, :-1] * spread[:, 1:])
    assert np.nanmedian(beside) == pytest.approx(made.correlation, abs=0.05)
    assert made.sigma_points == SIGMA and made.sigma_cells < SIGMA


def test_nothing_is_made_up_over_a_gap() -> None:
    cloud = scan()
    kept = (cloud["step"] < 4) | (cloud["step"] > 9)
    made = height_map({name: column[kept] for name, column in cloud.items()}, 4e-4)
    _, y = places(made)
    inside = (y > 4.2e-3) & (y < 8.8e-3)
    assert made.unmeasured >= inside.sum() and made.steep == 0
    assert np.isnan(made.heights[inside]).all() and np.isfinite(made.heights[y < 2.5e-3]).mean() > 0.9


def test_numbers_give_heights_within_half_a_level_and_the_same_numbers_again() -> None:
    rng = np.random.default_rng(5)
    heights = rng.normal(0.85, 0.01, (40, 30))
    heights[3:5, 7:20] = np.nan
    numbers, scale, offset = encoded(heights)
    again = decoded(numbers, scale, offset)
    assert np.array_equal(np.isnan(again), np.isnan(heights)) and numbers.max() > 65000
    assert np.nanmax(np.abs(again - heights)) <= 0.5 * scale * (1.0 + 1e-6)
    assert np.array_equal(encoded(again)[0] > 0, numbers > 0) and np.array_equal(
        np.round((again[numbers > 0] - offset) / scale), numbers[numbers > 0]
    )
    flat, scale, offset = encoded(np.full((2, 2), 0.5))
    assert np.allclose(decoded(flat, scale, offset), 0.5, atol=1e-15)


@pytest.mark.parametrize(
    ("kept", "pitch", "words"),
    [(slice(0, ROWS), None, "one line"), (slice(0, 2), None, "so many points"), (slice(None), 1e-6, "too large")],
)
def test_what_makes_no_height_map_is_refused(kept: slice, pitch: float | None, words: str) -> None:
    cloud = {name: column[kept] for name, column in scan().items()}
    with pytest.raises(InputError, match=words):
        height_map(cloud, pitch)


def test_strays_that_are_left_out_leave_the_others_where_they_were_on_a_grid_of_their_own() -> None:
    """Four stray cells doubled the grid: under half of its cells had a height, and heights began at -858 mm."""
    whole = height_map(scan())
    heights = np.full(tuple(2 * side for side in whole.heights.shape), np.nan)
    heights[-whole.heights.shape[0] :, : whole.heights.shape[1]] = whole.heights
    top = whole.y + whole.heights.shape[0] * whole.pitch
    heights[:2, -2:] = -0.8
    assert whole.why is not None and whole.count is not None
    why, count = np.full(heights.shape, UNMEASURED, dtype=np.uint8), np.zeros(heights.shape, dtype=np.intp)
    why[-whole.why.shape[0] :, : whole.why.shape[1]] = whole.why
    count[-whole.why.shape[0] :, : whole.why.shape[1]] = whole.count
    why[:2, -2:], count[0, -2:] = HEIGHT, 1
    # and one between the others, which stays on the map
    heights[-4, 4], at_4 = -0.8, int(count[-4, 4])
    wide = replace(whole, heights=heights, y=top, why=why, count=count, points=whole.points + 2)
    kept = within(wide, (-0.1, 1.0))
    known = np.isfinite(whole.heights)
    rows, columns = (np.flatnonzero(known.any(axis=axis)) for axis in (1, 0))
    inner = whole.heights[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    inner[-4, 4] = np.nan
    np.testing.assert_array_equal(kept.heights, inner)
    assert kept.x == pytest.approx(whole.x + columns[0] * whole.pitch, abs=1e-12)
    assert kept.y == pytest.approx(whole.y - rows[0] * whole.pitch, abs=1e-12)
    has = int(np.isfinite(kept.heights).sum())
    assert has + kept.steep + kept.unmeasured + kept.left_out == kept.heights.size < wide.heights.size
    assert kept.left_out == 1 and kept.points_left_out == 2 + at_4
    assert kept.points_without == whole.points_without + 2 + at_4
    assert within(wide, None) is wide and within(wide, (-1.0, 1.0)) is wide
    with pytest.raises(InputError, match="no cell with a height"):
        within(wide, (5.0, 6.0))


def test_a_stray_point_does_not_widen_the_map() -> None:
    clean, cloud = height_map(scan(), 4e-4), scan()
    stray = {name: np.append(column, column[0]) for name, column in cloud.items()}
    stray["x"][-1], stray["y"][-1] = 0.08, -0.05
    made = height_map(stray, 4e-4)
    assert made.heights.shape == clean.heights.shape
    assert (made.x, made.y) == pytest.approx((clean.x, clean.y), abs=1e-12)
    assert np.allclose(made.heights, clean.heights, atol=1e-12, equal_nan=True)


def wall_and_top() -> Cloud:
    """A floor, a wall of 50 mm that 12 profiles climb slantwise, and its top; points 0.3 mm apart along a profile."""
    step = np.arange(STEPS)[:, None]
    up = np.linspace(0.0, 0.05, 40)
    floor, top = np.linspace(0.01, 0.0003, 30), np.linspace(-0.0003, -0.01, 30)
    x = np.concatenate([floor, 1e-5 * np.sin(40.0 * np.arange(len(up))), top])
    z = np.concatenate([np.zeros(30), up, np.full(30, 0.05)])
    y = 1e-3 * step + 0.2 * z + 1e-6 * x
    count = STEPS * len(x)
    row = np.tile(np.arange(len(x), dtype=np.int32), STEPS)
    return {
        "x": np.tile(x, STEPS), "y": y.ravel(), "z": np.tile(z, STEPS), "sigma_random": np.full(count, SIGMA),
        "correlation_length": np.ones(count), "row": row, "laser": np.zeros(count, dtype=np.int32),
        "step": np.repeat(np.arange(STEPS, dtype=np.int32), len(x)),
    }  # fmt: skip


def test_beside_a_wall_no_cell_has_a_height_that_nobody_measured() -> None:
    """Cells between a wall's top at 250 mm and points on its face held 208, 181 and 149 mm."""
    cloud = wall_and_top()
    made = height_map(cloud, 4e-4)
    heights = made.heights[np.isfinite(made.heights)]
    between = np.minimum(np.abs(heights), np.abs(heights - 0.05))
    assert len(heights) > 200 and between.max() < 1.3e-3, "no farther up the wall than its first point"
    assert np.ptp(heights) == pytest.approx(0.05) and made.steep > 10
    assert made.points_without >= np.count_nonzero((cloud["z"] > 1e-3) & (cloud["z"] < 0.049))


def test_a_jump_between_two_levels_is_not_bridged_and_a_steep_flank_is_kept() -> None:
    cloud = scan()
    x = cloud["x"]
    middle = 3e-4 * ROWS / 2
    stepped = height_map(cloud | {"z": 0.1 + 1.2e-3 * (x > middle)}, 1e-4)
    heights = stepped.heights[np.isfinite(stepped.heights)]
    assert np.minimum(np.abs(heights - 0.1), np.abs(heights - 0.1012)).max() < 3e-4 and stepped.steep > 0
    flank = height_map(cloud | {"z": 0.1 + 4.0 * np.abs(x - middle)}, 1e-4)
    places_x, _ = places(flank)
    known = np.isfinite(flank.heights)
    assert flank.steep == 0 and flank.points_without < 0.1 * flank.points
    assert np.abs(flank.heights - 0.1 - 4.0 * np.abs(places_x - middle))[known].max() < 1.3e-3
