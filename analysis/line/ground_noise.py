"""The gain by the ground beside the line, where that is uneven: its noise against its own level.

    V = r^2 + K M        V variance and M mean of blocks of pixels, weighted least squares (photon transfer: Janesick,
                         Photon Transfer, SPIE 2007, 5.2)

V is that of second differences along the scan line, to which a slope adds nothing. A texture that multiplies the light
has a variance that grows faster than the level, so that r^2 comes out negative: then nothing is told.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

BLOCK = 16
"""px; so many tell the level ten times better than the range of it that is of use."""
FEWEST = 200
SURE, NEGATIVE = 5.0, -2.0
"""Standard errors from which the gain is believed, and of a variance without light that may be none."""
STRAY, ROUNDS = 5.0, 4


def ground_noise(ground: NDArray[np.floating]) -> tuple[float, float] | None:
    """Pixels beside the line (n, w) in DN, NaN elsewhere -> gain, DN/e-, and variance without light, DN^2.

    None: the ground is too even to tell, or its noise is no count.
    """
    count = ground.shape[1] // BLOCK
    rows = ground[: len(ground) // 2 * 2, : count * BLOCK].reshape(len(ground) // 2, 2, count, BLOCK).astype(np.float64)
    pairs = rows.swapaxes(1, 2).reshape(-1, 2, BLOCK)
    pairs = pairs[np.isfinite(pairs).all(axis=(1, 2))]
    if len(pairs) < FEWEST:
        return None
    # the level of the other scan line: of a count's own pixels mean and variance go together on even ground too
    level, blocks = pairs[:, ::-1].mean(axis=2).ravel(), pairs.reshape(-1, BLOCK)
    apart = np.abs(level - np.median(level))  # what stands out is no ground
    blocks, level = (one[apart <= STRAY * np.median(apart)] for one in (blocks, level))
    bends = blocks[:, :-2] - 2.0 * blocks[:, 1:-1] + blocks[:, 2:]
    variance = np.mean(bends**2, axis=1) / 6.0
    design = np.stack([np.ones_like(level), level], axis=1)
    least = 0.1 * float(np.median(variance))
    if not least > 0.0:
        return None
    fitted = np.full_like(variance, 10.0 * least)
    for _ in range(ROUNDS):
        weighed = design / np.maximum(fitted, least)[:, None] ** 2
        inverse = np.linalg.pinv(weighed.T @ design)
        found = inverse @ (weighed.T @ variance)
        fitted = design @ found
    error = np.sqrt(np.diag(inverse) * np.mean((variance / np.maximum(fitted, least) - 1.0) ** 2))
    sure = found[1] > SURE * error[1] and found[0] > NEGATIVE * error[0]
    return (float(found[1]), max(float(found[0]), 0.0)) if sure else None
