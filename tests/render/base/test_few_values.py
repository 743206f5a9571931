"""Quantiles of a few values are those of NumPy."""

import numpy as np
import pytest

from render.base.few_values import quantile


@pytest.mark.parametrize("count", [1, 2, 3, 8, 15])
@pytest.mark.parametrize("share", [0.0, 0.25, 0.5, 1.0])
def test_it_is_the_quantile(count, share):
    values = np.random.default_rng(count).normal(size=count)
    assert quantile(values, share) == pytest.approx(float(np.quantile(values, share)), rel=1e-14)
    assert quantile(values) == np.median(values)
