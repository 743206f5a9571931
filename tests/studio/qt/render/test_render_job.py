"""What a render waits for: its first figures go before its reflected light."""

from __future__ import annotations

import threading

import pytest

from studio.qt.render import render_job
from studio.qt.render.render_job import FirstFigures
from tests.studio.qt.small_session import small_session


@pytest.fixture
def session(qtbot):
    made = small_session(rendered=True)
    made.measures = True
    return made


def test_it_waits_until_the_render_is_measured(session):
    figures, ended = FirstFigures(session), threading.Event()
    figures.of(session.shown)
    waiting = threading.Thread(target=lambda: (figures.wait(lambda: False), ended.set()))
    waiting.start()
    assert not ended.wait(0.2)
    session.measured.emit()
    waiting.join()
    assert ended.is_set()


def test_it_waits_no_longer_than_is_of_use(session, monkeypatch):
    monkeypatch.setattr(render_job, "MOST_SECONDS", 0.2)
    figures = FirstFigures(session)
    figures.of(session.shown)
    figures.wait(lambda: False)
    assert not figures._there.is_set(), "it went on though figures did not come"
    monkeypatch.setattr(figures._there, "wait", lambda seconds: pytest.fail("cancelled, or nobody measures"))
    figures.wait(lambda: True)
    session.measures = False
    figures.wait(lambda: False)


def test_what_is_warned_of_is_told_once(session):
    told, figures = [], FirstFigures(session)
    session.message.connect(lambda level, text: told.append((level, text)))
    session.shown.doubts = ["dark", "short"]
    figures.of(None)
    figures.of(session.shown)
    figures.warn(["short"])
    session.measured.emit()
    session.measured.emit()
    assert told == [("warning", "short"), ("warning", "dark")]
    figures.of(None)
    figures.warn(["dark"])
    assert len(told) == 3, "of another render again"
