"""The deviation that passes put the line to, from their spread: against the deviation that they were drawn with."""

from __future__ import annotations

import numpy as np
import pytest

from render.importance import CELL, Importance
from render.laser_indirect.connection_buffer import BLOCK, PassBuffer
from render.laser_indirect.integrator import empty_buffer
from render.laser_indirect.line_goal import Effect, LineErrors, Projection

HEIGHT, WIDTH = 200, 64
LINE = slice(28, 36)
DEVIATION = 0.3


def importance(peaks: float = 0.0) -> Importance:
    """Of a line down the middle of the image: what is left of it pulls to the left, what is right to the right."""
    weight = np.zeros((HEIGHT, WIDTH), np.float32)
    weight[:, LINE] = np.linspace(-1.0, 1.0, 8)
    away = np.full((HEIGHT, WIDTH), peaks, np.float32)
    away[:, LINE] = 0.0
    return Importance((weight,), np.abs(weight), "rows", (away,) if peaks else ())


def passes(rng: np.random.Generator, common: float = 0.0) -> list[PassBuffer]:
    """Four passes with independent light in every pixel, and light that all pixels of a row have in common."""
    buffers = [empty_buffer(HEIGHT * WIDTH) for _ in range(4)]
    for buffer in buffers:
        light = 5.0 + DEVIATION * rng.standard_normal((HEIGHT, WIDTH))
        light[:, : WIDTH // 2] += common * rng.standard_normal((HEIGHT, 1))
        buffer.image[:] = light.ravel()
        buffer.touched[:] = True
    return buffers


@pytest.mark.parametrize("common", [0.0, 0.5])
def test_the_error_is_that_of_the_mean_of_all_passes(common: float) -> None:
    rng, errors = np.random.default_rng(1), LineErrors.of(importance(), 0)
    weights = 0.0
    for size in (1, 1, 2, 4):
        errors.add(passes(rng, common), weight=float(size), size=float(size))
        weights += 4.0 * size
    weight = np.linspace(-1.0, 1.0, 8)
    one = DEVIATION**2 * np.sum(weight**2) + common**2 * np.sum(weight[:4]) ** 2
    mean = np.sqrt(one * 4.0 * (1 + 1 + 4 + 16)) / weights
    # waves of weight 1, 1, 4, 16 give a line 5.3 degrees of freedom; of the 13 at the end of a ranking, the fewest that
    # are taken together, the deviation is known to 8.5 %. The error is that of nearly the worst line: three times that.
    assert mean < errors.deviation(weights) < mean * 1.26


def test_the_bound_on_the_deviation_holds_as_often_as_it_says() -> None:
    """Of waves whose passes all lines have in common, so that they are no better known together than one."""
    rng, weight, held, trials = np.random.default_rng(6), np.linspace(-1.0, 1.0, 8), 0, 400
    buffers = [empty_buffer(HEIGHT * WIDTH) for _ in range(4)]
    for _ in range(trials):
        errors, weights = LineErrors.of(importance(), 0), 0.0
        for size in (1, 1, 2):
            for buffer in buffers:
                buffer.image.reshape(HEIGHT, WIDTH)[:, LINE] = rng.standard_normal() * weight / np.sqrt(size)
            errors.add(buffers, weight=float(size), size=float(size))
            weights += 4.0 * size
        true = np.sum(weight**2) * np.sqrt(4.0 * (1 + 1 + 4 / 2)) / weights
        held += errors.error(weights) > true
    # Satterthwaite's degrees of freedom are an approximation, good to a percent or two
    assert abs(held / trials - 0.95) < 3.0 * np.sqrt(0.95 * 0.05 / trials) + 0.02


def test_a_few_bad_lines_do_not_speak_for_those_about_them() -> None:
    """One line in forty is ten times as noisy: they may miss the goal, and the others are known as they are."""
    rng, errors, without = np.random.default_rng(4), LineErrors.of(importance(), 0), LineErrors.of(importance(), 0)
    weights = 0.0
    for size in (1, 1, 2, 4):
        alike = passes(rng)
        bad = [buffer._replace(image=buffer.image.copy(), touched=buffer.touched.copy()) for buffer in alike]
        for buffer in bad:
            rows = buffer.image.reshape(HEIGHT, WIDTH)[::40]
            rows[:] = 5.0 + 10.0 * (rows - 5.0)
        errors.add(bad, weight=float(size), size=float(size))
        without.add(alike, weight=float(size), size=float(size))
        weights += 4.0 * size
    assert errors.error(weights) == pytest.approx(without.error(weights), rel=0.2)


def test_lines_that_are_known_less_well_are_counted() -> None:
    """One in twenty is ten times as noisy, and the weights are such that only these are above the allowed deviation."""
    rng, errors, weights = np.random.default_rng(7), LineErrors.of(importance(), 0), 0.0
    assert errors.unknown(1.0) == HEIGHT
    for size in (1, 1, 2, 4):
        buffers = passes(rng)
        for buffer in buffers:
            rows = buffer.image.reshape(HEIGHT, WIDTH)[::20]
            rows[:] = 5.0 + 10.0 * (rows - 5.0)
        errors.add(buffers, weight=float(size), size=float(size))
        weights += 4.0 * size
    # a deviation of 0.15 or 1.5: of 12 degrees of freedom, a tenth of these at most below 1
    assert HEIGHT // 20 - 2 <= errors.unknown(weights) <= HEIGHT // 20 + 2


def test_light_that_few_passes_hold_counts_for_all_lines_that_it_may_meet() -> None:
    """A hundredth of the lines has all of it in each pass, other ones each time: no line is known."""
    rng, errors = np.random.default_rng(5), LineErrors.of(importance(), 0)
    for _ in range(3):
        buffers = [empty_buffer(HEIGHT * WIDTH) for _ in range(4)]
        for buffer in buffers:
            for row in rng.choice(HEIGHT, HEIGHT // 100, replace=False):
                buffer.image[row * WIDTH + LINE.start] = 100.0
            buffer.touched[:] = True
        errors.add(buffers, 1.0, 1.0)
    # variance of a pass p (1 - p) 100^2 with p = 0.01, of the mean of 12 of them; pooled over 25 lines three times
    expected = 100.0 * np.sqrt(0.01 * 0.99 / 12.0)
    assert 0.8 * expected < errors.deviation(12.0) < 2.5 * expected


def test_a_goal_is_out_of_reach_far_beyond_where_the_render_ends() -> None:
    def judged(error: float, image_error: float, paths: int = 1000, most: float = 1e6) -> bool:
        errors = LineErrors.of(importance(), 0)
        errors.judge(error, image_error, paths, most)
        return errors.out_of_reach

    # paths grow as the square of the error: those for the line, beside those for the image or the limit
    assert not judged(error=10.0, image_error=10.0) and not judged(error=1.0, image_error=0.5)
    assert judged(error=10.0, image_error=3.0) and judged(error=100.0, image_error=1e3)
    assert not judged(error=np.inf, image_error=1.0)


def test_waves_of_before_count_by_those_that_were_measured() -> None:
    """Projected anew after two waves of four: the two that follow tell of all."""
    rng, all_of_them, later = np.random.default_rng(2), LineErrors.of(importance(), 0), LineErrors.of(importance(), 0)
    weights = 0.0
    for n in range(4):
        buffers = passes(rng)
        all_of_them.add(buffers, 1.0, 1.0)
        later.all_waves += 0.0 if n >= 2 else 4.0
        if n >= 2:
            later.add(buffers, 1.0, 1.0)
        weights += 4.0
    assert later.all_waves == all_of_them.all_waves == 16.0
    assert later.deviation(weights) == pytest.approx(all_of_them.deviation(weights), rel=0.15)
    # half of the waves are known to half of the degrees of freedom
    assert later.margin > all_of_them.margin


def test_a_bright_dot_where_a_peak_could_appear_is_an_error() -> None:
    errors = LineErrors.of(importance(peaks=0.1), 0)
    buffers = [empty_buffer(HEIGHT * WIDTH) for _ in range(4)]
    errors.add(buffers, 1.0, 1.0)
    assert errors.error(4.0) == 0.0
    for row in range(0, HEIGHT, 10):
        buffers[1].image[row * WIDTH + 7] = 80.0
        buffers[1].touched[row * WIDTH // 64] = True
    errors = LineErrors.of(importance(peaks=0.1), 0)
    errors.add(buffers, 1.0, 1.0)
    # one of four passes has all of it: the deviation of the mean is the mean itself
    assert errors.deviation(4.0) == pytest.approx(0.1 * 80.0 / 4.0, rel=1e-6)


def test_what_a_checkpoint_keeps_gives_the_same_error() -> None:
    rng, errors = np.random.default_rng(3), LineErrors.of(importance(peaks=0.01), 0)
    errors.add(passes(rng), 1.0, 1.0)
    errors.judge(1e6, 1.0, 4, 8.0)
    again = LineErrors.of_arrays(errors.arrays())
    assert again.out_of_reach
    buffers = passes(rng)
    for one in (errors, again):
        one.add(buffers, 2.0, 2.0)
    assert again.error(12.0) == errors.error(12.0) > 0.0
    np.testing.assert_array_equal(again.moved, errors.moved)


def test_even_light_has_no_effect_on_the_line_but_a_slope_has() -> None:
    columns, flat, rising = np.arange(HEIGHT * WIDTH) % WIDTH, [], []
    for _ in range(4):
        flat.append(empty_buffer(HEIGHT * WIDTH))
        flat[-1].image[:] = 3.0
        rising.append(empty_buffer(HEIGHT * WIDTH))
        rising[-1].image[:] = 3.0 + 0.1 * columns
    even, slope = (Effect.of(Projection.of(importance(), 0), buffers) for buffers in (flat, rising))
    assert even.most() < 1e-5
    expected = 0.1 * np.sum(np.linspace(-1.0, 1.0, 8) * np.arange(8))
    assert slope.most() == pytest.approx(expected, rel=1e-5)
    assert slope.most(without=even) == pytest.approx(expected, rel=1e-5)


def test_light_beside_the_line_counts_by_the_peak_that_it_would_be() -> None:
    buffers = [empty_buffer(HEIGHT * WIDTH) for _ in range(4)]
    for buffer in buffers:
        buffer.image[50 * WIDTH + 8 : 50 * WIDTH + 8 + CELL] = 2.0
        buffer.touched[(50 * WIDTH + 8) // BLOCK] = True
    effect = Effect.of(Projection.of(importance(peaks=0.25), 0), buffers)
    assert effect.most() == pytest.approx(0.25 * 2.0 * CELL)
