"""What a person reads of a calibration agrees with what was decided."""

from __future__ import annotations

import pytest

from analysis.calibration.checks import LensTrial
from render.base.errors import InputError
from studio.calibration.board_text import parse_board
from studio.calibration.in_silico import virtual_views
from studio.calibration.words import lens_sentence
from studio.project.project import Project
from studio.project.templates import template_folder


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


def test_a_board_that_no_place_shows_is_not_told_as_found() -> None:
    project, board = Project.load(template_folder("plane")), parse_board("checkerboard:13x9:2000mm")
    with pytest.raises(InputError) as refused:
        virtual_views(project, board, 3, seed=1, depth=(0.4, 0.6), most_tilt=0.5, sigmas=(0.1, 0.1))
    told = str(refused.value)
    assert "too little of a board of 13 x 9 corners that are 2000 mm apart, from 400 to 600 mm before it" in told
    assert "found" not in told
