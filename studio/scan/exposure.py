"""What the camera takes of one laser: one image, or a series of exposures to be fused."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from render.frame import Frame
from render.sampling.random import wrapped
from render.sensor.develop import Image, develop
from studio.project.project import Project

APART = 1_000_003
"""Between the seeds of two exposures."""


def expose(
    project: Project,
    frame: Frame,
    power: Sequence[float] | None,
    number: int = 0,
    *,
    noise: bool = True,
    threads: int | None = None,
) -> Image:
    """The project's exposure of a frame, with the `shorter` ones that the extraction asks for.

    power: W of each laser, None: the scene's. number: of the laser that fires, for its own noise. InputError: as
    `develop`.
    """
    images = []
    for k in range(project.extraction.exposures):
        time = project.sensor.exposure_time / project.extraction.exposure_ratio**k
        sensor = project.sensor.model_copy(update={"exposure_time": time})
        seed = wrapped(project.seed + number + APART * k)
        images.append(develop(frame, project.scene, sensor, seed=seed, threads=threads, laser_power=power, noise=noise))
    return replace(images[0], shorter=tuple(images[1:]))
