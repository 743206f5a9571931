"""What use leaves on a surface: dents and scratches, drawn from a seed. A description only, no triangles."""

from __future__ import annotations

from render.base.model import Model, quantity

MOST = 200
"""Dents, or scratches, of one object."""
FINEST = 1e-6
"""Of any length of a dent or scratch, m."""


class Wear(Model):
    """Marks at random places of an object's surface."""

    seed: int = quantity(0, label="Seed", help="Decides where the marks are.", ge=0, le=2**53 - 1)
    dents: int = quantity(0, label="Dents", ge=0, le=MOST)
    dent_radius: float = quantity(0.005, unit="m", label="Dent radius", ge=FINEST, le=1.0)
    dent_depth: float = quantity(
        0.0005, unit="m", label="Dent depth", help="At its middle; below 0 it is a bump.", ge=-0.1, le=0.1
    )
    scratches: int = quantity(0, label="Scratches", ge=0, le=MOST)
    scratch_length: float = quantity(0.03, unit="m", label="Scratch length", ge=FINEST, le=10.0)
    scratch_width: float = quantity(0.001, unit="m", label="Scratch width", ge=FINEST, le=0.1)
    scratch_depth: float = quantity(
        0.0001, unit="m", label="Scratch depth", help="Along its middle; below 0 it is a ridge.", ge=-0.01, le=0.01
    )
