"""While a render refines, its depth may still be to come, which the sensor's defocus needs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from pytestqt.qtbot import QtBot

from studio.qt.core.render import Render
from studio.qt.render.develop_panel import DevelopPanel
from tests.studio.qt.small_session import small_render, small_session


def test_until_its_depth_is_there_a_render_is_developed_in_focus_and_not_measured(qtbot: QtBot) -> None:
    """A red message told to switch defocus off, in the middle of a render that went well."""
    session = small_session()
    session.set(("sensor", "defocus"), True)
    session.set(("scene", "rig", "camera", "lens", "focus_distance"), 0.3)
    world, frame = small_render()
    blurred = session.project
    refined = Render(1, blurred, world, replace(frame, truth=None), final=False)
    panel = DevelopPanel(session)
    qtbot.addWidget(panel)
    errors: list[str] = []
    session.message.connect(lambda kind, text: errors.append(f"{kind}: {text}"))
    session.add_render(refined)
    qtbot.waitUntil(lambda: bool(refined.images) and not panel.busy, timeout=20_000)
    assert not errors and not refined.measurements
    assert "in focus until its depth is rendered" in panel.told.text()
    sharp = refined.images[0].pixels.astype(np.float64)

    refined.frame, refined.final = frame, True
    panel.refresh()
    qtbot.waitUntil(lambda: bool(refined.measurements) and not panel.busy, timeout=20_000)
    assert not errors and "defocus by developing" in panel.told.text() and "in focus" not in panel.told.text()
    assert refined.images[0].pixels.max() < sharp.max()
