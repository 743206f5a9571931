"""No more than a scene needs: what each part of the render changes in the measured depth, and a cheaper project.

A project that asks for errors of its image is first given a goal in depth, which is most of what can be saved. Then
each part that takes seconds worth a change is made cheaper by itself, the transport of the laser's light before all
others, which are then tried beside it: the boldest way first, and a milder one only where that changes depth. What
changes it far beyond what is asked on the first seed is not looked at on others. The choice may be wrong: nothing is
claimed of it.

The parts that leave depth as it is are taken together, and that project is held against the original on fresh seeds,
which had no say in the choice: seed by seed, on the points that both measure on the line (`studio.study.alike`). It is
proved where the 95 % intervals of the change in bias, sigma, measured rows and wrong rows lie within what was asked.
Where they do not, the half of the parts that changed most is given up, the transport and the goal last. What is tried
next is known before any fresh seed is looked at, so that all are held against the same originals: each finds a change
of just the size asked in 2.5 % of cases, by whatever seeds, and all together in no more than the sum. A proof that half
of its seeds refute ends there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

from render.base.errors import InputError
from studio.project.project import MAX_SEED, Project
from studio.runtime.workers import Engine, Team, team
from studio.study.alike import Change, Run, change, run_of
from studio.study.cheaper_parts import GOAL, TRANSPORT, Part, cheaper, goal_of, parts_of
from studio.study.kept import ERRORS
from studio.study.measuring import measure_task, warm_up
from studio.study.tasks import Task, Work

SCREENED = 3
"""Seeds for the choice."""
ROOM = 0.5
"""A part may change depth by so much of what is asked: several are taken together."""
HOPELESS, SURELY = 3.0, 2.0
"""Times that, by so many standard errors, on the first seed: two more would not bring it back."""
PAYS = 0.95
"""A part that leaves more of the seconds than this is not worth a change."""
MOST_PROOFS = 3


@dataclass(frozen=True)
class Tried:
    """One part by itself, or beside the goal where that is taken."""

    part: Part
    found: Change
    taken: bool = False

    def fits(self, allowed: float) -> bool:
        """It leaves depth as it is, as far as so few seeds tell, and seconds are saved."""
        return self.found.size(less=1.0) <= allowed and _pays(self.found)


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
        return self.alike and _pays(self.found)


@dataclass(frozen=True)
class Advice:
    tried: tuple[Tried, ...]
    proofs: tuple[Proof, ...]
    untried: tuple[str, ...] = ()
    """Parts that take too few seconds to be worth a change."""

    @property
    def proved(self) -> Proof | None:
        """None: no cheaper project is known to measure alike."""
        return next((proof for proof in self.proofs if proof.holds), None)

    def project(self, original: Project) -> Project:
        """The cheaper project; only where one is proved."""
        assert self.proved is not None
        return cheaper(original, self.proved.parts)


@dataclass(frozen=True)
class Question:
    """within: share by which bias, sigma, measured and wrong rows may change; seeds: of the proof."""

    within: float = 0.03
    seeds: int = 8
    image_scale: float = 1.0
    laser: int = 0
    engine: Engine = field(default_factory=Engine)

    @property
    def allowed(self) -> float:
        """Of one part by itself."""
        return ROOM * self.within


def advise(
    project: Project,
    question: Question,
    progress: Callable[[str, float], None] = lambda stage, done: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> Advice:
    """InputError: there is nothing to measure. Raises Cancelled."""
    begin = partial(_warm_up, project.to_text(), str(project.folder))
    with team(question.engine, measure_task, begin, cancelled) as workers:
        bench = _Bench(workers, project, question, progress, cancelled)
        tried, untried = _choice(bench)
        return Advice(tuple(tried), tuple(_proofs(bench, tried)), tuple(untried))


@dataclass
class _Bench:
    """Measures projects on seeds, each once."""

    workers: Team
    project: Project
    question: Question
    progress: Callable[[str, float], None]
    cancelled: Callable[[], bool]
    known: dict[tuple[str, int], Run] = field(default_factory=dict)

    def runs(self, stage: str, projects: Mapping[str, Project], seeds: Sequence[int]) -> dict[str, list[Run]]:
        """Of each project on each seed."""
        texts = {name: project.to_text() for name, project in projects.items()}
        missing = {
            self._task(project, seed): (texts[name], seed)
            for seed in seeds
            for name, project in projects.items()
            if (texts[name], seed) not in self.known
        }
        for done, (task, rows) in enumerate(self.workers.results(list(missing), self.cancelled, "the advice"), 1):
            ((_, row, seconds),) = rows
            self.known[missing[task]] = run_of({**row, **seconds})
            self.progress(stage, done / len(missing))
        return {name: [self.known[text, seed] for seed in seeds] for name, text in texts.items()}

    def seeds(self, first: int, count: int) -> list[int]:
        return [(self.project.seed + first + i) % (MAX_SEED + 1) for i in range(count)]

    def _task(self, project: Project, seed: int) -> Task:
        seeded = project.model_copy(update={"seed": seed})
        work = Work(f"{seed}", seeded.to_text(), "", "", ERRORS)
        return Task(str(project.folder.resolve()), self.question.image_scale, self.question.laser, (work,))


def _measured(runs: Sequence[Run], where: str) -> Sequence[Run]:
    """As they are. InputError: a seed measured nothing."""
    if not all(math.isfinite(run.wrong) and len(run.crossing) for run in runs):
        found = "; ".join(sorted({run.reason for run in runs if run.reason})) or "no depth on some seeds"
        raise InputError("the project measures nothing that could be compared", where=where, found=found)
    return runs


def _warm_up(text: str, folder: str) -> None:
    warm_up(Project.from_text(text).in_folder(Path(folder)))


def _choice(bench: _Bench) -> tuple[list[Tried], list[str]]:
    """What was tried, each beside what had been taken before it, and what was not worth it."""
    base, tried, untried = bench.project, list[Tried](), list[str]()
    _measured(bench.runs("the original", {"": base}, bench.seeds(0, 1))[""], base.name)
    goal = goal_of(base)
    if goal is not None:
        one = _tried(bench, "the goal", base, {goal.name: goal})[goal.name]
        # of its own it adds little to any row, and all that follows needs what it saves
        tried.append(replace(one, taken=_hopeful(one, bench.question)))
    for transport in (True, False):
        base = cheaper(bench.project, [one.part for one in tried if one.taken])
        (run,) = bench.runs("the original", {"": base}, bench.seeds(0, 1))[""]
        waiting: dict[str, list[Part]] = {}
        for part in parts_of(base):
            if (part.name == TRANSPORT) == transport:
                waiting.setdefault(part.name, []).append(part)
        idle = [name for name, ways in waiting.items() if run.share(ways[0].stages) <= 1.0 - PAYS]
        untried += idle
        waiting = {name: ways for name, ways in waiting.items() if name not in idle}
        while waiting:
            found = _tried(bench, "each part", base, {name: ways[0] for name, ways in waiting.items()})
            found = {name: replace(one, taken=one.fits(bench.question.allowed)) for name, one in found.items()}
            tried += found.values()
            # a way that leaves out less saves no more
            open_yet = [name for name, one in found.items() if not one.taken and _pays(one.found)]
            waiting = {name: waiting[name][1:] for name in open_yet if waiting[name][1:]}
    return tried, untried


def _tried(bench: _Bench, stage: str, base: Project, parts: Mapping[str, Part]) -> dict[str, Tried]:
    """Each by itself; on the first seed alone where that is enough to give it up."""
    projects = {name: cheaper(base, (part,)) for name, part in parts.items()}
    found: dict[str, Tried] = {}
    for count in (1, SCREENED):
        seeds = bench.seeds(0, count)
        left = {name: projects[name] for name in parts if name not in found or _hopeful(found[name], bench.question)}
        runs = bench.runs(stage, {"": base, **left}, seeds)
        found |= {name: Tried(parts[name], change(runs[""], runs[name])) for name in left}
    return found


def _hopeful(one: Tried, question: Question) -> bool:
    return one.found.size(less=SURELY) <= HOPELESS * question.allowed and _pays(one.found)


def _proofs(bench: _Bench, tried: Sequence[Tried]) -> list[Proof]:
    """Until one holds; each without those parts of the one before that changed most."""
    taken, question, proofs = [one for one in tried if one.taken], bench.question, list[Proof]()
    first = [one for one in taken if one.part.name in (GOAL, TRANSPORT)]  # beside which all others were tried
    others = sorted((one for one in taken if one not in first), key=lambda one: one.found.size())
    chosen = [one.part for one in first + others]
    while chosen and len(proofs) < MOST_PROOFS and not any(proof.holds for proof in proofs):
        both = {"": bench.project, "cheaper": cheaper(bench.project, chosen)}
        for count in (question.seeds // 2, question.seeds):
            seeds = bench.seeds(SCREENED, count)
            runs = bench.runs(f"proof {len(proofs) + 1}", both, seeds)
            found = change(_measured(runs[""], bench.project.name), runs["cheaper"])
            if count > 1 and found.beyond(question.within):
                break
        alike = len(seeds) == question.seeds and found.within(question.within)
        proofs.append(Proof(tuple(chosen), found, tuple(seeds), alike))
        rest = len(chosen) - len(first)
        chosen = chosen[: len(first) + rest // 2] if rest > 0 else chosen[:-1]
    return proofs


def _pays(found: Change) -> bool:
    """Enough seconds are saved to be worth a change."""
    return found.seconds < PAYS * found.seconds_before
