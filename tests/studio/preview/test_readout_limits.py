"""A read-out that is judged beyond its limit does not read as the limit itself."""

from __future__ import annotations

from dataclasses import replace

import pytest

from studio.preview.readout_rows import rows
from studio.preview.readouts import Range
from tests.studio.preview.test_readouts import read, sample


@pytest.mark.parametrize(
    ("blur", "told", "level"),
    [
        (0.96, "1.0 px", ""),
        (1.004, "1.0 px", ""),
        (1.04, "1.04 px", "warning"),
        (1.06, "1.1 px", "warning"),
        (4.0, "4.0 px", "warning"),
        (4.03, "4.03 px", "error"),
    ],
)
def test_a_blur_that_reads_as_the_limit_of_sharpness_counts_as_sharp(blur: float, told: str, level: str) -> None:
    made = replace(read(sample("plane"), "plane"), blur_px=Range(blur, blur, blur))
    (found,) = [row for row in rows(made) if row.key == "blur"]
    assert (found.value, found.level) == (told, level)
