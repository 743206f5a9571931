"""Direct laser light through an aperture: a control variate removes the noise of the rays' random aperture points.

Every ray gives the linear change of the sheet's coordinate q over its pixel and over the aperture, on its own facet.
The mean of these planes is a model g of the pixel, whose mean G over pixel and aperture is known in closed form. With X
the rays' radiances and b the radiance in the sheet's middle that they imply, the estimate  mean X - b (mean g - G)  is
exact where the surface is flat and evenly lit, and consistent everywhere.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float, Int
from render.laser.sheet_integral import about_over_aperture, mean_over, mean_over_aperture


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
    """As `render.laser_direct.shading.gather`, for rays through points lens (n, 2) of an aperture of this radius, m.

    values (n, 2) and planes (n, 5) are those of `shade`. A ray that is not among the first `count` of `sample`, or is
    occluded, has no light and no plane.
    """
    n = cells * cells
    size, half = 1.0 / cells, 0.5 / cells
    plane = np.empty(5)
    lit = np.zeros(values.shape[0], dtype=np.bool_)
    for j in range(count):
        lit[sample[j]] = not occluded[j]
    for i in range(mean.shape[0]):
        total = first = second = lit_count = 0.0
        plane[:] = 0.0
        for r in range(i * n, i * n + n):
            if lit[r]:
                total += values[r, 0]
                first += values[r, 1]
                second += values[r, 1] ** 2
                lit_count += 1.0
                for axis in range(5):
                    plane[axis] += planes[r, axis]
        mean[i], error[i] = total / n, 0.0
        if lit_count == 0.0:
            continue
        for axis in range(5):
            plane[axis] /= lit_count
        reach = radius * math.hypot(plane[3], plane[4])
        # by the same approximation as the rays' predictions, so that the ratio is the radiance in the sheet's middle
        predicted = about_over_aperture(plane[0], plane[1] * 0.5, plane[2] * 0.5, reach)
        if predicted <= 0.0:
            continue
        exact = mean_over_aperture(plane[0], plane[1] * 0.5, plane[2] * 0.5, reach)
        modelled = squared_residual = 0.0
        middle = first / n / predicted
        for cell in range(n):
            r = i * n + cell
            u, v = (cell % cells + 0.5) * size - 0.5, (cell // cells + 0.5) * size - 0.5
            q = plane[0] + plane[1] * u + plane[2] * v + plane[3] * lens[r, 0] + plane[4] * lens[r, 1]
            g = mean_over(q, plane[1] * half, plane[2] * half)
            modelled += g
            squared_residual += ((values[r, 0] if lit[r] else 0.0) - middle * g) ** 2
        residual = total / n - middle * modelled / n
        corrected = residual + middle * exact
        spread = max(second / n - (first / n) ** 2, squared_residual / n - residual * residual, 0.0) * n / (n - 1)
        # measured: between 1/2, independent samples, and 5/8, an edge through jittered cells of pixel and aperture
        error[i] = math.sqrt(spread) / n**0.5625
        # beside an edge the model may be far off: a radiance must not become negative
        if corrected > 0.0:
            mean[i] = corrected
