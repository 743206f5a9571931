"""Trains a chooser: scenes rendered, a network fitted to those for training, judged by those that it never saw."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import rankdata

from analysis.line.result import Line
from analysis.line.selection.features import FEATURES, candidate_features
from analysis.line.selection.learned import CLASSES, FEWEST, LINE, Card, Chooser, choose_learned, frame_features
from render.base.arrays import Float
from render.base.errors import InputError
from render.base.files import atomic_write
from render.base.threads import Cancel
from studio.chooser.network import fitted, onnx_of
from studio.chooser.samples import NONE, Sample, samples_of
from studio.dataset.images import Task
from studio.dataset.recipe import Recipe, base_of
from studio.runtime.workers import EVERY_PROCESSOR, Engine, team
from studio.study.measuring import warm_up

SURE = (0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.97, 0.98, 0.99)
WRONG = 0.0005
"""Share of wrong rows that the held-out scenes may have; half of what is wanted of others, as they are few.

The least probability is the smallest that keeps to it."""
SHRINKAGE = 0.2
"""Of the frames' covariance towards its diagonal (Ledoit and Wolf, 2004), as there are few frames."""
MARGIN = 1.1
"""Times the farthest held-out frame, as that is not the farthest there can be."""

Progress = Callable[[int, int], None]


def gathered(
    recipes: Sequence[tuple[Recipe, Path]],
    scenes: int,
    *,
    engine: Engine = EVERY_PROCESSOR,
    progress: Progress = lambda done, known: None,
    cancelled: Cancel = lambda: False,
) -> list[Sample]:
    """The photographs of the first so many scenes of each recipe. InputError: a recipe does not fit. Cancelled."""
    tasks = []
    for recipe, root in recipes:
        base = base_of(recipe, root)
        tasks += [
            Task(recipe.model_dump_json(), base.to_text(), str(root.resolve()), str(base.folder.resolve()), "", k)
            for k in range(scenes)
        ]
    base = base_of(*recipes[0])
    made: dict[Task, list[Sample]] = {}
    progress(0, len(tasks))
    with team(engine, samples_of, partial(warm_up, base), cancelled) as workers:
        for task, found in workers.results(tasks, cancelled, "the chooser"):
            made[task] = found
            progress(len(made), len(tasks))
    return [sample for task in tasks for sample in made[task]]


def trained(samples: Sequence[Sample], seed: int, told: dict[str, Any]) -> Chooser:
    """A network fitted to the samples of the training split. told: of its data, for the card.

    InputError: a split has no frames with candidates, or a class is missing.
    """
    parts = {name: [one for one in samples if one.split == name and one.candidates.valid.sum() >= FEWEST]
             for name in ("train", "validation", "test")}  # fmt: skip
    for name, part in parts.items():
        if not part:
            raise InputError(f"no scene of the {name} split shows a line", where="chooser", cure="more scenes: --count")
    table = [candidate_features(one.candidates) for one in parts["train"]]
    kind = np.concatenate([one.kind[one.kind != NONE] for one in parts["train"]])
    missing = [name for k, name in enumerate(CLASSES) if not (kind == k).any()]
    if missing:
        cure = "more scenes, or a recipe with reflections"
        raise InputError(f"no candidate of the training scenes is {missing[0]}", where="chooser", cure=cure)
    network = fitted(np.concatenate(table), kind, np.ones(len(kind)), len(CLASSES), seed)
    weights = onnx_of(network)
    frames = np.stack([frame_features(one.candidates, found) for one, found in zip(parts["train"], table, strict=True)])
    mean, precision = frames.mean(axis=0), _precision(frames)
    card = Card(
        weights_sha256=hashlib.sha256(weights).hexdigest(),
        features=FEATURES,
        parameters=network.parameters,
        sure=SURE[0],
        frame_mean=tuple(mean.tolist()),
        frame_precision=tuple(tuple(row) for row in precision.tolist()),
        farthest=1e9,
        trained_on=told | {"seed": seed, "frames": {name: len(part) for name, part in parts.items()}},
        scores={},
    )
    chooser = Chooser(card, weights)
    held_out = [distance_of(chooser, one.candidates) for one in parts["validation"]]
    chooser = _with(chooser, farthest=MARGIN * max(held_out))
    for sure in SURE:
        chooser = _with(chooser, sure=sure)
        if shares(chooser, parts["validation"])["wrong"] <= WRONG:
            break
    return _with(chooser, scores=scores(chooser, parts["test"]))


def _with(chooser: Chooser, **changes: Any) -> Chooser:
    return Chooser(chooser.card.model_copy(update=changes), chooser.weights)


def _precision(frames: Float) -> Float:
    """Frames (m, f) -> (f, f) the inverse of their shrunk covariance."""
    covariance = np.cov(frames, rowvar=False)
    own = np.maximum(np.diag(covariance), 1e-6)
    return np.asarray(np.linalg.inv((1.0 - SHRINKAGE) * covariance + SHRINKAGE * np.diag(own)), np.float64)


def distance_of(chooser: Chooser, candidates: Line) -> float:
    """How far a frame is from those that the chooser was trained on; infinite without candidates to tell."""
    if candidates.valid.sum() < FEWEST:
        return np.inf
    return chooser.distance(frame_features(candidates, candidate_features(candidates)))


def shares(chooser: Chooser, samples: Sequence[Sample]) -> dict[str, float]:
    """Of the rows that the line crosses: wrong and right ones, and those where a candidate is the line at all."""
    wrong = right = possible = crossed = 0
    for one in samples:
        rank = choose_learned(one.candidates, one.candidates.valid, chooser).rank
        taken = rank >= 0
        kind = np.take_along_axis(one.kind, np.maximum(rank, 0)[:, None], axis=1)[:, 0]
        right += int((taken & (kind == LINE)).sum())
        wrong += int((taken & (kind != LINE)).sum())
        possible += int((one.kind == LINE).any(axis=1).sum())
        crossed += int(one.crossed.sum())
    return {name: value / max(crossed, 1) for name, value in
            (("wrong", wrong), ("right", right), ("possible", possible))}  # fmt: skip


def scores(chooser: Chooser, samples: Sequence[Sample]) -> dict[str, Any]:
    """For the card: rows of the test scenes, and how well frames of three other kinds are told from them."""
    near = np.array([distance_of(chooser, one.candidates) for one in samples])
    kinds = sorted({name for one in samples for name in one.unlike})
    told = {}
    for name in kinds:
        far = np.array([distance_of(chooser, one.unlike[name]) for one in samples])
        told[name] = {
            "auc": round(auc(near, far), 4),
            "flagged": round(float((far > chooser.card.farthest).mean()), 4),
        }
    rows = {name: round(value, 5) for name, value in shares(chooser, samples).items()}
    return {"rows": rows, "flagged": round(float((near > chooser.card.farthest).mean()), 4), "unlike": told}


def auc(low: Float, high: Float) -> float:
    """Area under the receiver's curve: the chance that one of `high` is above one of `low` (Mann and Whitney, 1947)."""
    ranks = rankdata(np.concatenate([low, high]))[len(low) :]
    return float((ranks.sum() - len(high) * (len(high) + 1) / 2) / (len(low) * len(high)))


def write(path: Path, found: Chooser) -> None:
    """Weights (.onnx), and the card beside them (.json). InputError: they cannot be written."""
    with atomic_write(path) as temporary:
        temporary.write_bytes(found.weights)
    with atomic_write(path.with_suffix(".json")) as temporary:
        text = json.dumps(found.card.model_dump(mode="json"), allow_nan=False)
        temporary.write_text(text + "\n", encoding="utf-8")


def told_of(recipes: Sequence[tuple[Recipe, Path]], scenes: int) -> dict[str, Any]:
    """The recipes of a chooser for its card."""
    return {
        "recipes": [
            {"name": recipe.name, "seed": recipe.seed, "scenes": scenes, "sha256": recipe.digest(base_of(recipe, root))}
            for recipe, root in recipes
        ]
    }
