"""What batches of samples do to a line, where some of its pixels are settled."""

import numpy as np
import pytest

from render.ambient.line_moves import SETTLED, LineMoves

WEIGHTS = np.array([0.02, 1.0, -1.0, -0.02, 0.0])
"""Of the pixels of one line: two that move it, two that hardly do, and one beside it."""


def line_moves():
    return LineMoves((WEIGHTS,), np.zeros(5, np.int64), 1)


def test_pixels_settle_by_their_weight_and_the_largest_variance_of_their_line():
    moves = line_moves()
    moves.settle(np.arange(4), np.array([0.0, 0.0, 9.0, 0.0]))
    assert moves.open.all()
    moves.settle(np.arange(4), np.array([0.0, 0.0, 4.0, 0.0]))
    assert moves.on[~moves.open].tolist() == [0, 3]
    # both by 0.02 times a deviation of 2, the same way
    assert moves.settled == pytest.approx(0.08)
    assert moves.settled <= SETTLED
    assert moves.variance == pytest.approx(0.08**2)


def test_the_heaviest_pixel_of_a_line_is_never_settled():
    moves = line_moves()
    moves.settle(np.arange(4), np.zeros(4))
    assert moves.open.sum() == 1 and moves.first_pixel[0] in moves.on[moves.open]


def test_batches_know_the_line_whether_or_not_its_pixels_are_settled():
    """The variance told is that of the mean over all samples, as it is without settled pixels and with them."""
    random = np.random.default_rng(3)
    batches, samples = 40, np.array([2, 8])
    for settles in (False, True):
        told, found = [], []
        for _ in range(200):
            moves, sums, done = line_moves(), np.zeros((5, 2, 3)), np.zeros((5, 2), np.int32)
            for batch in range(batches):
                count = np.tile(samples[batch % 2], (5, 2)).astype(np.int32)
                count[moves.on[~moves.open]] = 0
                light = random.normal(3.0, np.sqrt(count)[..., None], (5, 2, 3)) * (count > 0)[..., None]
                sums, done = sums + light, done + count
                means = (sums.sum(axis=1) / done.sum(axis=1)[:, None])[moves.on[~moves.open]]
                moves.add(light.astype(np.float32), count, means.astype(np.float32))
                if settles and batch == batches // 2:
                    moves.settle(np.arange(4), np.full(4, 1.0 / done[0].sum()))
            told.append(moves.variance[0])
            found.append(WEIGHTS @ (sums.sum(axis=1) / done.sum(axis=1)[:, None])[:, 0])
        assert (~moves.open).sum() == (2 if settles else 0)
        # told: the largest of three colours, each known to sqrt(2 / 79), 0.85 of that higher; found: known to a tenth
        assert np.mean(told) == pytest.approx(1.135 * np.var(found), rel=0.3)
