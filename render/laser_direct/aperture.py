"""Direct laser light through an aperture: the rays' own points of it are noise, which a plane through them takes away.

Every ray tells how the sheet's coordinate q changes over its pixel and over the aperture on its own facet. The mean of
these planes is a picture g of the pixel, whose mean G over pixel and aperture is known. With X the rays' radiances and
b the radiance in the sheet's middle that they imply,  mean X - b (mean g - G)  is exact where the surface is flat and
evenly lit, and right in the limit everywhere: a control variate.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

from render.laser.sheet_integral import about_over_aperture, mean_over, mean_over_aperture

Float = NDArray[np.float64]
Int = NDArray[np.int32]


@numba.njit(nogil=True, cache=True, error_model="numpy")
def gather_aperture(  # noqa: PLR0913
    values: Float,
    planes: Float,
    lens: Float,
    radius: float,
    occluded: NDArray[np.bool_],
    sample: Int,
    count: int,
    cells: int,
    mean: Float,
    error: Float,
) -> None:
    """As `render.laser_direct.shading.gather`, of rays (n, ...) through points (a, b) of an aperture; planes as its
    `shade` gives.

    A ray that was not written to `sample`, or is occluded, has no light and no plane.
    """
    n = cells * cells
    size, half = 1.0 / cells, 0.5 / cells
    plane = np.empty(5)
    lit = np.zeros(values.shape[0], dtype=np.bool_)
    for j in range(count):
        lit[sample[j]] = not occluded[j]
    for i in range(mean.shape[0]):
        total = first = second = known = 0.0
        plane[:] = 0.0
        for r in range(i * n, i * n + n):
            if lit[r]:
                total += values[r, 0]
                first += values[r, 1]
                second += values[r, 1] ** 2
                known += 1.0
                for axis in range(5):
                    plane[axis] += planes[r, axis]
        mean[i], error[i] = total / n, 0.0
        if known == 0.0:
            continue
        for axis in range(5):
            plane[axis] /= known
        reach = radius * math.hypot(plane[3], plane[4])
        # as the rays predict it, so that the ratio is the radiance
        predicted = about_over_aperture(plane[0], plane[1] * 0.5, plane[2] * 0.5, reach)
        if predicted <= 0.0:
            continue
        whole = mean_over_aperture(plane[0], plane[1] * 0.5, plane[2] * 0.5, reach)
        pictured = apart = 0.0
        middle = first / n / predicted
        for cell in range(n):
            r = i * n + cell
            u, v = (cell % cells + 0.5) * size - 0.5, (cell // cells + 0.5) * size - 0.5
            q = plane[0] + plane[1] * u + plane[2] * v + plane[3] * lens[r, 0] + plane[4] * lens[r, 1]
            g = mean_over(q, plane[1] * half, plane[2] * half)
            pictured += g
            apart += ((values[r, 0] if lit[r] else 0.0) - middle * g) ** 2
        left = total / n - middle * pictured / n
        corrected = left + middle * whole
        spread = max(second / n - (first / n) ** 2, apart / n - left * left, 0.0) * n / (n - 1)
        # between independent samples, 1/2, and an edge through jittered cells of pixel and aperture, 5/8; as measured
        error[i] = math.sqrt(spread) / n**0.5625
        # beside an edge the picture may be far from the truth: a radiance stays one
        if corrected > 0.0:
            mean[i] = corrected
