"""The points in the 3D view: of the shown render as the results show them, or of a running scan."""

from __future__ import annotations

from typing import Any

from studio.qt.core.session import Session
from studio.qt.shell.panels import Panels
from studio.qt.viewport.error_cloud import ErrorCloud
from studio.qt.viewport.measure_marks import MeasureMarks


def points_in_3d(session: Session, panels: Panels, viewport: Any) -> ErrorCloud:
    """Joined to the panels that say which points, and to those that hear of a point or a box that is chosen."""
    made, motion = ErrorCloud(session, viewport.view), panels["motion"]
    MeasureMarks(session, viewport.view, made)

    def join_results(results: Any) -> None:
        made.choose(results.view)
        made.of_scan_changed.connect(results.tell_growing)
        results.view_changed.connect(made.choose)
        results.scan_bar.scope_changed.connect(made.show_all_steps)
        results.region.changed.connect(lambda: made.show_box(results.region.region))

    panels.when_made("results", join_results)
    made.pressed.connect(lambda scan_line: panels["results"].pin(scan_line))  # type: ignore[attr-defined]
    made.boxed.connect(lambda box: panels["results"].choose(box))  # type: ignore[attr-defined]
    viewport.box.drawn.connect(made.take_box)
    motion.began.connect(made.begin_scan)  # type: ignore[attr-defined]
    motion.grew.connect(made.grow)  # type: ignore[attr-defined]
    return made
