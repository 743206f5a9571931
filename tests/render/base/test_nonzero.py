"""Where an image is not zero, found on threads as by one look."""

import numpy as np
import pytest

from render.base.nonzero import CHUNK, nonzero_places


@pytest.mark.parametrize("share", [0.0, 0.02, 1.0])
@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_all_that_is_not_zero_is_found_in_order(share: float, kind: type) -> None:
    random = np.random.default_rng(3)
    image = np.where(random.random((7, CHUNK // 3)) < share, random.normal(size=(7, CHUNK // 3)), 0.0).astype(kind)
    image[0, 0], image[-1, -1] = np.nan, -0.0
    places = nonzero_places(image, 2)
    assert places.dtype == np.int32
    np.testing.assert_array_equal(places, np.flatnonzero(image))
