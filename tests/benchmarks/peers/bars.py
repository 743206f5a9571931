"""What is asked of ours, beside the best peer in the same run."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Bar:
    scene: str
    pixels: str
    """line: the lit pixels with 99.9 % of the light; reflection: those lit by way of two surfaces, or the caustic."""
    error: float
    ratio: float
    """Times sooner than the best peer."""


BARS = (
    Bar("s1", "line", 0.01, 150.0),
    Bar("s1", "line", 0.001, 1000.0),
    Bar("s2", "line", 0.02, 8.0),
    Bar("s2", "reflection", 0.10, 15.0),
    Bar("s2", "reflection", 0.03, 40.0),
    Bar("s2-shiny", "reflection", 0.10, 100.0),
    Bar("s3", "reflection", 0.10, 30.0),
    Bar("channel", "reflection", 0.03, 20.0),
    Bar("rocker", "reflection", 0.03, 20.0),
)
QUICK = {"s2": ("ours", "mitsuba ptracer, LLVM", "mitsuba ptracer, aimed", "luxcore light", "cycles guided")}
QUICK |= {
    "s2-shiny": ("ours", "mitsuba ptracer, LLVM", "mitsuba ptracer, aimed", "mitsuba path", "luxcore light"),
    "s3": ("ours", "mitsuba ptracer, aimed", "luxcore light", "luxcore hybrid"),
}
"""Scenes of the reflections' bars, and what comes near to one of them there, by the start of its name."""
