"""Reports with white pictures and an empty PDF, for tests of all else in them: drawing takes most of their time.

What draws is tested where that is asked for: figures, 3D pictures and PDF in tests/analysis/report, the files of a
whole scan in tests/studio/scan/test_scan.py.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from analysis.report.picture import Drawing

WHITE = np.full((9, 16, 3), 255, np.uint8)


def _white(drawing: Drawing, folder: Path) -> tuple[Path, Path]:
    """As `Drawing.finish`."""
    made = folder / "scene.png", folder / "cloud.png"
    for path in made:
        Image.fromarray(WHITE).save(path)
    return made


@contextmanager
def drawn_quickly() -> Iterator[None]:
    """Reports that are written meanwhile have every figure, caption, table and word."""
    with pytest.MonkeyPatch.context() as patch:
        for name in ("__init__", "start", "stop"):
            patch.setattr(Drawing, name, lambda *_: None)
        patch.setattr(Drawing, "finish", _white)
        patch.setattr(Figure, "draw", lambda figure, renderer: None)
        patch.setattr("analysis.report.write.write_pdf", lambda page, path: path.write_bytes(b"%PDF-1.7\n"))
        yield
