"""The Motion panel, which is of no workspace, where it is called for: by the scene tree, to run a scan or go on, and
behind Design where the project moves, as soon as it does."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtWidgets import QDockWidget

from studio.qt.core.actions import Actions
from studio.qt.render.motion_panel import MotionPanel
from studio.qt.scene.scene_tree import SceneTree
from studio.qt.shell.panels import Panels

HOME, BESIDE = "setup", "readout"
"""The workspace that has it where the project moves, and the panel there that it comes behind."""


class MotionCalls:
    """`offer` gives the panel its place where the project moves, `leave` notes whether it is in front there."""

    def __init__(
        self,
        panels: Panels,
        commands: Actions,
        docks: dict[str, QDockWidget],
        call_panel: Callable[[str], None],
        workspace: Callable[[], str],
    ) -> None:
        """call_panel: brings a panel to the front by its key. workspace: the key of the one that is shown."""
        motion, tree = panels["motion"], panels["scene"]
        assert isinstance(motion, MotionPanel) and isinstance(tree, SceneTree)
        self._motion, self._commands, self._docks = motion, commands, docks
        self._call_panel, self._workspace = call_panel, workspace
        self._in_front = False
        """When its workspace was left."""
        self._kind = motion.session.project.scene.motion.kind
        motion.session.project_changed.connect(self._follow)
        tree.motion_clicked.connect(lambda: call_panel("motion"))
        commands.connect("scan", lambda: self._call(motion.ask_and_run))
        commands.connect("resume_scan", lambda: self._call(motion.ask_and_resume))
        motion.stopped_changed.connect(self._allow)
        self._allow()

    def offer(self) -> None:
        """As a tab: in front where it was when its workspace was left, else what is in front stays there."""
        moves = self._motion.session.project.scene.frame_count > 1
        if self._workspace() == HOME and moves and self._docks["motion"].isHidden():
            self._call_panel("motion")
            if not self._in_front:
                self._docks[BESIDE].raise_()

    def leave(self) -> None:
        """Another workspace is about to be shown."""
        if self._workspace() == HOME:
            self._in_front = not self._motion.visibleRegion().isEmpty()

    def _call(self, then: Callable[[], object]) -> None:
        self._call_panel("motion")
        then()

    def _allow(self) -> None:
        self._commands["resume_scan"].setEnabled(self._motion.stopped is not None)

    def _follow(self) -> None:
        before, self._kind = self._kind, self._motion.session.project.scene.motion.kind
        if before != self._kind:
            self._in_front = False
            self.offer()
