"""Whether a goal in depth measures what a far longer render does: sigma, bias, and rows found, missed and false.

    python tests/validation/long_render.py [template ...] [--scale 1] [--seeds 8]   default: weld_seam

The long render has a tenth of the goal, which takes about a hundred times the paths. Each seed renders anew and draws
noise of its own, which the long render is developed with too. Bars: sigma of both within 3 %, bias within 3 % of sigma,
means over the seeds; 99 % of the rows found, missed or false as in the long render. Exit code 1: one is missed.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import studio as blazer

SAME, ALIKE = 0.03, 0.99
LONG = {
    "render.goal": {"depth": 0.01},
    "render.light_paths": 1 << 26,
    "render.indirect_error": 1e-3,
    "render.ambient_samples": 256,
    "seed": 1000,
}


def measured(frame: blazer.RenderedFrame, seed: int) -> blazer.PointErrors:
    return blazer.compare(blazer.triangulate(blazer.extract(blazer.develop(frame, seed=seed))), frame)


def states(errors: blazer.PointErrors) -> np.ndarray:
    """Of each scan line: 1 found, 2 false, 0 neither."""
    points, found = errors.points, np.zeros(len(errors.points.line.valid), np.int8)
    right = points.valid & (errors.truth >= 0) & ~errors.outlier
    found[points.index[points.valid & ~right]] = 2
    found[points.index[right]] = 1
    return found


def proved(template: str, scale: float, seeds: int) -> bool:
    """One template's figures; whether all bars are met."""
    project = blazer.Project.load(template)
    began = time.process_time()
    long = blazer.render(project.replaced(LONG), image_scale=scale)
    spent = time.process_time() - began
    sigma, robust, bias, alike, seconds = [], [], [], [], 0.0
    for seed in range(1, seeds + 1):
        began = time.process_time()
        short = blazer.render(project, image_scale=scale, seed=seed)
        seconds += time.process_time() - began
        one, other = measured(short, seed), measured(long, seed)
        sigma.append((one.depth_z.sigma, other.depth_z.sigma))
        robust.append((one.depth_z.robust_sigma, other.depth_z.robust_sigma))
        bias.append((one.depth_z.bias, other.depth_z.bias))
        alike.append(float(np.mean(states(one) == states(other))))
    print(f"{template}, scale {scale:g}: {seconds / seeds:.1f} processor s a frame, the long one {spent:.0f}")
    of_sigma, of_robust = (float(np.divide(*np.mean(each, axis=0))) for each in (sigma, robust))
    apart = float(np.mean([a - b for a, b in bias])) / float(np.mean([b for _, b in robust]))
    print(
        f"    sigma over that of the long render {of_sigma:.4f}, robust {of_robust:.4f}, bias {apart:+.4f} sigma apart"
    )
    print(f"    rows found, missed or false as there {np.mean(alike):.2%}, at least {min(alike):.2%}", flush=True)
    told = [(one.group, f"{one.error:.3f} of {one.target:.3f}") for one in long.quality]
    print(f"    the long render tells {told}")
    return abs(of_robust - 1.0) <= SAME and abs(apart) <= SAME and float(np.mean(alike)) >= ALIKE


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("templates", nargs="*", default=["weld_seam"])
    parser.add_argument("--scale", type=float, default=1.0)
    parser.add_argument("--seeds", type=int, default=8)
    given = parser.parse_args()
    found = [proved(template, given.scale, given.seeds) for template in given.templates]
    return 0 if all(found) else 1


if __name__ == "__main__":
    sys.exit(main())
