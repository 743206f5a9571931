"""The learned selection: it chooses and never measures, does not judge what it does not know, takes only our files."""

from __future__ import annotations

import hashlib
import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

from analysis.line.extract import select
from analysis.line.result import Flag, Line
from analysis.line.selection.features import FEATURES, candidate_features, segments
from analysis.line.selection.learned import READY_MADE, UNLIKE, choose_learned, load_chooser
from render.base.errors import InputError

ROWS = 400


def candidates(*, jitter: float = 0.0, reflection: float = 3.0) -> Line:
    """A straight line on every row, beside it a reflection on 60 of them, wider, bent and so many times as bright."""
    rng = np.random.default_rng(5)
    rows = np.arange(ROWS)
    u = np.full((ROWS, 5), np.nan)
    sigma, width, amplitude, chi2 = (np.full((ROWS, 5), np.nan) for _ in range(4))
    lit = slice(150, 210)
    u[:, 0] = 200.0 + 0.2 * rows + rng.normal(0.0, 0.15, ROWS) + rng.uniform(-jitter, jitter, ROWS)
    sigma[:, 0], width[:, 0], amplitude[:, 0] = 0.15, 0.9, 900.0 * rng.uniform(0.1, 1.0, ROWS)
    chi2[:, 0] = rng.uniform(0.8, 1.3, ROWS)
    bent = u[lit, 0] + 25.0 + 0.02 * (rows[lit] - 180) ** 2 + rng.normal(0.0, 0.6, 60)
    # peaks are ordered by brightness
    for values, second in ((u, bent), (sigma, 0.1), (width, 2.5), (amplitude, reflection * 900.0), (chi2, 6.0)):
        values[lit, 1] = second
        if reflection > 1.0:
            values[lit, :2] = values[lit, 1::-1].copy()
    flag = np.where(np.isnan(u), np.uint8(Flag.NO_PEAK), np.uint8(Flag.OK))
    return Line("rows", "likelihood", u, sigma, width, amplitude, np.where(np.isnan(u), np.nan, 5.0), chi2, flag)


def test_the_line_is_chosen_beside_a_brighter_reflection_and_stays_where_it_was_measured():
    seen = candidates()
    line = select(seen, "learned")
    truth = 200.0 + 0.2 * np.arange(ROWS)
    found = line.valid[:, 0]
    assert found.mean() > 0.9
    assert np.abs(line.u[found, 0] - truth[found]).max() < 1.0
    # the bias that the choice adds is nothing at all: every number is a candidate's to the last bit
    for name in ("u", "sigma_u", "width", "amplitude", "chi2"):
        chosen, of_all = getattr(line, name)[found], getattr(seen, name)[found]
        assert (chosen == of_all).any(axis=1).all()
    assert (line.flag[~found, 0] == Flag.REJECTED).all()


def test_only_allowed_candidates_are_chosen():
    seen = candidates()
    allowed = seen.valid.copy()
    allowed[:100] = False
    assert (choose_learned(seen, allowed, load_chooser(READY_MADE)).rank[:100] == -1).all()


def test_an_image_unlike_the_training_is_told_and_not_judged():
    line = select(candidates(jitter=10.0), "learned")
    assert not line.valid.any() and line.note == UNLIKE


def test_without_candidates_there_is_no_line_and_no_remark():
    seen = candidates()
    none = replace(seen, flag=np.full_like(seen.flag, Flag.NO_PEAK), u=np.full_like(seen.u, np.nan))
    line = select(none, "learned")
    assert line.u.shape == (ROWS, 1) and not line.valid.any() and line.note == ""


def test_features_do_not_change_with_brightness_or_in_a_mirror():
    seen = candidates()
    own = candidate_features(seen)
    assert own.shape == (int(seen.valid.sum()), len(FEATURES)) and np.isfinite(own).all()
    np.testing.assert_allclose(candidate_features(replace(seen, amplitude=7.0 * seen.amplitude)), own, atol=1e-9)
    np.testing.assert_allclose(candidate_features(replace(seen, u=600.0 - seen.u)), own, atol=1e-9)


def test_a_segment_skips_two_rows_and_ends_at_a_jump():
    u = np.full((10, 2), np.nan)
    u[:4, 0], u[6:8, 0], u[8:, 1] = 10.0, 10.5, 40.0
    number = segments(u)
    assert len(set(number[:6])) == 1 and len(set(number[6:])) == 1 and number[0] != number[-1]


def copied(tmp_path):
    for suffix in (".onnx", ".json"):
        shutil.copy(READY_MADE.with_suffix(suffix), tmp_path / f"mine{suffix}")
    return tmp_path / "mine.onnx"


def recarded(path, **changes):
    card = json.loads(path.with_suffix(".json").read_text())
    card["weights_sha256"] = hashlib.sha256(path.read_bytes()).hexdigest()
    path.with_suffix(".json").write_text(json.dumps(card | changes))


def test_a_copy_of_the_weights_and_card_is_taken(tmp_path):
    assert load_chooser(copied(tmp_path)).card.parameters <= 100_000
    assert copied(tmp_path).stat().st_size < 2**20


@pytest.mark.parametrize(
    ("harm", "told"),
    [
        (lambda path: path.unlink(), "mine.onnx"),
        (lambda path: path.with_suffix(".json").unlink(), "mine.json"),
        (lambda path: path.with_suffix(".json").write_text("[" * 100_000), "not the card"),
        (lambda path: path.with_suffix(".json").write_bytes(b"\xff\xfe"), "not the card"),
        (lambda path: recarded(path, frame_mean=[0.0]), "other things"),
        (lambda path: recarded(path, features=["width"]), "other things"),
        (lambda path: recarded(path, farthest="nan"), "not the card"),
        (lambda path: path.write_bytes(path.read_bytes()[:-1] + b"\x00"), "not the weights that the card"),
        (lambda path: path.write_bytes(b"\x80\x04pickled"), "not the weights that the card"),
        (lambda path: (path.write_bytes(b"\x80\x04pickled"), recarded(path)), "not those of a chooser"),
        (lambda path: (path.write_bytes(b""), recarded(path)), "not those of a chooser"),
        (lambda path: (path.write_bytes(path.read_bytes()[:4000]), recarded(path)), "not those of a chooser"),
        (lambda path: path.write_bytes(bytes(2**20 + 1)), "mine.onnx"),
    ],
)
def test_files_that_are_not_a_choosers_are_refused_in_one_message(tmp_path, harm, told):
    path = copied(tmp_path)
    harm(path)
    with pytest.raises(InputError, match=told):
        load_chooser(path)
