"""A session on a saved project, and the inspector on it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from studio.qt.core.session import Session
from studio.qt.scene.inspector import Inspector
from tests.studio.qt.scene.inspector_hands import inspector_window, sample_session


@pytest.fixture
def session(tmp_path: Path) -> Session:
    return sample_session(tmp_path)


@pytest.fixture
def inspector(session: Session, qtbot: QtBot) -> Iterator[Inspector]:
    with inspector_window(session, qtbot) as panel:
        yield panel
