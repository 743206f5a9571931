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
    from PIL import Image

    try:
        data = read_bytes(inside(root, name, "delivery.logo"), MOST_BYTES, "logo")
        opened = Image.open(io.BytesIO(data), formats=("PNG", "JPEG"))
        if opened.width * opened.height > MOST_PIXELS:
            raise ValueError(f"it has {opened.width} x {opened.height} px")
        whole = opened.convert("RGBA")
        whole.thumbnail((WIDEST, TALLEST), Image.Resampling.LANCZOS)
        ground = Image.new("RGBA", whole.size, "white")
        ground.alpha_composite(whole)
        return image_uri(np.asarray(ground.convert("RGB"))), ""
    except (InputError, OSError, ValueError, SyntaxError) as error:
        return "", f"The logo {name} is not shown: {error}."
