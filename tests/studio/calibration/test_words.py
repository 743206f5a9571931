"""What a person reads of a calibration agrees with what was decided."""

from __future__ import annotations

from analysis.calibration.checks import LensTrial
from studio.calibration.words import lens_sentence


def test_the_lens_that_is_passed_over_is_told_to_be_worse_and_by_how_much() -> None:
    trials = [LensTrial(0, 1.2, 43e-6, 2.4), LensTrial(4, 1.1, 41e-6, 0.6), LensTrial(5, 1.09, 42e-6, 0.0)]
    assert lens_sentence(4, trials) == (
        "4 distortion terms, the fewest within one standard error (se) of the best on held-out views "
        "(0: 1.2 and 43 um, 2.4 se worse; 4: 1.1 and 41 um, chosen, 0.6 se worse; 5: 1.09 and 42 um)"
    )


def test_where_no_lens_is_the_best_at_corners_and_in_depth_the_closest_is_told() -> None:
    trials = [LensTrial(0, 1.2, 43e-6, 1.4), LensTrial(4, 1.1, 48e-6, 3.0)]
    assert lens_sentence(0, trials).startswith("0 distortion terms, the closest to the best on held-out views (0")


def test_without_a_laser_no_depth_is_told() -> None:
    assert lens_sentence(0, [LensTrial(0, 0.98, 0.0, 0.0)]).endswith("(0: 0.98, chosen)")
