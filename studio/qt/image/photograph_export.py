"""What was found in photographs, as files: the table of a line, the photograph with its line on it, or both of all."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QFileDialog, QHBoxLayout, QMenu, QMessageBox, QPushButton, QWidget

from render.base.errors import InputError
from render.base.threads import Cancel
from studio.photographs.line_tables import table_path, write_line
from studio.photographs.measured_set import MeasuredSet
from studio.photographs.overlay import write_overlay
from studio.photographs.photographs import Measured
from studio.qt.core.jobs import JobRunner
from studio.qt.core.session import Session
from studio.qt.core.widgets import text_button
from studio.runtime.jobs import Progress
from studio.scan.own_files import check_replaceable

LANE = "export of photographs"
TABLE, PICTURE = "Table of the line (*.csv)", "Photograph with its line (*.png)"
NOTHING = "No line was measured yet: add photographs and press Measure, then Export…"
TIP = "The points of the line in px, as a table (CSV), or the photograph with its line on it (PNG)"


class PhotographExport(QWidget):
    """A button with a menu; `found` and `shown` tell what there is to be written."""

    told = Signal(str)
    """What was written, or why nothing was."""

    def __init__(
        self,
        session: Session,
        runner: JobRunner,
        found: Callable[[], MeasuredSet | None],
        shown: Callable[[], Path | None],
    ) -> None:
        super().__init__()
        self.session, self.runner, self.found, self.shown = session, runner, found, shown
        self.button: QPushButton = text_button("Export…", TIP)
        menu = QMenu(self.button)
        self.one = menu.addAction("This photograph…", self.ask)
        self.all = menu.addAction("All photographs into a folder…", self.ask_folder)
        self.button.setMenu(menu)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self.button)
        self.refresh()

    def refresh(self) -> None:
        """Offer what was measured."""
        found = self.found()
        self.one.setEnabled(found is not None and self.shown() in found.lines)
        self.all.setEnabled(found is not None and bool(found.lines))
        self.button.setEnabled(self.one.isEnabled() or self.all.isEnabled())

    def ask(self) -> None:
        """Where the photograph that is shown goes, as which of the two."""
        path, found = self.shown(), self.found()
        if path is None or found is None or path not in found.lines:
            self.told.emit(NOTHING)
            return
        start = str(path.with_name(f"{path.stem}_line.csv"))
        name, kind = QFileDialog.getSaveFileName(
            self.window(), f"Export the line of {path.name}", start, f"{TABLE};;{PICTURE}"
        )
        if not name:
            return
        target = Path(name)
        if target.suffix.lower() not in (".csv", ".png") or (kind == PICTURE and target.suffix.lower() == ".csv"):
            target = target.with_suffix(".png" if kind == PICTURE else ".csv")
            if target.exists() and not self._may_replace(target.parent, [target.name]):
                return
        self.write(target, found.lines[path])

    def ask_folder(self) -> None:
        """Where table and picture of all go."""
        path, found = self.shown(), self.found()
        if found is None or not found.lines:
            self.told.emit(NOTHING)
            return
        start = str((path or next(iter(found.lines))).parent)
        folder = QFileDialog.getExistingDirectory(self.window(), "Folder for tables and pictures", start)
        if folder:
            self.write_all(Path(folder))

    def write(self, path: Path, measured: Measured) -> None:
        """One file, by its ending a table or a picture."""

        def work(progress: Progress, cancelled: Cancel) -> list[Path]:
            if path.suffix.lower() == ".png":
                return [write_overlay(path, measured)]
            write_line(path, measured.line)
            return [path]

        self._run(work)

    def write_all(self, folder: Path) -> None:
        """A table and a picture of each photograph, named as it is."""
        found = self.found()
        assert found is not None
        taken: set[Path] = set()
        try:
            tables = {path: table_path(path, folder, taken) for path in found.lines}
            pictures = {path: table.with_suffix(".png") for path, table in tables.items()}
            check_replaceable(list(tables.values()))
        except InputError as error:
            self.told.emit(str(error))
            return
        there = [path.name for path in (*tables.values(), *pictures.values()) if path.exists()]
        if there and not self._may_replace(folder, there):
            return

        def work(progress: Progress, cancelled: Cancel) -> list[Path]:
            written: list[Path] = []
            for number, (path, measured) in enumerate(found.lines.items()):
                if cancelled():
                    break
                progress("writing", number / len(found.lines))
                write_line(tables[path], measured.line)
                written += [tables[path], write_overlay(pictures[path], measured)]
            return written

        self._run(work)

    def _may_replace(self, folder: Path, names: list[str]) -> bool:
        them = f"{names[0]} is" if len(names) == 1 else f"{len(names)} files of such names, {names[0]} and others, are"
        told = f"{them} in {folder}. Replace?"
        answers = QMessageBox.StandardButton.Yes | QMessageBox.StandardButton.Cancel
        return QMessageBox.question(self, "Replace files", told, answers) == QMessageBox.StandardButton.Yes

    def _run(self, work: Callable[[Progress, Cancel], list[Path]]) -> None:
        def then(written: list[Path]) -> None:
            if not written:
                return
            first = str(written[0])
            told = f"Wrote {first}" if len(written) == 1 else f"Wrote {len(written)} files, {first} and others"
            self.told.emit(f"{told}; positions in px")
            self.session.message.emit("info", f"{told}; positions in px")

        self.runner.run(LANE, "exporting photographs", work, then)
