"""Profiles a second of a long scan that keeps no frame: 2048 rows on a rough part, all light, goal in depth, as a run.

    python tests/benchmarks/bench_profiles.py [frames]      default: 1000

Bar: 1,000 profiles in 4 minutes, and memory from the first tenth on within 5 %. The sensor is read in a region of
interest of 256 columns, as scanners do; the part is steel of roughness 0.4 in steps, on a grey table, under a lamp.
"""

from __future__ import annotations

import sys
import tempfile
import threading
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import studio as blazer
from studio.scan.options import ScanOptions
from studio.scan.scan import run_scan

BAR_SECONDS, BAR = 240.0, 0.05
ROWS, COLUMNS = 2048, 256


def part(frames: int) -> blazer.Project:
    """The step block of rough steel, passed by the rig."""
    project = blazer.Project.load("step_block")
    camera = {"width": COLUMNS, "height": ROWS, "cx": 0.5 * (COLUMNS - 1), "cy": 0.5 * (ROWS - 1)}
    steel = {"kind": "conductor", "metal": "steel", "roughness": 0.4}
    motion = {"kind": "linear", "moves": "rig", "step": (2e-5, 0.0, 0.0), "steps": frames}
    changes = {f"scene.rig.camera.{name}": value for name, value in camera.items()}
    return project.replaced({**changes, "scene.objects[1].material": steel, "scene.motion": motion})


def memory() -> float:
    """MB that the process holds now."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096 / 1e6


def main() -> int:
    frames = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    project, held, over = part(frames), [], threading.Event()

    def watch() -> None:
        while not over.wait(0.5):
            held.append(memory())

    with tempfile.TemporaryDirectory() as name:
        warm = Path(name) / "warm"
        run_scan(project, project.folder, out=warm, options=ScanOptions(frames="none", steps=2, report=False))
        watcher = threading.Thread(target=watch)
        watcher.start()
        began, spent = time.perf_counter(), time.process_time()
        options = ScanOptions(frames="none", report=False)
        result = run_scan(project, project.folder, out=Path(name) / "out", options=options)
        seconds, processor = time.perf_counter() - began, time.process_time() - spent
        over.set()
        watcher.join()
    tenth, last = max(held[: len(held) // 10 + 1]), max(held)
    stages = {stage: spent for stage, spent in result.manifest["seconds"].items() if spent > 0.02 * seconds}
    print(f"{frames} profiles: {seconds:.1f} s, {processor:.1f} processor s, {frames / seconds:.2f} a second")
    print("    " + ", ".join(f"{stage} {spent:.1f} s" for stage, spent in stages.items()))
    when = held.index(last) / len(held)
    print(f"memory in the first tenth {tenth:.0f} MB, at most {last:.0f} MB, at {when:.0%} of the time")
    return 0 if seconds <= BAR_SECONDS * frames / 1000 and last <= (1.0 + BAR) * tenth else 1


if __name__ == "__main__":
    sys.exit(main())
