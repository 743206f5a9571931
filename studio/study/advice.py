"""No more than a scene needs: what each part of the render changes in the measured depth, and a cheaper project.

A project that asks for errors of its image is first given a goal in depth, which is most of what can be saved; then
each part is made cheaper by itself, over a few seeds. Of the parts that leave depth as it is the cheapest are taken
together, and that project is held against the original on seeds that had no say in the choice: seed by seed, so that
what both have in common, the sensor's noise, cancels. It is proved where the 95 % intervals of the change in bias and
in sigma lie within what was asked; where they do not, the half of the parts that changed most is given up, and the
rest is proved on fresh seeds.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from analysis.study.intervals import Interval, mean_interval
from render.base.errors import InputError
from studio.project.project import MAX_SEED, Project
from studio.runtime.workers import Engine
from studio.study.effects import without_subsurface
from studio.study.runner import run_study
from studio.study.store import Row, Store
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

    @property
    def pays(self) -> bool:
        """Enough seconds are saved to be worth a change."""
        return self.seconds < PAYS * self.seconds_before

    def size(self) -> float:
        """The largest of the mean changes."""
        return max(abs(one.mean) for one in (self.bias, self.sigma, self.completeness))


@dataclass(frozen=True)
class Tried:
    """One part by itself, or beside the goal where that is taken."""

    part: Part
    found: Change
    taken: bool = False

    def fits(self, allowed: float) -> bool:
        """It leaves depth as it is, and seconds are saved."""
        return self.found.size() <= allowed and self.found.pays


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
        return self.alike and self.found.pays


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


def goal_of(project: Project) -> Part | None:
    """What a project without a goal in depth is given first."""
    if project.render.goal is not None:
        return None
    return Part("goal", f"{MEASURED:g} of the line's sigma", {"render.goal": {"depth": MEASURED}})


def parts_of(project: Project) -> list[Part]:
    """Every way but the goal in which the project's render can be made cheaper."""
    render = project.render
    found = []
    if render.transport != "direct":
        if render.transport != "auto":
            found.append(Part("laser light", "what a pilot finds", {"render.transport": "auto"}))
        found.append(Part("laser light", "one surface only", {"render.transport": "direct"}))
        if render.transport != "interreflection":
            found.append(Part("laser light", "no caustics", {"render.transport": "interreflection"}))
    targets = [("laser_error", "laser error", render.laser_error, 0.1)]
    if render.goal is None:
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

    def measured(name: str, stage: str, projects: Mapping[str, Project], seeds: int) -> dict[str, list[Row]]:
        heard = _staged(progress, stage)
        return _measured(projects, question, seeds, folder / name, heard, cancelled)

    goal, allowed = goal_of(project), ROOM * question.within
    leaner = {} if goal is None else {"goal": _cheaper(project, (goal,))}
    rows = measured("goal", "the original", {ORIGINAL: project, **leaner}, SCREENED)
    base, before, tried = project, _known(rows[ORIGINAL], project), list[Tried]()
    if goal is not None:
        one = Tried(goal, _change(before, rows["goal"]))
        if one.fits(allowed):
            base, before, one = leaner["goal"], rows["goal"], replace(one, taken=True)
        tried.append(one)
    given = [one.part for one in tried if one.taken]
    variants = {f"{part.name}: {part.change}": part for part in parts_of(base)}
    projects = {name: _cheaper(base, (part,)) for name, part in variants.items()}
    rows = measured("parts", "each part", projects, SCREENED) if projects else {}
    found = [Tried(part, _change(before, rows[name])) for name, part in variants.items()]
    best: dict[str, Tried] = {}
    for one in sorted((one for one in found if one.fits(allowed)), key=lambda one: one.found.seconds):
        best.setdefault(one.part.name, one)
    tried += [replace(one, taken=best.get(one.part.name) is one) for one in found]
    chosen = given + [one.part for one in sorted(best.values(), key=lambda one: one.found.size())]
    proofs: list[Proof] = []
    seed = project.seed + SCREENED
    while chosen and len(proofs) < MOST_PROOFS and not any(proof.holds for proof in proofs):
        fresh = project.model_copy(update={"seed": seed % (MAX_SEED + 1)}).in_folder(project.folder)
        name = f"proof {len(proofs) + 1}"
        rows = measured(name, name, {ORIGINAL: fresh, "cheaper": _cheaper(fresh, chosen)}, question.seeds)
        change = _change(_known(rows[ORIGINAL], project), rows["cheaper"])
        seeds = tuple((seed + i) % (MAX_SEED + 1) for i in range(question.seeds))
        proofs.append(Proof(tuple(chosen), change, seeds, change.within(question.within)))
        seed, chosen = seed + question.seeds, chosen[: len(chosen) // 2]  # without those that changed most
    return Advice(tuple(tried), tuple(proofs))


def _staged(progress: Callable[[str, float], None], stage: str) -> Progress:
    return lambda done, known: progress(stage, done / max(known, 1))


def _cheaper(project: Project, parts: Sequence[Part]) -> Project:
    return project.replaced({place: value for part in parts for place, value in part.values.items()})


def _measured(
    projects: Mapping[str, Project],
    question: Question,
    seeds: int,
    folder: Path,
    progress: Progress,
    cancelled: Callable[[], bool],
) -> dict[str, list[Row]]:
    """Rows of each project over as many seeds, from its own on."""
    bases, first = dict(projects), next(iter(projects.values()))
    study = Study.model_validate(
        {
            "name": "advice",
            "base": next(iter(bases)),
            "image_scale": question.image_scale,
            "laser": question.laser,
            "repeats": seeds,
            "methods": (first.extraction.method,),
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
    return {name: next(iter(grouped(study, bases, rows, k).values())) for k, name in enumerate(bases)}


def _known(rows: list[Row], project: Project) -> list[Row]:
    """As they are. InputError: a seed measured nothing."""
    if not np.isfinite(values_of(rows, "depth_sigma")).all():
        reasons = {str(row["reason"]) for row in rows if row.get("reason")}
        found = "; ".join(sorted(reasons)) or "no depth on some seeds"
        raise InputError("the project measures nothing that could be compared", where=project.name, found=found)
    return rows


def _change(before: list[Row], after: list[Row]) -> Change:
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
