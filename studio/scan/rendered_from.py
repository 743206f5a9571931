"""What a frame was rendered from, as its sidecar says it, and in what a project differs from that."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

from pydantic import ValidationError

from render.base.errors import InputError
from render.checkpoint import CHANGEABLE
from render.scene.scene import Scene
from render.scene.settings import RenderSettings
from studio.project.input_files import changed_files, listed
from studio.project.project import Project
from studio.project.strict_json import brief
from studio.scan.redevelop import light_path

Record = dict[str, Any]


def made_of(project: Project, marks: Mapping[str, str], inputs: Mapping[str, str]) -> Record:
    """For the sidecar: another frame is as good only where all of this is the same.

    marks: of the render's state; inputs: SHA-256 of every input file by its path. With a goal in depth sensor and
    extraction decide where light is rendered well.
    """
    goal = project.render.goal
    measured = {name: getattr(project, name).model_dump(mode="json") for name in ("sensor", "extraction")}
    return {
        **marks,
        "measured_by": None if goal is None else measured,
        "targets": project.render.model_dump(mode="json"),
        "axis": project.extraction.axis,
        "seed": project.seed,
        "scene": _plain(project.scene),
        "inputs": dict(inputs),
    }


def differences(record: Mapping[str, Any], project: Project, *, resume: bool = False) -> list[str]:
    """Each field of the project that cannot be had from a frame with such a record, with both values.

    Free is what developing and extraction decide: the sensor, the lasers' power where they were on, a pinhole's lens,
    names. resume: the frame is to go on, so that all of the scene must be the same, and only its targets are free.
    """
    try:
        scene = Scene.model_validate_json(json.dumps(record.get("scene")))
        settings = RenderSettings.model_validate_json(json.dumps(record.get("targets")))
    except ValidationError:
        return ["the frame does not say what it was rendered from"]
    then, now = settings.model_dump(mode="json"), project.render.model_dump(mode="json")
    pairs: list[tuple[str, Any, Any]] = [("seed", record.get("seed"), project.seed)]
    if resume:
        fixed = then.keys() - CHANGEABLE
        pairs += [
            ("scene", _plain(scene), _plain(project.scene)),
            ("render", {name: then[name] for name in fixed}, {name: now[name] for name in fixed}),
        ]
    else:
        pairs += [
            ("scene", _plain(light_path(scene)), _plain(light_path(project.scene))),
            ("render", then, now),
            ("extraction.axis", record.get("axis"), project.extraction.axis),
        ]
        for i, (before, after) in enumerate(zip(scene.lasers, project.scene.lasers, strict=False)):
            if before.power == 0.0 < after.power:  # it left no light to scale
                pairs.append((f"scene.rig.lasers[{i}].power", before.power, after.power))
    return [
        f"{place}: {brief(old)} in the frames, {brief(new)} in the project"
        for name, before, after in pairs
        for place, old, new in _unequal(name, before, after)
    ]


def check_rendered_from(
    record: Mapping[str, Any],
    project: Project,
    inputs: Mapping[str, str],
    where: str,
    *,
    resume: bool = False,
    cure: str = "render the project again",
) -> None:
    """InputError: a frame with such a record is not of this project and these input files; it names what differs."""
    found = differences(record, project, resume=resume)
    recorded = record.get("inputs")
    found += changed_files(recorded if isinstance(recorded, dict) else {}, inputs)
    if not found:
        return
    raise InputError(
        f"the frames were rendered from something else: {listed(found)}",
        where=where,
        allowed="the same scene and input files"
        if resume
        else "the same scene; sensor, laser power, a pinhole's lens and extraction may differ",
        cure=cure,
    )


def _plain(scene: Scene) -> Record:
    """What light meets: the scene as JSON without what is hidden, and without digests, which `inputs` has of all."""
    seen = tuple(item for item in scene.objects if item.visible)
    record = scene.model_copy(update={"objects": seen}).model_dump(mode="json")
    for item in record["objects"]:
        item["shape"].pop("sha256", None)
    return record


def _unequal(place: str, then: Any, now: Any) -> Iterator[tuple[str, Any, Any]]:
    """The innermost places where two JSON values differ."""
    if isinstance(then, dict) and isinstance(now, dict) and then.keys() == now.keys():
        for key in then:
            yield from _unequal(f"{place}.{key}", then[key], now[key])
    elif isinstance(then, list) and isinstance(now, list) and len(then) == len(now):
        for i, (a, b) in enumerate(zip(then, now, strict=True)):
            yield from _unequal(f"{place}[{i}]", a, b)
    elif then != now:
        yield place, then, now
