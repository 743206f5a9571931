"""Times in the machine's own rays: twice as quick a machine takes half the seconds, and as many rays."""

from __future__ import annotations

import math

import numpy as np
import pytest

from studio.study.ray_units import RAY_SPEED, rays_per_second
from studio.study.tables import rays_of

SLOW = {"seconds_render": 4.0, "seconds_develop": 1.0, "seconds_extract": 1.0, RAY_SPEED: 5e6}
QUICK = {"seconds_render": 2.0, "seconds_develop": 0.5, "seconds_extract": 0.5, RAY_SPEED: 10e6}


def test_two_machines_take_as_many_rays() -> None:
    assert rays_of([SLOW], "frame") == rays_of([QUICK], "frame") == pytest.approx(30.0)
    assert rays_of([SLOW], "line") == rays_of([QUICK], "line") == pytest.approx(5.0)


def test_rows_of_before_have_none() -> None:
    rows = [{name: value for name, value in SLOW.items() if name != RAY_SPEED}]
    assert np.isnan(rays_of(rows, "frame")).all()


def test_a_machine_traces_rays() -> None:
    assert 0.0 < rays_per_second() < math.inf
    assert rays_per_second() == rays_per_second()  # once a process
