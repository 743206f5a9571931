"""A pose is read and typed on the rig or in the world, and is the same pose."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication, QToolButton
from pytestqt.qtbot import QtBot

from studio.qt.core.session import Session
from studio.qt.forms.form import Form, Section
from studio.qt.scene.inspector import Inspector
from tests.studio.qt.scene.inspector_hands import LASER, field, row, type_into

POSE = (*LASER, "T_rig_laser")
PART = ("scene", "objects", 0)


@pytest.fixture(autouse=True)
def as_given() -> Iterator[None]:
    yield
    Form.elsewhere.clear()


def switch(inspector: Inspector, text: str) -> None:
    """Press the button of the pose's section."""
    QApplication.processEvents()  # what was made anew is shown
    (button,) = [one for one in inspector.form.findChildren(QToolButton) if one.text() == text and one.isVisible()]
    button.click()
    QApplication.processEvents()


def titles(inspector: Inspector) -> list[str]:
    return [one.title for one in inspector.form.findChildren(Section) if one.isVisible()]


def shown(inspector: Inspector, part: int = 0) -> np.ndarray:
    return np.array([float(one.text()) for one in field(inspector, *POSE, part=part).fields])


def test_a_laser_is_moved_in_the_world_and_keeps_its_rotation(
    qtbot: QtBot, session: Session, inspector: Inspector
) -> None:
    before = session.project.scene.lasers[0].T_rig_laser
    switch(inspector, "World")
    assert "Pose in the world" in titles(inspector)
    world = session.project.scene.T_world_laser(0)
    np.testing.assert_allclose(shown(inspector), 1e3 * world[:3, 3], atol=1e-3)
    type_into(qtbot, field(inspector, *POSE, axis=2), "900", key=Qt.Key.Key_Return)
    after = session.project.scene.T_world_laser(0)
    np.testing.assert_allclose(after[:3, 3], (*world[:2, 3], 0.9), atol=2e-9)
    assert session.project.scene.lasers[0].T_rig_laser.rotation == before.rotation
    assert not row(inspector, *POSE).reset.isVisible() and not row(inspector, *POSE).varied()
    switch(inspector, "Rig")
    given = session.project.scene.lasers[0].T_rig_laser.translation
    np.testing.assert_allclose(shown(inspector), 1e3 * np.array(given), atol=1e-3)


def test_a_laser_is_turned_in_the_world_and_stays_where_it_is(
    qtbot: QtBot, session: Session, inspector: Inspector
) -> None:
    before = session.project.scene.lasers[0].T_rig_laser
    switch(inspector, "World")
    for axis, text in enumerate(("180", "10", "0")):
        type_into(qtbot, field(inspector, *POSE, part=1, axis=axis), text, key=Qt.Key.Key_Return)
    sine, cosine = np.sin(np.radians(10.0)), np.cos(np.radians(10.0))
    expected = np.array([[cosine, 0.0, -sine], [0.0, -1.0, 0.0], [-sine, 0.0, -cosine]])
    turned = session.project.scene.T_world_laser(0)[:3, :3]
    np.testing.assert_allclose(turned, expected, atol=1e-6)
    assert session.project.scene.lasers[0].T_rig_laser.translation == before.translation


def test_what_is_shown_in_the_world_follows_the_rig_and_the_motion(
    qtbot: QtBot, session: Session, inspector: Inspector
) -> None:
    switch(inspector, "World")
    rig = session.project.scene.rig.T_world_rig
    moved = rig.model_copy(update={"translation": tuple(np.add(rig.translation, (0.0, 0.01, 0.0)))})
    session.set(("scene", "rig", "T_world_rig"), moved)
    np.testing.assert_allclose(shown(inspector), 1e3 * session.project.scene.T_world_laser(0)[:3, 3], atol=1e-3)
    session.look_at_step(3)
    np.testing.assert_allclose(shown(inspector), 1e3 * session.project.scene.T_world_laser(0, 3)[:3, 3], atol=1e-3)


def test_a_part_is_shown_on_the_rig_and_the_rig_has_but_one_frame(
    qtbot: QtBot, session: Session, inspector: Inspector
) -> None:
    session.select(PART)
    switch(inspector, "Rig")
    assert "Pose on the rig" in titles(inspector)
    session.select(("scene", "rig"))
    QApplication.processEvents()
    texts = [one.text() for one in inspector.form.findChildren(QToolButton) if one.isVisible()]
    assert "Rig" not in texts and "World" not in texts
