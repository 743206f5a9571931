"""Tables as CSV: one way to write them, so that all end their lines alike and leave out alike what is not known."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path

from render.base.files import atomic_write


def write_csv(path: Path, header: Sequence[object], rows: Iterable[Sequence[object]]) -> None:
    """Header and rows in UTF-8, lines ended by a line feed; None and NaN are empty cells.

    InputError: the file cannot be written.
    """
    with atomic_write(path) as temporary, open(temporary, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        for row in rows:
            writer.writerow("" if cell is None or cell != cell else cell for cell in row)
