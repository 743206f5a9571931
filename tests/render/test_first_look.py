"""The first look at a pixel."""

from __future__ import annotations

import numpy as np

from render.first_look import look_around


def test_where_no_light_is_seen_nothing_is_read():
    # memory that was never written may hold anything
    planes = np.full((3, 4), np.nan)
    planes[1] = 0.1, 2.0, 0.0, 5.0
    planes[[0, 2], 3] = 0.0
    middle, mean, error = np.array([0.0, 0.8, 0.0]), np.empty(3), np.empty(3)
    look_around(0, 3, np.arange(10, 13, dtype=np.int32), 100, planes, middle, mean, error)
    assert mean[0] == mean[2] == 0.0 and mean[1] > 0.0
    # beside the edge all three are in doubt
    assert np.all(error > 0.0) and np.isfinite(error).all()
