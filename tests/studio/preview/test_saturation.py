"""What is expected to saturate, against drawn noise and patterns, and against the rows of a developed render."""

from __future__ import annotations

import numpy as np
import pytest

from render.frame import Axis, LaserCurve
from render.render import render_world
from render.sensor.develop import Image, develop
from render.sensor.sensor import Sensor
from render.sensor.speckle import scintillate, speckle
from render.world.world import build_world
from studio.preview.inspection import inspect, view_warnings
from studio.preview.preview import Preview
from studio.preview.readout_rows import rows
from studio.preview.readouts import readouts
from studio.preview.saturation import brightest, counted_saturated, exceeding, full_electrons, saturated_lines, shares
from studio.project.document import replaced
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.scan.stages import scaled
from tests.analysis.line.line_images import expected
from tests.studio.preview.test_scintillation import NM, PITCH, camera

DRAWS = 200_000


@pytest.mark.parametrize("bits", [8, 12])
@pytest.mark.parametrize(("light", "background"), [(9_600.0, 750.0), (0.0, 10_400.0), (10_450.0, 0.0)])
def test_as_many_pixels_saturate_as_drawn_shot_and_read_noise_lets(light: float, background: float, bits: int) -> None:
    sensor = Sensor(read_noise=30.0, prnu=0.005, dsnu=2.0, bits=bits)  # type: ignore[arg-type]
    random = np.random.default_rng(1)
    mean = (light + background) * (1.0 + sensor.prnu * random.standard_normal(DRAWS))
    charge = random.poisson(mean) + np.hypot(sensor.read_noise, sensor.dsnu) * random.standard_normal(DRAWS)
    numbers = np.floor(sensor.dn_per_electron * np.minimum(charge, sensor.full_well) + 0.5)
    found = float(np.mean(numbers >= 2**bits - 1))
    told = float(exceeding(sensor, camera(5.6), NM, np.array(light), background))
    assert 0.05 < found < 0.95
    assert told == pytest.approx(found, abs=5 * np.sqrt(found * (1 - found) / DRAWS))


def test_a_pixel_is_full_by_its_well_or_by_its_highest_number() -> None:
    sensor = Sensor(full_well=10_000.0, bits=12)
    assert full_electrons(sensor) == pytest.approx(10_000.0)
    assert full_electrons(sensor.model_copy(update={"gain": 1.0})) == 4095.0
    assert full_electrons(sensor.model_copy(update={"gain": 0.1})) == 10_000.0


@pytest.mark.parametrize(("f_number", "sigma", "amplitude"), [(1.4, 0.8, 8e3), (2.8, 1.2, 6e3), (5.6, 1.2, 5e3)])
def test_as_many_lines_saturate_as_a_drawn_pattern_has(f_number: float, sigma: float, amplitude: float) -> None:
    rows, background = 4000, 300.0
    rough = Sensor(speckle="polarised", full_well=10_000)
    centre = 40 + np.random.default_rng(3).uniform(-0.5, 0.5, rows)
    field = speckle(NM, camera(f_number).working_f_number, PITCH)
    light = expected(80, centre, amplitude, sigma, 0.0).astype(np.float32)
    image = scintillate(light, 0, rows, field, 4, 0, 0) + np.float32(background)
    found = float(np.mean(image.max(axis=1) > rough.full_well))
    shown = np.full(rows, sigma), centre, np.full(rows, amplitude), np.full(rows, background)
    told = float(np.mean(saturated_lines(rough, camera(f_number), NM, *shown)))
    # neighbouring rows saturate together
    assert told == pytest.approx(found, abs=4 * np.sqrt(2 * found * (1 - found) / rows))
    assert not saturated_lines(rough.model_copy(update={"speckle": "off"}), camera(f_number), NM, *shown).any()


def test_the_brightest_of_a_pattern_is_the_quantile_of_its_pixels() -> None:
    rough = Sensor(speckle="polarised")
    field = speckle(NM, camera(2.8).working_f_number, PITCH)
    flat = scintillate(np.ones((600, 600), np.float32), 0, 600, field, 2, 0, 0)
    assert brightest(rough, camera(2.8), NM, 0.005) == pytest.approx(np.quantile(flat, 0.995), rel=0.02)
    assert brightest(Sensor(speckle="off"), camera(2.8), NM, 0.005) == 1.0


@pytest.mark.parametrize(
    ("speckled", "milliseconds"), [("off", 6.85), ("off", 7.0), ("polarised", 4.9), ("depolarised", 5.5)]
)
def test_design_and_inspection_tell_the_share_of_rows_that_a_developed_render_saturates(
    speckled: str, milliseconds: float
) -> None:
    """Of mean light below the full well 12 to 23 % of the rows saturated, and none was told of."""
    root = template_folder("v_groove")
    project = Project.load(root / "project.json")
    for name, value in (("exposure_time", 1e-3 * milliseconds), ("speckle", speckled)):
        project = replaced(project, ("sensor", name), value)
    project = scaled(project, 0.5)
    world = build_world(project.scene, root, 0)
    frame = render_world(world, project.scene, settings=project.render, axis=project.extraction.axis)
    quick, slow = readouts(Preview(1).look(project, root), 0), inspect(project, root).lasers[0]
    assert quick.saturated is not None and slow.saturated is not None
    found = share_of_rows(develop(frame, project.scene, project.sensor), quick.scan_lines_hit)
    assert 0.02 < found < 0.6
    # of 602 rows, where neighbours saturate together by their speckle
    within = 4 * np.sqrt((1.0 if speckled == "off" else 2.0) * found * (1.0 - found) / quick.scan_lines_hit)
    assert quick.saturated == pytest.approx(found, abs=within) and slow.saturated == pytest.approx(found, abs=within)
    # light that is rendered, beside a closed form
    assert quick.saturated == pytest.approx(slow.saturated, abs=0.02)
    (row,) = [row for row in rows(quick) if row.key == "saturated"]
    assert row.level
    assert any("of the scan lines the brightest pixel saturates" in text for text in view_warnings(project, frame))


def share_of_rows(image: Image, hit: int) -> float:
    """Of the rows that are hit, those whose brightest pixel is saturated."""
    return float(np.sum(image.pixels.max(axis=1) >= image.saturation)) / hit


@pytest.mark.parametrize("axis", ["rows", "columns"])
def test_scan_lines_are_counted_in_images_of_any_axis_with_colours_and_without_a_line(axis: Axis) -> None:
    """A frame whose line had left the part ended the scan."""
    pixels = np.zeros((40, 30, 3), np.uint8)
    pixels[5, 7, 2] = pixels[6, 7, 0] = pixels[39, 29, 1] = 255
    nothing = np.zeros(0)
    for colours in (pixels, pixels.max(axis=2)):
        image = Image(colours, 8, 1.0, 0.0, 255.0, 1.0, None)
        for index, full in (((4, 5, 5, 6, 7), {"rows": 2, "columns": 1}[axis]), ((), 0)):
            lines = np.array(index, dtype=np.int32)
            curve = LaserCurve(axis, lines, *[nothing] * 8, np.zeros((0, 2, 3)), nothing)
            (told,) = counted_saturated([image], [curve]).tolist()
            assert told == [full, len(set(index))]
            assert shares(np.array([told])) == [full / 4 if index else None]
