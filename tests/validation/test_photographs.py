"""Strangers' photographs: ours, by defaults alone, beside a centre of mass and a ridge filter of OpenCV.

BLAZER_PHOTOGRAPHS names a folder with a folder for each set; skipped without. There is no truth: a row is right where
two of the three methods agree and their neighbours go on, and false where one is elsewhere than that line, also across
its gaps; beyond it nothing is judged. Past a sharp end a row shows blur alone, of light that is nobody's: rows of less
than half of the light next to them are not asked for. Residuals are those to a parabola through a long piece of line,
as a plane makes it in a lens that distorts, of the typical piece. A file region.txt in a set, "x,y,w,h" in px, says
where its line can be: what is found elsewhere is false. Scatter is that about a parabola through a short piece.

Sigma is laid to the residuals of what the defaults give, and this is asserted. Printed beside it is the same of
positions that are not smoothed along the line: a smoothed line errs alike over many rows, a parabola takes them out,
and of a sigma that is right 0.85 are left after smoothing over 2.5 rows, 0.7 over 4, and 0.3 over 13. Printed beside
the false rows is how many of them are on the line itself, where it steps to another surface: a straight line across a
step is on neither.

    BLAZER_PHOTOGRAPHS=/tmp/sets python -m pytest -m validation -s tests/validation/test_photographs.py
"""

from __future__ import annotations

import json
import os
import warnings
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from click.testing import CliRunner
from numpy.typing import NDArray

import main
from studio.photographs.image_files import load_photograph
from tests.studio.photographs.test_evidence import positions
from tests.validation.opencv_line import centre_of_mass, light_of, steger

pytestmark = pytest.mark.validation

Floats = NDArray[np.float64]

AGREE, FAR = 8.0, 6.0
"""px between two methods that mean one line: a colour difference is that far off a white core; px from the running
middle of its neighbours beyond which a row is none of it."""
RUN, PIECE, PLANE = 31, 17, 96
"""Rows of the running middle, of a short piece and of a long one."""
BESIDE, LIT, FILLED = 8, 0.5, 0.8
"""Rows next to one, the share of their light that it has, and of a long piece that all methods found."""
FALSE, TRUTHFUL = 0.001, (0.8, 1.3)
SINGLE = "--no-smooth-along"
KINDS = {".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff"}


def sets() -> list[Path]:
    root = os.environ.get("BLAZER_PHOTOGRAPHS")
    return sorted(path for path in Path(root).iterdir() if path.is_dir()) if root else []


def reference(methods: list[Floats]) -> Floats:
    """(n,): where two methods agree and the line goes on, NaN elsewhere."""
    found = np.stack(methods)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # rows without any
        middle = np.nanmedian(found, axis=0)
        near = np.abs(found[:, None] - found[None]) <= AGREE
        agreed = (near.sum(axis=(0, 1)) - np.isfinite(found).sum(axis=0)) >= 2
        pairs = np.where(near.sum(axis=1) >= 2, found, np.nan)
        middle = np.where(agreed, np.nanmean(pairs, axis=0), np.nan)
        windows = np.lib.stride_tricks.sliding_window_view(np.pad(middle, RUN // 2, constant_values=np.nan), RUN)
        running = np.nanmedian(windows, axis=1)
    full = np.isfinite(windows).mean(axis=1) >= 0.5
    return np.where(agreed & full & (np.abs(middle - running) <= FAR), middle, np.nan)


def across_gaps(true: Floats) -> Floats:
    """(n,): the line also where its gaps are shorter than a run, NaN elsewhere."""
    there = np.flatnonzero(np.isfinite(true))
    if not len(there):
        return true
    rows = np.arange(len(true))
    after = np.clip(np.searchsorted(there, rows), 0, len(there) - 1)
    before = np.clip(np.searchsorted(there, rows, side="right") - 1, 0, None)
    inside = (there[after] - there[before] <= RUN) & (there[0] <= rows) & (rows <= there[-1])
    return np.where(inside, np.interp(rows, there, true[there]), np.nan)


def on_a_step(u: Floats, true: Floats) -> NDArray[np.bool_]:
    """(n,): whether a row without a reference has what the line before its gap, or after it, goes on to."""
    there = np.flatnonzero(np.isfinite(true))
    if not len(there):
        return np.zeros(len(true), np.bool_)
    rows = np.arange(len(true))
    after = np.clip(np.searchsorted(there, rows), 0, len(there) - 1)
    sides = true[there[after]], true[there[np.clip(after - 1, 0, None)]]
    near = np.minimum(*(np.abs(u - side) for side in sides))
    return np.asarray(~np.isfinite(true) & (near <= AGREE))


def region_of_set(folder: Path, axis: str, count: int) -> tuple[Floats, Floats]:
    """(n,) first and last position that the line can have on each scan line."""
    low, high = np.zeros(count), np.full(count, np.inf)
    if (folder / "region.txt").exists():
        x, y, w, h = map(int, (folder / "region.txt").read_text().split(","))
        (at, size), (first, rows) = ((x, w), (y, h)) if axis == "rows" else ((y, h), (x, w))
        low, high = np.full(count, np.inf), np.full(count, -np.inf)
        low[first : first + rows], high[first : first + rows] = at, at + size
    return low, high


def scatter(u: Floats, true: Floats) -> Floats:
    """Distance of each row's position from a straight line through its piece, in its own degrees of freedom, px."""
    good = np.where(np.abs(u - true) <= AGREE, u, np.nan)
    windows = np.lib.stride_tricks.sliding_window_view(good, PIECE)
    windows = windows[::PIECE][np.isfinite(windows[::PIECE]).all(axis=1)]
    if not len(windows):
        return np.full((0, PIECE), np.nan)
    x = np.arange(PIECE) - PIECE // 2
    basis = np.linalg.qr(np.stack([np.ones(PIECE), x, x**2], axis=1))[0]
    left = windows - windows @ basis @ basis.T
    return left * np.sqrt(PIECE / (PIECE - 3.0))


def lit(light: NDArray[np.float32], true: Floats) -> NDArray[np.bool_]:
    """(n,) whether a row has half of the light or more of those on either side of it."""
    at = np.nan_to_num(true).astype(np.intp)[:, None] + np.arange(-int(AGREE), int(AGREE) + 1)
    smooth = cv2.GaussianBlur(light, (0, 0), 1.0)
    near = np.take_along_axis(smooth, np.clip(at, 0, light.shape[1] - 1), axis=1)
    height = np.where(np.isfinite(true), near.max(axis=1) - near.min(axis=1), 0.0)
    padded = np.pad(height, BESIDE)
    sides = [np.lib.stride_tricks.sliding_window_view(padded, BESIDE)[k:][: len(height)] for k in (0, BESIDE + 1)]
    usual = np.max([np.median(side, axis=1) for side in sides], axis=0)
    return np.asarray(np.isfinite(true) & (height >= LIT * usual))


def from_planes(methods: dict[str, Floats], sigma: Floats, true: Floats) -> tuple[dict[str, list[float]], list[float]]:
    """RMS residuals to long pieces, px, by method, on rows that all of them found; and ours over sigma."""
    found: dict[str, list[float]] = {name: [] for name in methods}
    over_sigma: list[float] = []
    x = np.arange(PLANE) - PLANE / 2
    basis = np.linalg.qr(np.stack([np.ones(PLANE), x, x**2], axis=1))[0]
    there = np.all([np.abs(u - true) <= AGREE for u in methods.values()], axis=0) & np.isfinite(sigma)
    start = 0
    while start + PLANE <= len(true):
        rows = start + np.flatnonzero(there[start : start + PLANE])
        if len(rows) < FILLED * PLANE:
            start += BESIDE
            continue
        part, freedom = basis[rows - start], len(rows) - 3
        for name, u in methods.items():
            left = u[rows] - part @ np.linalg.lstsq(part, u[rows], rcond=None)[0]
            found[name].append(float(np.sqrt((left**2).sum() / freedom)))
            if name == "ours":
                over_sigma.append(float(np.sqrt(((left / sigma[rows]) ** 2).sum() / freedom)))
        start += PLANE
    return found, over_sigma


def extracted(files: list[Path], out: Path, *options: str) -> dict[str, Any]:
    """What `main.py extract` tells of image files."""
    arguments = ["extract", *map(str, files), "--out", str(out), "--json", "--quiet", *options]
    return dict(json.loads(CliRunner().invoke(main.cli, arguments).stdout))


def table(folder: Path, files: list[Path], out: Path) -> tuple[dict[str, tuple[float, float, float]], float]:
    """Method -> rows right, rows false (shares of the rows that have a line), residual px; normalised residual of ours.
    Prints them, and the last without smoothing along the line."""
    answer, single = (extracted(files, out / name, *option) for name, option in (("", ()), ("single", (SINGLE,))))
    chosen = answer["chosen"]
    sums: dict[str, list[list[float]]] = {}
    ratios: dict[str, list[float]] = {"default": [], "single": []}
    pieces: dict[str, list[float]] = {}
    for row, alone in zip(answer["images"], single["images"], strict=True):
        image = load_photograph(Path(row["image"]))
        light = light_of(image, chosen["colour"] or "mono", chosen["axis"])
        ours, sigma = positions(Path(row["file"]), len(light), "u" if chosen["axis"] == "rows" else "v")
        methods = {"ours": ours, "centre of mass": centre_of_mass(light), "Steger": steger(light)}
        allowed = region_of_set(folder, chosen["axis"], len(light))
        true = reference([np.where((u >= allowed[0]) & (u <= allowed[1]), u, np.nan) for u in methods.values()])
        have = lit(light, true)
        planes, over_sigma = from_planes(methods, sigma, true)
        ratios["default"] += over_sigma
        by_itself = positions(Path(alone["file"]), len(light), "u" if chosen["axis"] == "rows" else "v")
        ratios["single"] += from_planes({**methods, "ours": by_itself[0]}, by_itself[1], true)[1]
        for name, u in methods.items():
            right = have & (np.abs(u - true) <= AGREE)
            wrong = (np.abs(u - across_gaps(true)) > AGREE) | (u < allowed[0]) | (u > allowed[1])
            left = scatter(u, true)
            stepping = wrong & (u >= allowed[0]) & (u <= allowed[1]) & on_a_step(u, true)
            rms = 1.4826 * float(np.median(np.abs(left))) if left.size else np.nan
            sums.setdefault(name, []).append([right.sum(), wrong.sum(), have.sum(), stepping.sum(), rms])
            pieces.setdefault(name, []).extend(planes[name])
    print(f"\n{folder.name}: {len(answer['images'])} photographs, {chosen['told']}")
    found = {}
    for name, rows in sums.items():
        right, wrong, have, stepping, _ = np.nansum(rows, axis=0)
        typical = float(np.nanmedian([row[4] for row in rows]))
        plane = float(np.median(pieces[name])) if pieces[name] else np.nan
        found[name] = right / max(have, 1), wrong / max(right + wrong, 1), plane
        shares = f"right {found[name][0]:7.2%}  false {found[name][1]:7.2%} ({wrong:.0f} rows, {stepping:.0f} at steps)"
        print(f"  {name:15s} {shares}  scatter {typical:.3f} px  plane {plane:.3f} px")
    normalised, single = (float(np.median(some)) if some else np.nan for some in ratios.values())
    print(f"  residual over sigma {normalised:.2f} of {len(ratios['default'])} pieces; not smoothed along {single:.2f}")
    return found, normalised


@pytest.mark.skipif(not sets(), reason="BLAZER_PHOTOGRAPHS names no folder of photographs")
@pytest.mark.parametrize("folder", sets(), ids=lambda folder: folder.name)
def test_defaults_find_more_and_invent_less_than_opencv(folder: Path, tmp_path: Path) -> None:
    files = sorted(path for path in folder.iterdir() if path.suffix.lower() in KINDS)
    found, normalised = table(folder, files, tmp_path)
    ours, others = found["ours"], (found["centre of mass"], found["Steger"])
    assert ours[0] >= max(other[0] for other in others)
    assert ours[1] <= FALSE
    if np.isfinite(normalised):
        assert ours[2] <= min(other[2] for other in others)
        assert TRUTHFUL[0] <= normalised <= TRUTHFUL[1]
