"""What `main.py board` does: a calibration board to print, or to render."""

from __future__ import annotations

from pathlib import Path

from analysis.calibration.board import Board
from render.base.errors import InputError
from studio.runtime.streams import print_json

BEGINNINGS = {".pdf": b"%PDF-", ".glb": b"glTF"}
"""Of files that may be replaced, by their ending."""


def print_board(text: str, *, out: Path | None, paper: str | None, contrast: float, quiet: bool, as_json: bool) -> None:
    """InputError: not a board, or it fits on no paper."""
    from studio.calibration.board_pdf import write_board
    from studio.calibration.board_text import board_text, parse_board

    board = parse_board(text)
    path = out or Path(f"{board_text(board).replace(':', '_')}.pdf")
    first = BEGINNINGS.get(path.suffix.lower())
    if first is None:
        allowed = "a name that ends in .pdf, or in .glb for a mesh to render"
        raise InputError("the board is a PDF or a mesh", where="--out", found=path.name, allowed=allowed)
    if path.exists() and not (path.is_file() and _begins_as(path, first)):
        raise InputError("another file is in the way", where=str(path), cure="choose another --out")
    if path.suffix.lower() == ".glb":
        _write_mesh(path, board, contrast, quiet=quiet, as_json=as_json)
        return
    taken = write_board(path, board, paper, contrast)
    if as_json:
        print_json({"ok": True, "board": board_text(board), "paper": taken, "file": str(path)})
        return
    print(f"wrote {path}")
    if not quiet:
        print(f"print it on {taken} at 100 %, check the ruler, and glue it to something flat and stiff; then:")
        print(f"  main.py calibrate scanner FOLDER --board {board_text(board)}")


def _write_mesh(path: Path, board: Board, contrast: float, *, quiet: bool, as_json: bool) -> None:
    from studio.calibration.board_mesh import write_board_mesh
    from studio.calibration.board_text import board_text

    write_board_mesh(path, board, contrast)
    if as_json:
        print_json({"ok": True, "board": board_text(board), "paper": None, "file": str(path)})
        return
    print(f"wrote {path}")
    if not quiet:
        print(
            'an object of a project shows it: "shape": {"kind": "file", "path": ...} and "albedo": {"source": "mesh"}'
        )


def _begins_as(path: Path, first: bytes) -> bool:
    with open(path, "rb") as file:
        return file.read(len(first)) == first
