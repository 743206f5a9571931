"""Dark and light: one palette each, a style sheet for what a palette cannot say, and the colours that plots use."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtGui import QColor, QPalette
from PySide6.QtWidgets import QApplication, QStyleFactory

Choice = Literal["system", "dark", "light"]
OUTLINED = ("QCheckBox", "QRadioButton", "QLineEdit", "QAbstractSpinBox", "QComboBox", "QPushButton", "QTableView")
FUSION_DARKER = 140
"""Percent, as Qt's `QColor.darker` has it."""
CHOICES: tuple[Choice, ...] = ("system", "dark", "light")


@dataclass(frozen=True)
class Colours:
    """Of one theme, as #rrggbb. What means something (truth, methods, wavelengths) is in `analysis.report.colour`."""

    window: str
    base: str
    raised: str
    text: str
    muted: str
    line: str
    edge: str
    """Of what can be ticked, typed into or pressed."""
    accent: str
    on_accent: str
    warning: str
    error: str
    good: str


DARK_AND_LIGHT = {
    "window": ("#20252b", "#f1f3f5"),
    "base": ("#171b20", "#ffffff"),
    "raised": ("#2b323a", "#ffffff"),
    "text": ("#dfe4e9", "#1c2733"),
    "muted": ("#94a0ab", "#5d6974"),
    "line": ("#38414a", "#d3d9de"),
    "edge": ("#7c8894", "#6f7982"),
    "accent": ("#38a8ca", "#0b6e8a"),
    "on_accent": ("#06161c", "#ffffff"),
    "warning": ("#e8b04a", "#966200"),
    "error": ("#f0736a", "#b3261e"),
    "good": ("#5fbf8f", "#1d7a4c"),
}
DARK, LIGHT = (Colours(**{role: pair[theme] for role, pair in DARK_AND_LIGHT.items()}) for theme in (0, 1))


class _Notice(QObject):
    changed = Signal()


notice = _Notice()
"""`notice.changed`: another theme holds; widgets that paint with their own colours follow it."""


def apply(choice: Choice) -> None:
    """Give the application the chosen theme; "system" follows the desktop's, light where it has none."""
    app = QApplication.instance()
    assert isinstance(app, QApplication)
    hints = app.styleHints()
    scheme = {"dark": Qt.ColorScheme.Dark, "light": Qt.ColorScheme.Light}.get(choice, Qt.ColorScheme.Unknown)
    if hints.colorScheme() != scheme:
        hints.setColorScheme(scheme)
    dark = choice == "dark" or (choice == "system" and hints.colorScheme() == Qt.ColorScheme.Dark)
    colours = DARK if dark else LIGHT
    sheet = style_sheet(colours)
    if app.styleSheet() == sheet and app.palette() == palette(colours):
        return  # every widget that there is would be styled anew, those of a window in more than a second
    style = QStyleFactory.create("Fusion")
    if style is not None and app.style().name().lower() != "fusion":
        app.setStyle(style)
    app.setPalette(palette(colours))
    for kind in OUTLINED:
        app.setPalette(outlined(colours), kind)  # type: ignore[arg-type]  # takes no bytes, whatever its stub says
    app.setStyleSheet(sheet)
    notice.changed.emit()


def colours() -> Colours:
    """Those of the theme that holds, judged by the application's palette."""
    return DARK if QApplication.palette().color(QPalette.ColorRole.Window).lightness() < 128 else LIGHT


def verdict_colour(verdict: str | None) -> str:
    """Of this theme: by the verdict, where there is one."""
    c = colours()
    return {"pass": c.good, "fail": c.error, "undecided": c.warning}.get(verdict or "", c.accent)


def palette(c: Colours) -> QPalette:
    """The Qt palette of a theme."""
    role, group = QPalette.ColorRole, QPalette.ColorGroup
    made = QPalette()
    for which, colour in (
        (role.Window, c.window),
        (role.WindowText, c.text),
        (role.Base, c.base),
        (role.AlternateBase, c.window),
        (role.Text, c.text),
        (role.PlaceholderText, c.muted),
        (role.Button, c.raised),
        (role.ButtonText, c.text),
        (role.BrightText, c.error),
        (role.ToolTipBase, c.raised),
        (role.ToolTipText, c.text),
        (role.Highlight, c.accent),
        (role.HighlightedText, c.on_accent),
        (role.Accent, c.accent),
        (role.Link, c.accent),
        (role.LinkVisited, c.accent),
        (role.Light, c.raised),
        (role.Midlight, c.line),
        (role.Mid, c.line),
        (role.Dark, c.line),
        (role.Shadow, "#000000"),
    ):
        made.setColor(which, QColor(colour))
    faded = mixed(c.text, c.window, 0.45)
    for which in (role.WindowText, role.Text, role.ButtonText):
        made.setColor(group.Disabled, which, QColor(faded))
    # a field that takes nothing is no well to type into
    made.setColor(group.Disabled, role.Base, QColor(c.window))
    made.setColor(group.Disabled, role.PlaceholderText, QColor(faded))
    made.setColor(group.Disabled, role.Highlight, QColor(c.line))
    return made


def outlined(c: Colours) -> QPalette:
    """The palette of controls that are an outline: Fusion draws it a good part darker than the window's colour."""
    made = palette(c)
    made.setColor(QPalette.ColorRole.Window, QColor(c.edge).lighter(FUSION_DARKER))
    made.setColor(QPalette.ColorGroup.Disabled, QPalette.ColorRole.Window, QColor(c.line).lighter(FUSION_DARKER))
    return made


def mixed(a: str, b: str, share: float) -> str:
    """#rrggbb between two colours; share 1 is the first."""
    one, two = QColor(a), QColor(b)
    parts = [
        round(share * x + (1.0 - share) * y)
        for x, y in ((one.red(), two.red()), (one.green(), two.green()), (one.blue(), two.blue()))
    ]
    return QColor(*parts).name()


def style_sheet(c: Colours) -> str:
    """Flat docks, quiet separators, a segmented workspace switch. Only what the palette cannot say."""
    return f"""
    QMainWindow::separator {{ background: {c.window}; width: 5px; height: 5px; }}
    QMainWindow::separator:hover {{ background: {c.accent}; }}
    QDockWidget {{ font-weight: 600; }}
    QDockWidget::title {{ background: {c.window}; padding: 5px 8px; border-bottom: 1px solid {c.line}; }}
    QToolBar {{ background: {c.window}; border: none; border-bottom: 1px solid {c.line}; spacing: 2px; padding: 3px; }}
    QToolBar::separator {{ background: {c.line}; width: 1px; margin: 5px 6px; }}
    QToolButton {{ border: 1px solid transparent; border-radius: 4px; padding: 4px; }}
    QToolButton:hover {{ background: {mixed(c.text, c.window, 0.10)}; }}
    QToolButton:pressed, QToolButton:checked {{ background: {mixed(c.accent, c.window, 0.30)}; }}
    QToolButton:focus {{ border-color: {c.accent}; }}
    QToolButton#workspace {{ padding: 5px 14px; border-radius: 0; font-weight: 600;
        background: {c.raised}; border: 1px solid {c.line}; }}
    QToolButton#workspace:hover {{ background: {mixed(c.accent, c.raised, 0.15)}; }}
    QToolButton#workspace:checked {{ background: {c.accent}; color: {c.on_accent}; border-color: {c.accent}; }}
    QToolButton[popupMode="2"] {{ padding-right: 17px; }}
    QToolButton::menu-indicator {{ subcontrol-origin: padding; subcontrol-position: center right; right: 3px; }}
    QPushButton#primary {{ background: {c.window}; color: {mixed(c.text, c.window, 0.45)};
        border: 1px solid {c.line}; border-radius: 3px; padding: 3px 14px; font-weight: 600; }}
    QPushButton#primary:enabled {{ background: {c.accent}; color: {c.on_accent}; border-color: {c.accent}; }}
    QPushButton#primary:enabled:hover {{ background: {mixed(c.accent, c.text, 0.85)}; }}
    QToolButton#fix {{ color: {c.accent}; border-color: {c.accent}; padding: 0 9px; font-weight: 600; }}
    QPushButton#choice {{ text-align: left; padding-left: 4px; min-height: 1.2em; }}
    QMenuBar {{ background: {c.window}; }}
    QMenuBar::item {{ padding: 4px 9px; background: transparent; border-radius: 4px; }}
    QMenuBar::item:selected {{ background: {mixed(c.text, c.window, 0.10)}; }}
    QMenu {{ background: {c.raised}; border: 1px solid {c.line}; padding: 4px; }}
    QMenu::item {{ padding: 5px 24px 5px 24px; border-radius: 3px; }}
    QMenu::item:selected {{ background: {c.accent}; color: {c.on_accent}; }}
    QMenu::item:disabled {{ color: {mixed(c.text, c.window, 0.45)}; }}
    QMenu::separator {{ height: 1px; background: {c.line}; margin: 4px 8px; }}
    QAbstractSpinBox {{ min-height: 1.2em; }}
    QStatusBar {{ background: {c.window}; border-top: 1px solid {c.line}; }}
    QStatusBar::item {{ border: none; }}
    QToolTip {{ background: {c.raised}; color: {c.text}; border: 1px solid {c.line}; padding: 4px; }}
    QTabBar::tab {{ padding: 5px 12px; border: none; border-bottom: 2px solid transparent; color: {c.muted}; }}
    QTabBar::tab:selected {{ color: {c.text}; border-bottom-color: {c.accent}; }}
    QTabBar::tab:hover {{ color: {c.text}; }}
    QTabWidget::pane {{ border: none; border-top: 1px solid {c.line}; }}
    QHeaderView::section {{ background: {c.window}; color: {c.muted}; border: none;
        border-bottom: 1px solid {c.line}; padding: 4px 4px; }}
    QHeaderView::section:vertical {{ border: none; padding: 2px 8px; }}
    QTableCornerButton::section {{ background: {c.window}; border: none; border-bottom: 1px solid {c.line}; }}
    QTableView {{ gridline-color: {c.line}; border: none; }}
    QProgressBar {{ background: {c.base}; border: 1px solid {c.line}; border-radius: 4px; text-align: center; }}
    QProgressBar::chunk {{ background: {c.accent}; border-radius: 3px; }}
    QLabel[note="true"] {{ background: {c.raised}; border: 1px solid {c.line}; border-radius: 5px; padding: 6px 9px; }}
    QLabel#muted {{ color: {c.muted}; }}
    QLabel#warning {{ color: {c.warning}; }}
    QLabel#error {{ color: {c.error}; }}
    """
