"""However many points come, as many are held as are worth drawing, from every part of the scan."""

from __future__ import annotations

import numpy as np

from studio.scan.point_sample import PointSample


def cloud(step: int, count: int = 100) -> dict[str, np.ndarray]:
    return {"x": np.arange(count, dtype=float), "step": np.full(count, step, np.int32)}


def test_few_points_are_all_kept() -> None:
    sample = PointSample(1000)
    for step in range(10):
        sample.add(cloud(step))
    assert len(sample.points["x"]) == 1000


def test_many_are_thinned_evenly() -> None:
    sample = PointSample(1000)
    sizes = []
    for step in range(300):
        sample.add(cloud(step))
        sizes.append(len(sample.points["x"]))
    assert max(sizes) <= 1000 and min(sizes[10:]) >= 500
    counts = np.bincount(sample.points["step"], minlength=300)
    assert counts.min() >= 1 and counts.max() <= 4
