"""Which laser of one scene is which of another: as a render has them, and as the project has them now."""

from __future__ import annotations

from collections.abc import Iterable

from analysis.gauges.gauge import Gauge
from render.scene.scene import Scene


def same_lasers(scene: Scene, other: Scene) -> dict[int, int]:
    """Index of a laser in `scene` -> that of the same in `other`, by its name; a renamed one by its place, where none
    was added or deleted."""
    names, others = [laser.name for laser in scene.lasers], [laser.name for laser in other.lasers]
    found = {i: others.index(name) for i, name in enumerate(names) if name in others}
    if len(names) == len(others):
        left = set(range(len(others))) - set(found.values())
        found |= {i: i for i in range(len(names)) if i not in found and i in left}
    return found


def of_same_lasers(gauges: Iterable[Gauge], scene: Scene, other: Scene) -> tuple[Gauge, ...]:
    """Measures of the lasers of `scene` as of those of `other`, without those of lasers that it does not have."""
    there = same_lasers(scene, other)
    return tuple(_of(gauge, there[gauge.laser]) for gauge in gauges if gauge.laser in there)


def _of(gauge: Gauge, laser: int) -> Gauge:
    return gauge if laser == gauge.laser else gauge.model_copy(update={"laser": laser})
