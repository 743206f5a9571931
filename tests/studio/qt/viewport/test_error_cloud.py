"""The colours of measured points can be read where the view of them is small."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from PySide6.QtGui import QImage
from pytestqt.qtbot import QtBot

from studio.qt.core import theme
from studio.qt.core.live_preview import live
from studio.qt.viewport.error_cloud import RIM, ErrorCloud
from studio.qt.viewport.viewport import Viewport
from tests.studio.qt.small_session import small_session


@pytest.fixture
def small_view(qtbot: QtBot) -> Iterator[Viewport]:
    made = Viewport(small_session())
    qtbot.addWidget(made)
    made.resize(420, 300)
    made.show()
    qtbot.waitExposed(made)
    yield made
    live(made.session).close()
    theme.apply("light")


def waves() -> dict[str, np.ndarray]:
    """25 scan lines of 400 points over hills above the ground, with an error of 0."""
    y, x = np.meshgrid(np.linspace(-0.2, 0.2, 25), np.linspace(-0.25, 0.25, 400), indexing="ij")
    z = 0.03 + 0.02 * np.sin(40.0 * x) * np.cos(30.0 * y)
    none, line = np.zeros(x.size), np.tile(np.arange(400, dtype=np.int32), 25)
    points = {"x": x.ravel(), "y": y.ravel(), "z": z.ravel(), "row": line, "step": np.repeat(np.arange(25), 400)}
    return {**points, "error_depth": none, "error_surface": none}


def colours(view: Viewport) -> np.ndarray:
    """(n, 3) of all pixels, as they are on the screen."""
    image = view.grab().toImage().convertToFormat(QImage.Format.Format_RGB32)
    raw = np.frombuffer(image.constBits(), np.uint8).reshape(-1, 4)
    return raw[:, 2::-1].astype(int)


@pytest.mark.parametrize("choice", ["dark", "light"])
def test_points_without_an_error_are_white_however_close_they_are(
    small_view: Viewport, qtbot: QtBot, choice: theme.Choice
) -> None:
    theme.apply(choice)
    made, rim = ErrorCloud(small_view.session, small_view.view), np.round(255.0 * np.array(RIM))

    def counted() -> tuple[int, int]:
        seen = colours(small_view)
        return int((np.abs(seen - 247).max(axis=1) < 4).sum()), int((np.abs(seen - rim).max(axis=1) < 4).sum())

    qtbot.waitUntil(lambda: len(small_view.live.look.placed) > 0)
    before = counted()
    made.begin_scan(1.0)
    made.grow(waves())
    white, dark = (now - then for now, then in zip(counted(), before, strict=True))
    assert white > 4 * dark > 0, "rims are seen about the whole, and in gaps"


def test_the_colours_of_large_errors_are_told_in_mm_until_a_person_chooses(small_view: Viewport) -> None:
    made = ErrorCloud(small_view.session, small_view.view)
    made.begin_scan(1.0)
    points = waves()
    made.grow({**points, "error_depth": np.full(len(points["x"]), 0.5)})
    bar = made.bar
    assert (bar.unit, bar.limits) == ("mm", (-500.0, 500.0)) and made.errors[0] == pytest.approx(500.0)
    bar.scaled.emit(bar.scale.dragged(bar.limits, True, 4.0))
    assert (bar.unit, bar.limits) == ("mm", (-4.0, 4.0)), "limits by hand stay in the unit that they were set in"
    actions = {action.text(): action for action in bar.menu().actions()}
    actions["\u00b5m"].trigger()
    assert (bar.unit, bar.limits) == ("\u00b5m", (-4000.0, 4000.0))
    actions["98 % of the points"].trigger()
    assert (bar.unit, bar.limits) == ("\u00b5m", (-500_000.0, 500_000.0)), "as it was chosen"


def test_the_colours_of_small_errors_are_told_in_micrometres(small_view: Viewport) -> None:
    made = ErrorCloud(small_view.session, small_view.view)
    made.begin_scan(1.0)
    points = waves()
    made.grow({**points, "error_depth": np.full(len(points["x"]), 0.005)})
    assert (made.bar.unit, made.bar.limits) == ("\u00b5m", (-5000.0, 5000.0))
