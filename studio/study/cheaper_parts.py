"""Every way in which one part of a project's render can be made cheaper."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from render.ambient.light_group import AmbientLight
from render.laser_direct.light_group import DirectLight
from render.laser_indirect.light_group import IndirectLight
from render.scene.settings import RenderSettings
from render.truth.light_group import PixelTruth
from studio.project.project import Project
from studio.study.effects import without_subsurface

COARSER = (10.0, 3.0)
MEASURED = 0.1
"""Goal in place of errors of the image: the render then adds half a percent to the variance of a row."""
GOAL, TRANSPORT = "goal", "laser light"
"""Names of the parts that decide what the others cost."""
DIRECT, REFLECTED, AMBIENT, TRUTH = DirectLight.stage, IndirectLight.stage, AmbientLight.stage, PixelTruth.stage


@dataclass(frozen=True)
class Part:
    """One part of the render, made cheaper in one way."""

    name: str
    change: str
    """In words."""
    values: Mapping[str, Any]
    """Fields of the project by their paths."""
    stages: tuple[str, ...]
    """Of a render: where seconds could be saved."""


def cheaper(project: Project, parts: Sequence[Part]) -> Project:
    """The project with all of them."""
    return project.replaced({place: value for part in parts for place, value in part.values.items()})


def goal_of(project: Project) -> Part | None:
    """What a project without a goal in depth is given first."""
    if project.render.goal is not None:
        return None
    words = f"{MEASURED:g} of the line's sigma"
    return Part(GOAL, words, {"render.goal": {"depth": MEASURED}}, (DIRECT, REFLECTED, AMBIENT))


def parts_of(project: Project) -> list[Part]:
    """Every way but the goal; of the ways of one part that which leaves out most comes first."""
    render = project.render
    found = [*_transport(render), *_targets(render)]
    for samples in (1, max(render.ambient_samples // 4, 1)):
        if samples < render.ambient_samples:
            found.append(Part("ambient samples", f"{samples}", {"render.ambient_samples": samples}, (AMBIENT,)))
    for bounces in (1, 2):
        if render.max_bounces is None or render.max_bounces > bounces:
            found.append(Part("ambient surfaces", f"at most {bounces}", {"render.max_bounces": bounces}, (AMBIENT,)))
    if render.truth_images and not project.sensor.needs_depth(project.scene.camera.lens.model):
        found.append(Part("per-pixel truth", "none", {"render.truth_images": False}, (TRUTH,)))
    below = _below_surfaces(project)
    if below:
        found.append(Part("light below surfaces", "none: it leaves where it enters", below, (REFLECTED, AMBIENT)))
    if render.light_paths > 1 << 20:
        found.append(Part("light paths", f"{1 << 20}", {"render.light_paths": 1 << 20}, (REFLECTED,)))
    return list({(part.name, part.change): part for part in found}.values())


def _transport(render: RenderSettings) -> list[Part]:
    steps = {"direct": "one surface only", "auto": "what a pilot finds", "interreflection": "no caustics"}
    if render.transport == "direct":
        return []
    if render.transport == "auto":
        del steps["auto"]
    return [
        Part(TRANSPORT, words, {"render.transport": step}, (REFLECTED,))
        for step, words in steps.items()
        if step != render.transport
    ]


def _targets(render: RenderSettings) -> list[Part]:
    targets: list[tuple[str, str, float, float, tuple[str, ...]]]
    targets = [("laser_error", "laser error", render.laser_error, 0.1, (DIRECT,))]
    if render.goal is None:
        targets.append(("indirect_error", "reflection error", render.indirect_error, 1.0, (REFLECTED,)))
        targets.append(("ambient_error", "ambient error", render.ambient_error, 0.3, (AMBIENT,)))
    else:
        aimed = (DIRECT, REFLECTED, AMBIENT)
        targets.append(("goal.depth", "goal, of the line's sigma", render.goal.depth, 1.0, aimed))
    found = []
    for factor in COARSER:
        for target, name, now, most, stages in targets:
            value = min(now * factor, most)
            if value > now:
                found.append(Part(name, f"{value:.3g}", {f"render.{target}": value}, stages))
    return found


def _below_surfaces(project: Project) -> dict[str, Any]:
    """Materials without light below the surface, by the places of those with it."""
    shallow = without_subsurface(project).scene.objects
    return {
        f"scene.objects[{i}].material": after.material.model_dump(mode="json")
        for i, (before, after) in enumerate(zip(project.scene.objects, shallow, strict=True))
        if before != after
    }
