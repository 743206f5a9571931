"""The guard between the stages: NaN and infinities are named where they arise, and get no farther."""

from __future__ import annotations

import numpy as np
import pytest

from render.base.errors import InputError
from render.base.finite import CURES, check_finite
from render.sensor.develop import develop, expected_electrons
from tests.render.sensor.test_develop import flat_frame, scene_of, sensor_of


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("stage", CURES)
def test_one_bad_number_names_the_stage_what_it_is_and_a_cure(stage: str, bad: float) -> None:
    values = np.ones(1000, dtype=np.float32)
    check_finite(stage, depths=values)
    values[7] = bad
    with pytest.raises(InputError, match=f"stage '{stage}'.*depths.*1 of 1000") as caught:
        check_finite(stage, depths=values)
    assert caught.value.cure


def test_numbers_whose_sum_overflows_are_still_finite() -> None:
    check_finite("render", radiances=np.full(10, 1e308), more=np.full(10, 3e38, dtype=np.float32), none=np.zeros(0))


def test_a_frame_with_light_that_is_no_number_is_not_handed_on() -> None:
    good = flat_frame(1.0, ambient=(1.0, 1.0, 1.0))
    good.check()
    for frame in (flat_frame(np.nan), flat_frame(1.0, ambient=(1.0, np.inf, 1.0))):
        with pytest.raises(InputError, match="stage 'render'"):
            frame.check()


def test_electrons_that_are_no_number_are_not_developed() -> None:
    """Light that comes from elsewhere than the renderer; NaN would be read as dark, and an infinity as saturated."""
    scene, sensor, frame = scene_of(1.0), sensor_of(), flat_frame(np.inf)
    for develops in (develop, expected_electrons):
        with pytest.raises(InputError, match="stage 'sensor'"):
            develops(frame, scene, sensor)
