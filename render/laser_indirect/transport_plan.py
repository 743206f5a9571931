"""Which kinds of the lasers' indirect light are computed: decided by the settings or by a short pilot."""

from __future__ import annotations

import functools
import math
import operator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from render.laser_indirect.integrator import indirect_shares
from render.laser_indirect.path_vertex import CAUSTIC, INTERREFLECTION, SPECULAR_CHAIN, SUBSURFACE_LIGHT
from render.light_group import Shares
from render.plan import GroupPlan, TransportStep
from render.run import Run
from render.scene.settings import RenderSettings
from render.world.placed import PlacedScene

Float32 = NDArray[np.float32]
PILOT_SEED = 7919


@dataclass(frozen=True)
class LightKind:
    """One step of the ladder of light transport, each dearer than the one before."""

    name: str
    """As `RenderSettings.transport` has it."""
    bits: int
    """Of `render.laser_indirect.path_vertex`; INTERREFLECTION: nothing but rough surfaces."""

    @property
    def share(self) -> str:
        """Field of `render.laser_indirect.integrator.Shares`."""
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
    """The plan that follows from what a pilot measured."""
    names = [kind.name for kind in LADDER]
    wanted = names.index(settings.transport) if settings.transport in names else -1
    # what may well be more than negligible is computed
    chosen = [
        kind
        for i, kind in enumerate(LADDER)
        if i <= wanted or (wanted < 0 and at_most(shares[kind.share]) > settings.negligible)
    ]
    kinds = functools.reduce(operator.or_, (kind.bits for kind in chosen), INTERREFLECTION) if chosen else None
    steps = []
    for i, kind in enumerate(LADDER):
        share, error = shares[kind.share]
        computed, reason = True, "requested" if wanted >= 0 else "pilot"
        if share == error == 0.0 and i > max(wanted, 0):
            # nothing in the scene makes such light, or none that the pilot met
            computed, reason = False, "absent"
        elif kind not in chosen and kinds is not None and kind.bits & kinds == kind.bits:
            reason = "implied"
        elif kind not in chosen:
            computed, reason = False, "not requested" if wanted >= 0 else "negligible"
        steps.append(TransportStep("indirect", kind.name, computed, reason, share, error))  # type: ignore[arg-type]
    return IndirectPlan(tuple(steps), kinds)


def at_most(share: tuple[float, float]) -> float:
    """What a share may well be, by its standard error."""
    return share[0] + 2.0 * share[1]


def pilot_shares(placed: PlacedScene, direct: tuple[Float32, ...], run: Run = Run()) -> Shares:
    """Each kind of indirect light over the direct light in the image, over all lasers, with its standard error.

    direct: (h, w) direct radiance of each laser. Raises Cancelled.
    """
    known = sum(float(image.sum(dtype=np.float64)) for image in direct)
    found = [indirect_shares(*laser, run=run.shifted(PILOT_SEED * (i + 1))) for i, laser in enumerate(placed.lasers)]
    shares = {}
    for kind in LADDER:
        parts = [getattr(one, kind.share) for one in found]
        flux, error = sum(part[0] for part in parts), math.sqrt(sum(part[1] ** 2 for part in parts))
        if known > 0.0:
            shares[kind.share] = (flux / known, error / known)
        else:
            shares[kind.share] = (math.inf, 0.0) if flux > 0.0 else (0.0, 0.0)
    return shares
