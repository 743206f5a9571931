"""One peak a scan line, or none: the candidate that a small network takes for the line, where it is sure.

The network names every candidate the line, a reflection, or something else; it never measures, so positions and sigmas
are those of the method to the last bit. It is an ONNX file with a card beside it, JSON, that says what it was trained
on, when it is sure, and what its frames look like: a frame farther from them than any held out for that
(Mahalanobis, 1936) is not judged. Trained by `studio/chooser`.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from analysis.line.result import Line
from analysis.line.selection.features import FEATURES, candidate_features
from render.base.arrays import Float
from render.base.errors import InputError
from render.base.files import read_bytes
from render.base.model import Model, quantity

Int = NDArray[np.int64]

LINE, REFLECTION, OTHER = 0, 1, 2
CLASSES = ("the line", "a reflection", "something else")
READY_MADE = Path(__file__).resolve().parents[3] / "assets" / "chooser" / "steel.onnx"
MOST_BYTES = 2**20
FEWEST = 20
"""Candidates that a frame is judged by; with fewer, it is not known what it looks like."""
UNLIKE = (
    "the image, as it is measured, is unlike those that the chooser was trained on: no peak is taken (select "
    "continuous, or train a chooser on a recipe like it)"
)


class Card(Model):
    """What is known of a network: the JSON file beside its weights."""

    format: Literal["Blazer Studio chooser 1"] = "Blazer Studio chooser 1"
    weights_sha256: str = quantity(label="SHA-256 of the weights", pattern="^[0-9a-f]{64}$")
    features: tuple[str, ...]
    parameters: int = quantity(label="Parameters", ge=1, le=100_000)
    sure: float = quantity(
        label="Least probability", help="Of being the line, for a candidate to be taken.", ge=0, le=1
    )
    frame_mean: tuple[float, ...]
    frame_precision: tuple[tuple[float, ...], ...]
    farthest: float = quantity(label="Farthest frame", help="Mahalanobis distance up to which it is judged.", gt=0)
    trained_on: dict[str, Any]
    scores: dict[str, Any]


@dataclass(frozen=True)
class Chooser:
    """A network that is ours, and its card."""

    card: Card
    weights: bytes

    def probabilities(self, features: Float) -> Float:
        """Features (m, f) -> (m, 3), in the order of `CLASSES`."""
        if not len(features):
            return np.zeros((0, len(CLASSES)))
        import cv2  # slow to load
        from scipy.special import softmax

        network = cv2.dnn.readNetFromONNX(np.frombuffer(self.weights, np.uint8))
        network.setInput(features.astype(np.float32), "features")
        return np.asarray(softmax(network.forward().astype(np.float64), axis=1))

    def distance(self, frame: Float) -> float:
        """Mahalanobis distance of a frame's `frame_features` from those that it was trained on."""
        off = frame - np.asarray(self.card.frame_mean)
        return float(np.sqrt(max(off @ np.asarray(self.card.frame_precision) @ off, 0.0)))


@dataclass(frozen=True)
class Choice:
    """The rank (n,) chosen on each scan line, -1 for none, and why none is chosen at all."""

    rank: Int
    refused: str = ""


def choose_learned(candidates: Line, allowed: NDArray[np.bool_], chooser: Chooser) -> Choice:
    """Peaks (n, k), of which some are allowed (n, k) -> what the network takes for the line."""
    rank = np.full(len(candidates.u), -1, np.int64)
    if not candidates.valid.any():
        return Choice(rank)
    features = candidate_features(candidates)
    if len(features) >= FEWEST:
        distance = chooser.distance(frame_features(candidates, features))
        if distance > chooser.card.farthest:
            return Choice(rank, UNLIKE)
    chance = np.zeros(candidates.u.shape)
    chance[candidates.valid] = chooser.probabilities(features)[:, LINE]
    chance = np.where(allowed, chance, 0.0)
    best = chance.argmax(axis=1)
    return Choice(np.where(chance.max(axis=1) >= chooser.card.sure, best, rank))


def frame_features(candidates: Line, features: Float) -> Float:
    """(f + 2,): the mean of the candidates' features (m, f), candidates a lit row, and share of rows with any."""
    lit = candidates.valid.any(axis=1)
    return np.append(features.mean(axis=0), [len(features) / max(int(lit.sum()), 1), lit.mean()])


@lru_cache(maxsize=4)
def load_chooser(path: Path) -> Chooser:
    """The network of an ONNX file and of the card beside it (.json). InputError: they are not ours, or damaged."""
    import cv2

    weights = read_bytes(path, MOST_BYTES, "chooser's weights")
    beside = path.with_suffix(".json")
    ours = "weights and card as `main.py chooser` writes them"
    text = read_bytes(beside, MOST_BYTES, "chooser's card")
    try:
        card = Card.model_validate(json.loads(text))
    except (ValidationError, ValueError, RecursionError):
        raise InputError("this is not the card of a chooser", where=str(beside), allowed=ours) from None
    size = len(FEATURES) + 2
    square = len(card.frame_precision) == size and all(len(row) == size for row in card.frame_precision)
    if card.features != FEATURES or len(card.frame_mean) != size or not square:
        cure = "train it anew with this version"
        raise InputError("the chooser looks at other things than this version", where=str(beside), cure=cure)
    if hashlib.sha256(weights).hexdigest() != card.weights_sha256:
        raise InputError("these are not the weights that the card describes", where=str(path), allowed=ours)
    chooser = Chooser(card, weights)
    try:
        given = chooser.probabilities(np.zeros((2, len(FEATURES))))
        good = given.shape == (2, len(CLASSES)) and bool(np.isfinite(given).all())
    except cv2.error:
        good = False
    if not good:
        raise InputError("the weights are not those of a chooser", where=str(path), allowed=ours)
    return chooser
