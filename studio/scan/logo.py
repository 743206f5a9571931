"""The logo of a report: an image of the project's folder as it stands in the page; and what a report lacks. Qt-free."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from analysis.report.style import image_uri
from render.base.errors import InputError
from render.base.files import inside, read_bytes
from studio.project.project import Project

MOST_BYTES = 16 * 2**20
WIDEST, TALLEST = 640, 240
"""px in the page."""
MOST_PIXELS = 50_000_000
ALLOWED = "allowed: a PNG or JPEG in that folder, by its path from there, such as logo.png"
CURE = "copy it there, or choose it by the button … of the field, which does"


def logo_remarks(project: Project, root: Path) -> list[str]:
    """Why its logo, or its surface, is not in a project's report: for who makes it, and not for who is handed it."""
    return [*filter(None, [logo_uri(project.delivery.logo, root)[1], gone(project)])]


def gone(project: Project) -> str:
    """That the object on which the surface is judged is not there, so that nothing is decided; empty: it is."""
    wanted, names = project.delivery.surface_of, [item.name for item in project.scene.visible_objects]
    if not wanted or wanted in names:
        return ""
    return (
        f"The report judges the surface of {wanted!r}, which is no visible object: choose another ({', '.join(names)})"
    )


def logo_uri(name: str, root: Path) -> tuple[str, str]:
    """data: URI of a PNG, and why there is none; both empty: no logo is named. What is transparent becomes white."""
    if not name:
        return "", ""
    from PIL import Image, UnidentifiedImageError

    try:
        file = inside(root, name, "delivery.logo")
    except InputError:
        return "", f"The logo {name} is not shown: it lies outside of the project's folder; {ALLOWED}; {CURE}."
    try:
        opened = Image.open(io.BytesIO(read_bytes(file, MOST_BYTES, "logo")), formats=("PNG", "JPEG"))
        if opened.width * opened.height > MOST_PIXELS:
            raise ValueError(f"it has {opened.width} x {opened.height} px")
        whole = opened.convert("RGBA")
        whole.thumbnail((WIDEST, TALLEST), Image.Resampling.LANCZOS)
        ground = Image.new("RGBA", whole.size, "white")
        ground.alpha_composite(whole)
        return image_uri(np.asarray(ground.convert("RGB"))), ""
    except UnidentifiedImageError:
        return "", f"The logo {name} is not shown: it is neither a PNG nor a JPEG."
    except (InputError, OSError, ValueError, SyntaxError) as error:
        return "", f"The logo {name} is not shown: {error}."
