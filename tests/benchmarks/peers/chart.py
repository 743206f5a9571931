"""Error against time, log-log, one panel for each scene and set of pixels that a bar is set for."""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from peers.bars import BARS
from peers.engines import ENGINES, OURS

TITLES = {
    ("s1", "line"): "s1: line on a Lambertian plane",
    ("s2", "line"): "s2: tee weld, all lit pixels",
    ("s2", "reflection"): "s2: tee weld, reflections",
    ("s2-shiny", "reflection"): "tee weld, alpha 0.03: reflections",
    ("s3", "reflection"): "s3: caustic of the glass ball",
    ("s4", "reflection"): "caustic behind a glass plate",
    ("channel", "reflection"): "channel of copper: reflections",
    ("rocker", "reflection"): "trough of chromium: reflections",
}
# colour-blind safe (Okabe and Ito 2008); ours in black
COLOURS = ("#000000", "#0072B2", "#56B4E9", "#882255", "#009E73", "#D55E00", "#E69F00", "#CC79A7", "#999999")
COLOURS += ("#44AA99", "#6699CC", "#AA4466")
MARKERS = ("o", "s", "D", "P", "^", "v", "<", ">", "x", "*", "p", "h")


def draw(rows: list[dict], folder: Path) -> list[Path]:
    """rows: scene, pixels, engine, seconds, error. Writes peers.svg and peers.png; returns them."""
    panels = [key for key in TITLES if any((r["scene"], r["pixels"]) == key for r in rows)]
    across = min(3, len(panels))
    down = -(-len(panels) // across)
    figure, axes = plt.subplots(down, across, figsize=(4.2 * across, 3.4 * down), squeeze=False, layout="constrained")
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
        axis.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{100 * y:g} %"))
        axis.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
        for labels in (axis.xaxis, axis.yaxis):
            # a short axis needs names between the powers of ten
            labels.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if spans_little(labels) else (1.0,)))
            labels.set_minor_formatter(NullFormatter())
        axis.tick_params(labelsize=8)
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


def spans_little(axis) -> bool:
    low, high = axis.get_view_interval()
    return bool(high < 100 * low)
