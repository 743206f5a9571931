"""Error against time beside Mitsuba 3, LuxCore and Cycles, in one run on two processors.

The scenes are those of `peers/scenes.py`. Each engine runs in a process of its own with two threads; counted are its
processor seconds divided by two, without loading and compiling. Energy is compared first, then the line's position,
then noise: WRONG marks an image that is too bright or too dark by 2 % or lies 0.1 px beside. Prints the seconds each
would need to the bars of `peers/bars.py`, and writes a chart and a table of all points to a folder. What is off by 5 %
or 0.1 px does not count as a peer.

    --bars      only the reflections' bars, beside the engines that come near to them: some five minutes

`make validate` installs Mitsuba and LuxCore. Cycles wants another numpy: give the Python of an environment that has it.

    python3.11 -m venv cycles && cycles/bin/pip install bpy==5.0.1
    python tests/benchmarks/bench_peers.py --bars --interpreter cycles=cycles/bin/python

Nothing here passes or fails.
"""

from __future__ import annotations

import argparse
import csv
import os
import platform
import sys
from pathlib import Path

import numpy as np
from peers import engines, measure, scenes
from peers.bars import BARS, QUICK, Bar
from peers.chart import draw
from peers.references import reference

FULL, SHORT, NEAR = [0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0], [0.5, 1.0, 2.0], [1.0, 2.0, 4.0, 8.0]
OURS_NEAR, OURS_RUNS = [2.0], 3
ENERGY, COUNTS, PLACE = 0.02, 0.05, 0.1
"""Share of the light by which an image may be off, by which it may be and still count as a peer, and px."""
FIELDS = ("scene", "engine", "run", "seconds", "pixels", "error", "energy", "shift_px", "shift_v_px")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="short budgets, one run of each")
    parser.add_argument("--bars", action="store_true", help="the reflections' bars, in minutes")
    parser.add_argument("--interpreter", nargs="*", default=[], metavar="ENGINE=PYTHON", help="that has an engine")
    parser.add_argument("--only", nargs="*", choices=scenes.NAMES, default=list(scenes.NAMES), metavar="SCENE")
    parser.add_argument("--engines", nargs="*", default=[], metavar="NAME", help="starts of their names")
    parser.add_argument("--budgets", nargs="*", type=float, help="seconds")
    parser.add_argument("--runs", type=int, help="of each engine, with seeds of their own")
    parser.add_argument("--folder", type=Path, default=Path("benchmark-output/peers"), help="for the results")
    options = parser.parse_args()
    budgets = options.budgets or (NEAR if options.bars else SHORT if options.quick else FULL)
    runs = options.runs or (1 if options.quick or options.bars else 3)
    chosen = [e for e in engines.ENGINES if not options.engines or any(e.startswith(s) for s in options.engines)]
    pythons = dict(one.split("=", 1) for one in options.interpreter)
    python = {e: next((p for start, p in pythons.items() if e.startswith(start)), sys.executable) for e in chosen}
    for start in ("mitsuba", "luxcore", "cycles"):
        mine = [e for e in chosen if e.startswith(start)]
        if mine and not engines.installed(mine[0], python[mine[0]]):
            print(f"{start.capitalize()} not installed: left out")
            chosen = [e for e in chosen if e not in mine]
    print(
        f"{platform.machine()}, {os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}; "
        f"budgets {budgets} s, {runs} runs"
    )
    rows: list[dict] = []
    for scene in (s for s in options.only if not options.bars or s in QUICK):
        known = reference(scene)
        if known is None:
            print(f"{scene}: no reference image, left out")
            continue
        sets = {"line": known.line} | ({"reflection": known.reflection} if known.reflection is not None else {})
        print(
            f"\n{scene}: {scenes.setting(scene).title}; " + ", ".join(f"{k} {int(p.sum())} px" for k, p in sets.items())
        )
        for engine in (e for e in chosen if not options.bars or e.startswith(QUICK[scene])):
            mine = []
            ours = options.bars and engine == engines.OURS
            for seed in range(OURS_RUNS if ours else runs):
                shots, trouble = engines.run(engine, scene, OURS_NEAR if ours else budgets, seed, python[engine])
                if trouble:
                    print(f"  {engine}: {trouble}; {len(shots)} images before that")
                for shot in shots:
                    for name, pixels in sets.items():
                        row = {"scene": scene, "engine": engine, "run": seed, "seconds": shot.seconds, "pixels": name}
                        row["error"] = measure.relative_error(shot.image, known.image, pixels)
                        row["energy"] = measure.energy(shot.image, known.image, pixels)
                        row["shift_px"] = measure.shift(shot.image, known.image, pixels)
                        row["shift_v_px"] = measure.shift(shot.image.T, known.image.T, pixels.T)
                        mine.append(row)
            rows += mine
            for name in sets:
                tell(engine, name, [r for r in mine if r["pixels"] == name])
            # a long run that is broken off leaves what it has
            write(rows, options.folder)
    if not rows:
        return
    for path in (options.folder / "peers.csv", *draw(rows, options.folder)):
        print(f"wrote {path}")
    table(rows)


def tell(engine: str, pixels: str, rows: list[dict]) -> None:
    """Energy and position of the longest run, and the error at each time."""
    if not rows:
        return
    best = min(rows, key=lambda r: r["error"])
    wrong = "   WRONG" if is_wrong(rows) else ""
    moved = " ".join(f"{p:+.4f}" for p in place_of(best))
    runs = [r for r in rows if r["run"] == rows[0]["run"]]
    errors = " ".join(f"{r['error']:.2%}@{r['seconds']:.3g}s" for r in runs)
    print(
        f"  {engine:<24} {pixels:<10} energy {best['energy']:.4f}  shift {moved} px  {errors}{wrong}",
        flush=True,
    )


def place_of(row: dict) -> tuple[float, ...]:
    """How far the image lies beside the reference, px: a line says nothing of where it lies along itself."""
    return (row["shift_px"],) if row["pixels"] == "line" else (row["shift_px"], row["shift_v_px"])


def is_wrong(rows: list[dict], energy: float = ENERGY) -> bool:
    """The best image of an engine is not the reference's: too much or too little light, or beside its place."""
    best = min(rows, key=lambda r: r["error"])
    return abs(best["energy"] - 1) >= energy or max(map(abs, place_of(best))) >= PLACE


def seconds(rows: list[dict], scene: str, engine: str, pixels: str, error: float) -> measure.Seconds:
    mine = [r for r in rows if (r["scene"], r["engine"], r["pixels"]) == (scene, engine, pixels)]
    return measure.seconds_to(error, np.array([r["seconds"] for r in mine]), np.array([r["error"] for r in mine]))


def table(rows: list[dict]) -> None:
    """Seconds to each bar, and how many times sooner ours is than the best peer."""
    print('\nseconds to a bar; "<": met at the shortest time, "~": extrapolated as 1 / sqrt(t)')
    for bar in BARS:
        if not any((r["scene"], r["pixels"]) == (bar.scene, bar.pixels) for r in rows):
            continue
        found = {e: seconds(rows, bar.scene, e, bar.pixels, bar.error) for e in engines.ENGINES}
        found = {e: s for e, s in found.items() if any((r["scene"], r["engine"]) == (bar.scene, e) for r in rows)}
        print(f"{bar.scene} {bar.pixels} to {bar.error:.1%}: " + "; ".join(f"{e} {s}" for e, s in found.items()))
        ours = found.get(engines.OURS)
        peers = {e: s for e, s in found.items() if e != engines.OURS and s.reached and not wrong(rows, bar, e)}
        if ours is None or not peers:
            continue
        best = min(peers, key=lambda e: peers[e].value)
        if not ours.reached:
            print(f"    ours does not get there ({ours}); best peer {best}")
            continue
        ratio = peers[best].value / ours.value
        at_least = {"<": "at least ", "~": "about "}.get(ours.kind or peers[best].kind, "")
        verdict = "met" if ratio >= bar.ratio else f"missed by {bar.ratio / ratio:.1f}"
        print(f"    {at_least}{ratio:.1f} times sooner than {best}; bar {bar.ratio:g}: {verdict}")


def wrong(rows: list[dict], bar: Bar, engine: str) -> bool:
    mine = [r for r in rows if (r["scene"], r["engine"], r["pixels"]) == (bar.scene, engine, bar.pixels)]
    return is_wrong(mine, COUNTS)


def write(rows: list[dict], folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "peers.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, FIELDS)
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
