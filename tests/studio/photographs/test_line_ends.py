"""Light past the end of a line is no line, and a line that fades of itself keeps its ends."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.ndimage import gaussian_filter1d

from analysis.line.result import Flag, Line
from studio.photographs.line_ends import GAMMA, Tone, ended

COUNT, FIRST, LAST = 200, 40, 159


def line_of(amplitude: np.ndarray, u: np.ndarray | None = None, width: np.ndarray | None = None) -> Line:
    """(COUNT, 1) found where its light is above 0.5."""
    found = (amplitude > 0.5)[:, None]
    u = np.full(COUNT, 50.0) if u is None else u
    width = np.full(COUNT, 2.0) if width is None else width

    def column(values: np.ndarray) -> np.ndarray:
        return np.where(found, values[:, None], np.nan)

    flag = np.where(found, np.uint8(Flag.OK), np.uint8(Flag.NO_PEAK)).astype(np.uint8)
    tenth = np.full(COUNT, 0.1)
    return Line(
        "rows",
        "likelihood",
        column(u),
        column(tenth),
        column(width),
        column(amplitude),
        column(tenth),
        column(tenth),
        flag,
    )


def test_a_blurred_line_ends_where_half_of_its_light_is_left() -> None:
    sharp = np.zeros(COUNT)
    sharp[FIRST : LAST + 1] = 300.0
    for blur in (0.7, 1.5, 3.0):
        line = line_of(gaussian_filter1d(sharp, blur))
        assert line.valid.sum() > LAST - FIRST + 3
        kept = ended(line)
        assert np.flatnonzero(kept.valid[:, 0]).tolist() == list(range(FIRST, LAST + 1))
        assert set(kept.flag[line.valid & ~kept.valid]) == {Flag.PAST_END}
        assert np.isnan(kept.u[~kept.valid]).all()


def test_what_begins_at_an_end_with_another_width_is_not_the_line() -> None:
    width = np.where(np.arange(COUNT) < FIRST, 9.0, 1.5)
    u = 50.0 + np.where(np.arange(COUNT) < FIRST, 3.0 * (FIRST - np.arange(COUNT)), 0.0)
    light = np.where(np.arange(COUNT) >= FIRST - 8, 200.0, 0.0)
    assert np.flatnonzero(ended(line_of(light, u, width)).valid[:, 0])[0] == FIRST


def test_a_line_that_fades_slowly_or_is_dark_in_its_middle_stays_whole() -> None:
    rng = np.random.default_rng(5)
    rows = np.arange(COUNT)
    fading = 200.0 * np.exp(-0.5 * ((rows - 100.0) / 60.0) ** 2) * rng.gamma(100.0, 0.01, COUNT)
    dark = np.where(np.abs(rows - 100) < 20, 10.0, 200.0)
    for light in (fading, dark):
        line = line_of(light)
        assert ended(line).valid.sum() == line.valid.sum()


def test_what_is_scattered_beside_the_line_is_none_of_it_however_long() -> None:
    """Beyond an end, and in a gap; a dark surface leaves the line's width, a depth out of focus its light."""
    rng = np.random.default_rng(8)
    rows = np.arange(COUNT)
    for there in (rows >= 140, np.abs(rows - 100) < 20):
        for wider, dimmer, stays in ((2.5, 0.2, False), (1.0, 0.2, True), (2.5, 0.4, True)):
            light = np.where(there, dimmer, 1.0) * 200.0 * rng.gamma(100.0, 0.01, COUNT)
            width = np.where(there, wider, 1.0) * 2.0 * rng.gamma(100.0, 0.01, COUNT)
            kept = ended(line_of(light, width=width)).valid[:, 0]
            inside = there & (np.abs(rows - 100) < 17) if there[100] else rows >= 143
            assert kept[inside].all() if stays else not kept[inside].any(), (wider, dimmer)
            assert kept[~there].mean() > 0.97


def test_scattered_light_is_dim_by_its_light_not_by_its_number() -> None:
    """At half of the number a picture for the eye shows a quarter of the light."""
    rows = np.arange(COUNT)
    light, width = np.where(rows < 140, 160.0, 80.0), np.where(rows < 140, 2.0, 5.0)
    line = line_of(light, width=width)
    assert ended(line).valid[140:].all()
    assert not ended(line, Tone(gain=1.0, black=0.0)).valid[140:].any()


def test_a_line_that_grows_brighter_inward_ends_by_the_light_at_its_end() -> None:
    """A glossy surface is four times as bright 8 scan lines in, which says nothing of the light at its end."""
    rows = np.arange(COUNT)
    sharp = np.where((rows >= FIRST) & (rows <= LAST), 100.0, 0.0)
    sharp *= np.where(rows < FIRST + 8, 1.0, 4.0)
    for blur in (0.7, 1.5):
        kept = np.flatnonzero(ended(line_of(gaussian_filter1d(sharp, blur))).valid[:, 0])
        # bends of what grows brighter are taken for scatter, and half of the light is asked for as surely
        assert FIRST <= kept[0] <= FIRST + 1 and kept[1:].tolist() == list(range(kept[0] + 1, LAST + 1))


def test_a_short_piece_far_off_is_the_line_only_if_it_is_as_bright() -> None:
    for light, stays in ((20.0, False), (150.0, True)):
        amplitude, u = np.full(COUNT, 200.0), np.full(COUNT, 50.0)
        amplitude[150:], u[150:] = 0.0, 90.0
        amplitude[155:165] = light
        assert bool(ended(line_of(amplitude, u)).valid[155:165].all()) is stays


def test_half_of_the_light_is_found_by_the_tone_curve_and_the_ground_that_it_lies_on() -> None:
    sharp = np.zeros(COUNT)
    sharp[FIRST : LAST + 1] = 1.0
    light = np.maximum(gaussian_filter1d(sharp, 1.5), 1e-9)
    gain, black = 0.5, 20.0
    for ground in (0.0, 0.05, 0.5):
        level = 255.0 * ground ** (1.0 / GAMMA)
        shown = (255.0 * (ground + 0.4 * light) ** (1.0 / GAMMA) - level) / gain
        line = line_of(shown)
        line = replace(line, background=np.where(line.valid, (level - black) / gain, np.nan))
        kept = ended(line, Tone(gain, black)).valid[:, 0]
        assert np.flatnonzero(kept).tolist() == list(range(FIRST, LAST + 1)), ground
        if ground < 0.5:  # by numbers blur would be a part of the line
            assert ended(line).valid.sum() > LAST - FIRST + 1


def test_one_wing_that_tells_too_little_does_not_make_the_line_as_dim_as_its_blur() -> None:
    sharp = np.zeros(COUNT)
    sharp[FIRST : LAST + 1] = 400.0
    line = line_of(gaussian_filter1d(sharp, 1.5))
    line.flag[100] = Flag.SATURATED
    line.amplitude[100] = 150.0
    assert np.flatnonzero(ended(line).valid[:, 0]).tolist() == list(range(FIRST, LAST + 1))


def test_blur_of_a_clipped_line_is_weighed_against_what_its_wings_tell() -> None:
    sharp = np.zeros(COUNT)
    sharp[FIRST : LAST + 1] = 2000.0
    light = gaussian_filter1d(sharp, 0.7)
    line = line_of(light)
    line.flag[light > 500.0] = Flag.SATURATED
    line.amplitude[FIRST + 7] = 500.0  # one wing that tells no more than what clips
    assert light[FIRST - 1] > 0.5 * 500.0
    assert np.flatnonzero(ended(line).valid[:, 0]).tolist() == list(range(FIRST, LAST + 1))


def test_a_scan_line_at_an_end_is_the_line_only_where_the_line_goes_on_to() -> None:
    rng = np.random.default_rng(6)
    rows, light = np.arange(COUNT), np.zeros(COUNT)
    light[FIRST : LAST + 1] = 200.0
    bent = 50.0 + 0.3 * rows + 0.05 * rng.standard_normal(COUNT)
    assert ended(line_of(light, bent)).valid.sum() == LAST - FIRST + 1
    bent[[FIRST, LAST]] += np.array([2.0, -2.0])
    assert np.flatnonzero(ended(line_of(light, bent)).valid[:, 0]).tolist() == list(range(FIRST + 1, LAST))


def test_wild_amplitudes_of_saturated_scan_lines_neither_end_a_line_nor_lengthen_it() -> None:
    rng = np.random.default_rng(7)
    light = np.zeros(COUNT)
    light[FIRST : LAST + 1] = 1000.0 * rng.uniform(1.0, 3.0, LAST - FIRST + 1)
    light[FIRST + 5 : LAST - 5 : 4] *= 100.0
    light[[FIRST - 1, LAST + 1]] = 300.0
    line = line_of(light)
    line.flag[FIRST : LAST + 1] = Flag.SATURATED
    kept = np.flatnonzero(ended(line).valid[:, 0])
    assert FIRST <= kept[0] <= FIRST + 2 and LAST - 2 <= kept[-1] <= LAST
