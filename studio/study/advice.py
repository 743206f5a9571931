"""No more than a scene needs: what each part of the render changes in the measured depth, and a cheaper project.

Each part is made cheaper by itself, over a few seeds. Of the parts that leave depth as it is the cheapest are taken
together, and that project is held against the original on seeds that had no say in the choice: seed by seed, so that
what both have in common, the sensor's noise, cancels. It is proved where the 95 % intervals of the change in bias and
in sigma lie within what was asked; a part is given up where they do not, and the rest is proved on fresh seeds.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from analysis.study.intervals import Interval, mean_interval
from render.base.errors import InputError
from studio.project.project import MAX_SEED, Project
from studio.runtime.workers import Engine
from studio.study.effects import without_subsurface
from studio.study.runner import run_study
from studio.study.store import Store
from studio.study.study import Study
from studio.study.tables import grouped, seconds_of, values_of

SCREENED = 4
"""Seeds for the choice."""
ROOM = 0.5
"""A part may change depth by so much of what is asked: several are taken together."""
PAYS = 0.95
"""A part that leaves more of the seconds than this is not worth a change."""
MOST_PROOFS = 3
"""Each fails to find a change of just the size asked in 2.5 % of cases: more tries would prove too much."""
ORIGINAL = "original"
COARSER = (10.0, 3.0)
MEASURED = 0.1
"""Goal in place of errors of the image: the render then adds half a percent to the variance of a row."""
Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Part:
    """One part of the render, made cheaper in one way."""

    name: str
    change: str
    """In words."""
    values: Mapping[str, Any]
    """Fields of the project by their paths."""


@dataclass(frozen=True)
class Change:
    """Of one project against another, over seeds that both have; shares, with their 95 % intervals."""

    bias: Interval
    """Of the depth error's RMS."""
    sigma: Interval
    """Of the depth sigma."""
    completeness: Interval
    seconds: float
    """Median processor seconds of a frame."""
    seconds_before: float

    def within(self, share: float) -> bool:
        """All three intervals lie within it."""
        found = (self.bias, self.sigma, self.completeness)
        return all(-share <= one.low and one.high <= share for one in found)

    def undecided(self, share: float) -> bool:
        """An interval is so wide that no change, not even none, could be shown to lie within it."""
        found = (self.bias, self.sigma, self.completeness)
        return any(one.high - one.low > 2.0 * share for one in found)

    def size(self) -> float:
        """The largest of the mean changes."""
        return max(abs(one.mean) for one in (self.bias, self.sigma, self.completeness))


@dataclass(frozen=True)
class Tried:
    """One part by itself."""

    part: Part
    found: Change
    taken: bool = False


@dataclass(frozen=True)
class Proof:
    """Some parts together, on seeds of their own."""

    parts: tuple[Part, ...]
    found: Change
    seeds: tuple[int, ...]
    alike: bool
    """Depth is within what was asked."""

    @property
    def holds(self) -> bool:
        """It is, and seconds are saved."""
        return self.alike and self.found.seconds < PAYS * self.found.seconds_before


@dataclass(frozen=True)
class Advice:
    tried: tuple[Tried, ...]
    proofs: tuple[Proof, ...]

    @property
    def proved(self) -> Proof | None:
        """None: no cheaper project is known to measure alike."""
        return next((proof for proof in self.proofs if proof.holds), None)

    def project(self, original: Project) -> Project:
        """The cheaper project; only where one is proved."""
        assert self.proved is not None
        return _cheaper(original, self.proved.parts)


@dataclass(frozen=True)
class Question:
    """within: share by which bias, sigma and completeness may change; seeds: of each proof."""

    within: float = 0.03
    seeds: int = 8
    image_scale: float = 1.0
    laser: int = 0
    engine: Engine = field(default_factory=Engine)


def parts_of(project: Project) -> list[Part]:
    """Every way in which the project's render can be made cheaper."""
    render = project.render
    found = []
    if render.transport != "direct":
        found.append(Part("laser light", "one surface only", {"render.transport": "direct"}))
        if render.transport != "interreflection":
            found.append(Part("laser light", "no caustics", {"render.transport": "interreflection"}))
    targets = [("laser_error", "laser error", render.laser_error, 0.1)]
    if render.goal is None:
        found.append(Part("goal", f"{MEASURED:g} of the line's sigma", {"render.goal": {"depth": MEASURED}}))
        targets.append(("indirect_error", "reflection error", render.indirect_error, 1.0))
        targets.append(("ambient_error", "ambient error", render.ambient_error, 0.3))
    else:
        targets.append(("goal.depth", "goal, of the line's sigma", render.goal.depth, 1.0))
    for factor in COARSER:
        for target, name, now, most in targets:
            value = min(now * factor, most)
            if value > now:
                found.append(Part(name, f"{value:.3g}", {f"render.{target}": value}))
    for samples in (1, max(render.ambient_samples // 4, 1)):
        if samples < render.ambient_samples:
            found.append(Part("ambient samples", f"{samples}", {"render.ambient_samples": samples}))
    for bounces in (1, 2):
        if render.max_bounces is None or render.max_bounces > bounces:
            found.append(Part("ambient surfaces", f"at most {bounces}", {"render.max_bounces": bounces}))
    if render.truth_images:
        found.append(Part("per-pixel truth", "none", {"render.truth_images": False}))
    shallow = without_subsurface(project).scene.objects
    below = {
        f"scene.objects[{i}].material": after.material.model_dump(mode="json")
        for i, (before, after) in enumerate(zip(project.scene.objects, shallow, strict=True))
        if before != after
    }
    if below:
        found.append(Part("light below surfaces", "none: it leaves where it enters", below))
    if render.light_paths > 1 << 20:
        found.append(Part("light paths", f"{1 << 20}", {"render.light_paths": 1 << 20}))
    return list({(part.name, part.change): part for part in found}.values())


def advise(
    project: Project,
    question: Question,
    folder: Path,
    progress: Callable[[str, float], None] = lambda stage, done: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> Advice:
    """folder: for what is measured on the way. InputError: there is nothing to measure. Raises Cancelled."""
    parts = parts_of(project)
    variants = {f"{part.name}: {part.change}": part for part in parts}
    projects = {name: _cheaper(project, (part,)) for name, part in variants.items()}
    found = _changes(project, projects, question, SCREENED, folder / "parts", _staged(progress, "each part"), cancelled)
    allowed = ROOM * question.within
    fit = {
        name: change
        for name, change in found.items()
        if change.size() <= allowed and change.seconds < PAYS * change.seconds_before
    }
    best: dict[str, str] = {}
    for name in sorted(fit, key=lambda one: fit[one].seconds):
        best.setdefault(variants[name].name, name)
    chosen = sorted(best.values(), key=lambda one: fit[one].size())
    tried = tuple(Tried(part, found[name], name in chosen) for name, part in variants.items())
    proofs: list[Proof] = []
    seed = project.seed + SCREENED
    while chosen and len(proofs) < MOST_PROOFS and not any(proof.holds for proof in proofs):
        taken = tuple(variants[name] for name in chosen)
        fresh = project.model_copy(update={"seed": seed % (MAX_SEED + 1)}).in_folder(project.folder)
        name = f"proof {len(proofs) + 1}"
        together = {"cheaper": _cheaper(fresh, taken)}
        change = _changes(fresh, together, question, question.seeds, folder / name, _staged(progress, name), cancelled)[
            "cheaper"
        ]
        seeds = tuple((seed + i) % (MAX_SEED + 1) for i in range(question.seeds))
        proofs.append(Proof(taken, change, seeds, change.within(question.within)))
        seed, chosen = seed + question.seeds, chosen[:-1]  # the one that changed most by itself goes first
    return Advice(tried, tuple(proofs))


def _staged(progress: Callable[[str, float], None], stage: str) -> Progress:
    return lambda done, known: progress(stage, done / max(known, 1))


def _cheaper(project: Project, parts: Sequence[Part]) -> Project:
    return project.replaced({place: value for part in parts for place, value in part.values.items()})


def _changes(
    original: Project,
    others: Mapping[str, Project],
    question: Question,
    seeds: int,
    folder: Path,
    progress: Progress,
    cancelled: Callable[[], bool],
) -> dict[str, Change]:
    """Of each project against the original, over as many seeds from the original's on."""
    bases = {ORIGINAL: original, **others}
    study = Study.model_validate(
        {
            "name": "advice",
            "base": ORIGINAL,
            "image_scale": question.image_scale,
            "laser": question.laser,
            "repeats": seeds,
            "methods": (original.extraction.method,),
            # a project's name decides nothing: what differs is its base
            "sweeps": [
                {"name": name, "base": name, "vary": ({"field": "name", "values": ("as it is",)},)} for name in bases
            ],
        }
    )
    folder.mkdir(parents=True)
    with Store(folder, study.digest(bases)) as store:
        run_study(study, bases, store, engine=question.engine, progress=progress, cancelled=cancelled)
        rows = store.rows()
    groups = [next(iter(grouped(study, bases, rows, number).values())) for number in range(len(bases))]
    before, *after = groups
    reasons = {row["reason"] for row in before if row.get("reason")}
    if not np.isfinite(values_of(before, "depth_sigma")).all():
        found = "; ".join(sorted(reasons)) or "no depth on some seeds"
        raise InputError("the project measures nothing that could be compared", where=original.name, found=found)
    return {name: _change(before, rows) for name, rows in zip(others, after, strict=True)}


def _change(before: list[dict[str, object]], after: list[dict[str, object]]) -> Change:
    def share(measure: str, of: str) -> Interval:
        scale = float(np.mean(values_of(before, of)))
        return mean_interval(_all_or_nothing((values_of(after, measure) - values_of(before, measure)) / scale))

    return Change(
        bias=share("depth_bias", "depth_rmse"),
        sigma=share("depth_sigma", "depth_sigma"),
        completeness=share("completeness", "completeness"),
        seconds=float(np.median(seconds_of(after, "frame"))),
        seconds_before=float(np.median(seconds_of(before, "frame"))),
    )


def _all_or_nothing(values: np.ndarray) -> np.ndarray:
    """A seed that measured nothing is a change that no mean may hide."""
    return values if np.isfinite(values).all() else np.full(1, np.nan)
