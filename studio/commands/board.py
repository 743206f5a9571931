"""What `main.py board` does: a calibration board to print."""

from __future__ import annotations

from pathlib import Path

from render.base.errors import InputError
from studio.runtime.streams import print_json


def print_board(text: str, *, out: Path | None, paper: str | None, contrast: float, quiet: bool, as_json: bool) -> None:
    """InputError: not a board, or it fits on no paper."""
    from studio.calibration.board_pdf import write_board
    from studio.calibration.board_text import board_text, parse_board

    board = parse_board(text)
    path = out or Path(f"{board_text(board).replace(':', '_')}.pdf")
    if path.suffix.lower() != ".pdf":
        raise InputError("the board is a PDF", where="--out", found=path.name, allowed="a name that ends in .pdf")
    if path.exists() and not (path.is_file() and _begins_as_pdf(path)):
        raise InputError("another file is in the way", where=str(path), cure="choose another --out")
    taken = write_board(path, board, paper, contrast)
    if as_json:
        print_json({"ok": True, "board": board_text(board), "paper": taken, "file": str(path)})
        return
    print(f"wrote {path}")
    if not quiet:
        print(f"print it on {taken} at 100 %, check the ruler, and glue it to something flat and stiff; then:")
        print(f"  main.py calibrate scanner FOLDER --board {board_text(board)}")


def _begins_as_pdf(path: Path) -> bool:
    with open(path, "rb") as file:
        return file.read(5) == b"%PDF-"
