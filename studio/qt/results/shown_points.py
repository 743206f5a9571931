"""The points of what is shown: of a whole scan as its folder has them, of a single render as it is measured now."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from analysis.cloud import Cloud, cloud, merge
from render.base.errors import InputError
from render.scene.scene import Scene
from studio.qt.core.session import Session
from studio.scan.deviation import read_cloud
from studio.scan.height_map import points_of
from studio.scan.remarks import best

NOTHING = "Render first, or open the results of a scan: there are no points yet."
Points = tuple[Scene, Path, Callable[[], Cloud]]
"""Scene, folder of its meshes, and what reads the points, apart from the window's thread."""


def are_there(session: Session) -> bool:
    """Something is measured."""
    render = session.shown
    return render is not None and (bool(render.measurements) or (render.scan is not None and render.scan.measured))


def shown_points(session: Session) -> Points:
    """InputError: nothing is measured yet."""
    render = session.shown
    if render is None or not are_there(session):
        raise InputError("there are no points yet", cure="render first, or open the results of a scan")
    scan = render.scan
    if scan is not None and scan.measured:
        found = scan.found
        return found.project.scene, found.root, lambda: read_cloud(points_of(found.folder))
    scene = render.project.scene
    parts = best(render.measurements, session.project)
    clouds = [cloud(one.points, one.errors, one.laser, one.step, scene) for one in parts]
    return scene, session.document.root, lambda: merge(clouds)
