"""Error against time, one panel for each scene and set of pixels, log-log."""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from peers.bars import BARS
from peers.engines import ENGINES, OURS

TITLES = {
    ("s1", "line"): "s1: line on a Lambertian plane",
    ("s2", "line"): "s2: tee weld, all lit pixels",
    ("s2", "reflection"): "s2: tee weld, reflections",
    ("s2-shiny", "line"): "tee weld, alpha 0.03: all lit pixels",
    ("s2-shiny", "reflection"): "tee weld, alpha 0.03: reflections",
    ("s3", "line"): "s3: glass ball, all lit pixels",
    ("s3", "reflection"): "s3: caustic of the glass ball",
    ("s4", "line"): "behind a glass plate: all lit pixels",
    ("s4", "reflection"): "caustic behind a glass plate",
}
# colour-blind safe (Okabe and Ito 2008); ours in black
COLOURS = ("#000000", "#0072B2", "#56B4E9", "#009E73", "#D55E00", "#E69F00", "#CC79A7", "#999999")
MARKERS = ("o", "s", "D", "^", "v", "<", ">", "x")


def draw(rows: list[dict], folder: Path) -> list[Path]:
    """rows: scene, pixels, engine, seconds, error. Writes peers.svg and peers.png; returns them."""
    panels = [key for key in TITLES if any((r["scene"], r["pixels"]) == key for r in rows)]
    across = min(2, len(panels))
    down = -(-len(panels) // across)
    figure, axes = plt.subplots(down, across, figsize=(5.6 * across, 3.9 * down), squeeze=False, layout="constrained")
    handles = {}
    for axis, key in zip(axes.ravel(), panels, strict=False):
        scene, pixels = key
        for engine, colour, marker in zip(ENGINES, COLOURS, MARKERS, strict=True):
            mine = sorted(
                (r["seconds"], r["error"])
                for r in rows
                if (r["scene"], r["pixels"], r["engine"]) == (scene, pixels, engine)
            )
            if not mine:
                continue
            heavy = {"linewidth": 2.0, "zorder": 3} if engine == OURS else {"linewidth": 1.0}
            (handles[engine],) = axis.loglog(*zip(*mine, strict=True), color=colour, marker=marker, ms=4, **heavy)
        for bar in BARS:
            if (bar.scene, bar.pixels) == key:
                axis.axhline(bar.error, color="0.6", linewidth=0.8, linestyle="--", zorder=0)
                axis.text(
                    0.99,
                    bar.error,
                    f"{bar.error:.1%}",
                    transform=axis.get_yaxis_transform(),
                    ha="right",
                    va="bottom",
                    fontsize=8,
                    color="0.4",
                )
        axis.set_title(TITLES[key], fontsize=10)
        axis.set_xlabel("processor seconds / 2")
        axis.set_ylabel("relative RMS error")
        axis.grid(True, which="both", linewidth=0.3, alpha=0.6)
    for axis in axes.ravel()[len(panels) :]:
        axis.axis("off")
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=4, fontsize=8, frameon=False)
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / "peers.svg", folder / "peers.png"]
    for path in paths:
        figure.savefig(path, dpi=130)
    plt.close(figure)
    return paths
