"""How a laser's plane stands, and the section that its profile is of: that plane, or an upright one.

Heights that are read in a leaning plane are longer than those of the part. A part that is the same all along its way
under the sheet has its own, drawn, dimensions in an upright section, onto which the points are carried level.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from render.base.arrays import Float
from render.base.pose import invert
from render.scene.scene import Scene
from studio.project.project import Project

Section = Literal["laser_plane", "upright"]
UPRIGHT = math.radians(0.5)
"""Leaning by less is not told: a height is 0.004 % longer."""
NEARLY_LEVEL = math.radians(80.0)


def sheet_lean(scene: Scene, laser: int, step: int = 0) -> float:
    """rad, of the plane of a laser from the vertical of the world."""
    normal = (scene.T_world_camera(step) @ scene.T_camera_laser(laser))[:3, 0]
    return math.asin(min(abs(float(normal[2])), 1.0))


def T_section_camera(scene: Scene, laser: int, step: int, section: Section) -> Float:
    """(4, 4) from the camera's frame to the section's: x across its plane, y across the fan, z away from the laser.

    Both start at the laser. An upright section holds the vertical of the world, and is turned as little as that takes.
    Of a level sheet there is none: its own plane is given.
    """
    T_camera_laser = scene.T_camera_laser(laser)
    T_world_camera = scene.T_world_camera(step)
    if section == "laser_plane":
        return invert(T_camera_laser)
    T_world_laser = T_world_camera @ T_camera_laser
    level = T_world_laser[:3, 0] * [1.0, 1.0, 0.0]
    if (length := float(np.linalg.norm(level))) < 1e-6:
        return invert(T_camera_laser)
    normal = level / length
    across = T_world_laser[:3, 1] - normal * (normal @ T_world_laser[:3, 1])
    across /= np.linalg.norm(across)
    T_world_section = T_world_laser.copy()
    T_world_section[:3, :3] = np.stack([normal, across, np.cross(normal, across)], axis=1)
    return invert(T_world_section) @ T_world_camera


def section_note(project: Project) -> str:
    """For a report, of the lasers that are measured: what their section does to measures; empty: nothing."""
    lasers = sorted({gauge.laser for gauge in project.measures if not gauge.of_scan})
    told = [lean_text(project.scene, laser, 0, project.measured_in) for laser in lasers]
    different = dict.fromkeys(filter(None, told))
    if len(lasers) == 1 or len(different) == 1 == len(set(told)):
        return next(iter(different), "")
    return " ".join(f"{project.scene.lasers[i].name}: {text}" for i, text in zip(lasers, told, strict=True) if text)


def lean_text(scene: Scene, laser: int, step: int = 0, section: Section = "laser_plane") -> str:
    """What that does to measures; empty: nothing."""
    lean = sheet_lean(scene, laser, step)
    if lean < UPRIGHT:
        return ""
    if lean > NEARLY_LEVEL:
        return "The laser's plane is nearly level: no height of a level part shows in it."
    leans = f"which leans by {math.degrees(lean):.1f}° from the vertical"
    if section == "upright":
        return (
            f"Points of the laser's plane, {leans}, are carried level onto an upright section: right for a part that "
            "is the same all along its way under the sheet."
        )
    return (
        f"Read in the laser's plane, {leans}: across a level part a height reads as {1.0 / math.cos(lean):.4g} times "
        "itself and angles follow, and the truth does too."
    )
