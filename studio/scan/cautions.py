"""What a person should know before believing a scan, gathered frame by frame; the gravest comes first."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

from analysis.report.summary import little_found, scale_note
from render.frame import Frame
from render.sensor.develop import Image
from studio.preview.inspection import saturation_warning, view_warnings
from studio.preview.saturation import counted_saturated, shares
from studio.project.project import Project

NAMED = 3
"""Fields that a note names one by one."""


class Cautions:
    """Of one scan; `look` at every frame, then ask for the `notes`."""

    def __init__(self, project: Project, image_scale: float = 1.0, laser_power: Sequence[float] | None = None) -> None:
        """project: as it is rendered, at `image_scale`; laser_power: W of each laser, in place of the scene's."""
        self.project, self.image_scale, self.laser_power = project, image_scale, laser_power
        self._frames = 0
        self._unseen = [0] * len(project.scene.lasers)
        self._saturated = np.zeros((len(project.scene.lasers), 2), dtype=np.int64)
        """Of each laser, as of `counted_saturated`, in all images."""
        self._doubts: dict[str, str] = {}
        self._caught: list[warnings.WarningMessage] = []
        self._heard: dict[str, None] = {}

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Python's own warnings in here, of mesh readers and the like, become notes."""
        with warnings.catch_warnings(record=True) as self._caught:
            warnings.simplefilter("always", UserWarning)
            yield
        self._hear()

    def look(self, frame: Frame, scene_warnings: Iterable[str], images: Sequence[Image]) -> None:
        """At one frame, as rendered and developed, with what `render.world.material_checks.scene_warnings` says."""
        self._hear()
        # what saturates is counted over all frames
        told = [None] * len(frame.curves)
        views = view_warnings(self.project, frame, self.laser_power, told) if self._frames == 0 else []
        self._saturated += counted_saturated(images, frame.curves)
        for text in (*views, *scene_warnings):  # in words as at first, though figures change from step to step
            self._doubts.setdefault(text.split(",", 1)[0], text)
        for i, curve in enumerate(frame.curves):
            self._unseen[i] += len(curve.index) == 0
        self._frames += 1

    def notes(self, rows: Sequence[Mapping[str, Any]] = ()) -> list[str]:
        """One sentence or two each; rows: the results, as `studio.scan.summary.summarise` gives them."""
        lasers = [laser.name for laser in self.project.scene.lasers]
        found = []
        for name in lasers:
            own = next((row for row in rows if row["laser"] == name), None)
            if own is not None:
                told = own["completeness"], own["points"], own["false_scan_lines"], name if len(lasers) > 1 else ""
                found.append(little_found(*told))
        found.append(scale_note(self.image_scale))
        for name, unseen in zip(lasers, self._unseen, strict=True):
            if unseen > 0 and self._frames > 1:
                found.append(f"{name}: in {unseen} of {self._frames} frames no part of the line is both lit and seen")
        found += map(saturation_warning, lasers, shares(self._saturated))
        self._hear()
        return list(dict.fromkeys(filter(None, (*found, *self._doubts.values(), *self._heard))))

    def _hear(self) -> None:
        """Take up what was caught, each once, though every frame repeats it."""
        for one in self._caught:
            if issubclass(one.category, UserWarning):
                self._heard.setdefault(str(one.message))
        self._caught.clear()


def is_aimed(frame: Frame) -> bool:
    """Some of the frame's light is rendered, or left out, by what it does to the measured line."""
    return any(one.of == "line" for one in frame.quality) or any(step.moves is not None for step in frame.plan.steps)


def light_note(rendered: Project, measured: Project) -> list[str]:
    """Of light that was rendered for the line as `rendered` measures it: one sentence where `measured`, of the same
    scene but for powers and lens, does so otherwise."""
    other = []
    for name in ("sensor", "extraction"):
        before, now = getattr(rendered, name), getattr(measured, name)
        other += [
            f"{name}.{field}" for field in type(now).model_fields if getattr(before, field) != getattr(now, field)
        ]
    for i, (a, b) in enumerate(zip(rendered.scene.lasers, measured.scene.lasers, strict=True)):
        other += [f"lasers[{i}].power"] if a.power != b.power else []
    goal = rendered.render.goal
    if goal is None or not other:
        return []
    named = ", ".join(other[:NAMED]) + (f" and {len(other) - NAMED} more" if len(other) > NAMED else "")
    return [
        f"The light was rendered for another measurement (other: {named}), in which its noise moves the line by less "
        f"than {goal.depth:g} of its sigma; here it may be more. Render with these settings, or with render.goal null."
    ]
