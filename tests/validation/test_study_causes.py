"""The cause is named right in 95 of 100 breakdowns whose cause is known."""

from __future__ import annotations

import numpy as np
import pytest

from tests.studio.study.test_known_causes import SEARCHES, named

pytestmark = pytest.mark.validation


def test_the_cause_is_named_right_in_95_of_100_breakdowns() -> None:
    random = np.random.default_rng(14)
    kinds = [list(SEARCHES)[number % len(SEARCHES)] for number in range(100)]
    wrong = [(kind, *said) for kind in kinds if (said := named(kind, random)) != ("found", kind)]
    print(f"{100 - len(wrong)} of 100 right; wrong: {wrong}")
    assert len(wrong) <= 5
