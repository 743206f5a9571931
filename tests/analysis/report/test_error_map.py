"""The colours of the error map, its caption and the glossary have the sign that errors have: positive is too far."""

from __future__ import annotations

from pathlib import Path

import matplotlib

import analysis.report
from analysis.report.colour import DIVERGING
from analysis.report.glossary import GLOSSARY


def test_red_is_positive_and_said_to_be_too_far() -> None:
    red, blue = (matplotlib.colormaps[DIVERGING](place) for place in (1.0, 0.0))
    assert red[0] > red[2] and blue[2] > blue[0]
    (folder,) = map(Path, analysis.report.__path__)
    page = " ".join((folder / "template.html").read_text(encoding="utf-8").split())
    assert "red lies behind it (too far from the camera), blue in front of it" in page
    assert "Positive is too far away." in dict(GLOSSARY)["Error"]
