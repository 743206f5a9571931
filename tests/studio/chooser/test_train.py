"""Training: the gradient is the loss's own, ONNX says what the perceptron says, and scores count what they say."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import check_grad

from analysis.line.result import Flag, Line
from analysis.line.selection.learned import LINE, OTHER, REFLECTION, load_chooser
from render.base.errors import InputError
from studio.chooser import network
from studio.chooser.samples import NONE, Sample, kinds, unlike
from studio.chooser.train import auc, trained, write


def test_the_gradient_is_that_of_the_loss():
    rng = np.random.default_rng(1)
    sizes = (4, 5, 3, 3)
    features, wanted = rng.normal(size=(20, 4)), np.eye(3)[rng.integers(0, 3, 20)]
    rest = (sizes, features, wanted, np.full(20, 0.05))
    packed = rng.normal(size=4 * 5 + 5 * 3 + 3 * 3 + 5 + 3 + 3)
    off = check_grad(lambda at: network._loss(at, *rest)[0], lambda at: network._loss(at, *rest)[1], packed)
    assert off < 1e-6


def test_the_area_under_the_curve_counts_pairs_in_order():
    rng = np.random.default_rng(2)
    low, high = rng.normal(0.0, 1.0, 50), rng.normal(1.0, 1.0, 40)
    assert auc(low, high) == pytest.approx((low[:, None] < high[None, :]).mean())


def line_of(u) -> Line:
    """Candidates at u (n, k), of one brightness and width in a column, the second column bright and wide."""
    rng = np.random.default_rng(3)
    valid = np.isfinite(u)
    column = np.broadcast_to(np.arange(u.shape[1]), u.shape)

    def of(first, second):
        return np.where(valid, np.where(column == 0, first, second) * rng.uniform(0.9, 1.1, u.shape), np.nan)

    flag = np.where(valid, np.uint8(Flag.OK), np.uint8(Flag.NO_PEAK))
    return Line(
        "rows", "likelihood", u, of(0.03, 0.1), of(1.0, 3.0), of(500.0, 1500.0), of(5.0, 5.0), of(1.0, 5.0), flag
    )


def samples() -> list[Sample]:
    """Frames of a line, a reflection and single grains beside it, eight for each split."""
    rng = np.random.default_rng(4)
    made = []
    for number in range(24):
        rows = np.arange(80)
        u = np.full((80, 3), np.nan)
        u[:, 0] = 100.0 + number + 0.1 * rows
        u[20:50, 1] = u[20:50, 0] + 20.0 + rng.normal(0.0, 0.5, 30)
        u[::9, 2] = rng.uniform(10.0, 90.0, 9)
        kind = np.where(np.isfinite(u), np.array([LINE, REFLECTION, OTHER]), NONE).astype(np.int8)
        split = ("train", "validation", "test")[number % 3]
        line = line_of(u)
        odd = {"shaken": replace(line, u=u + rng.uniform(-30.0, 30.0, u.shape))} if split == "test" else {}
        made.append(Sample(line, kind, np.ones(80, np.bool_), split, number, odd))
    return made


def test_what_is_trained_is_written_as_weights_and_card_that_load_again(tmp_path):
    found = trained(samples(), 0, {"recipes": []})
    write(tmp_path / "mine.onnx", found)
    chooser = load_chooser(tmp_path / "mine.onnx")
    assert chooser.card == found.card
    scores = chooser.card.scores
    assert scores["rows"]["wrong"] == 0.0 and scores["rows"]["right"] > 0.9 and scores["rows"]["possible"] == 1.0
    assert scores["unlike"]["shaken"]["auc"] >= 0.9


def test_onnx_says_what_the_perceptron_says(tmp_path):
    import cv2

    rng = np.random.default_rng(6)
    features, kind = rng.normal(3.0, 2.0, (200, 7)), rng.integers(0, 3, 200)
    fitted = network.fitted(features, kind, np.ones(200), 3, 0)
    run = cv2.dnn.readNetFromONNX(np.frombuffer(network.onnx_of(fitted), np.uint8))
    run.setInput(features.astype(np.float32), "features")
    np.testing.assert_allclose(run.forward(), fitted.logits(features), rtol=1e-4, atol=1e-4)


def test_too_few_scenes_and_recipes_without_reflections_are_refused():
    with pytest.raises(InputError, match="validation"):
        trained([one for one in samples() if one.split != "validation"], 0, {})
    plain = [replace(one, kind=np.where(one.kind == REFLECTION, np.int8(OTHER), one.kind)) for one in samples()]
    with pytest.raises(InputError, match="a reflection"):
        trained(plain, 0, {})


def test_candidates_are_named_by_the_truth():
    u = np.array([[10.4, 30.0, 50.0], [13.0, np.nan, np.nan]])
    direct, reflected = np.zeros((2, 60)), np.zeros((2, 60))
    reflected[0, 30], direct[0, 50] = 1.0, 1.0
    curve = SimpleNamespace(index=np.array([0, 1]), position=np.array([10.0, 10.0]))
    frame = SimpleNamespace(curves=[curve], laser_direct=[direct], laser_indirect=[reflected])
    assert kinds(line_of(u), frame, 0).tolist() == [[LINE, REFLECTION, OTHER], [OTHER, NONE, NONE]]


def test_frames_made_unlike_others_keep_shape_and_type_and_are_repeatable():
    pixels = np.zeros((16, 64), np.uint16)
    pixels[:, 30] = 1000
    made, again = unlike(pixels, 1, 7), unlike(pixels, 1, 7)
    assert len(made) == 3
    for name, one in made.items():
        assert one.shape == pixels.shape and one.dtype == pixels.dtype and np.array_equal(one, again[name])
    assert ((made["three lines for one"] > 0).sum(axis=1) == 3).all()
    assert (made["scan lines shaken by 10 px"].argmax(axis=1) != 30).any()
