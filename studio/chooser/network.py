"""A small perceptron trained by L-BFGS on its cross-entropy, and written as ONNX."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import log_softmax

from render.base.arrays import Float
from render.base.errors import InputError

HIDDEN = (32, 16)
DECAY = 1e-3
"""Weight of the sum of squared weights beside the mean cross-entropy."""
STEPS = 200


@dataclass(frozen=True)
class Perceptron:
    """Weights (in, out) and offsets (out,) of each layer; tanh between them."""

    weights: tuple[Float, ...]
    offsets: tuple[Float, ...]

    @property
    def parameters(self) -> int:
        """How many numbers were fitted."""
        return sum(one.size for one in (*self.weights, *self.offsets))

    def logits(self, features: Float) -> Float:
        """(m, f) -> (m, classes)."""
        return _layers(self, features)[-1]


def fitted(features: Float, kind: NDArray[np.integer], weight: Float, classes: int, seed: int) -> Perceptron:
    """Features (m, f), class (m,) and weight (m,) of each -> the perceptron of least cross-entropy.

    Features are standardised for the fit, which is then taken into the first layer.
    """
    mean, scale = features.mean(axis=0), np.maximum(features.std(axis=0), 1e-3)
    standard = (features - mean) / scale
    sizes = (features.shape[1], *HIDDEN, classes)
    rng = np.random.default_rng(seed)
    weights = [rng.normal(0.0, 1.0 / np.sqrt(a), (a, b)) for a, b in pairwise(sizes)]
    start = _packed(weights, [np.zeros(size) for size in sizes[1:]])
    wanted = np.eye(classes)[kind]
    share = weight / weight.sum()
    done = minimize(_loss, start, (sizes, standard, wanted, share), "L-BFGS-B", jac=True, options={"maxiter": STEPS})
    network = _unpacked(done.x, sizes)
    first = network.weights[0] / scale[:, None]
    return Perceptron((first, *network.weights[1:]), (network.offsets[0] - mean @ first, *network.offsets[1:]))


def _loss(packed: Float, sizes: tuple[int, ...], features: Float, wanted: Float, share: Float) -> tuple[float, Float]:
    """Cross-entropy with its decay, and its gradient (back-propagation)."""
    network = _unpacked(packed, sizes)
    layers = _layers(network, features)
    logs = log_softmax(layers[-1], axis=1)
    loss = -float(share @ (wanted * logs).sum(axis=1)) + DECAY * sum(float((one**2).sum()) for one in network.weights)
    error = share[:, None] * (np.exp(logs) - wanted)
    weights: list[Float] = []
    offsets: list[Float] = []
    for k in reversed(range(len(network.weights))):
        weights.insert(0, layers[k].T @ error + 2.0 * DECAY * network.weights[k])
        offsets.insert(0, error.sum(axis=0))
        if k:
            error = (error @ network.weights[k].T) * (1.0 - layers[k] ** 2)
    return loss, _packed(weights, offsets)


def _layers(network: Perceptron, features: Float) -> list[Float]:
    """What goes into each layer, and what comes out of the last."""
    layers = [features]
    for k, (weight, offset) in enumerate(zip(network.weights, network.offsets, strict=True)):
        out = layers[-1] @ weight + offset
        layers.append(out if k == len(network.weights) - 1 else np.tanh(out))
    return layers


def _packed(weights: list[Float], offsets: list[Float]) -> Float:
    return np.concatenate([one.ravel() for one in (*weights, *offsets)])


def _unpacked(packed: Float, sizes: tuple[int, ...]) -> Perceptron:
    shapes = [*pairwise(sizes), *((size,) for size in sizes[1:])]
    ends = np.cumsum([int(np.prod(shape)) for shape in shapes])[:-1]
    parts = [one.reshape(shape) for one, shape in zip(np.split(packed, ends), shapes, strict=True)]
    layers = len(sizes) - 1
    return Perceptron(tuple(parts[:layers]), tuple(parts[layers:]))


def check_onnx() -> None:
    """InputError: the package that writes weights is not installed."""
    if find_spec("onnx") is None:
        cure = 'install it: pip install "blazer-studio[chooser]"'
        raise InputError("onnx is not installed", where="chooser", cure=cure)


def onnx_of(network: Perceptron) -> bytes:
    """The perceptron as an ONNX model: "features" (m, f) -> "logits" (m, classes), float32.

    InputError: as `check_onnx`.
    """
    check_onnx()
    from onnx import TensorProto, checker, helper, numpy_helper

    nodes, tensors = [], []
    name = "features"
    for k, (weight, offset) in enumerate(zip(network.weights, network.offsets, strict=True)):
        tensors += [numpy_helper.from_array(value.astype(np.float32), f"{kind}{k}")
                    for kind, value in (("weight", weight), ("offset", offset))]  # fmt: skip
        last = k == len(network.weights) - 1
        out = "logits" if last else f"sum{k}"
        nodes.append(helper.make_node("Gemm", [name, f"weight{k}", f"offset{k}"], [out]))
        if not last:
            nodes.append(helper.make_node("Tanh", [out], [f"layer{k}"]))
        name = f"layer{k}"
    ends = [helper.make_tensor_value_info(end, TensorProto.FLOAT, ["m", size])
            for end, size in (("features", len(network.weights[0])), ("logits", len(network.offsets[-1])))]  # fmt: skip
    graph = helper.make_graph(nodes, "chooser", ends[:1], ends[1:], tensors)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)], ir_version=8)
    checker.check_model(model)
    return bytes(model.SerializeToString())
