"""What a person waits for and looks at of a scan in the window."""

from __future__ import annotations

from pytestqt.qtbot import QtBot

from studio.qt.core.render import Render
from studio.qt.results.results_panel import ResultsPanel
from studio.qt.shell.window import MainWindow


def results_of(window: MainWindow) -> ResultsPanel:
    panel = window.panels["results"]
    assert isinstance(panel, ResultsPanel)
    panel.scan_bar.scope.setCurrentIndex(0)
    return panel


def shown(window: MainWindow, qtbot: QtBot, step: int) -> Render:
    """The scan's step, measured."""

    def there() -> bool:
        render = window.session.shown
        return (
            render is not None
            and render.scan is not None
            and render.frame.step == step
            and len(render.measurements) == 3
        )

    qtbot.waitUntil(there)
    assert window.session.shown is not None
    return window.session.shown
