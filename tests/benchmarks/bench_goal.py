"""What a goal in depth saves beside the errors of the image: seconds, light paths, and the measured depth of both.

    python tests/benchmarks/bench_goal.py [template] [scale]      default: weld_seam 1

Bar of the sample at full size: 3 s for the whole frame with truth and points; sigma and bias as those of the image.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import studio as blazer


def main() -> None:
    template = sys.argv[1] if len(sys.argv) > 1 else "weld_seam"
    scale = float(sys.argv[2]) if len(sys.argv) > 2 else 1.0
    project = blazer.Project.load(template)
    seconds = {}
    for name, goal in (("depth 0.1", {"depth": 0.1}), ("image", None)):
        asked = project.replaced({"render.goal": goal})
        measured(asked, 0.1)  # loads the kernels
        began, spent = time.perf_counter(), time.process_time()
        frame, errors = measured(asked, scale)
        seconds[name] = time.perf_counter() - began
        print(
            f"{name}: {seconds[name]:.1f} s, {time.process_time() - spent:.1f} processor s; depth sigma "
            f"{errors.depth_z.sigma * 1e6:.2f} um, robust {errors.depth_z.robust_sigma * 1e6:.2f}, "
            f"bias {errors.depth_z.bias * 1e6:+.2f} um, {errors.depth_z.count} points"
        )
        for one in frame.quality:
            known = f"{one.error:.2g} of sigma" if one.of == "line" else f"{one.error:.2%}"
            print(f"    {one.group}: {known}, {one.work:.3g} {one.unit}")
    print(f"image over depth: {seconds['image'] / seconds['depth 0.1']:.1f}")


def measured(project: blazer.Project, scale: float) -> tuple[blazer.RenderedFrame, blazer.PointErrors]:
    frame = blazer.render(project, image_scale=scale)
    return frame, blazer.compare(blazer.triangulate(blazer.extract(blazer.develop(frame))), frame)


if __name__ == "__main__":
    main()
