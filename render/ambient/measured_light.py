"""Ambient light for what is measured: as well as each scan line needs it where a line is, coarse elsewhere; and for an
image that may be off by a twentieth, coarse everywhere."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from render.ambient.coarse_image import COARSE_ERROR, TILE, CoarseImage, coarse_image
from render.ambient.integrator import AmbientImage, ambient_images
from render.ambient.line_samples import band_of, sample_band
from render.ambient.path_state import CLAMPED, INVALID
from render.ambient.path_tracer import CameraPaths, camera_paths
from render.ambient.pixel_samples import PixelSamples
from render.ambient.taught_image import CHECK_SEED, CoarseLesson, taken_over
from render.base.arrays import Float, Float32, Int
from render.base.threads import map_chunks
from render.importance import LEAST_SAMPLES, Importance, known_below
from render.run import Run
from render.world.placed import PlacedScene

COARSE_SAMPLES, COARSE_SHARE = 0.5, 0.125
"""Most samples a pixel, and of those that are allowed, for the coarse image: where what it does not reach matters, the
band is wider."""
COARSE = "coarse ambient"
"""Part of a memory and of the lessons of a block."""


def measured_images(
    placed: PlacedScene,
    importance: Importance,
    *,
    most: int = 16,
    surfaces: int | None = 1,
    clamp: float | None = None,
    target: float | None = None,
    run: Run = Run(),
) -> Iterator[AmbientImage]:
    """The coarse image, where one is wanted early, then the one whose scan lines are known, or on which `most` samples
    a pixel are spent.

    Where the goal is out of reach, all that is allowed goes to where the lines are; where `most` leaves no room for a
    first look at them, the image is rendered in its place, to the relative error `target`. As `ambient_images`; the
    error of the second is the deviation of its scan lines over the allowed one, which most of them are below. Raises
    Cancelled. ValueError: the importance is of another image.
    """
    camera, view = placed.camera, placed.camera.view(placed.T_world_camera)
    if importance.ambient.shape != (camera.height, camera.width):
        raise ValueError(f"weights {importance.ambient.shape} of an image of {camera.height} x {camera.width}")
    if most < LEAST_SAMPLES:
        least = 0.0 if target is None else target
        yield from ambient_images(placed, target=least, most=most, surfaces=surfaces, clamp=clamp, run=run)
        return
    paths = camera_paths(placed.world, placed.scene, view, surfaces=surfaces, clamp=clamp, seed=run.seed)
    budget = most * camera.width * camera.height
    coarse = _coarse(placed, paths, (most, surfaces, clamp, run.seed), budget, run.between(0.0, 0.5))
    band = band_of(importance, coarse, run.threads)
    film = PixelSamples(band.pixels)
    if run.shows_early:
        yield _image(coarse, film, None)
    deviations = np.zeros(0)
    if len(band.pixels):
        deviations = sample_band(film, paths, band, budget - coarse.samples, run.between(0.5, 1.0))
    if run.shows_early or not run.alone:
        coarse = replace(coarse, radiance=_copied(coarse.radiance))
    yield _image(coarse, film, deviations, band.pixels)


def image_light(
    placed: PlacedScene,
    *,
    target: float,
    most: int = 16,
    surfaces: int | None = 1,
    clamp: float | None = None,
    run: Run = Run(),
) -> Iterator[AmbientImage]:
    """As `ambient_images`; where the target is no finer than COARSE_ERROR, the coarse image alone, if it reaches it.

    Raises Cancelled.
    """
    camera, part = placed.camera, run
    if target >= COARSE_ERROR and most >= LEAST_SAMPLES:
        view = camera.view(placed.T_world_camera)
        paths = camera_paths(placed.world, placed.scene, view, surfaces=surfaces, clamp=clamp, seed=run.seed)
        allowed = _share(most) * most * camera.width * camera.height
        coarse = coarse_image(paths, camera.height, int(allowed), run.between(0.0, 0.2), target)
        if coarse.error <= target:
            image = _image(coarse, PixelSamples(np.zeros(0, np.int32)), None)
            yield replace(image, error=coarse.error, coarse_error=None)
            run.progress(1.0)
            return
        part = run.between(0.2, 1.0)
    yield from ambient_images(placed, target=target, most=most, surfaces=surfaces, clamp=clamp, run=part)


def _share(most: int) -> float:
    """Of the samples that are allowed, for the coarse image."""
    return min(COARSE_SAMPLES / most, COARSE_SHARE)


def _coarse(placed: PlacedScene, paths: CameraPaths, settings: tuple[Any, ...], budget: int, run: Run) -> CoarseImage:
    """The coarse image: of what was seen before as it was, of what is much like another frame as that has it, if that
    is near enough; else sampled. Raises Cancelled."""
    world, made_of = placed.world, seen_from(placed, *settings)
    found: CoarseImage | None = run.recall(COARSE, world, made_of)
    lesson: CoarseLesson | None = run.taught(COARSE)
    if found is None and lesson is not None and lesson.placed.world is world and lesson.seen_from == made_of:
        found = lesson.coarse
    if found is not None:
        return found
    if lesson is not None:
        found = taken_over(lesson, placed, replace(paths, seed=run.shifted(CHECK_SEED).seed), run)
    if found is None:
        found = coarse_image(paths, placed.camera.height, int(_share(settings[0]) * budget), run)
    run.leave(COARSE, world, made_of, found, for_others=True)
    run.teach(COARSE, CoarseLesson(found, placed, made_of))
    return found


def _copied(radiance: Float32) -> Float32:
    """(h, w, 3) of the first image, which whoever shows it or another frame still holds."""
    copy = np.empty_like(radiance)

    def work(start: int, stop: int) -> None:
        copy[start:stop] = radiance[start:stop]

    map_chunks(work, len(copy), TILE)
    return copy


def seen_from(placed: PlacedScene, *settings: object) -> tuple[object, ...]:
    """All that the ambient light depends on besides the world, with the settings of its render: not the lasers."""
    scene = placed.scene
    return scene.camera, placed.T_world_camera.tobytes(), scene.lights, scene.environment, *settings


def _image(coarse: CoarseImage, film: PixelSamples, deviations: Float | None, band: Int | None = None) -> AmbientImage:
    """The coarse image, with the pixels of the band in it, in place, once they are sampled to some deviations of the
    lines."""
    radiance, error, total = coarse.radiance, float("nan"), coarse.samples + film.total
    lines: int | None = None
    unknown: int | None = None
    if deviations is not None and band is not None:
        radiance.reshape(-1, 3)[band] = film.means().mean(axis=1)
        error, lines, unknown = known_below(deviations), len(deviations), int(np.sum(deviations > 1.0))
    return AmbientImage(
        radiance,
        error,
        total / (radiance.shape[0] * radiance.shape[1]),
        coarse.dropped + int(film.invalid_counts[INVALID]),
        coarse.clamped + int(film.invalid_counts[CLAMPED]),
        (coarse.cut * coarse.samples + film.cut) / total,
        coarse.error,
        lines,
        unknown,
    )
