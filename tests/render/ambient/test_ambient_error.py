"""Ambient light to an error: the error told is the true one, samples go where it pays, the plan is measured."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from render.ambient.coarse_image import means_about
from render.ambient.integrator import ambient_image, ambient_images
from render.ambient.light_group import AmbientLight
from render.ambient.transport_plan import ONWARD, UNREACHABLE, has_ambient
from render.ambient.transport_plan import onward_share as share_of
from render.base.errors import Cancelled
from render.base.pose import Pose
from render.frame import Frame
from render.light_group import chosen_plan
from render.material.material import Conductor, Emitter, Glass, Lambertian
from render.mesh.primitives import primitive_mesh
from render.plan import TransportStep
from render.progressive import refine
from render.render import render_world
from render.run import Run
from render.scene.lights import Environment, PointLight, RectangleLight
from render.scene.settings import RenderSettings
from render.scene.shape import Box, Sphere
from render.world.placed import PlacedScene
from tests.render.ambient.test_path_kernels import inside_out, scene_with
from tests.render.scenes import moved, paper_camera, plane_mesh

SKY = Environment(radiance=(0.2, 0.3, 0.4))
LAMP = PointLight(T_world_light=Pose(translation=(0.3, 0.1, 0.1)))
PANEL = RectangleLight(width=0.2, height=0.2, T_world_light=Pose(translation=(0.3, 0.1, 0.1)))


def box_on_a_wall(scale=0.05, **parts):
    """Soft shadows about a box; most of the wall is smooth."""
    box = moved(primitive_mesh(Box(size_x=0.1, size_y=0.1, size_z=0.1)), (0, 0, 0.85), (0.3, 0.2, 0.1))
    return scene_with(
        paper_camera(scale),
        (plane_mesh((0.2, 0.1, 1), 0.9), Lambertian(albedo=0.5)),
        (box, Lambertian(albedo=0.5)),
        **({"environment": SKY, "lights": (PANEL,)} | parts),
    )


def images_of(scene, world, **options):
    return list(ambient_images(PlacedScene(world, scene), **options))


def true_error(image, reference):
    return np.sqrt(np.mean((image.astype(np.float64) - reference) ** 2) / np.mean(reference**2))


def test_the_error_told_is_the_true_one_at_every_refinement():
    scene, world = box_on_a_wall()
    pose = scene.T_world_camera()
    reference = ambient_image(world, scene, scene.camera, pose, samples=1024, surfaces=None, run=Run(seed=99)).astype(
        np.float64
    )
    told, true = [], []
    for image in images_of(scene, world, target=1e-4, most=64, surfaces=None):
        told.append(image.error)
        true.append(true_error(image.radiance, reference))
    assert len(told) >= 4 and all(b < a for a, b in itertools.pairwise(true))
    # 12 000 pixels, a part of which holds most of the error
    assert np.array(told) == pytest.approx(np.array(true), rel=0.15)


def test_it_ends_at_the_error_asked_for_and_not_much_later():
    scene, world = box_on_a_wall()
    images = images_of(scene, world, target=0.01, most=4096)
    assert images[-1].error <= 0.01 < images[-2].error
    finer = images_of(scene, world, target=0.005, most=4096)[-1]
    assert finer.error <= 0.005 and 1.3 < finer.samples / images[-1].samples < 8.0


@pytest.mark.validation
def test_samples_where_the_variance_is_beat_the_same_number_everywhere():
    # the lamp's light on the wall is smooth; the edges of the box and of its shadow are not
    scene, world = box_on_a_wall(0.1, lights=(LAMP,), environment=Environment())
    pose = scene.T_world_camera()
    reference = ambient_image(world, scene, scene.camera, pose, samples=512, run=Run(seed=99)).astype(np.float64)
    led = images_of(scene, world, target=1e-5, most=32)[-1]
    even = ambient_image(world, scene, scene.camera, pose, samples=32)
    assert led.samples == pytest.approx(32, rel=0.05)
    assert true_error(led.radiance, reference) < 0.7 * true_error(even, reference)


def test_the_image_is_unbiased_however_the_samples_are_led():
    # many short renders, each of which decided for itself
    scene, world = box_on_a_wall(0.01)
    pose = scene.T_world_camera()
    sums = [images_of(scene, world, target=1e-5, most=8, run=Run(seed=seed))[-1].radiance.sum() for seed in range(40)]
    reference = ambient_image(world, scene, scene.camera, pose, samples=16384, run=Run(seed=99)).sum()
    error = np.std(sums, ddof=1) / np.sqrt(len(sums))
    assert abs(np.mean(sums) - reference) < 4.0 * error


def test_threads_do_not_change_a_bit_of_any_refinement():
    scene, world = box_on_a_wall()
    one, three = (images_of(scene, world, target=1e-5, most=40, surfaces=None, run=Run(threads=n)) for n in (1, 3))
    assert len(one) == len(three)
    assert all(np.array_equal(a.radiance, b.radiance) and a.error == b.error for a, b in zip(one, three, strict=True))


def test_a_pass_is_cancelled_within_a_wave():
    scene, world = box_on_a_wall(0.1)
    asked = []
    with pytest.raises(Cancelled):
        images_of(scene, world, target=1e-5, most=4096, run=Run(cancelled=lambda: len(asked) > 20 or asked.append(1)))


def test_a_clamp_makes_darker_and_says_so():
    scene, world = box_on_a_wall()
    free = images_of(scene, world, target=1e-5, most=16, surfaces=None)[-1]
    cut = images_of(scene, world, target=1e-5, most=16, surfaces=None, clamp=0.02)[-1]
    assert free.clamped == 0 and free.clamped_radiance == 0.0 and free.invalid == 0
    assert cut.clamped > 0 and cut.radiance.mean() < free.radiance.mean()
    assert free.radiance.mean() - cut.radiance.mean() == pytest.approx(cut.clamped_radiance, rel=0.1)
    settings = RenderSettings(ambient_samples=4, clamp=0.02, transport="interreflection", truth_images=False)
    frame = render_world(world, scene, settings=settings)
    assert frame.plan.clamp == 0.02 and frame.quality_of("ambient").clamped > 0


@pytest.mark.parametrize("threads", [1, 2])
def test_a_refined_frame_and_a_rendered_one_are_the_same(threads):
    scene, world = box_on_a_wall()
    settings = RenderSettings(ambient_error=0.01, ambient_samples=64, truth_images=False)
    *_, last = refine(world, scene, settings=settings, run=Run(threads=threads))
    whole = render_world(world, scene, settings=settings, run=Run(threads=3 - threads))
    assert np.array_equal(last.ambient, whole.ambient) and last.plan == whole.plan
    assert last.quality == whole.quality


def plan_of(scene, world, **settings):
    dark = Frame(0, (), None, (), None)
    return chosen_plan(AmbientLight(), PlacedScene(world, scene), RenderSettings(**settings), dark)[0]


def onward_share(world, scene):
    return share_of(PlacedScene(world, scene))


def test_a_single_wall_reflects_nothing_on_and_is_left_at_one_surface():
    scene, world = scene_with(paper_camera(0.05), (plane_mesh((0.2, 0.1, 1), 0.9), Lambertian()), environment=SKY)
    assert onward_share(world, scene) == (0.0, 0.0)
    chosen = plan_of(scene, world)
    assert chosen.surfaces == 1 and chosen.steps[1] == TransportStep("ambient", ONWARD, False, "negligible", 0.0, 0.0)


def test_a_room_is_followed_and_the_pilot_knows_its_share():
    room = inside_out(primitive_mesh(Sphere(radius=2.0)))
    scene, world = scene_with(paper_camera(0.01), (room, Emitter(albedo=0.5)))
    share, error = onward_share(world, scene)
    # a + a^2 + ... over a
    assert share == pytest.approx(1.0, abs=4 * error + 0.01) and error < 0.05
    chosen = plan_of(scene, world)
    assert chosen.surfaces is None
    assert chosen.steps[1] == TransportStep("ambient", ONWARD, True, "pilot", share, error)
    assert plan_of(scene, world, max_bounces=3).surfaces == 3
    assert plan_of(scene, world, transport="direct").surfaces == 1


def test_what_is_seen_through_glass_only_is_not_left_out():
    ball = moved(primitive_mesh(Sphere(radius=0.4)), (0, 0, 0.6))
    lamp = PointLight(T_world_light=Pose(translation=(0.0, 0.0, -0.5)))
    scene, world = scene_with(
        paper_camera(0.02), (ball, Glass()), (plane_mesh((0, 0, 1), 1.5), Lambertian()), environment=SKY, lights=(lamp,)
    )
    chosen = plan_of(scene, world)
    assert chosen.surfaces is None
    assert UNREACHABLE in chosen.steps


def test_metal_is_lit_by_what_it_mirrors():
    # the metal mirrors a bright wall that the camera does not see, and a sky as dark as that wall is bright
    metal, wall = plane_mesh((0, 0, 1), 0.9), moved(plane_mesh((0, 1, 0.001), 0.0004, size=3.0), (0, 0.4, 0))
    scene, world = scene_with(
        paper_camera(0.03), (metal, Conductor(roughness=0.3)), (wall, Lambertian(albedo=0.8)), environment=SKY
    )
    share, error = onward_share(world, scene)
    assert share > 0.1 > 0.02 + 4 * error
    assert plan_of(scene, world).surfaces is None


def test_shining_objects_are_ambient_light():
    scene, _ = scene_with(paper_camera(0.01), (plane_mesh((0, 0, 1), 1.0), Emitter()))
    assert has_ambient(scene)
    dark, _ = scene_with(paper_camera(0.01), (plane_mesh((0, 0, 1), 1.0), Emitter(radiance=(0.0, 0.0, 0.0))))
    assert not has_ambient(dark)


@pytest.mark.parametrize("wanted", [True, False])
def test_an_unfinished_pass_is_kept_where_that_is_wanted(wanted):
    scene, world = box_on_a_wall(0.1)
    images, calls, limit = [], itertools.count(), [10**9]

    def cancelled():
        return next(calls) > limit[0]

    with pytest.raises(Cancelled):
        for image in ambient_images(
            PlacedScene(world, scene),
            target=1e-6,
            most=4096,
            run=Run(threads=1, cancelled=cancelled, keep_partial=lambda: wanted),
        ):
            images.append(image)
            if len(images) == 3:
                limit[0] = next(calls) + 30  # some chunks into the next pass
    assert len(images) == (4 if wanted else 3)
    if wanted:
        before, kept = images[-2:]
        assert kept.samples > 1.1 * before.samples
        same = np.all(before.radiance == kept.radiance, axis=2).mean()
        assert 0.02 < same < 0.98  # whole tiles of the new pass, the others as they were
        assert np.abs(kept.radiance - before.radiance).mean() < 0.1 * before.radiance.mean()


def test_means_of_squares_are_never_negative():
    values = np.exp(np.random.default_rng(0).normal(0.0, 12.0, (16, 64))).astype(np.float32)
    values[:, 20:] = 0.0
    found = means_about(values, (3, 3), "constant")
    assert found.min() == 0.0
    around = np.pad(values, 1).astype(np.float64)
    mean = sum(around[i : i + 16, j : j + 64] for i in range(3) for j in range(3)) / 9.0
    np.testing.assert_allclose(found[:, :20], mean[:, :20], rtol=1e-3, atol=1e-6 * mean.max())
