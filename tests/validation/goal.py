"""Renders to the goal in depth beside renders of many times the light paths and samples, over several seeds.

    python tests/validation/goal.py [template ...] [--scale 0.25] [--seeds 4] [--times 16]    default: sample, V groove

Every seed is rendered to the goal, and again far beyond it; both images are developed with the same noise. Of all
seeds together the depth's sigma and bias are to agree within 3 % of sigma, and 99 % of the rows are to be found, missed
or false in both. Told beside: by how much rows differ in the images without noise, over their own sigma, of which
95 % are to be within the goal. Exit code 1: they are not.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import studio as blazer

FALSE = 5.0
"""Pixels from the exact line at which a row is false; nearer it is found."""
DEPTH, ROWS, MOVED = 0.03, 0.99, 0.95


def kinds(line: blazer.ExtractedLine, frame: blazer.RenderedFrame) -> np.ndarray:
    """(rows,) 0: missed, 1: found, 2: false."""
    curve, u = frame.curves[0], line.u[:, 0]
    nearest = np.full(len(u), np.inf)
    np.minimum.at(nearest, curve.index, np.abs(np.nan_to_num(u[curve.index], nan=np.inf) - curve.position))
    return np.where(~line.valid[:, 0], 0, np.where(nearest <= FALSE, 1, 2))


def proved(template: str, scale: float, seeds: int, times: float) -> bool:
    """One template's row of figures; whether all bars are met."""
    project = blazer.Project.load(template).replaced({"render.truth_images": False})
    goal = project.render.goal
    if goal is None:
        raise SystemExit(f"{template} asks for no goal in depth")
    began, first = time.process_time(), blazer.render(project, image_scale=scale, seed=1)
    spent = time.process_time() - began
    paths = max((one.work for one in first.quality if one.group == "indirect"), default=0.0)
    ambient = next((one.work for one in first.quality if one.group == "ambient"), 1.0)
    long = {
        **{"render.goal": None, "render.transport": "subsurface", "render.indirect_error": 2e-4},
        # the long render's own direct light must not be what moves the rows
        "render.laser_error": 1e-4,
        **{"render.light_paths": int(min(max(times * paths, 1 << 20), 1 << 25)), "render.ambient_error": 2e-4},
        "render.ambient_samples": int(min(max(times * ambient, 64), 1024)),
    }
    reference = blazer.render(project.replaced(long), image_scale=scale, seed=1000)
    still = blazer.extract(blazer.develop(reference, noise=False))
    figures, same, moved = [], [], []
    for seed in range(1, seeds + 1):
        frame = first if seed == 1 else blazer.render(project, image_scale=scale, seed=seed)
        (errors, rows), (expected, expected_rows) = measured(frame, seed), measured(reference, seed)
        figures.append([(e.depth_z.sigma, e.depth_z.robust_sigma, e.depth_z.bias) for e in (errors, expected)])
        same.append(np.mean(rows == expected_rows))
        other, seen = blazer.extract(blazer.develop(frame, noise=False)), still.valid[:, 0]
        moved.append((other.u - still.u)[seen, 0] / still.sigma_u[seen, 0])
    goals, longs = np.array(figures).swapaxes(0, 1)
    sigma, robust = np.sqrt(np.mean(goals[:, :2] ** 2, axis=0)) / np.sqrt(np.mean(longs[:, :2] ** 2, axis=0))
    bias = float(np.mean(goals[:, 2] - longs[:, 2])) / float(np.sqrt(np.mean(longs[:, 1] ** 2)))
    deviation = np.sqrt(np.nanmean(np.square(moved), axis=0))
    within, alike = float(np.mean(deviation <= goal.depth)), float(np.mean(same))
    work = f"{long['render.light_paths']:.3g} and {long['render.ambient_samples']} samples a pixel"
    print(f"{template}, scale {scale}, {seeds} seeds, {spent:.1f} processor s each; {paths:.3g} paths, long {work}")
    print(f"    depth over the long render's: sigma {sigma:.3f}, robust {robust:.3f}; bias {bias:+.3f} robust sigma")
    print(f"    rows found, missed, false alike: {alike:.2%}; light moves the median row by ", end="")
    print(f"{np.nanmedian(deviation):.3f} sigma, {within:.1%} by at most {goal.depth:g}", flush=True)
    depth = abs(robust - 1.0) <= DEPTH and abs(sigma - 1.0) <= DEPTH and abs(bias) <= DEPTH
    return depth and alike >= ROWS and within >= MOVED


def measured(frame: blazer.RenderedFrame, seed: int) -> tuple[blazer.PointErrors, np.ndarray]:
    """Errors in depth, and the kind of each row, with one seed's noise."""
    line = blazer.extract(blazer.develop(frame, seed=seed))
    return blazer.compare(blazer.triangulate(line), frame), kinds(line, frame)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("templates", nargs="*", default=["weld_seam", "v_groove"])
    parser.add_argument("--scale", type=float, default=0.25)
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--times", type=float, default=16.0)
    given = parser.parse_args()
    found = [proved(template, given.scale, given.seeds, given.times) for template in given.templates]
    return 0 if all(found) else 1


if __name__ == "__main__":
    sys.exit(main())
