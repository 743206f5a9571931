"""The numbers that a render reports of its work, each with the kind that says how it adds up over frames."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, get_args

Kind = Literal["count", "seconds", "error", "mean"]
"""Over several frames counts and seconds add up; errors (fractions, 0 to 1) and means are averaged."""


@dataclass(frozen=True)
class Quantity:
    """One of the numbers of `Frame.counts`."""

    what: str
    kind: Kind = "count"
    laser: int | None = None
    """Index into `scene.lasers`; None: of the whole frame."""

    def of(self, laser: int) -> Quantity:
        """This quantity, of one laser."""
        return replace(self, laser=laser)

    def label(self, lasers: Sequence[str]) -> str:
        """As a person reads it; lasers: the names of the scene's."""
        if self.laser is None:
            return self.what
        return f"{self.what}, {lasers[self.laser] if self.laser < len(lasers) else f'laser {self.laser + 1}'}"


Counts = dict[Quantity, float]

RAYS = Quantity("rays")
EMBREE_SECONDS = Quantity("seconds in embree, all threads", "seconds")

DIRECT_ERROR = Quantity("relative error", "error")
LIT_PIXELS = Quantity("lit pixels")
DIRECT_SAMPLES = Quantity("samples")
DIRECT_DROPPED = Quantity("dropped contributions of direct light")

INDIRECT_ERROR = Quantity("relative error of reflections", "error")
UNASKED_INDIRECT_ERROR = Quantity(
    "relative error of reflections (not rendered to be known away from the line, by the goal in depth)", "error"
)
LIGHT_PATHS = Quantity("light paths")
INDIRECT_DROPPED = Quantity("dropped contributions")
INDIRECT_CLAMPED = Quantity("clamped contributions")
INDIRECT_CUT = Quantity("mean radiance taken by the clamp", "mean")

AMBIENT_ERROR = Quantity("relative error, ambient", "error")
AMBIENT_SAMPLES = Quantity("samples a pixel, ambient", "mean")
AMBIENT_DROPPED = Quantity("dropped contributions, ambient")
AMBIENT_CLAMPED = Quantity("clamped contributions, ambient")
AMBIENT_CUT = Quantity("mean radiance taken by the clamp, ambient", "mean")

OF_GROUPS = {
    "direct": {"error": DIRECT_ERROR, "lit_pixels": LIT_PIXELS, "work": DIRECT_SAMPLES, "invalid": DIRECT_DROPPED},
    "indirect": {
        "error": INDIRECT_ERROR,
        "work": LIGHT_PATHS,
        "invalid": INDIRECT_DROPPED,
        "clamped": INDIRECT_CLAMPED,
        "clamped_radiance": INDIRECT_CUT,
    },
    "ambient": {
        "error": AMBIENT_ERROR,
        "work": AMBIENT_SAMPLES,
        "invalid": AMBIENT_DROPPED,
        "clamped": AMBIENT_CLAMPED,
        "clamped_radiance": AMBIENT_CUT,
    },
}
"""By light group: which number of `render.plan.GroupQuality` is counted, over several frames, as what."""
OF_A_FRAME = (RAYS, EMBREE_SECONDS, *OF_GROUPS["ambient"].values())
OF_A_LASER = (*OF_GROUPS["direct"].values(), *OF_GROUPS["indirect"].values())


def counts_record(counts: Counts, plain: Any) -> list[dict[str, Any]]:
    """As JSON holds them; plain: makes a number fit for JSON."""
    return [
        {"what": quantity.what, "kind": quantity.kind, "laser": quantity.laser, "value": plain(value)}
        for quantity, value in counts.items()
    ]


def counts_from(record: Any, lasers: Sequence[str]) -> Counts:
    """Inverse of `counts_record`; also of the names that the first version of a sidecar held in place of kinds.

    AttributeError, KeyError, TypeError, ValueError: the record is damaged.
    """
    if not isinstance(record, list):
        return _by_name(record, lasers)
    counts: Counts = {}
    for one in record:
        what, kind, laser = one["what"], one["kind"], one["laser"]
        if not isinstance(what, str) or kind not in get_args(Kind):
            raise ValueError(f"{what!r} of kind {kind!r} is no count")
        if laser is not None and not (type(laser) is int and laser >= 0):
            raise ValueError(f"there is no laser {laser!r}")
        counts[Quantity(what, kind, laser)] = _number(one["value"])
    return counts


def _by_name(record: Any, lasers: Sequence[str]) -> Counts:
    names = {quantity.what: quantity for quantity in OF_A_FRAME}
    for i in range(len(lasers)):
        names |= {quantity.of(i).label(lasers): quantity.of(i) for quantity in OF_A_LASER}
    return {names.get(str(name), Quantity(str(name))): _number(value) for name, value in record.items()}


def _number(value: Any) -> float:
    return float("nan") if value is None else float(value)
