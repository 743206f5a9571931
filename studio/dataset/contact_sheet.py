"""A look at a recipe before a long run: its first scenes, small, on one sheet, with their exact lines."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from render.base.files import atomic_write
from studio.dataset.images import photograph, rendered
from studio.dataset.recipe import Recipe, base_of
from studio.dataset.run import Progress
from studio.dataset.scenes import drawn_scene
from studio.preview.preview import Preview

SCENES, COLUMNS = 64, 8
SIDE = 200
"""px of the longer side of one picture."""


def write_contact_sheet(
    recipe: Recipe, root: Path, path: Path, *, scenes: int = SCENES, progress: Progress = lambda done, known: None
) -> Path:
    """Write the PNG of the first `scenes` scenes; each is brightened by the root of its numbers, its line beside it.

    InputError: the recipe draws what is not allowed.
    """
    from matplotlib.figure import Figure

    base = base_of(recipe, root)
    camera = base.scene.camera
    small = recipe.model_copy(update={"image_scale": min(recipe.image_scale, SIDE / max(camera.width, camera.height))})
    preview = Preview()
    rows = -(-scenes // COLUMNS)
    figure = Figure(
        figsize=(COLUMNS * 1.6, rows * 1.6 * camera.height / camera.width + 0.4 * rows), layout="constrained"
    )
    axes = np.atleast_1d(figure.subplots(rows, COLUMNS, squeeze=False)).ravel()
    for k in range(scenes):
        scene = drawn_scene(small, base, root, k, preview)
        frame = rendered(scene)
        pixels = photograph(scene.projects[0], frame, None).astype(np.float64)
        axes[k].imshow(np.sqrt(pixels / max(float(pixels.max()), 1.0)), cmap="gray", vmin=0.0, vmax=1.0)
        for curve in frame.curves:
            pair = (curve.position, curve.index) if curve.axis == "rows" else (curve.index, curve.position)
            axes[k].plot(*pair, ".", markersize=0.6, color="#e69f00")
        axes[k].set_title(f"{k}", fontsize=6, pad=1)
        progress(k + 1, scenes)
    for one in axes:
        one.set_axis_off()
    with atomic_write(path) as temporary:
        figure.savefig(temporary, dpi=150)
    return path
