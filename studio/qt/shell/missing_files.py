"""What is to become of a project whose meshes or textures are not where it has them."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtWidgets import QFileDialog, QMessageBox, QWidget

from studio.project.document import Document, replaced
from studio.project.project_files import bring, missing_files

LISTED = 8


def may_open(window: QWidget, document: Document) -> bool:
    """Whether a person wants the document: with its files found, or with objects hidden that lack theirs.

    InputError: a file cannot be copied to its place.
    """
    while gone := missing_files(document.project.scene, document.root):
        answer = _ask(window, document, gone)
        if answer == "hide":
            project = document.project
            for i in {i for i, _ in gone}:
                project = replaced(project, ("scene", "objects", i, "visible"), False)
            document.apply("hide what is missing", project)
        elif answer == "cancel":
            return False
        else:
            _locate(window, [file for _, file in gone])
    return True


def _ask(window: QWidget, document: Document, gone: list[tuple[int, Path]]) -> str:
    names = [document.project.scene.objects[i].name for i, _ in gone]
    text = "Files of this project are missing"
    box = QMessageBox(QMessageBox.Icon.Warning, "Missing files", text, parent=window)
    box.setObjectName("missing")
    listed = [f"{name}: {file}" for name, (_, file) in zip(names[:LISTED], gone, strict=False)]
    more = [f"and {len(gone) - LISTED} more"] if len(gone) > LISTED else []
    box.setInformativeText(
        "\n".join([*listed, *more]) + "\n\nLocate them: each is copied to its place in the project's folder. Or open "
        "with these objects hidden; the project file stays as it is until you save."
    )
    locate = box.addButton("Locate…", QMessageBox.ButtonRole.AcceptRole)
    hide = box.addButton("Open with them hidden", QMessageBox.ButtonRole.AcceptRole)
    box.addButton(QMessageBox.StandardButton.Cancel)
    box.setDefaultButton(locate)
    box.exec()
    chosen = box.clickedButton()
    return "locate" if chosen is locate else "hide" if chosen is hide else "cancel"


def _locate(window: QWidget, files: list[Path]) -> None:
    """Ask for one file after the other; those of the same name in a folder that was chosen are taken from there."""
    folder: Path | None = None
    for file in dict.fromkeys(files):
        found = None if folder is None else folder / file.name
        if found is None or not found.is_file():
            start = str(folder or file.parent.parent)
            kinds = f"*{file.suffix} (*{file.suffix});;All files (*)"
            chosen, _ = QFileDialog.getOpenFileName(window, f"Where is {file.name}?", start, kinds)
            if not chosen:
                return
            found = Path(chosen)
            folder = found.parent
        bring(found, file)
