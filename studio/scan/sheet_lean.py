"""How a laser's plane stands: heights that are read in it are longer than those of the part where it leans."""

from __future__ import annotations

import math

from render.scene.scene import Scene

UPRIGHT = math.radians(0.5)
"""Leaning by less is not told: a height is 0.004 % longer."""


def sheet_lean(scene: Scene, laser: int, step: int = 0) -> float:
    """rad, of the plane of a laser from the vertical of the world."""
    normal = (scene.T_world_camera(step) @ scene.T_camera_laser(laser))[:3, 0]
    return math.asin(min(abs(float(normal[2])), 1.0))


def lean_text(scene: Scene, laser: int, step: int = 0) -> str:
    """What that does to measures; empty: nothing."""
    lean = sheet_lean(scene, laser, step)
    if lean < UPRIGHT:
        return ""
    if lean > math.radians(80.0):
        return "Read in the laser's plane, which is nearly level: no height of a level part shows in it."
    return (
        f"Read in the laser's plane, which leans by {math.degrees(lean):.1f}° from the vertical: across a level part a "
        f"height reads as {1.0 / math.cos(lean):.4g} times itself and angles follow, and the truth does too."
    )
