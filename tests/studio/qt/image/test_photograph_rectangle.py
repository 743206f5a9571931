"""The rectangle of a photograph by mouse and by numbers."""

from __future__ import annotations

import numpy as np
import pyqtgraph as pg
import pytest
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QMouseEvent
from PySide6.QtWidgets import QApplication, QVBoxLayout, QWidget

from studio.qt.image.image_item import PictureView
from studio.qt.image.photograph_rectangle import PhotographRectangle
from studio.qt.image.photograph_window import CONTROLS

WIDTH, HEIGHT = 400, 300
FIRST = (100, 75, 200, 150)
"""Half of either side, in the middle."""


@pytest.fixture
def made(qtbot):
    """A rectangle in a view of a grey photograph; every move of the mouse counts, however fast it is."""
    before = pg.getConfigOption("mouseRateLimit")
    pg.setConfigOption("mouseRateLimit", -1)
    page = QWidget()
    page.view = PictureView()
    page.rectangle = PhotographRectangle(page.view)
    layout = QVBoxLayout(page)
    layout.addWidget(page.view, 1)
    layout.addWidget(page.rectangle)
    page.resize(900, 760)
    qtbot.addWidget(page)
    page.show()
    qtbot.waitExposed(page)
    page.view.item.set_levels([np.full((HEIGHT, WIDTH, 4), 90, np.uint8)])
    page.view.fit()
    page.rectangle.follow_picture()
    page.rectangle.limited.setChecked(True)
    QApplication.processEvents()
    yield page
    pg.setConfigOption("mouseRateLimit", before)


def at(view, x, y):
    """Where a corner of pixels is in the window: (0, 0) is that of the photograph."""
    return view.mapFromScene(view.box.mapViewToScene(QPointF(x - 0.5, y - 0.5)))


def drag(view, start, end, modifiers=Qt.KeyboardModifier.NoModifier):
    """From and to corners of pixels."""
    begin, stop = (QPointF(at(view, *place)) for place in (start, end))
    left, none = Qt.MouseButton.LeftButton, Qt.MouseButton.NoButton
    moves = [(QEvent.Type.MouseMove, begin + share * (stop - begin), none, left) for share in (0.3, 0.6, 1.0)]
    for kind, place, button, held in (
        (QEvent.Type.MouseMove, begin, none, none),
        (QEvent.Type.MouseButtonPress, begin, left, left),
        *moves,
        (QEvent.Type.MouseButtonRelease, stop, left, none),
    ):
        port = view.viewport()
        event = QMouseEvent(kind, place, QPointF(port.mapToGlobal(place.toPoint())), button, held, modifiers)
        QApplication.sendEvent(port, event)


def numbers(made):
    return tuple(box.value() for box in made.rectangle.boxes)


@pytest.mark.parametrize(
    ("start", "end", "box"),
    [
        ((100, 150), (60, 150), (60, 75, 240, 150)),
        ((300, 150), (340, 150), (100, 75, 240, 150)),
        ((200, 75), (200, 45), (100, 45, 200, 180)),
        ((200, 225), (200, 255), (100, 75, 200, 180)),
        ((100, 75), (60, 45), (60, 45, 240, 180)),
        ((300, 75), (340, 45), (100, 45, 240, 180)),
        ((100, 225), (60, 255), (60, 75, 240, 180)),
        ((300, 225), (340, 255), (100, 75, 240, 180)),
        ((101, 100), (61, 100), (60, 75, 240, 150)),
        ((200, 150), (220, 140), (120, 65, 200, 150)),
    ],
    ids=["left", "right", "top", "bottom", "left top", "right top", "left bottom", "right bottom", "a side beside its "
         "grip", "all of it"],
)  # fmt: skip
def test_every_side_and_corner_is_dragged_and_the_numbers_follow(made, start, end, box):
    assert numbers(made) == made.rectangle.box == FIRST
    drag(made.view, start, end)
    assert numbers(made) == made.rectangle.box == made.rectangle.region().box
    assert np.abs(np.subtract(numbers(made), box)).max() <= 1  # a pixel of the screen
    (x, y), (w, h) = made.rectangle.outline.pos(), made.rectangle.outline.size()
    assert (x + 0.5, y + 0.5, w, h) == numbers(made)


def test_a_side_stops_at_the_border_of_the_photograph(made):
    drag(made.view, (100, 75), (-30, -30))
    assert numbers(made) == (0, 0, 300, 225)
    drag(made.view, (150, 100), (380, 100))
    assert numbers(made) == (100, 0, 300, 225)


def test_typed_numbers_move_it_and_stay_within_the_photograph(made):
    left, top, width, height = made.rectangle.boxes
    left.setValue(20)
    height.setValue(90)
    assert made.rectangle.outline.pos() == QPointF(19.5, 74.5)
    assert tuple(made.rectangle.outline.size()) == (200.0, 90.0)
    width.setValue(5000)
    assert numbers(made) == (20, 75, WIDTH - 20, 90)
    top.setValue(299)
    assert numbers(made)[1] + numbers(made)[3] == HEIGHT


def test_one_is_drawn_with_shift_wherever_another_was(made):
    made.rectangle.limited.setChecked(False)
    drag(made.view, (120, 90), (160, 140), Qt.KeyboardModifier.ShiftModifier)
    assert made.rectangle.limited.isChecked() and made.rectangle.outline.isVisible()
    assert np.abs(np.subtract(numbers(made), (120, 90, 40, 50))).max() <= 1
    drag(made.view, (150, 130), (130, 100), Qt.KeyboardModifier.ShiftModifier)
    assert np.abs(np.subtract(numbers(made), (130, 100, 20, 30))).max() <= 1


def test_how_one_is_drawn_is_said_beside_its_numbers(made):
    how = made.rectangle.how
    assert how.isVisible() and how.text().startswith("Shift + drag")
    assert how.sizeHint().width() < CONTROLS


def test_it_is_seen_on_what_is_bright_and_on_what_is_dark(made):
    for level in (0, 255):
        made.view.item.set_levels([np.full((HEIGHT, WIDTH, 4), level, np.uint8)])
        image = made.view.grab().toImage()
        place = at(made.view, 140, 75)
        around = [image.pixelColor(place + QPoint(0, k)).lightness() for k in range(-3, 4)]
        assert min(around) < 60 and max(around) > 190


def test_without_a_photograph_there_is_none(qtbot):
    view = PictureView()
    rectangle = PhotographRectangle(view)
    for widget in (view, rectangle):
        qtbot.addWidget(widget)
    rectangle.limited.setChecked(True)
    assert rectangle.region().box is None and not rectangle.outline.isVisible()
