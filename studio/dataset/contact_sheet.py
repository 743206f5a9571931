"""A look at a recipe before a long run: its first scenes, small, with their exact lines, one by one or on a sheet."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from render.base.arrays import Float
from render.base.files import atomic_write
from render.base.threads import Cancel, thread_count
from render.frame import Axis
from render.run import never
from studio.dataset.images import photograph, rendered
from studio.dataset.recipe import Recipe, base_of
from studio.dataset.run import Progress
from studio.dataset.scenes import Scene, drawn_scene
from studio.preview.preview import Preview

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SCENES, COLUMNS = 64, 8
SIDE = 200
"""px of the longer side of one picture."""
LINE = "#e69f00"
"""Colour of the exact lines."""


@dataclass(frozen=True)
class Curve:
    """An exact line in the pixels of a picture, as of `LaserCurve`."""

    axis: Axis
    index: Float
    position: Float


@dataclass(frozen=True)
class Picture:
    """A scene, small."""

    number: int
    """Of the scene, or of the image in a folder."""
    values: Float
    """(h, w) from 0 to 1: the root of the photograph's numbers, so that dark parts show."""
    curves: tuple[Curve, ...]
    rejected: tuple[str, ...]
    """Why attempts before it were drawn anew."""


def pictures(recipe: Recipe, root: Path, scenes: int, cancelled: Cancel = never) -> Iterator[Picture]:
    """The first scenes in their order, each as it is ready.

    InputError: the recipe draws what is not allowed. Cancelled: so asked.
    """
    base = base_of(recipe, root)
    camera = base.scene.camera
    scale = min(recipe.image_scale, SIDE / max(camera.width, camera.height))
    small = recipe.model_copy(update={"image_scale": scale, "images": 1})
    preview = Preview()
    count = thread_count(None)
    waiting: list[Future[Picture]] = []
    # each small image leaves most of the processors idle
    with ThreadPoolExecutor(count) as threads:
        try:
            for k in range(scenes):
                waiting.append(threads.submit(_picture, drawn_scene(small, base, root, k, preview), cancelled))
                if len(waiting) > count:
                    yield waiting.pop(0).result()
            for future in waiting:
                yield future.result()
        finally:
            threads.shutdown(cancel_futures=True)


def large_picture(recipe: Recipe, root: Path, number: int, cancelled: Cancel = never) -> Picture:
    """One of the scenes in the size of the recipe's images. Errors: as `pictures`."""
    scene = drawn_scene(recipe.model_copy(update={"images": 1}), base_of(recipe, root), root, number, Preview())
    return _picture(scene, cancelled)


def _picture(scene: Scene, cancelled: Cancel) -> Picture:
    frame = rendered(scene, cancelled)
    pixels = photograph(scene.projects[0], frame, None).astype(np.float64)
    values = np.sqrt(pixels / max(float(pixels.max()), 1.0))
    curves = tuple(Curve(one.axis, one.index.astype(np.float64), one.position) for one in frame.curves)
    return Picture(scene.number, values, curves, scene.rejected)


def write_contact_sheet(
    recipe: Recipe, root: Path, path: Path, *, scenes: int = SCENES, progress: Progress = lambda done, known: None
) -> Path:
    """Write the PNG of the first `scenes` scenes; the exact line is drawn on the upper half.

    InputError: as `pictures`.
    """
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    camera = base_of(recipe, root).scene.camera
    rows = -(-scenes // COLUMNS)
    close = ConstrainedLayoutEngine(w_pad=0.01, h_pad=0.01, wspace=0.0, hspace=0.0)
    figure = Figure(figsize=(COLUMNS * 1.6, rows * 1.6 * camera.height / camera.width + 0.4 * rows), layout=close)
    axes = np.atleast_1d(figure.subplots(rows, COLUMNS, squeeze=False)).ravel()
    for one in axes:
        one.set_axis_off()
    for picture in pictures(recipe, root, scenes):
        _draw(axes[picture.number], picture)
        progress(picture.number + 1, scenes)
    with atomic_write(path) as temporary:
        figure.savefig(temporary, dpi=150)
    return path


def _draw(axes: Axes, picture: Picture) -> None:
    axes.imshow(picture.values, cmap="gray", vmin=0.0, vmax=1.0)
    for curve in picture.curves:
        pair = (curve.position, curve.index) if curve.axis == "rows" else (curve.index, curve.position)
        upper = slice(0, len(curve.index) // 2)  # the other half shows the line itself
        axes.plot(pair[0][upper], pair[1][upper], ".", markersize=0.6, color=LINE)
    axes.set_title(f"{picture.number}", fontsize=6, pad=1)
