"""The colours of the error map, its caption and the glossary have the sign that errors have: positive is too far."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
import pytest

import analysis.report
from analysis.report.colour import DIVERGING
from analysis.report.error_figures import REACH, beyond, error_limit, nice_limit
from analysis.report.glossary import GLOSSARY


def test_red_is_positive_and_said_to_be_too_far() -> None:
    red, blue = (matplotlib.colormaps[DIVERGING](place) for place in (1.0, 0.0))
    assert red[0] > red[2] and blue[2] > blue[0]
    (folder,) = map(Path, analysis.report.__path__)
    page = " ".join((folder / "template.html").read_text(encoding="utf-8").split())
    assert "red lies behind it (too far from the camera), blue in front of it" in page
    assert "Positive is too far away." in dict(GLOSSARY)["Error"]


def test_a_few_gross_errors_do_not_set_the_scale_and_are_told_beside_it() -> None:
    """An axis to 15 mm held errors of 20 um in one bar, and the part was white all over."""
    error = 2e-5 * np.random.default_rng(3).standard_normal(500)
    without = error_limit(error)
    assert without == nice_limit(error) and beyond(error, REACH * without) == ("", "")
    error[:12], error[12], error[13] = np.linspace(1e-3, 14.2e-3, 12), -9e-3, np.nan
    limit = error_limit(error)
    assert nice_limit(error) > 1e-3 and without <= limit <= 2.0 * without
    told = [text.replace("\u00a0", " ") for text in beyond(error, REACH * limit)]
    assert told == ["12 points beyond, to +14.2 mm", "1 point beyond, to \u22129000 µm"]


@pytest.mark.parametrize("offset", [0.0, 3e-3])
def test_errors_that_many_points_have_stay_within_the_scale(offset: float) -> None:
    """Off by what all share, or a fifth of the part that lies elsewhere: these are no outliers."""
    error = offset + 1e-5 * np.random.default_rng(4).standard_normal(500)
    error[::5] += 1.5e-3
    assert max(beyond(error, REACH * error_limit(error))) == "" and error_limit(error) == nice_limit(error)
    assert error_limit(np.full(5, 2e-5)) == pytest.approx(2e-5) and error_limit(np.array([np.nan])) == 1e-6
