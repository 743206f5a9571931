"""Which kinds of the lasers' indirect light are computed: decided by the settings or by a short pilot."""

from __future__ import annotations

import functools
import math
import operator
from dataclasses import dataclass, replace

import numpy as np

from render.base.arrays import Float32
from render.importance import Importance
from render.laser_indirect.line_goal import Projection
from render.laser_indirect.path_vertex import CAUSTIC, INTERREFLECTION, SPECULAR_CHAIN, SUBSURFACE_LIGHT
from render.laser_indirect.pilot import indirect_pilot
from render.light_group import Shares
from render.plan import GroupPlan, TransportStep
from render.run import Run
from render.scene.settings import RenderSettings
from render.world.placed import PlacedScene

PILOT_SEED = 7919


@dataclass(frozen=True)
class LightKind:
    """One step of the ladder of light transport, each dearer than the one before."""

    name: str
    """As `RenderSettings.transport` has it."""
    bits: int
    """Of `render.laser_indirect.path_vertex`; INTERREFLECTION: nothing but rough surfaces."""

    @property
    def field(self) -> str:
        """Field of `render.laser_indirect.pilot.IndirectPilot`."""
        return self.name.replace("-", "_")


LADDER = (
    LightKind("interreflection", INTERREFLECTION),
    LightKind("caustic", CAUSTIC),
    LightKind("specular-chain", CAUSTIC | SPECULAR_CHAIN),
    LightKind("subsurface", SUBSURFACE_LIGHT),
)
SWITCHED_OFF = TransportStep("indirect", "indirect", False, "switched off")


@dataclass(frozen=True)
class IndirectPlan(GroupPlan):
    """What is traced of the lasers' indirect light, and why."""

    kinds: int | None = None
    """Kinds of light besides plain interreflection (`render.laser_indirect.path_vertex`); None: no indirect light at
    all.
    """


def plan_of(shares: Shares, settings: RenderSettings) -> IndirectPlan:
    """The plan that follows from what a pilot measured: shares of the light, and with a goal effects on the line."""
    names = [kind.name for kind in LADDER]
    wanted = names.index(settings.transport) if settings.transport in names else -1
    # what may well be more than negligible is computed
    chosen = [kind for i, kind in enumerate(LADDER) if i <= wanted or (wanted < 0 and _matters(kind, shares, settings))]
    kinds = functools.reduce(operator.or_, (kind.bits for kind in chosen), INTERREFLECTION) if chosen else None
    steps = []
    for i, kind in enumerate(LADDER):
        share, error = shares[kind.field]
        computed, reason = True, "requested" if wanted >= 0 else "pilot"
        if share == error == 0.0 and i > max(wanted, 0):
            # nothing in the scene makes such light, or none that the pilot met
            computed, reason = False, "absent"
        elif kind not in chosen and kinds is not None and kind.bits & kinds == kind.bits:
            reason = "implied"
        elif kind not in chosen:
            computed, reason = False, "not requested" if wanted >= 0 else "negligible"
        step = TransportStep("indirect", kind.name, computed, reason, share, error)  # type: ignore[arg-type]
        moves = (
            shares[effect_of(kind)][0] * settings.goal.depth if settings.goal and effect_of(kind) in shares else None
        )
        steps.append(replace(step, moves=moves))
    return IndirectPlan(tuple(steps), kinds)


def effect_of(kind: LightKind) -> str:
    """Where shares have what a kind of light may do to the line, over what is allowed."""
    return f"effect of {kind.name}"


def _matters(kind: LightKind, shares: Shares, settings: RenderSettings) -> bool:
    """It may well do more to the line than the goal allows, or be more than a negligible share of the light."""
    if settings.goal is not None and effect_of(kind) in shares:
        return shares[effect_of(kind)][0] > 1.0
    return at_most(shares[kind.field]) > settings.negligible


def at_most(share: tuple[float, float]) -> float:
    """What a share may well be, by its standard error."""
    return share[0] + 2.0 * share[1]


def pilot_shares(
    placed: PlacedScene, direct: tuple[Float32, ...], run: Run = Run(), importance: Importance | None = None
) -> Shares:
    """Each kind of indirect light over the direct light in the image, over all lasers, with its standard error.

    direct: (h, w) direct radiance of each laser. importance: where errors matter, for the effects. Raises Cancelled.
    """
    known = sum(float(image.sum(dtype=np.float64)) for image in direct)
    found = [
        indirect_pilot(
            *laser,
            projection=None if importance is None else Projection.of(importance, i),
            run=run.shifted(PILOT_SEED * (i + 1)),
        )
        for i, laser in enumerate(placed.lasers)
    ]
    shares = {}
    for kind in LADDER:
        if importance is not None:
            shares[effect_of(kind)] = max(one.effects.get(kind.field, 0.0) for one in found), 0.0
        parts = [getattr(one, kind.field) for one in found]
        flux, error = sum(part[0] for part in parts), math.sqrt(sum(part[1] ** 2 for part in parts))
        if known > 0.0:
            shares[kind.field] = (flux / known, error / known)
        else:
            shares[kind.field] = (math.inf, 0.0) if flux > 0.0 else (0.0, 0.0)
    return shares
