"""The exposure that fills the sensor by the line, and leaves glints to saturate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from render.frame import Frame, LaserCurve
from render.sensor.develop import develop
from studio.preview.remedy_changes import FILLED
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.scan.exposure import filling_exposure
from studio.scan.stages import scaled


@pytest.fixture(scope="module")
def project() -> Project:
    whole = scaled(Project.load(template_folder("plane") / "project.json"), 0.05)
    return whole.model_copy(update={"sensor": whole.sensor.model_copy(update={"bits": 16, "exposure_time": 1e-3})})


def frame_of(project: Project, axis: str) -> Frame:
    """A line that gets brighter from scan line to scan line, with a glint on one and a lamp's image beside it."""
    camera = project.scene.camera
    count, across = (camera.height, camera.width) if axis == "rows" else (camera.width, camera.height)
    light = np.zeros((count, across), np.float32)
    index = np.arange(count, dtype=np.int32)
    position = 20.0 + 0.3 * (index % 7)
    light[index, np.rint(position).astype(int)] = 1.0 + 0.01 * index
    light[3, 21] = 500.0
    ambient = np.zeros((count, across, 3), np.float32)
    ambient[:, 40] = 1e4
    if axis == "columns":
        light, ambient = np.ascontiguousarray(light.T), np.ascontiguousarray(ambient.swapaxes(0, 1))
    rest = np.ones(count)
    curve = LaserCurve(
        axis, index, position, np.ones((count, 3)), rest, rest, index, rest, rest, rest, np.zeros((0, 2, 3)), rest
    )
    return Frame(0, (light,), ambient, (curve,), None)


@pytest.mark.parametrize("axis", ["rows", "columns"])
def test_the_brightest_scan_lines_come_to_the_share_that_is_asked_for(project: Project, axis: str) -> None:
    frame = frame_of(project, axis)
    time = filling_exposure(project, frame, [0.01], FILLED)
    assert time is not None
    image = develop(
        frame,
        project.scene,
        project.sensor.model_copy(update={"exposure_time": time}),
        seed=1,
        laser_power=[0.01],
        noise=False,
    )
    light = image.pixels if axis == "rows" else image.pixels.T
    peaks = np.quantile(light[:, 15:30].max(axis=1), 0.99) - image.black_level
    # three digits of the time are kept, and a number is rounded
    assert peaks / (image.saturation - image.black_level) == pytest.approx(FILLED, rel=0.006)
    assert light[3, 21] == image.saturation


def test_twice_the_power_takes_half_the_time_and_a_laser_that_is_off_has_none(project: Project) -> None:
    dark = frame_of(project, "rows")
    frame = replace(dark, ambient=None)
    sensor = project.sensor.model_copy(update={"dark_current": 0.0})
    project = project.model_copy(update={"sensor": sensor})
    one, two = (filling_exposure(project, frame, [power], FILLED) for power in (0.01, 0.02))
    assert one is not None and two is not None and one / two == pytest.approx(2.0, rel=0.006)
    assert filling_exposure(project, frame, [0.0], FILLED) is None
