"""The Motion panel, which is of no workspace, where it is called for: by the scene tree, to run a scan or go on, and
behind Design where the project moves, as soon as it does."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtWidgets import QDockWidget

from studio.qt.core.actions import Actions
from studio.qt.render.motion_panel import MotionPanel
from studio.qt.scene.scene_tree import SceneTree
from studio.qt.shell.panels import Panels

BESIDE = "readout"
"""The panel that it comes behind."""


def join_motion(
    panels: Panels,
    commands: Actions,
    docks: dict[str, QDockWidget],
    call_panel: Callable[[str], None],
    workspace: Callable[[], str],
) -> Callable[[], None]:
    """call_panel: brings a panel to the front by its key. workspace: the key of the one that is shown.

    What is returned offers the panel there: as a tab, and what was in front stays there.
    """
    motion, tree = panels["motion"], panels["scene"]
    assert isinstance(motion, MotionPanel) and isinstance(tree, SceneTree)

    def call(then: Callable[[], object]) -> Callable[[], None]:
        def called() -> None:
            call_panel("motion")
            then()

        return called

    def allow() -> None:
        commands["resume_scan"].setEnabled(motion.stopped is not None)

    def offer() -> None:
        if workspace() == "setup" and motion.session.project.scene.frame_count > 1 and docks["motion"].isHidden():
            call_panel("motion")
            docks[BESIDE].raise_()

    still = motion.session.project.scene.motion.kind

    def follow() -> None:
        nonlocal still
        before, still = still, motion.session.project.scene.motion.kind
        if before != still:
            offer()

    motion.session.project_changed.connect(follow)
    tree.motion_clicked.connect(call(lambda: None))
    commands.connect("scan", call(motion.ask_and_run))
    commands.connect("resume_scan", call(motion.ask_and_resume))
    motion.stopped_changed.connect(allow)
    allow()
    return offer
