"""The founding paper's single-bevel tee joint: a base plate, a bevelled upright, and a rippled bead in the corner.

Three closed parts that overlap by a small embedding, so that no two faces coincide and no light passes between them.
The visible front is developed along v: from the base plate's far edge over the bead to the top of the upright.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from render.base.arrays import Float
from render.mesh.mesh import Mesh
from render.mesh.primitives import corners_uv, mesh, prism
from render.scene.shape import WeldTee

EMBEDDING = 0.02
"""Overlap of the parts, as a fraction of the least length it has to fit in."""
ROOT_FACE = 1 / 6
"""Least part of the upright's foot that the bevel leaves standing on the base."""
BEVEL_REACH = 0.8
"""Greatest height of the bevel, as a fraction of the leg, so that the bead always covers it."""
RIPPLE_BOW = 1.2
"""Ripple pitches by which the toes lag behind the middle of the bead: the crescents of a weld."""
RIPPLE_SKEW = 0.6
"""Lean of each ripple, 0 for a cosine; below 1 it stays single-crested."""


@dataclass(frozen=True)
class Section:
    """The design of the joint's cross-section (x, z), m, and where its parts lie on the developed front."""

    embedding: float
    bevel_depth: float
    """Along the foot, m."""
    bevel_height: float
    """Along the face, m."""
    bead_length: float
    """Of the unrippled bead from toe to toe, m."""
    base_front: float
    """From the base plate's edge to the toe, m."""
    upright_front: float
    """From the toe to the top of the upright, m."""
    rust: float
    """v below which the base plate is not ground, at least 0."""

    @property
    def developed(self) -> float:
        """Length of the front that v in [0, 1] runs over, m."""
        return self.base_front + self.bead_length + self.upright_front

    @property
    def toes(self) -> tuple[float, float]:
        """v of the bead's toe on the base and on the upright."""
        return self.base_front / self.developed, (self.base_front + self.bead_length) / self.developed


def section(shape: WeldTee) -> Section:
    """Cross-section of a joint."""
    slope = math.tan(shape.bevel_angle)
    depth = (1 - ROOT_FACE) * shape.thickness
    if slope * depth > BEVEL_REACH * shape.leg:
        depth = BEVEL_REACH * shape.leg / slope
    height = depth * slope
    if height < 1e-6 * shape.leg:
        depth = height = 0.0
    half_arc = _half_arc(shape)
    chord = shape.leg * math.sqrt(2)
    bead = chord if half_arc == 0.0 else chord * half_arc / math.sin(half_arc)
    base, upright = shape.base_width / 2 - shape.leg, shape.upright_height - shape.leg
    return Section(
        embedding=EMBEDDING * min(shape.leg, shape.thickness, shape.length, base, upright),
        bevel_depth=depth,
        bevel_height=height,
        bead_length=bead,
        base_front=base,
        upright_front=upright,
        rust=max(0.0, base - shape.ground_band) / (base + bead + upright),
    )


def bead_surface(shape: WeldTee, across: Float, y: Float) -> Float:
    """(..., 3) points of the bead, m: `across` from 0 at the base's toe to 1 at the upright's, y along the seam, m.

    A circular arc through the toes with the asked convexity, and ripples added to the distance from the joint's corner:
    a cosine skewed along the seam, delayed with the square of the distance from the middle, fading to 0 at the toes.
    """
    half_arc = _half_arc(shape)
    chord = shape.leg * math.sqrt(2)
    side = 2.0 * across - 1.0
    if half_arc == 0.0:
        along, out = chord / 2 * side, np.zeros_like(side)
    else:
        radius = chord / (2 * math.sin(half_arc))
        along, out = radius * np.sin(half_arc * side), radius * (np.cos(half_arc * side) - math.cos(half_arc))
    # Axes at 45 deg: along the chord from the base's toe to the upright's, and outward from the corner.
    x = shape.leg / 2 + (out - along) / math.sqrt(2)
    z = shape.leg / 2 + (out + along) / math.sqrt(2)
    phase = 2.0 * np.pi * (y / shape.ripple_pitch - RIPPLE_BOW * side**2)
    wave = 0.5 * np.cos(phase + RIPPLE_SKEW * np.sin(phase))
    factor = 1.0 + shape.ripple_height * (1.0 - side**4) * wave / np.hypot(x, z)
    return np.stack(np.broadcast_arrays(x * factor, y, z * factor), axis=-1)


def weld_tee_mesh(shape: WeldTee) -> Mesh:
    """The joint as one mesh of three closed parts: base plate, upright, bead (in this order)."""
    design = section(shape)
    parts = [_base(shape, design), _upright(shape, design), _bead(shape, design)]
    offsets = np.cumsum([0, *(len(part.vertices) for part in parts[:-1])])
    return mesh(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate([part.triangles.astype(np.int64) + offset for part, offset in zip(parts, offsets, strict=True)]),
        np.concatenate([part.uv for part in parts if part.uv is not None]),
    )


def bead_outline(shape: WeldTee, design: Section, across: int, y: Float) -> Float:
    """(n, across + 1 + hidden, 3) closed outlines of the bead at each y (n,), counter-clockwise seen from -y.

    First the visible points from toe to toe, then the hidden ones: the surface carried on into the upright, down
    behind the bevel, along under the base and up to the first toe.
    """
    e = 2 * design.embedding
    visible = bead_surface(shape, np.linspace(0.0, 1.0, across + 1)[None, :], y[:, None])
    contact = math.pi / 4 + _half_arc(shape)
    inward = e / math.tan(contact)  # by the arc's tangent, so that the surface enters the plate without a kink
    hidden = [[-e, shape.leg + inward]]
    if design.bevel_height > 0.0:
        back = -design.bevel_depth - e
        hidden += [[-e, design.bevel_height + e], [back, e], [back, -e]]
    else:
        hidden += [[-e, -e]]
    hidden += [[shape.leg + inward, -e]]
    points = np.empty((len(y), len(hidden), 3))
    points[:, :, 0], points[:, :, 2] = np.array(hidden).T[:, None, :]
    points[:, :, 1] = y[:, None]
    return np.concatenate([visible, points], axis=1)


def _half_arc(shape: WeldTee) -> float:
    """Half of the angle that the bead's arc spans, rad; its sagitta is the convexity."""
    return 2.0 * math.atan(2.0 * shape.convexity / (shape.leg * math.sqrt(2)))


def _base(shape: WeldTee, design: Section) -> Mesh:
    """The base plate: its front develops v, all its other sides show what lies beyond the ground band."""
    half, t = shape.base_width / 2, shape.thickness
    profile = np.array([[-half, -t], [half, -t], [half, 0.0], [shape.leg, 0.0], [-half, 0.0]])
    plate = prism(profile, np.array([[0, 1, 3], [1, 2, 3], [0, 3, 4]]), shape.length)
    r = design.rust
    return _with_front(plate, profile, r, [(0.0, r), (r, 0.0), (0.0, design.toes[0]), (r, 0.0), (0.0, r)])


def _upright(shape: WeldTee, design: Section) -> Mesh:
    """The upright, its foot embedded in the base and its ends drawn back, both by the embedding."""
    t, e, height = shape.thickness, design.embedding, shape.upright_height
    front = [[0.0, shape.leg], [0.0, height], [-t, height]]
    if design.bevel_height > 0.0:
        foot = [[-design.bevel_depth, -e], [-design.bevel_depth, 0.0], [0.0, design.bevel_height]]
    else:
        foot = [[0.0, -e]]
    profile = np.array([[-t, -e], *foot, *front])
    n = len(profile)
    # A fan from the top of the back sees every edge, also past the bevel's reflex corner.
    caps = np.array([[n - 1, i, i + 1] for i in range(n - 2)])
    plate = prism(profile, caps, shape.length - 2 * e)
    r = design.rust
    sides = [(0.0, r)] * (n - 3) + [(design.toes[1], 1.0), (r, 0.0), (0.0, r)]
    return _with_front(plate, profile, r, sides)


def _with_front(plate: Mesh, profile: Float, rust: float, sides: list[tuple[float, float]]) -> Mesh:
    """A prism with v from `sides`, one (from, to) for each edge of its profile, and ends within v <= rust."""
    assert plate.uv is not None
    n = len(profile)
    v0, v1 = np.array(sides).T
    zero, one = np.zeros(n), np.ones(n)
    ends = plate.uv[2 * n :] * (1.0, rust)
    uv = np.concatenate(
        [corners_uv((zero, v0), (one, v0), (one, v1)), corners_uv((zero, v0), (one, v1), (zero, v1)), ends]
    )
    return mesh(plate.vertices, plate.triangles.astype(np.int64), uv)


def _bead(shape: WeldTee, design: Section) -> Mesh:
    """The bead: its outline swept along y, with a fan from the joint's corner on either end."""
    hidden = 5 if design.bevel_height > 0.0 else 3
    # Cells four times as long across as along the seam, where the ripples run.
    across = max(4, round(math.sqrt(shape.triangles * design.bead_length / (8.0 * shape.length))))
    m = across + 1 + hidden
    along = max(1, round((shape.triangles - 2 * m) / (2 * m)))
    half = shape.length / 2 - 2 * design.embedding
    y = np.linspace(-half, half, along + 1)
    rings = bead_outline(shape, design, across, y).reshape(-1, 3)
    centres = np.array([[0.0, -half, 0.0], [0.0, half, 0.0]])

    i = np.arange(m)
    j = (i + 1) % m
    row = np.arange(along)[:, None] * m
    a, b, c, d = (np.ravel(row + k) for k in (i, i + m, j + m, j))
    first, last = np.full(m, len(rings)), np.full(m, len(rings) + 1)
    triangles = np.concatenate(
        [
            np.stack([a, b, c], axis=1),
            np.stack([a, c, d], axis=1),
            np.stack([first, i, j], axis=1),
            np.stack([last, along * m + j, along * m + i], axis=1),
        ]
    )
    toe0, toe1 = design.toes
    past = design.embedding * 2 / design.developed
    v = np.concatenate([np.linspace(toe0, toe1, across + 1), [toe1 + past], np.full(hidden - 2, toe1), [toe0 - past]])
    u = y / shape.length + 0.5
    u0, u1 = np.repeat(u[:-1], m), np.repeat(u[1:], m)
    v0, v1 = np.tile(v, along), np.tile(v[j], along)
    one, middle = np.ones(m), np.full(m, (toe0 + toe1) / 2)
    uv = np.concatenate(
        [
            corners_uv((u0, v0), (u1, v0), (u1, v1)),
            corners_uv((u0, v0), (u1, v1), (u0, v1)),
            corners_uv((u[0] * one, middle), (u[0] * one, v), (u[0] * one, v[j])),
            corners_uv((u[-1] * one, middle), (u[-1] * one, v[j]), (u[-1] * one, v)),
        ]
    )
    return mesh(np.concatenate([rings, centres]), triangles, uv)
