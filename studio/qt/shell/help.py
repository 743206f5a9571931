"""Help: one page for each panel, in a window beside the work; F1 opens the page of the panel that has the focus."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from PySide6.QtCore import QUrl
from PySide6.QtGui import QCursor
from PySide6.QtWidgets import QApplication, QDialog, QHBoxLayout, QListWidget, QTextBrowser, QWidget

from studio.qt.core import theme

FOLDER = Path(__file__).resolve().parents[3] / "assets" / "help"
PAGES = {
    "start": "First steps",
    "viewport": "3D view",
    "scene": "Scene",
    "inspector": "Inspector",
    "materials": "Materials",
    "camera": "Camera view",
    "readout": "Design",
    "render": "Render",
    "develop": "Exposure and measurement",
    "results": "Results",
    "nominal": "Deviation, section, height map",
    "study": "Study",
    "charts": "Charts of a study",
    "calibrate": "Calibrate",
    "boards": "Camera image of a calibration",
    "calibration": "Result of a calibration",
    "recipe": "Dataset",
    "contact": "Contact sheet of a dataset",
    "motion": "Motion",
    "files": "Projects and files",
    "log": "Messages",
}
"""Page -> title, in the order of the list; panels have pages of their own key."""

OF_WORKSPACE = {
    "render": "render",
    "measure": "results",
    "study": "study",
    "calibrate": "calibrate",
    "dataset": "recipe",
}
"""The page of a workspace as a whole."""


class Help(QDialog):
    """Not modal: read and do."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("help")
        self.setWindowTitle("Help")
        self.list = QListWidget()
        self.list.addItems(list(PAGES.values()))
        self.list.setMaximumWidth(210)
        self.list.setSpacing(3)
        self.list.setFrameShape(QListWidget.Shape.NoFrame)
        self.text = QTextBrowser()
        self.text.setOpenLinks(False)
        self.text.setFrameShape(QTextBrowser.Shape.NoFrame)
        self.text.anchorClicked.connect(self._follow)
        self.text.document().setDocumentMargin(18)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addWidget(self.list)
        layout.addWidget(self.text, 1)
        self.list.currentRowChanged.connect(self._show_row)
        theme.notice.changed.connect(self._repaint)
        self.resize(820, 600)

    def open_page(self, key: str) -> None:
        """Show a page; the first steps for a key that there is not."""
        keys = list(PAGES)
        self.list.setCurrentRow(keys.index(key) if key in keys else 0)
        self.show()
        self.raise_()

    @property
    def page(self) -> str:
        return list(PAGES)[max(0, self.list.currentRow())]

    def _show_row(self, row: int) -> None:
        if row >= 0:
            self.text.setMarkdown((FOLDER / f"{list(PAGES)[row]}.md").read_text(encoding="utf-8"))

    def _repaint(self) -> None:
        self._show_row(self.list.currentRow())

    def _follow(self, url: QUrl) -> None:
        """Links between pages: [Render](render.md)."""
        self.open_page(url.fileName().removesuffix(".md"))


def panel_with_focus(panels: Iterable[tuple[str, QWidget]], workspace: str) -> str:
    """The panel that has the focus, or else the one under the mouse, or else the workspace's own."""
    for widget in (QApplication.focusWidget(), QApplication.widgetAt(QCursor.pos())):
        while widget is not None:
            for key, panel in panels:
                if widget is panel:
                    return key
            widget = widget.parentWidget()
    return OF_WORKSPACE.get(workspace, "start")
