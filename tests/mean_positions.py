"""Where lines lie on average over the sensor's noise: by how far these places differ, a render adds to a measurement.

A position is a function of the light and of the noise, with variance Var E[u | light] + E Var[u | light]: the second is
the sensor's, and the first is what the render adds. In an image without noise both are mixed. There a fit that takes in
one pixel more jumps by a tenth of a sigma where the light is all but the same; noise makes it do so anyway, as often.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from render.base.arrays import Float
from render.frame import Frame
from render.sensor.develop import expected_electrons
from studio.project.project import Project
from studio.scan.line_extraction import extract_line, noise_model
from studio.scan.render_goal import _expected_image


def rendered_variance(project: Project, frames: Sequence[Frame], draws: int) -> Float:
    """(lines,) px^2, of the first laser: variance over the frames of where a line lies on average over the noise; NaN:
    not found in one of the images. Unbiased, so that it may be negative.

    The noise is the same for all frames, each with its opposite. Defocus, where a frame has no truth, is left out.
    """
    if frames[0].truth is None:
        project = project.model_copy(update={"sensor": project.sensor.model_copy(update={"defocus": False})})
    electrons = [expected_electrons(frame, project.scene, project.sensor) for frame in frames]
    floor = noise_model(_expected_image(project, electrons[0]), project, 0).floor
    places = []
    for draw in range(draws):
        noise = np.random.default_rng(draw).standard_normal(electrons[0].shape, np.float32)
        noise *= np.sqrt(np.maximum(electrons[0] + np.float32(floor), np.float32(1e-2)))
        images = [[_expected_image(project, light + sign * noise) for sign in (1, -1)] for light in electrons]
        lines = [[extract_line(project, image, 0).u[:, 0] for image in pair] for pair in images]
        places.append(np.mean(lines, axis=1))
    u = np.asarray(places)
    u -= u.mean(axis=1, keepdims=True)  # what all frames have in common
    between = u.mean(axis=0).var(axis=0, ddof=1)
    within = u.var(axis=0, ddof=1).sum(axis=0) / (draws * (len(frames) - 1))
    return np.asarray(between - within)
