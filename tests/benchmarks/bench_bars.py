"""The rows of the bars in turn, each in a process of its own: seconds on the clock and of the processor, and memory.

    python tests/benchmarks/bench_bars.py [ROW ...]      default: all; the names are those of ROWS

Frames are whole: all light to a depth of a tenth of its sigma, truth, image, line and points, with warm kernels. Long
rows are shown by their own benchmarks' last lines. Nothing here passes or fails; the machine should do nothing else.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))


@dataclass(frozen=True)
class Row:
    """A command of this Python, what is asked of it, and how many of its last lines tell."""

    command: tuple[str, ...]
    bar: str
    lines: int = 1
    environment: str = ""
    """A variable that names an empty folder."""


THIS = "tests/benchmarks/bench_bars.py"
ROWS = {
    "sample": Row((THIS, "--frame", "weld_seam"), "3 s, 1.2 GB"),
    "shiny": Row((THIS, "--frame", "shiny_weld_seam"), "3 s"),
    "groove": Row((THIS, "--frame", "v_groove"), "1 s"),
    "ball": Row((THIS, "--frame", "glass_ball"), "5 s"),
    "scan": Row((THIS, "--scan", "scan"), "15 s"),
    "kernels": Row(("-m", "studio.scan.kernel_warm_up", "all"), "30 s", 0, "NUMBA_CACHE_DIR"),
    "window": Row(("tests/benchmarks/bench_start.py", "3"), "15 s after a first start", 3),
    "profiles": Row(("tests/benchmarks/bench_profiles.py",), "1000 in 240 s, flat memory", 3),
    "ambient": Row(("tests/benchmarks/bench_ambient.py",), "40 s"),
    "roofline": Row(("tests/benchmarks/bench_roofline.py",), "two threads 1.8 x one", 22),
    "peers": Row(("tests/benchmarks/bench_peers.py", "--bars"), "15, 40, 100, 30 times", 12),
}


def main() -> None:
    if sys.argv[1:2] == ["--frame"]:
        return frame(sys.argv[2])
    if sys.argv[1:2] == ["--scan"]:
        return scan(sys.argv[2])
    unknown = set(sys.argv[1:]) - ROWS.keys()
    if unknown:
        sys.exit(f"rows: {', '.join(ROWS)}; not {', '.join(sorted(unknown))}")
    print(f"{'row':<10}{'clock':>9}{'processor':>11}   bar", flush=True)
    for name in sys.argv[1:] or ROWS:
        run(name, ROWS[name])


def run(name: str, row: Row) -> None:
    """One row: seconds of the whole command, and what it says."""
    with tempfile.TemporaryDirectory() as folder:
        more = {row.environment: folder} if row.environment else {}
        began, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run(
            [sys.executable, *row.command], cwd=ROOT, env={**os.environ, **more}, capture_output=True, text=True
        )
        seconds, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    busy = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    load = f"load {os.getloadavg()[0]:.1f}"
    print(f"{name:<10}{seconds:8.1f} s{busy:9.1f} s   {row.bar} ({load}; with loading)")
    said = (done.stdout if done.stdout.strip() else done.stderr).strip().splitlines()
    for line in said[-row.lines :] if row.lines else []:
        print(f"    {line}")
    sys.stdout.flush()


def frame(template: str) -> None:
    import studio as blazer

    project = blazer.Project.load(template)
    for scale in (0.1, 1.0):  # the first loads the kernels
        began, spent = time.perf_counter(), time.process_time()
        rendered = blazer.render(project, image_scale=scale)
        errors = blazer.compare(blazer.triangulate(blazer.extract(blazer.develop(rendered))), rendered)
        seconds, busy = time.perf_counter() - began, time.process_time() - spent
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    print(
        f"{seconds:.1f} s on the clock, {busy:.1f} of the processor, {memory:.2f} GB; {errors.depth_z.count} points, "
        f"robust sigma {errors.depth_z.robust_sigma * 1e6:.2f} um"
    )


def scan(template: str) -> None:
    import studio as blazer
    from studio.scan.options import ScanOptions
    from studio.scan.scan import run_scan

    project = blazer.Project.load(template)
    with tempfile.TemporaryDirectory() as name:
        run_scan(project, project.folder, out=Path(name) / "warm", options=ScanOptions(steps=1, report=False))
        began, spent = time.perf_counter(), time.process_time()
        run_scan(project, project.folder, out=Path(name) / "out", options=ScanOptions())
        print(
            f"{time.perf_counter() - began:.1f} s on the clock, {time.process_time() - spent:.1f} of this process, "
            "with files and report"
        )


if __name__ == "__main__":
    main()
