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
    only: str = ""
    """Peers that count, by the start of their name; empty: all."""


BARS = (
    Bar("s1", "line", 0.01, 150.0),
    Bar("s1", "line", 0.001, 1000.0),
    Bar("s2", "line", 0.02, 8.0),
    Bar("s2", "reflection", 0.10, 6.0),
    Bar("s2", "reflection", 0.03, 6.0),
    Bar("s2-shiny", "reflection", 0.10, 8.0),
    Bar("s3", "reflection", 0.10, 10.0, "luxcore"),
)
