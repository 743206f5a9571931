"""Sums over images that go in parts."""

from __future__ import annotations

import cv2
import numpy as np

from render.laser_indirect.line_sums import smoothed


def test_an_image_that_is_smoothed_in_bands_is_that_of_one() -> None:
    image = np.random.default_rng(0).random((700, 90), dtype=np.float32)
    weights = cv2.getGaussianKernel(17, 2.0, cv2.CV_32F)
    assert np.array_equal(
        smoothed(image, 2.0), cv2.sepFilter2D(image, -1, weights, weights, borderType=cv2.BORDER_REFLECT)
    )
