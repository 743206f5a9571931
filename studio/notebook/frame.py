"""`render`: from a project to one frame with its light groups, its plan, its quality and the exact truth."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

from render.base.threads import Cancel
from render.frame import Frame
from render.run import Run
from render.world.world import World, build_world
from studio.notebook.checks import check_number, check_threads, check_whole, expect, extended
from studio.project.project import MAX_SEED, Project
from studio.runtime.console import StageProgress
from studio.scan.stages import Clock, render_step, scaled, validated

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LOAD = 'load one: blazer.Project.load("weld_seam")'
RENDER = "render one: frame = blazer.render(project)"


@dataclass(frozen=True)
class RenderedFrame(Frame):
    """A `Frame` (radiance of each light group as arrays, truth, plan) that knows what it was rendered from.

    `laser_direct[i]`, `laser_indirect[i]` (h, w) and `ambient` (h, w, 3) are W/(m^2 sr); `laser(i)` is the sum of one
    laser; `curves[i]` is the exact line, `truth` depth, position, normal and object of each pixel. `plan.steps` says
    what was computed and what was left out, `quality` error, target and work of each light group; here the most samples
    allowed ended the ambient light:

    >>> import studio as blazer
    >>> frame = blazer.render(blazer.Project.load("plane"), image_scale=0.05)
    >>> [(one.group, one.laser, one.reason) for one in frame.quality]
    [('direct', 'laser', 'target'), ('ambient', None, 'target')]
    >>> [step.name for step in frame.plan.of("indirect") if step.computed]
    []
    """

    project: Project = field(kw_only=True)
    """As it was rendered: at the image scale, with the seed and the settings."""
    image_scale: float = field(default=1.0, kw_only=True)

    @cached_property
    def world(self) -> World:
        """The placed triangles of this step. InputError: a mesh is not there any more."""
        return build_world(self.project.scene, self.project.folder, self.step)

    def __getstate__(self) -> dict[str, Any]:
        """Without Embree's own memory, so that what is made of a frame goes to other processes and to files."""
        return {name: value for name, value in vars(self).items() if name != "world"}

    def show(self, kind: str | None = None, laser: int = 0) -> Figure:
        """A figure of the light. kind: "laser", "reflected", "ambient", "light" (all, in colour) or "depth".

        None: all light in colour, or that of the only laser. Faint light is lifted: grey is the square root.
        InputError: the frame does not have that.

        >>> import studio as blazer
        >>> frame = blazer.render(blazer.Project.load("plane"), image_scale=0.05)
        >>> frame.show("depth").savefig("depth.png")
        """
        from studio.notebook.figures import frame_figure

        return frame_figure(self, kind, laser)

    def __repr__(self) -> str:
        height, width = self.shape
        known = [f"{one.laser or 'all'} {one.group} light {one.error:.2%}" for one in self.quality]
        return f"<RenderedFrame {self.project.name!r}, step {self.step}, {width} x {height} px: {', '.join(known)}>"


def render(
    project: Project,
    *,
    error: float | None = None,
    step: int = 0,
    image_scale: float = 1.0,
    seed: int | None = None,
    threads: int | None = None,
    progress: StageProgress = lambda stage, done: None,
    cancelled: Cancel = lambda: False,
) -> RenderedFrame:
    """Render one step of a project's motion: each laser and the ambient light apart, and the exact truth.

    error: relative RMS error of the lasers' direct light, a fraction, in place of the project's; the other targets and
    the transport are `project.render`. step: of the motion. image_scale: so many times the pixels a side, for a quick
    look; figures measured then are not the scanner's. seed: in place of the project's. threads: None takes all
    processors; the numbers never depend on it. progress(stage, done): done is 0 to 1. cancelled(): asked often.

    Meshes and textures are looked for below `project.folder`. A step of a motion gets a plan of its own, where a whole
    scan (`main.py run`) decides on one for all its steps.

    InputError: a number out of range, a mesh or texture that cannot be read, nothing to see. Cancelled: so requested.

    >>> import studio as blazer
    >>> project = blazer.Project.load("plane")
    >>> frame = blazer.render(project, error=0.01, image_scale=0.1)
    >>> frame.laser(0).shape, frame.curves[0].depth_z.shape == frame.curves[0].position.shape
    ((205, 245), True)
    >>> frame.plan.steps[0].name, frame.plan.steps[0].computed
    ('direct', True)
    """
    expect(project, Project, "render: project", LOAD)
    scale = check_number(image_scale, "render: image_scale", 0.01, 4.0)
    check_whole(step, "render: step", 0, project.scene.frame_count - 1)
    check_threads(threads)
    chosen = validated(scaled(_with(project, error, seed), scale), f"at image scale {scale:g}")
    chosen = chosen.in_folder(project.folder)
    clock = Clock(progress, cancelled)
    with clock.stage("loading meshes"):
        world = build_world(chosen.scene, chosen.folder, step)

    frame = render_step(chosen, world, step, clock, Run(threads=threads))
    made = extended(RenderedFrame, frame, project=chosen, image_scale=scale)
    vars(made)["world"] = world  # it is there already
    return made


def _with(project: Project, error: float | None, seed: int | None) -> Project:
    if error is not None:
        target = check_number(error, "render: error", 1.000001e-6, 1.0)
        project = project.model_copy(update={"render": project.render.model_copy(update={"laser_error": target})})
    if seed is not None:
        project = project.model_copy(update={"seed": check_whole(seed, "render: seed", 0, MAX_SEED)})
    return project
