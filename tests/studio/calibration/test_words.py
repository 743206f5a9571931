"""What a person reads of a calibration agrees with what was decided."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.calibration.lens_choice import LensTrial
from analysis.calibration.next_pose import Advice
from render.base.errors import InputError
from studio.calibration.board_text import parse_board
from studio.calibration.in_silico import virtual_views
from studio.calibration.solving import in_window
from studio.calibration.words import lens_sentence, next_sentence
from studio.project.project import Project
from studio.project.templates import template_folder


def test_the_lens_is_told_with_why_it_was_chosen_and_which_was_the_best() -> None:
    trials = [LensTrial(0, 1.2, 43e-6, 2e-5), LensTrial(4, 1.1, 41e-6, 0.6), LensTrial(5, 1.09, 42e-6, 1.0)]
    assert lens_sentence(4, trials) == (
        "4 distortion terms: the fewest to which no lens with more is proved better on views that were left out of its "
        "fit. Each lens with the mean squared residual there, how far off its boards depth was, and p, the chance that "
        "noise alone makes a lens with more terms seem so much better (below 0.05 more terms are proved to help): "
        "0 terms 1.2, 43 um, p 2e-05; "
        "4 terms 1.1, 41 um, p 0.6 (chosen); 5 terms 1.09, 42 um (the least residual)"
    )


def test_a_lens_without_terms_may_be_the_best_itself() -> None:
    trials = [LensTrial(0, 0.959, 42e-6, 0.7), LensTrial(4, 0.964, 41e-6, 0.4), LensTrial(5, 0.975, 42e-6, 1.0)]
    assert "0 terms 0.959, 42 um, p 0.7 (chosen, the least residual); 4 terms 0.964" in lens_sentence(0, trials)


@pytest.mark.parametrize(
    ("wanted_um", "ending"),
    [
        (27.0, "27 um are reached by it"),
        (20.0, "20 um take about 3 views more"),
        (5.0, "5 um take more than 4 views more"),
    ],
)
def test_what_the_error_that_is_wanted_takes_is_told_with_the_next_pose(wanted_um: float, ending: str) -> None:
    advice = Advice(np.eye(3), np.array([0.0, 0.0, 0.5]), 31e-6, 26e-6, (26e-6, 22e-6, 19e-6, 17e-6))
    assert next_sentence(advice, wanted_um).endswith(f"26.0 um; {ending}")


def test_without_a_laser_no_depth_is_told() -> None:
    told = lens_sentence(0, [LensTrial(0, 0.98, 0.0, 1.0)])
    assert told.endswith("0 terms 0.98 (chosen, the least residual)") and "depth" not in told and " um" not in told


def test_a_board_that_no_place_shows_is_not_told_as_found() -> None:
    project, board = Project.load(template_folder("plane")), parse_board("checkerboard:13x9:2000mm")
    with pytest.raises(InputError) as refused:
        virtual_views(project, board, 3, seed=1, depth=(0.4, 0.6), most_tilt=0.5, sigmas=(0.1, 0.1))
    told = str(refused.value)
    assert "too little of a board of 13 x 9 corners that are 2000 mm apart, from 400 to 600 mm before it" in told
    assert "found" not in told


@pytest.mark.parametrize(
    ("where", "allowed", "cure"),
    [
        ("--farthest", "beyond --nearest, 0.5 m", ""),
        ("--paper", "A4 or A3", "--paper A3, or smaller squares"),
        ("--board", "8x6@10", "hold it at other distances (--nearest and --farthest)"),
        ("", "", "calibrate with --lens so many"),
        ("", "", "choose another --out"),
    ],
)
def test_the_window_names_no_option_of_the_command(where: str, allowed: str, cure: str) -> None:
    assert "--" not in in_window(InputError("not allowed", where=where, allowed=allowed, cure=cure))
