"""Icons of the items of a scene: thin lines in the text's colour, a laser's sheet in the colour of its light."""

from __future__ import annotations

from PySide6.QtGui import QIcon

from analysis.report.colour import hex_colour, wavelength_colour
from render.laser.laser import LineLaser
from studio.project.document import FieldPath, value_at
from studio.project.project import Project
from studio.qt.core.icons import drawn

SHAPES = {
    "project": "<path d='M6 3h8l4 4v14H6zM14 3v4h4'/>",
    "rig": "<path d='M3 7h18M6 7v4M18 7v4M4 11h5v4H4zM15 11h5v4h-5zM12 7V3'/>",
    "camera": "<path d='M3 8h13v9H3zM16 11l5-3v9l-5-3'/><circle cx='9.5' cy='12.5' r='2.4'/>",
    "laser": "<path d='M9 3h6v6H9z'/><path d='M12 9L4 21h16z' fill='{accent}' fill-opacity='.45' stroke='{accent}'/>",
    "lasers": "<path d='M9 3h6v6H9zM12 9L4 21M12 9v12M12 9l8 12'/>",
    "objects": "<path d='M12 4l7 4v8l-7 4-7-4V8zM5 8l7 4 7-4M12 12v8'/>",
    "file": "<path d='M12 3l9 16H3zM12 3l-2 16M12 3l3.5 16M7.5 11h9'/>",
    "plane": "<path d='M7 7h14l-4 10H3z'/>",
    "box": "<path d='M12 4l7 4v8l-7 4-7-4V8zM5 8l7 4 7-4M12 12v8'/>",
    "sphere": "<circle cx='12' cy='12' r='8'/><path d='M4 12c3 3.5 13 3.5 16 0M12 4c-4 4-4 12 0 16'/>",
    "cylinder": "<path d='M6 6v12c0 3 12 3 12 0V6'/><ellipse cx='12' cy='6' rx='6' ry='2.5'/>",
    "step_block": "<path d='M4 20v-4h4v-4h4V8h4V4h4v16z'/>",
    "v_groove": "<path d='M3 8h5l4 7 4-7h5v11H3z'/>",
    "weld_tee": "<path d='M3 17h18v3H3zM8 17V4h3v10'/><path d='M11 12c1 3 3 4.5 6 5h-6z' fill='currentColor'/>",
    "lights": "<path d='M9 18h6M10 21h4M12 3a6 6 0 0 0-3.5 11c.8.700.5 1.500.5 1.5h6s-.3-.8.5-1.5A6 6 0 0 0 12 3z'/>",
    "rectangle": "<path d='M5 4h14v7H5zM7 14l-2 5M12 14v5M17 14l2 5'/>",
    "environment": "<circle cx='12' cy='12' r='4'/><path d='M12 3v3M12 18v3M3 12h3M18 12h3M5.6 5.6l2 2M16.4 16.4l2 2"
    "M18.4 5.6l-2 2M7.6 16.4l-2 2'/>",
    "motion": "<path d='M3 12h18M17 8l4 4-4 4M3 8v8M8 9.5v5M12 9.5v5'/>",
    "sensor": "<path d='M6 6h12v12H6zM10 6v12M14 6v12M6 10h12M6 14h12M3 9h3M3 15h3M18 9h3M18 15h3'/>",
    "render": "<path d='M4 5h16v14H4zM4 16l5-5 4 4 3-3 4 4'/><circle cx='9' cy='9' r='1.2'/>",
    "extraction": "<path d='M3 19c5 0 6-14 9-14s4 14 9 14M12 3v18' /><path d='M12 3v18' stroke-dasharray='2 2.5'/>",
    "delivery": "<path d='M6 3h12v18H6zM9 8h6M9 12h6M9 16h3'/>",
    "problem": "<path d='M12 4l9.500 16.500h-19zM12 10v5M12 17.200v.6'/>",
    "eye": "<path d='M2.5 12c4-7 15-7 19 0-4 7-15 7-19 0z'/><circle cx='12' cy='12' r='2.8'/>",
    "hidden": "<path d='M3 13c4 6 14 6 18 0M6 16l-1.5 2.5M12 17.5v3M18 16l1.5 2.5' opacity='.55'/>",
}


def scene_icon(name: str, accent: str = "") -> QIcon:
    """One of `SHAPES`; accent: #rrggbb of a laser's light."""
    return drawn(SHAPES[name], accent)


def icon_name(project: Project, path: FieldPath) -> tuple[str, str]:
    """Name and accent of an item's icon."""
    if not path:
        return "project", ""
    if isinstance(path[-1], str):
        return path[-1], ""
    item = value_at(project, path)
    if isinstance(item, LineLaser):
        return "laser", hex_colour(wavelength_colour(item.wavelength_nm))
    kind = item.shape.kind if hasattr(item, "shape") else "lights" if item.kind == "point" else item.kind
    return (kind if kind in SHAPES else "objects"), ""


def item_icon(project: Project, path: FieldPath) -> QIcon:
    """The icon of an item of the scene."""
    return scene_icon(*icon_name(project, path))
