"""The Motion panel, which is of no workspace, where it is called for: by the scene tree, and to run a scan or go on."""

from __future__ import annotations

from collections.abc import Callable

from studio.qt.core.actions import Actions
from studio.qt.render.motion_panel import MotionPanel
from studio.qt.scene.scene_tree import SceneTree
from studio.qt.shell.panels import Panels


def join_motion(panels: Panels, commands: Actions, call_panel: Callable[[str], None]) -> None:
    """call_panel: brings a panel to the front by its key."""
    motion, tree = panels["motion"], panels["scene"]
    assert isinstance(motion, MotionPanel) and isinstance(tree, SceneTree)

    def call(then: Callable[[], object]) -> Callable[[], None]:
        def called() -> None:
            call_panel("motion")
            then()

        return called

    def allow() -> None:
        commands["resume_scan"].setEnabled(motion.stopped is not None)

    tree.motion_clicked.connect(call(lambda: None))
    commands.connect("scan", call(motion.ask_and_run))
    commands.connect("resume_scan", call(motion.ask_and_resume))
    motion.stopped_changed.connect(allow)
    allow()
