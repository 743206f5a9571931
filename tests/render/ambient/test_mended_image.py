"""What a frame takes over of the coarse ambient light of another: as far as that one saw it, the rest is its own."""

from __future__ import annotations

from functools import partial

import numpy as np

from render.ambient import taught_image
from render.ambient.coarse_image import FIRST_SAMPLES, coarse_image, own_places
from render.ambient.guided_image import guided_image
from render.ambient.integrator import ambient_image
from render.ambient.mended_image import mended_grid
from render.ambient.path_tracer import camera_paths
from render.ambient.pixel_samples import PixelSamples
from render.ambient.taught_image import CoarseLesson, _shown_before, taken_over
from render.material.material import Lambertian
from render.mesh.primitives import primitive_mesh
from render.run import Run
from render.scene.motion import LinearStage
from render.scene.shape import Box
from render.world.placed import PlacedScene
from tests.render.ambient.test_ambient_error import PANEL, SKY
from tests.render.ambient.test_path_kernels import scene_with
from tests.render.scenes import moved, paper_camera, plane_mesh

SEEDS = 6


def boxes_beside_each_other():
    """A dark box in the middle of a wall, and a white one that comes into the image as the rig moves."""
    meshes = [
        moved(primitive_mesh(Box(size_x=0.1, size_y=0.1, size_z=0.1)), (x, 0, 0.85), (0.3, 0.2, 0.1)) for x in (0, 0.4)
    ]
    scene, world = scene_with(
        paper_camera(0.2),
        (plane_mesh((0.2, 0.1, 1), 0.9), Lambertian(albedo=0.5)),
        (meshes[0], Lambertian(albedo=0.2)),
        (meshes[1], Lambertian(albedo=0.9)),
        environment=SKY,
        lights=(PANEL,),
    )
    return scene.model_copy(update={"motion": LinearStage(moves="rig", step=(0.12, 0.0, 0.0), steps=2)}), world


def paths_of(placed, seed):
    return camera_paths(placed.world, placed.scene, placed.camera.view(placed.T_world_camera), seed=seed)


def square_error(image, a, b):
    """Squared relative error by two images whose noise knows nothing of each other or of it."""
    a, b, image = (one.astype(np.float64) for one in (a, b, image))
    return np.sum((image - a) * (image - b)) / np.sum(a * b)


def test_samples_of_what_another_frame_did_not_show_mend_most_of_the_image():
    scene, world = boxes_beside_each_other()
    teacher, pupil = PlacedScene(world, scene, 0), PlacedScene(world, scene, 1)
    height, most = scene.camera.height, scene.camera.width * scene.camera.height
    references = [
        ambient_image(world, scene, scene.camera, pupil.T_world_camera, samples=16, surfaces=1, run=Run(seed=seed))
        for seed in (97, 98)
    ]
    shown = partial(_shown_before, teacher, world.rays.centre)
    mended, moved_only, own = [], [], []
    for seed in range(SEEDS):
        coarse = coarse_image(paths_of(teacher, 10 * seed), height, most, Run(seed=10 * seed))
        paths, film = paths_of(pupil, 10 * seed + 1), PixelSamples(np.zeros(0, np.int32))
        grid, new = mended_grid(coarse.grid, paths, height, shown, film, Run())
        assert 0 < len(new) < 0.4 * len(grid.item) and film.total == 2 * FIRST_SAMPLES * len(new)
        for errors, of, places in (
            (mended, grid, own_places(paths)),
            (moved_only, coarse.grid, lambda *seen: shown(*seen)[0]),
        ):
            errors.append(square_error(guided_image(of, paths, height, places, Run()), *references))
        own.append(square_error(coarse_image(paths, height, most, Run(seed=seed)).radiance, *references))
    # most of what reprojection alone is worse by than the frame's own image, beyond the scatter of the seeds
    gained = 0.5 * (np.add(moved_only, own)) - mended
    assert gained.mean() > 4.0 * gained.std(ddof=1) / np.sqrt(SEEDS)


def test_a_frame_tells_how_far_off_it_is_what_it_took_over(monkeypatch):
    # whatever it is: of images as small as this one edges are too much of the image for a twentieth
    monkeypatch.setattr(taught_image, "COARSE_ERROR", 0.1)
    scene, world = boxes_beside_each_other()
    teacher, pupil = PlacedScene(world, scene, 0), PlacedScene(world, scene, 1)
    height, most = scene.camera.height, scene.camera.width * scene.camera.height
    coarse = coarse_image(paths_of(teacher, 0), height, most, Run())
    image = taken_over(CoarseLesson(coarse, teacher, ()), pupil, paths_of(pupil, 1), Run())
    assert image is not None and image.taken_over and 0.0 < image.error < 0.1
    assert image.samples < coarse.samples
    far = scene.model_copy(update={"motion": LinearStage(moves="rig", step=(0.7, 0.0, 0.0), steps=2)})
    pupil = PlacedScene(world, far, 1)
    assert taken_over(CoarseLesson(coarse, teacher, ()), pupil, paths_of(pupil, 1), Run()) is None
