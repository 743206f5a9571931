"""What is kept of a scan: exact where sums can be, a fair sample where they cannot, and no more with every frame."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from analysis import spool
from analysis.measures import measure
from analysis.report.record import ScanRecord
from analysis.report.sample import RUN, Sample
from analysis.report.summary import headline, sample_note
from analysis.report.tables import counts
from analysis.report.total import Total, total
from analysis.report.write import render_page
from analysis.spool import Spool
from render.base.counts import EMBREE_SECONDS
from render.base.errors import InputError
from render.plan import GroupQuality
from tests.analysis.report.test_report import extraction, make_frames, make_report, report_of, wall_curve

FRAMES, ROWS, SMALL = 60, 100, 1200


def long_scan(most_lines: int) -> ScanRecord:
    """Noise that grows from frame to frame, with gross errors now and then."""
    random = np.random.default_rng(8)
    scene, (frame,) = make_frames()
    curve, record = wall_curve(scene), ScanRecord(scene, most_lines=most_lines)
    for step in range(FRAMES):
        noise = (0.05 + 0.002 * step) * random.standard_normal(ROWS) + 0.01
        noise[random.random(ROWS) < 0.01] += 5.0
        lasers = (dataclasses.replace(frame.lasers[0], extractions=(extraction(scene, curve, 0, "x", noise),)),)
        record.add(dataclasses.replace(frame, step=step, lasers=lasers))
    return record


@pytest.fixture(scope="module")
def both() -> tuple[Total, Total]:
    """The same scan kept whole, and by a sample of a sixth of it."""
    return total(long_scan(1 << 18).chosen()), total(long_scan(SMALL).chosen())


def test_a_scan_that_fits_is_measured_as_a_whole(both: tuple[Total, Total]) -> None:
    whole, _ = both
    rows = long_scan(1 << 18).chosen().rows
    assert not whole.sampled and whole.lines == FRAMES * 120 and len(rows) == FRAMES * ROWS
    assert whole.u == measure(rows["position"], rows["sigma_position"], 1.0, rows["index"], rows["rank"])


def test_sums_of_a_longer_scan_are_exact(both: tuple[Total, Total]) -> None:
    whole, part = both
    assert part.sampled and RUN < part.lines_kept <= SMALL and part.lines == whole.lines
    for name in ("points", "outliers", "truth_rows", "valid_rows", "measured_rows", "false_rows", "completeness"):
        assert getattr(part, name) == getattr(whole, name)
    for name in ("u", "depth_z", "surface"):
        a, b = getattr(whole, name), getattr(part, name)
        exact = [(one.count, one.bias, one.sigma, one.rmse, one.coverage) for one in (a, b)]
        assert exact[1] == pytest.approx(exact[0], rel=1e-9)


def test_quantiles_of_the_sample_are_those_of_the_scan_within_its_spread(both: tuple[Total, Total]) -> None:
    """A quantile of n values has the standard error sqrt(p (1 - p) / n) / density; runs of 64 hardly add to it."""
    whole, part = both
    n = part.lines_kept * ROWS / 120
    # P95 of |e| for a normal: density 2 phi(1.96) = 0.117 in units of sigma
    spread = whole.u.robust_sigma * np.sqrt(0.95 * 0.05 / n) / 0.117
    assert abs(part.u.p95 - whole.u.p95) < 4 * 1.5 * spread
    assert abs(part.u.robust_sigma / whole.u.robust_sigma - 1) < 4 * 1.17 / np.sqrt(n) * 1.5
    assert abs(part.u.outlier_rate - whole.u.outlier_rate) < 4 * np.sqrt(whole.u.outlier_rate / n)
    assert abs(part.u.autocorrelation - whole.u.autocorrelation) < 4 / np.sqrt(n)


def test_the_report_says_which_figures_are_of_a_sample(quick_reports: None) -> None:
    report = make_report(steps=3)
    record = long_scan(SMALL)
    page = render_page(dataclasses.replace(report, record=record))
    note = sample_note(total(record.chosen()))
    assert note in page and "of the 7\u202f200 scan lines" in note
    assert "points in a sample" in headline(dataclasses.replace(report, record=record))
    assert "are nearer (sample)" in page and "of the 6\u202f000 points" in page
    assert sample_note(total(report.record.chosen())) == "" and "sample" not in headline(report)
    assert ") were rightly measured by" in headline(report), "points that are wrong are among those of its figures"


def test_every_scan_line_is_as_likely_in_the_sample_and_methods_share_it() -> None:
    frames, lines, most = 400, 256, 6400
    sample = Sample(most)
    record = ScanRecord(make_frames()[0])
    rows = record.chosen().rows
    every = np.zeros(lines, rows.dtype)
    every["index"] = np.arange(lines)
    for _ in range(frames):
        sample.add(0, lines, [every, every[::2].copy()])
    own, other = sample.rows(0, 0), sample.rows(0, 1)
    assert len(own) == sample.lines(0)[0] == most and sample.lines(0)[1] == frames * lines
    assert np.array_equal(own["index"][own["index"] % 2 == 0], other["index"])
    image, line = np.divmod(own["index"], 1_000_000)
    # of 100 runs kept, 25 are expected of each quarter of an image and of the scan, +- 4.3
    for part in (line // RUN, image // (frames // 4)):
        kept = np.bincount(part, minlength=4) / RUN
        assert np.all(np.abs(kept - 25) < 4 * 4.3) and kept.sum() == 100


def test_the_same_scan_has_the_same_sample() -> None:
    one, two = (long_scan(SMALL).chosen().rows for _ in range(2))
    assert np.array_equal(one["index"], two["index"]) and np.array_equal(one["world"], two["world"], equal_nan=True)


def test_frames_that_wait_are_read_from_disk_as_they_were(monkeypatch, tmp_path) -> None:
    monkeypatch.setattr(spool, "IN_MEMORY", 1)
    scene, frames = make_frames(steps=3, lasers=2)
    record = ScanRecord(scene, tmp_path / "new")
    for frame in frames:
        record.add(frame)
    shown = record.shown_frame()
    assert np.array_equal(shown.lasers[1].image, frames[shown.step].lasers[1].image)
    assert list((tmp_path / "new").iterdir()) == []  # a killed program would leave nothing


def test_a_disk_that_takes_no_more_is_named(tmp_path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be kept"):
        Spool(tmp_path / "file").append(b"x")


@pytest.mark.parametrize("name", ["error probe", "mean", "seconds", "fraction a pixel"])
def test_a_laser_may_be_called_like_a_kind_of_number(name):
    scene, made = make_frames(steps=2, name=name)
    quality = (
        GroupQuality("direct", f"{name}a", 0.004, 0.003, 4e6, "samples", lit_pixels=1e5),
        GroupQuality("indirect", f"{name}a", 0.05, 0.1, 1e6, "light paths", clamped=3, clamped_radiance=0.25),
        GroupQuality("ambient", None, float("nan"), 0.01, 15.5, "samples a pixel", invalid=2),
    )
    frames = [dataclasses.replace(frame, quality=quality, counts={EMBREE_SECONDS: 0.5}) for frame in made]
    assert counts(report_of(scene, frames)) == [
        ("seconds in embree, all threads", "1.00\u00a0s"),
        (f"relative error, {name}a", "0.40\u00a0%"),
        (f"lit pixels, {name}a", "200\u202f000"),
        (f"samples, {name}a", "8\u202f000\u202f000"),
        (f"dropped contributions of direct light, {name}a", "0"),
        (f"relative error of reflections, {name}a", "5.00\u00a0%"),
        (f"light paths, {name}a", "2\u202f000\u202f000"),
        (f"dropped contributions, {name}a", "0"),
        (f"clamped contributions, {name}a", "6"),
        (f"mean radiance taken by the clamp, {name}a", "0.25"),
        ("samples a pixel, ambient", "15.5"),
        ("dropped contributions, ambient", "4"),
    ]
    # of light for the line the error is of the line's position, in sigmas: 0.0122 was told as 1.22 % of the light
    line = dataclasses.replace(quality[0], error=0.0122, of="line", image_error=0.0021)
    dark = dataclasses.replace(quality[1], error=0.024, of="line", image_error=None)
    for_line = [dataclasses.replace(frame, quality=(line, dark, quality[2])) for frame in frames]
    told = dict(counts(report_of(scene, for_line)))
    assert told[f"relative error, {name}a"] == "0.21\u00a0%" and f"relative error of reflections, {name}a" not in told
    # of reflections 198 %, which is no figure, stood there without a word
    noisy = dataclasses.replace(dark, image_error=1.981)
    for_line = [dataclasses.replace(frame, quality=(line, noisy, quality[2])) for frame in frames]
    (what,) = (what for what, text in counts(report_of(scene, for_line)) if text == "over 100\u00a0%")
    assert what.endswith(f"(not rendered to be known away from the line, by the goal in depth), {name}a")
