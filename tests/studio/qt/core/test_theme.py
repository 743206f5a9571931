"""What can be read and what can be seen in both themes, by the contrast ratio of WCAG 2.2 (1.4.3 and 1.4.11)."""

from __future__ import annotations

import pytest
from PySide6.QtGui import QColor, QPalette
from PySide6.QtWidgets import QApplication

from studio.qt.core import theme
from studio.qt.core.theme import DARK, LIGHT, Colours
from tests.studio.qt.shell.window_hands import contrast

BOTH = pytest.mark.parametrize("colours", [DARK, LIGHT], ids=["dark", "light"])
TEXT, OUTLINE = 4.5, 3.0


def test_the_ratio_is_that_of_the_standard() -> None:
    assert contrast("#000000", "#ffffff") == pytest.approx(21.0)
    assert contrast("#777777", "#ffffff") == pytest.approx(4.48, abs=0.01)


def test_a_theme_that_holds_is_not_applied_again(qapp: QApplication) -> None:
    """All widgets of a window were styled anew."""
    theme.apply("light")
    applied: list[str] = []
    connection = theme.notice.changed.connect(lambda: applied.append(qapp.styleSheet()))
    theme.apply("light")
    assert not applied
    qapp.setPalette(theme.palette(DARK))
    theme.apply("light")
    theme.notice.changed.disconnect(connection)
    assert applied == [theme.style_sheet(LIGHT)] and theme.colours() == LIGHT


@BOTH
def test_every_text_can_be_read_on_every_ground(colours: Colours) -> None:
    grounds = {"window": colours.window, "base": colours.base, "raised": colours.raised}
    inks = ("text", "muted", "accent", "warning", "error", "good")
    found = {(ink, name): contrast(getattr(colours, ink), ground) for ink in inks for name, ground in grounds.items()}
    tinted = {"checked": (colours.accent, 0.3), "hovered": (colours.text, 0.1), "stale": (colours.warning, 0.3)}
    for name, (tint, share) in tinted.items():
        found["text", name] = contrast(colours.text, theme.mixed(tint, colours.window, share))
    found["on_accent", "accent"] = contrast(colours.on_accent, colours.accent)
    assert {pair: round(ratio, 2) for pair, ratio in found.items() if ratio < TEXT} == {}


@BOTH
def test_the_outline_of_what_is_ticked_typed_into_or_pressed_can_be_seen(colours: Colours) -> None:
    window = theme.outlined(colours).color(QPalette.ColorRole.Window)
    drawn = window.darker(theme.FUSION_DARKER).name()  # as Fusion draws it
    for ground in (colours.window, colours.base, colours.raised):
        assert contrast(drawn, ground) >= OUTLINE
        assert contrast(colours.accent, ground) >= OUTLINE, "of the field that has the focus"
    assert QColor(drawn).lightness() == pytest.approx(QColor(colours.edge).lightness(), abs=6)


@BOTH
def test_a_field_that_takes_nothing_is_told_from_one_that_does(colours: Colours) -> None:
    made, role, group = theme.outlined(colours), QPalette.ColorRole, QPalette.ColorGroup
    assert made.color(group.Disabled, role.Base) == QColor(colours.window) != made.color(group.Active, role.Base)
    drawn = made.color(group.Disabled, role.Window).darker(theme.FUSION_DARKER).name()
    assert contrast(drawn, colours.window) < OUTLINE / 1.5, "its outline is no longer that of what can be typed into"
