"""The measure menu: from scan line to scan line."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from PySide6.QtCore import QObject

from studio.qt.core.actions import Actions
from studio.qt.core.session import Session
from studio.scan.remarks import best
from studio.scan.stages import Measurement


class MeasureActions(QObject):
    """Moves the hovered scan line; what is hovered is marked in every view."""

    def __init__(self, window: Any, session: Session, actions: Actions) -> None:
        """window: the main one, which has the panels."""
        super().__init__(window)
        self.window = window
        self.session, self.actions = session, actions
        actions.connect("previous_line", lambda: self.step(-1))
        actions.connect("next_line", lambda: self.step(1))
        actions.connect("worst_line", self.worst)
        for key in ("deviation", "section", "heights"):
            actions.connect(key, partial(self.inspect, key))
        session.renders_changed.connect(self.refresh)
        session.measured.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        there = self._best() is not None
        for key in ("previous_line", "next_line", "worst_line"):
            self.actions[key].setEnabled(there)

    def step(self, by: int) -> None:
        """The next scan line that has a point, in a direction."""
        best = self._best()
        if best is None:
            return
        lines = np.unique(best.points.index[best.points.valid])
        if len(lines) == 0:
            return
        now = self.session.hovered
        if now is None:
            self.session.hover(int(lines[len(lines) // 2]))
            return
        beyond = lines[lines > now] if by > 0 else lines[lines < now]
        if len(beyond):
            self.session.hover(int(beyond[0] if by > 0 else beyond[-1]))

    def worst(self) -> None:
        """The scan line with the largest error of depth."""
        best = self._best()
        if best is not None and np.isfinite(best.errors.depth).any():
            self.session.hover(int(best.points.index[np.nanargmax(np.abs(best.errors.depth))]))

    def inspect(self, key: str) -> None:
        """The panel of deviation, section and height map, with the tab that was asked for."""
        self.window.call_panel("nominal")
        panel = self.window.panels["nominal"]
        panel.show_tab(getattr(panel, key))

    def _best(self) -> Measurement | None:
        """The shown render's first laser, by the project's own method."""
        render = self.session.shown
        if render is None or not render.measurements:
            return None
        found = best(render.measurements, self.session.project)
        return found[0] if found else None
