"""Refinement: early frames are usable, late ones better, and the last one is the render itself."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from analysis.report.light_text import plan_lines
from render.base.counts import RAYS
from render.base.errors import Cancelled
from render.base.pose import Pose
from render.mesh.primitives import primitive_mesh
from render.products import expected_plan
from render.progressive import refine
from render.render import render_world
from render.run import Run
from render.scene.lights import Environment, PointLight
from render.scene.settings import RenderSettings
from render.scene.shape import Box
from render.sensor.develop import develop
from render.sensor.sensor import Sensor, SpectralCurve
from tests.render.scenes import moved, paper_camera, paper_laser, plane_mesh, scene_of, world_of

SKY = Environment(radiance=(0.2, 0.3, 0.4))
LAMP = PointLight(intensity=(1.0, 1.0, 1.0), T_world_light=Pose(translation=(0.3, 0.1, 0.1)))
SETTINGS = RenderSettings(transport="direct", laser_error=0.01, ambient_samples=16, ambient_error=2e-4)


def box_on_a_wall(**parts):
    parts = {"environment": SKY, "lights": (LAMP,)} | parts
    box = moved(primitive_mesh(Box(size_x=0.1, size_y=0.1, size_z=0.1)), (0, 0, 0.85), (0.3, 0.2, 0.1))
    scene = scene_of(paper_camera(0.05), paper_laser(), objects=2, **parts)
    return world_of(scene, plane_mesh((0.2, 0.1, 1), 0.9), box), scene


def arrays(frame):
    truth = frame.truth
    found = [*frame.laser_direct, frame.ambient, *(curve.position for curve in frame.curves)]
    return [*found, truth.depth_z, truth.depth_range, truth.position, truth.normal, truth.object_id]


def test_the_last_frame_is_the_render_bit_for_bit():
    world, scene = box_on_a_wall()
    *_, last = refine(world, scene, settings=SETTINGS, run=Run(seed=3, threads=2))
    whole = render_world(world, scene, settings=SETTINGS, run=Run(seed=3, threads=1))
    assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(arrays(last), arrays(whole), strict=True))
    assert last.plan == whole.plan
    assert whole.counts.keys() <= last.counts.keys() and whole.seconds.keys() <= last.seconds.keys()


def test_every_frame_can_be_developed_and_knows_more_than_the_one_before():
    world, scene = box_on_a_wall()
    sensor = Sensor(efficiency=(SpectralCurve(wavelength_nm=(400.0, 700.0), value=(0.6, 0.6)),))
    frames = list(refine(world, scene, settings=SETTINGS))
    assert len(frames) == 2 + 1 + 3  # two of the laser, the truth, and 2, 4 and 16 samples
    for frame in frames:
        assert develop(frame, scene, sensor).pixels.max() > 0
        assert len(frame.curves[0].index) > 0
    assert [frame.truth is not None for frame in frames] == [False, False, True, True, True, True]
    assert [frame.ambient is not None for frame in frames] == [False] * 3 + [True] * 3
    assert frames[1].quality_of("direct", "laser").error <= 0.01
    rays = [frame.counts[RAYS] for frame in frames]
    assert rays == sorted(rays) and rays[0] > 0


def test_the_first_frame_is_a_small_part_of_the_work():
    world, scene = box_on_a_wall()
    frames = list(refine(world, scene, settings=SETTINGS))
    assert frames[0].counts[RAYS] < 0.02 * frames[-1].counts[RAYS]


def test_progress_rises_to_the_end():
    world, scene = box_on_a_wall()
    told: list[tuple[str, float]] = []
    list(refine(world, scene, settings=SETTINGS, progress=lambda stage, done: told.append((stage, done))))
    shares = [done for _, done in told]
    assert all(b >= a - 1e-12 for a, b in itertools.pairwise(shares))
    assert shares[0] == 0.0 and shares[-1] == pytest.approx(1.0)
    assert told[-1][0] == "ambient light"


def test_cancelling_keeps_the_frames_so_far():
    world, scene = box_on_a_wall()
    frames = []
    with pytest.raises(Cancelled):
        for frame in refine(world, scene, settings=SETTINGS, run=Run(cancelled=lambda: len(frames) == 4)):
            frames.append(frame)
    assert len(frames) == 4 and frames[-1].ambient is not None


@pytest.mark.parametrize("samples", [1, 2, 5, 20])
def test_the_samples_asked_for_end_the_ambient_light(samples):
    world, scene = box_on_a_wall()
    settings = SETTINGS.model_copy(update={"ambient_samples": samples, "truth_images": False})
    frames = [frame for frame in refine(world, scene, settings=settings) if frame.ambient is not None]
    found = [frame.quality_of("ambient").work for frame in frames]
    assert found == sorted(set(found))
    # whole samples on every tile: half of one in the mean at most
    assert found[-1] == pytest.approx(samples, abs=1.0)


def test_a_dark_scene_ends_with_the_truth_and_one_without_truth_with_the_lasers():
    world, scene = box_on_a_wall(environment=Environment(), lights=())
    frames = list(refine(world, scene, settings=SETTINGS))
    assert frames[-1].ambient is None and frames[-1].truth is not None
    *_, last = refine(world, scene, settings=SETTINGS.model_copy(update={"truth_images": False}))
    assert last.truth is None and last.laser_direct[0].max() > 0


def test_the_plan_says_what_is_computed_and_what_is_not():
    _, scene = box_on_a_wall()
    plan = expected_plan(scene, SETTINGS)
    computed = {(step.group, step.name): step.computed for step in plan.steps}
    assert computed["direct", "direct"] and computed["ambient", "ambient"] and computed["truth", "pixels"]
    assert computed["indirect", "indirect"] is False and computed["ambient", "interreflection"] is False
    text = "\n".join(plan_lines(plan))
    assert "16 samples" in text and "interreflection" in text and "depth" in text
    _, dark = box_on_a_wall(environment=Environment(), lights=())
    assert expected_plan(dark, SETTINGS).step("ambient", "ambient").reason == "absent"
    assert "ambient: none" in "\n".join(plan_lines(expected_plan(dark, SETTINGS)))
