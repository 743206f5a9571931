"""How a laser's plane stands, and the section that its profile is of: that plane, an upright one, or across an axis.

Heights that are read in a leaning plane are longer than those of the part. A part that is the same all along one
direction, as a rail or a seam is, has its own, drawn, dimensions in the section across that direction, onto which the
points are carried along it.
"""

from __future__ import annotations

import math

import numpy as np

from analysis.gauges.profile import Section
from render.base.arrays import Float
from render.base.pose import invert
from render.scene.scene import Scene
from studio.project.project import ProfileSection, Project

SECTIONS: dict[ProfileSection, str] = {
    "laser_plane": "In the laser's plane",
    "upright": "In an upright section",
    "across_x": "In a section across X",
    "across_y": "In a section across Y",
    "across_z": "In a section across Z",
}
"""As the list of sections, beside the measures in the window, has them."""
AXES: dict[ProfileSection, str] = {
    "across_x": "the world's X",
    "across_y": "the world's Y",
    "across_z": "the world's Z",
}
"""Sections across an axis, and how it is called."""
UPRIGHT = math.radians(0.5)
"""Leaning by less is not told: a height is 0.004 % longer."""
NEARLY_LEVEL = math.radians(80.0)


def sheet_lean(scene: Scene, laser: int, step: int = 0) -> float:
    """rad, of the plane of a laser from the vertical of the world."""
    normal = (scene.T_world_camera(step) @ scene.T_camera_laser(laser))[:3, 0]
    return math.asin(min(abs(float(normal[2])), 1.0))


def T_section_camera(scene: Scene, laser: int, step: int, section: ProfileSection) -> Float:
    """(4, 4) from the camera's frame to the section's: x across its plane, y across the fan, z away from the laser.

    Both start at the laser; the section's is turned as little as it takes.
    """
    T_camera_laser, T_world_camera = scene.T_camera_laser(laser), scene.T_world_camera(step)
    if section == "laser_plane":
        return invert(T_camera_laser)
    T_world_laser = T_world_camera @ T_camera_laser
    normal = section_normal(T_world_laser, section)
    across, down = (T_world_laser[:3, k] - normal * (normal @ T_world_laser[:3, k]) for k in (1, 2))
    if np.linalg.norm(across) < np.linalg.norm(down):
        across = np.cross(down, normal)
    across /= np.linalg.norm(across)
    T_world_section = T_world_laser.copy()
    T_world_section[:3, :3] = np.stack([normal, across, np.cross(normal, across)], axis=1)
    return invert(T_world_section) @ T_world_camera


def section_normal(T_world_laser: Float, section: ProfileSection) -> Float:
    """(3,) unit, in the world: along which points are carried, on the side of the sheet's own normal.

    Of a level sheet no section is upright: its own normal is given.
    """
    own = T_world_laser[:3, 0]
    along = own * [1.0, 1.0, 0.0] if section == "upright" else np.eye(3)[list(AXES).index(section)]
    length = float(np.linalg.norm(along))
    if length < 1e-6:
        return np.asarray(own)
    return np.asarray(along / length * (1.0 if along @ own >= 0.0 else -1.0))


def section_of(scene: Scene, laser: int, step: int, section: ProfileSection) -> Section:
    """Its name, and the others that the list has and that show the line's points apart, as seen from its frame."""
    T_world_camera = scene.T_world_camera(step)
    T_world_laser = T_world_camera @ scene.T_camera_laser(laser)
    turned = T_section_camera(scene, laser, step, section)[:3, :3] @ T_world_camera[:3, :3].T
    own = T_world_laser[:3, 0]
    normals = {name: own if name == "laser_plane" else section_normal(T_world_laser, name) for name in SECTIONS}
    others = tuple(
        (SECTIONS[name], turned @ normal)
        for name, normal in normals.items()
        if name != section and float(normal @ own) > math.cos(NEARLY_LEVEL)
    )
    return Section(in_words(section), others)


def in_words(section: ProfileSection) -> str:
    """ "in the laser's plane"."""
    title = SECTIONS[section]
    return title[:1].lower() + title[1:]


def section_note(project: Project) -> str:
    """For a report, of the lasers that are measured: what their section does to measures; empty: nothing."""
    lasers = sorted({gauge.laser for gauge in project.measures if not gauge.of_scan})
    told = [lean_text(project.scene, laser, 0, project.measured_in) for laser in lasers]
    different = dict.fromkeys(filter(None, told))
    if len(lasers) == 1 or len(different) == 1 == len(set(told)):
        return next(iter(different), "")
    return " ".join(f"{project.scene.lasers[i].name}: {text}" for i, text in zip(lasers, told, strict=True) if text)


def lean_text(scene: Scene, laser: int, step: int = 0, section: ProfileSection = "laser_plane") -> str:
    """What that does to measures; empty: nothing."""
    lean = sheet_lean(scene, laser, step)
    if section in AXES or (section == "upright" and lean <= NEARLY_LEVEL):
        return _carried_text(scene.T_world_camera(step) @ scene.T_camera_laser(laser), section)
    if lean < UPRIGHT:
        return ""
    if lean > NEARLY_LEVEL:
        return "The laser's plane is nearly level: no height of a level part shows in it."
    return (
        f"Read in the laser's plane, which leans by {math.degrees(lean):.1f}° from the vertical: a level part's "
        f"height reads as {1.0 / math.cos(lean):.4g} times itself, angles follow, and the truth too. The list of "
        "sections has others."
    )


def _carried_text(T_world_laser: Float, section: ProfileSection) -> str:
    normal = section_normal(T_world_laser, section)
    between = math.acos(min(abs(float(normal @ T_world_laser[:3, 0])), 1.0))
    if between < UPRIGHT:
        return ""
    x, y, z = (f"{value:.3g}" for value in np.round(normal, 3) + 0.0)
    way = AXES.get(section, f"({x}, {y}, {z})")
    if between > NEARLY_LEVEL:
        return f"The laser's plane runs nearly along {way}: it shows no section across that."
    return (
        f"Points are carried along {way}, {math.degrees(between):.1f}° from across the laser's plane: right for a part "
        "that is the same all along that direction."
    )
