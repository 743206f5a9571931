"""Vectors of three numbers as tuples, which cost nothing between kernels."""

from __future__ import annotations

import math

import numba

from render.base.arrays import Float, Float32

Vector = tuple[float, float, float]


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def vector(array: Float | Float32, start: int = 0) -> Vector:
    """Three numbers of an array, from `start` on."""
    return float(array[start]), float(array[start + 1]), float(array[start + 2])


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def store(array: Float | Float32, a: Vector) -> None:
    """Write a vector -> array (3,)."""
    array[0], array[1], array[2] = a


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def row_vector(array: Float | Float32, i: int, start: int = 0) -> Vector:
    """Three numbers of row i of an array, from `start` on; quicker than a view of the row."""
    return float(array[i, start]), float(array[i, start + 1]), float(array[i, start + 2])


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def store_row(array: Float | Float32, i: int, a: Vector) -> None:
    """Write a vector -> row i of an array (n, 3)."""
    array[i, 0], array[i, 1], array[i, 2] = a


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def length(a: Vector) -> float:
    return math.sqrt(dot(a, a))


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def plus(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def minus(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def negative(a: Vector) -> Vector:
    return -a[0], -a[1], -a[2]


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def along(a: Vector, distance: float, direction: Vector) -> Vector:
    """The point a + distance direction."""
    return a[0] + distance * direction[0], a[1] + distance * direction[1], a[2] + distance * direction[2]


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def times(a: Vector, b: Vector) -> Vector:
    """Component by component, as bands of light are multiplied."""
    return a[0] * b[0], a[1] * b[1], a[2] * b[2]


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def scaled(factor: float, a: Vector) -> Vector:
    return factor * a[0], factor * a[1], factor * a[2]


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def divided(a: Vector, divisor: float) -> Vector:
    return a[0] / divisor, a[1] / divisor, a[2] / divisor


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def rotated(matrix: Float, a: Vector) -> Vector:
    """The direction a, rotated by a pose (4, 4) or by axes (3, 3), one a row."""
    x, y, z = a
    return (
        matrix[0, 0] * x + matrix[0, 1] * y + matrix[0, 2] * z,
        matrix[1, 0] * x + matrix[1, 1] * y + matrix[1, 2] * z,
        matrix[2, 0] * x + matrix[2, 1] * y + matrix[2, 2] * z,
    )


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def transformed(matrix: Float, a: Vector) -> Vector:
    """The point a, transformed by a pose (4, 4)."""
    x, y, z = rotated(matrix, a)
    return x + matrix[0, 3], y + matrix[1, 3], z + matrix[2, 3]
