"""Times in the machine's own rays: twice as quick a machine takes half the seconds, and as many rays."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from studio.study.answers import answers
from studio.study.cells import next_cells
from studio.study.charts import chart
from studio.study.ray_units import RAY_SPEED, rays_per_second, throughput
from studio.study.study import Study
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


def test_a_frame_takes_no_less_than_a_ray_a_pixel_whatever_the_machine() -> None:
    """In the machine's own rays the limit is the image's pixels; of two machines it is the median one's."""
    for speed in (5e6, 10e6):
        found = throughput([speed, speed, math.nan], 1e6)
        assert found is not None
        assert found.frame_seconds * found.rays_per_second == pytest.approx(1e6)
    assert throughput([math.nan], 1e6) is None and throughput([], 1e6) is None


def test_a_chart_of_speed_shows_time_in_rays_and_their_limit() -> None:
    data = {"name": "s", "vary": [{"field": "sensor.read_noise", "values": [1.0, 2.0]}], "chart": "speed"}
    chosen = Study.model_validate({"base": "plane", "image_scale": 0.5, "repeats": 2, "sweeps": [data]})
    bases = chosen.bases(Path())
    cells = next_cells(chosen, bases, {})
    found = answers(chosen, bases, {cell.key: {"depth_rmse": 1e-4, "reason": "", **SLOW} for cell in cells})[0]
    camera = bases["plane"].scene.rig.camera.scaled(0.5)
    assert found.throughput is not None
    assert found.throughput.frame_seconds == pytest.approx(camera.width * camera.height / SLOW[RAY_SPEED])
    drawn = chart(found, {})
    drawn.canvas.draw()  # the axis of rays takes its limits as it is drawn
    axes = drawn.axes[0]
    assert any(set(line.get_xdata()) == {found.throughput.frame_seconds} for line in axes.lines)
    (top,) = axes.child_axes
    assert top.get_xlabel() == "million rays of this machine"
    assert np.asarray(top.get_xlim()) == pytest.approx(np.asarray(axes.get_xlim()) * SLOW[RAY_SPEED] / 1e6)
