"""One frame of a scene: the light groups, each apart, and the truth."""

from __future__ import annotations

from render.base.progress import Clock, StageProgress
from render.frame import Axis, Frame
from render.progressive import frames
from render.run import Run
from render.scan_plan import ScanPlan
from render.scene.scene import Scene
from render.scene.settings import RenderSettings
from render.world.placed import PlacedScene
from render.world.world import World


def render_world(
    world: World,
    scene: Scene,
    *,
    settings: RenderSettings | None = None,
    step: int = 0,
    axis: Axis = "rows",
    run: Run = Run(),
    progress: StageProgress | None = None,
    scan: ScanPlan | None = None,
) -> Frame:
    """Render a world placed for `step`; `axis` is the scan axis of the exact line.

    progress: of each stage. scan: the plan of a whole scan; None: a pilot decides for this frame alone. Raises
    InputError, Cancelled.
    """
    placed = PlacedScene(world, scene, step)
    *_, last = frames(placed, settings or RenderSettings(), run, Clock(progress), axis=axis, scan=scan)
    return last
