"""The photographs of `photograph_scenes`, each taken many times: what sigma covers, known to half a percent.

Each draw has noise and speckle of its own, and its line elsewhere: up to 4 px aside and leaning by up to 0.1 px a scan
line, evenly, or upright as rendered on every second draw, as a mosaic and a JPEG's blocks move an upright line by the
same on all scan lines. Printed for positions by default and for single scan lines:

    found, false, 2 sigma   means over the draws, the last with its standard error
    rms, robust             of error over sigma: root of the mean square, and of the median
    mean                    rms over draws of a photograph's mean error, over what sigma and correlation length tell
    rest                    rms of what single positions are off that mean, over sigma

    python -m tests.validation.photograph_draws FOLDER [--draws N] [--first SEED] [NAME ...]
"""

from __future__ import annotations

import argparse
import csv
import math
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from tests.validation.photograph_scenes import (
    TROUBLES,
    Place,
    Trouble,
    measured,
    nearest,
    off_by,
    photograph,
)

ASIDE, LEANING = 4.0, 0.1
"""px, and px a scan line, that a line is moved by at most."""
OPTIONS: dict[str, tuple[str, ...]] = {"default": (), "single": ("--no-smooth-along",)}


@dataclass(frozen=True)
class Draw:
    """One photograph: shares found and false, and of right positions (n,) error and sigma in px."""

    found: float
    false: float
    error: np.ndarray
    sigma: np.ndarray
    told_of_mean: float
    """px, standard deviation of the mean error that sigma and correlation length tell."""

    @property
    def within(self) -> float:
        return float(np.mean(np.abs(self.error) < 2.0 * self.sigma))


def place_of(seed: int) -> Place:
    """Where the line of a draw is."""
    rng = np.random.default_rng([seed, 77])
    shift, slope = ASIDE * rng.uniform(-1.0, 1.0), LEANING * rng.uniform(-1.0, 1.0)
    return Place(shift, slope if seed % 2 else 0.0)


def drawn(trouble: Trouble, seed: int, folder: Path) -> dict[str, Draw]:
    """One photograph of a scene, measured with each of `OPTIONS`; without those on which no line was found."""
    taken = photograph(trouble, seed, place_of(seed))
    path = folder / "drawn.png"
    cv2.imwrite(str(path), taken.pixels[..., ::-1])
    found = {}
    for name, options in OPTIONS.items():
        told, positions = measured(path, folder, *options)
        if told["axis"] != taken.axis or not len(positions):
            continue
        error, reached = off_by(taken, positions)
        right = np.abs(error) < nearest(taken)
        sigma, length = positions[:, 2], _lengths(Path(told["file"]))
        known = right & np.isfinite(sigma)
        mean = math.sqrt(float((sigma**2 * length)[known].sum())) / max(int(known.sum()), 1)
        found[name] = Draw(float(reached.mean()), float(np.mean(~right)), error[known], sigma[known], mean)
    return found


def _lengths(table: Path) -> np.ndarray:
    """(n,) scan lines that err alike, of the positions in a table."""
    with open(table, newline="") as file:
        return np.array([float(row["correlation_length"] or 1.0) for row in csv.DictReader(file) if row["u"]])


def told(draws: list[Draw]) -> str:
    """A row of the table."""
    ratio = np.concatenate([one.error / one.sigma for one in draws])
    within = np.array([one.within for one in draws])
    rest = np.concatenate([(one.error - one.error.mean()) / one.sigma for one in draws])
    means = np.array([one.error.mean() / one.told_of_mean for one in draws])
    shares = f"{np.mean([one.found for one in draws]):7.1%} {np.mean([one.false for one in draws]):7.2%}"
    covered = f"{within.mean():6.1%} +- {within.std() / math.sqrt(len(draws)):.1%}"
    spread = f"{_rms(ratio):6.2f} {1.4826 * np.median(np.abs(ratio)):6.2f} {_rms(means):6.2f} {_rms(rest):6.2f}"
    return f"{shares}  {covered}  {spread}"


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--draws", type=int, default=40)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("names", nargs="*")
    asked = parser.parse_intermixed_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    print(f"{'scene':18s}            found   false  2 sigma            rms robust   mean   rest")
    for scene in asked.names or TROUBLES:
        taken_all = [drawn(TROUBLES[scene], asked.first + k, asked.folder) for k in range(asked.draws)]
        for option in OPTIONS:
            some = [one[option] for one in taken_all if option in one]
            print(f"{scene:18s} {option:8s} {told(some) if some else 'no line'}  of {len(some)}", flush=True)
