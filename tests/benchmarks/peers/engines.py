"""The engines that are compared, each run in a process of its own, so that one that aborts loses only itself."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

OURS = "ours"
BENCHMARKS = Path(__file__).parents[1]
ENGINES = {
    OURS: ("peers.ours",),
    "mitsuba ptracer, LLVM": ("peers.mitsuba_run", "llvm_ad_rgb", "ptracer"),
    "mitsuba ptracer, scalar": ("peers.mitsuba_run", "scalar_rgb", "ptracer"),
    "mitsuba ptracer, aimed": ("peers.mitsuba_run", "llvm_ad_rgb", "ptracer", "aimed"),
    "mitsuba path, LLVM": ("peers.mitsuba_run", "llvm_ad_rgb", "path"),
    "luxcore light": ("peers.luxcore_run", "light"),
    "luxcore path": ("peers.luxcore_run", "path"),
    "luxcore bidir, halved": ("peers.luxcore_run", "bidir"),
    "luxcore hybrid": ("peers.luxcore_run", "hybrid"),
    "luxcore caches": ("peers.luxcore_run", "caches"),
    "cycles path": ("peers.cycles_run", "path"),
    "cycles guided": ("peers.cycles_run", "guided"),
}
PACKAGES = {"mitsuba": "mitsuba", "luxcore": "pyluxcore", "cycles": "bpy"}
"""What an engine is installed as, by the start of its name."""
GRACE = 600.0
"""Seconds a process may take beside its longest budget: loading, compiling, and a machine that does other things."""


@dataclass(frozen=True)
class Shot:
    """One image of one engine, and the processor seconds / 2 that it took."""

    seconds: float
    image: np.ndarray
    more: dict


def installed(engine: str, python: str) -> bool:
    """Whether this interpreter has the engine's package."""
    package = next((name for start, name in PACKAGES.items() if engine.startswith(start)), None)
    if package is None:
        return True
    asked = f"import importlib.util, sys; sys.exit(importlib.util.find_spec({package!r}) is None)"
    return subprocess.run([python, "-c", asked]).returncode == 0


def run(
    engine: str, scene: str, budgets: list[float], seed: int, python: str = sys.executable
) -> tuple[list[Shot], str]:
    """All images that the engine made before it ended, and what went wrong ("" if nothing did).

    python: the interpreter that has it.
    """
    module, *mode = ENGINES[engine]
    folder = Path(tempfile.mkdtemp(prefix="peers-"))
    command = [python, "-m", module, scene, *mode, str(seed), str(folder), *map(str, budgets)]
    root = BENCHMARKS.parents[1]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(root), str(BENCHMARKS)])}
    trouble = ""
    try:
        # processor seconds are counted over two threads: on a busy machine the clock on the wall runs faster
        limit = GRACE + 8.0 * budgets[-1]
        done = subprocess.run(command, env=environment, cwd=BENCHMARKS, capture_output=True, text=True, timeout=limit)
        if done.returncode:
            lines = [line for line in done.stderr.strip().splitlines() if line.strip()]
            trouble = f"ended with {done.returncode}" + (f": {lines[-1]}" if lines else "")
    except subprocess.TimeoutExpired:
        trouble = f"stopped after {limit:.0f} s"
    try:
        shots = []
        for path in sorted(folder.glob("*.json"), key=lambda p: int(p.stem)):
            more = json.loads(path.read_text())
            image = np.load(path.with_suffix(".npy")).astype(np.float64)
            shots.append(Shot(more.pop("seconds"), image, more))
        return shots, trouble
    finally:
        shutil.rmtree(folder)
