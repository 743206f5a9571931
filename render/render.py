"""One frame of a scene: the light groups, each apart, and the truth."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from render.base.progress import Clock
from render.base.threads import Cancel
from render.checkpoint import RenderState
from render.frame import Axis, Frame
from render.progressive import frames
from render.scan_plan import ScanPlan
from render.scene.scene import Scene
from render.scene.settings import RenderSettings
from render.world.world import World, build_world

StageProgress = Callable[[str, float], None]


def render(  # noqa: PLR0913
    scene: Scene,
    root: Path,
    *,
    settings: RenderSettings | None = None,
    step: int = 0,
    axis: Axis = "rows",
    seed: int = 0,
    threads: int | None = None,
    progress: StageProgress | None = None,
    cancelled: Cancel | None = None,
) -> Frame:
    """Load the meshes below `root` and render one step. Raises InputError, Cancelled."""
    world = build_world(scene, root, step)
    return render_world(
        world,
        scene,
        settings=settings,
        step=step,
        axis=axis,
        seed=seed,
        threads=threads,
        progress=progress,
        cancelled=cancelled,
    )


def render_world(  # noqa: PLR0913
    world: World,
    scene: Scene,
    *,
    settings: RenderSettings | None = None,
    step: int = 0,
    axis: Axis = "rows",
    seed: int = 0,
    threads: int | None = None,
    progress: StageProgress | None = None,
    cancelled: Cancel | None = None,
    seconds: float | None = None,
    state: RenderState | None = None,
    refined: Callable[[Frame], None] = lambda frame: None,
    scan: ScanPlan | None = None,
) -> Frame:
    """Render a world placed for `step`; `axis` is the scan axis of the exact line.

    progress: of each stage. seconds, state: see `render.progressive.refine`. refined: hears of every frame, the last is
    the result. scan: the plan of a whole scan; None: a pilot decides for this frame alone. Raises InputError,
    Cancelled.
    """
    settings = settings or RenderSettings()
    clock, targets = Clock(progress), (settings.laser_error,)
    for frame in frames(
        world, scene, settings, clock, targets, step, axis, seed, threads, cancelled, None, seconds, state, scan
    ):
        refined(frame)
    return frame
