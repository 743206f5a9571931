"""A look at a recipe before a long run: its first scenes, small, on one sheet, with their exact lines."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from render.base.files import atomic_write
from render.base.threads import thread_count
from studio.dataset.images import photograph, rendered
from studio.dataset.recipe import Recipe, base_of
from studio.dataset.run import Progress
from studio.dataset.scenes import drawn_scene
from studio.notebook.frame import RenderedFrame
from studio.preview.preview import Preview

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SCENES, COLUMNS = 64, 8
SIDE = 200
"""px of the longer side of one picture."""


def write_contact_sheet(
    recipe: Recipe, root: Path, path: Path, *, scenes: int = SCENES, progress: Progress = lambda done, known: None
) -> Path:
    """Write the PNG of the first `scenes` scenes; each is brightened by the root of its numbers, with the exact
    line on the upper half.

    InputError: the recipe draws what is not allowed.
    """
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    base = base_of(recipe, root)
    camera = base.scene.camera
    small = recipe.model_copy(update={"image_scale": min(recipe.image_scale, SIDE / max(camera.width, camera.height))})
    preview = Preview()
    rows = -(-scenes // COLUMNS)
    close = ConstrainedLayoutEngine(w_pad=0.01, h_pad=0.01, wspace=0.0, hspace=0.0)
    figure = Figure(figsize=(COLUMNS * 1.6, rows * 1.6 * camera.height / camera.width + 0.4 * rows), layout=close)
    axes = np.atleast_1d(figure.subplots(rows, COLUMNS, squeeze=False)).ravel()
    drawn = [drawn_scene(small, base, root, k, preview) for k in range(scenes)]
    with ThreadPoolExecutor(thread_count(None)) as threads:  # each small image leaves most of the processors idle
        for k, (scene, frame) in enumerate(zip(drawn, threads.map(rendered, drawn), strict=True)):
            _draw(axes[k], f"{k}", photograph(scene.projects[0], frame, None), frame)
            progress(k + 1, scenes)
    for one in axes:
        one.set_axis_off()
    with atomic_write(path) as temporary:
        figure.savefig(temporary, dpi=150)
    return path


def _draw(axes: Axes, name: str, pixels: NDArray[Any], frame: RenderedFrame) -> None:
    values = pixels.astype(np.float64)
    axes.imshow(np.sqrt(values / max(float(values.max()), 1.0)), cmap="gray", vmin=0.0, vmax=1.0)
    for curve in frame.curves:
        pair = (curve.position, curve.index) if curve.axis == "rows" else (curve.index, curve.position)
        upper = slice(0, len(curve.index) // 2)  # the other half shows the line itself
        axes.plot(pair[0][upper], pair[1][upper], ".", markersize=0.6, color="#e69f00")
    axes.set_title(name, fontsize=6, pad=1)
