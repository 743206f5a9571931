"""What a study's page says of a chart in words."""

from __future__ import annotations

from analysis.study.intervals import Interval
from studio.study.answers import Answer, Spot
from studio.study.page import sentences
from studio.study.study import Parameter, Sweep

EXPOSURES = (0.001, 0.002, 0.004)


def test_errors_of_chance_finds_are_told_as_such() -> None:
    """A tidy curve of metres stood without a word, of a line of which an eighth was found."""
    sweep = Sweep(name="light", vary=(Parameter(field="sensor.exposure_time", values=EXPOSURES),), measure="depth_p95")
    spots = tuple(Spot((value,), "likelihood", Interval(7.0, 6.0, 8.0, 8), 1.0) for value in EXPOSURES)
    (told,) = sentences(Answer(sweep, spots, None, (), little=2), {})
    assert told.startswith("At 2 of 3 points less than half of the line is measured")
    assert not sentences(Answer(sweep, spots, None, ()), {})
    of_share = sweep.model_copy(update={"measure": "completeness"})
    assert not sentences(Answer(of_share, spots, None, (), little=2), {})
