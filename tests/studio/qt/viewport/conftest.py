"""One 3D view of the tilted plane for many tests: making a window of VTK's takes longer than most of them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from studio.project.document import Document
from studio.project.project import Project
from studio.qt.core import theme
from studio.qt.core.session import Session
from studio.qt.viewport.viewport import Viewport

SAMPLE = Path(__file__).parents[4] / "assets/projects/plane/project.json"


def sample() -> Document:
    return Document(Project.load(SAMPLE), SAMPLE)


@pytest.fixture(scope="module")
def one_viewport(qapp: QApplication) -> Iterator[Viewport]:
    theme.apply("dark")
    made = Viewport(Session(sample()))
    made.resize(700, 560)
    made.show()
    yield made
    made.close()


@pytest.fixture
def viewport(qtbot: QtBot, one_viewport: Viewport) -> Viewport:
    """Of the sample, seen from where it is first seen; with the keys."""
    made = one_viewport
    made.session.replace_document(sample())
    made.set_local(False)
    made.set_parallel(False)
    made.activateWindow()
    made.view.setFocus()
    # the eye stands only now where a new view has it
    made._frame_soon = True
    made._draw()
    qtbot.waitUntil(lambda: made.live.look.project is made.session.project and len(made.live.look.placed) == 1)
    qtbot.waitUntil(lambda: not made._frame_soon and made.view.paints > 0 and made.view.hasFocus())
    return made
