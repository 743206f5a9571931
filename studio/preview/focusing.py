"""Where a lens is to be focused: on the line, else on what the rig looks at."""

from __future__ import annotations

from render.scene.scene import Scene
from studio.editing.placement import working_distance
from studio.preview.preview import Look

DIGITS = 4
"""Of a focus that is proposed."""


def between(nearest: float, farthest: float) -> float:
    """Depth, m, at which a lens blurs two depths alike: that of the middle of their vergences."""
    return float(f"{2.0 / (1.0 / nearest + 1.0 / farthest):.{DIGITS}g}")


def line_depth(look: Look) -> float | None:
    """Depth, m, between the ends of the lines of all lasers; None: none is seen."""
    curves = [look.lit(i).curve.depth_z for i in range(len(look.scene.lasers))]
    lines = [(float(depth.min()), float(depth.max())) for depth in curves if len(depth)]
    return between(min(near for near, _ in lines), max(far for _, far in lines)) if lines else None


def looked_at(scene: Scene) -> float | None:
    """The working distance, m, of a scene without a line that is seen; None: there is nothing to look at."""
    if not scene.lasers and not scene.visible_objects and scene.camera.lens.focus_distance is None:
        return None
    return float(f"{working_distance(scene):.{DIGITS}g}")
