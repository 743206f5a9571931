"""Error against time beside Mitsuba 3 and LuxCore, in one run on two processors, over the scenes of `peers/scenes.py`.

Each engine runs in a process of its own with two threads; counted are its processor seconds divided by two, without
loading and compiling. Energy is compared first, then the line's position, then noise: WRONG marks an image that is too
bright or too dark by 2 % or lies 0.1 px beside. Prints the seconds each would need to the bars of `peers/bars.py`, and
writes a chart and a table of all points to a folder.

`make validate` installs the engines. Nothing here passes or fails.
"""

from __future__ import annotations

import argparse
import csv
import importlib.util
import os
import platform
from pathlib import Path

import numpy as np
from peers import engines, measure, scenes
from peers.bars import BARS
from peers.chart import draw
from peers.references import reference

FULL, QUICK = [0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0], [0.5, 1.0, 2.0]
FIELDS = ("scene", "engine", "run", "seconds", "pixels", "error", "energy", "shift_px", "shift_v_px")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="short budgets, one run of each")
    parser.add_argument("--only", nargs="*", choices=scenes.NAMES, default=list(scenes.NAMES), metavar="SCENE")
    parser.add_argument("--engines", nargs="*", default=[], metavar="NAME", help="starts of their names")
    parser.add_argument("--budgets", nargs="*", type=float, help="seconds")
    parser.add_argument("--runs", type=int, help="of each engine, with seeds of their own")
    parser.add_argument("--folder", type=Path, default=Path("benchmark-output/peers"), help="for the results")
    options = parser.parse_args()
    budgets = options.budgets or (QUICK if options.quick else FULL)
    runs = options.runs or (1 if options.quick else 3)
    chosen = [e for e in engines.ENGINES if not options.engines or any(e.startswith(s) for s in options.engines)]
    for package, start in (("mitsuba", "mitsuba"), ("pyluxcore", "luxcore")):
        if importlib.util.find_spec(package) is None:
            print(f"{package} is not installed (make validate installs it): left out")
            chosen = [e for e in chosen if not e.startswith(start)]
    print(
        f"{platform.machine()}, {os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}; "
        f"budgets {budgets} s, {runs} runs"
    )
    rows: list[dict] = []
    for scene in options.only:
        known = reference(scene)
        if known is None:
            print(f"{scene}: no reference image, left out")
            continue
        sets = {"line": known.line} | ({"reflection": known.reflection} if known.reflection is not None else {})
        print(
            f"\n{scene}: {scenes.setting(scene).title}; " + ", ".join(f"{k} {int(p.sum())} px" for k, p in sets.items())
        )
        for engine in chosen:
            mine = []
            for seed in range(runs):
                shots, trouble = engines.run(engine, scene, budgets, seed)
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
    # a line says nothing of where it lies along itself
    place = (best["shift_px"],) if pixels == "line" else (best["shift_px"], best["shift_v_px"])
    wrong = "" if abs(best["energy"] - 1) < 0.02 and max(map(abs, place)) < 0.1 else "   WRONG"
    moved = " ".join(f"{p:+.4f}" for p in place)
    runs = [r for r in rows if r["run"] == rows[0]["run"]]
    errors = " ".join(f"{r['error']:.2%}@{r['seconds']:.3g}s" for r in runs)
    print(
        f"  {engine:<24} {pixels:<10} energy {best['energy']:.4f}  shift {moved} px  {errors}{wrong}",
        flush=True,
    )


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
        peers = {e: s for e, s in found.items() if e.startswith(bar.only) and e != engines.OURS and s.reached}
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


def write(rows: list[dict], folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "peers.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, FIELDS)
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
