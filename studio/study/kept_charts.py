"""The paper's own figures: a line in three panels (positions, depths, depth errors), and images side by side."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from analysis.measures import robust_sigma
from analysis.report.colour import MUTED, TRUTH, method_name
from analysis.report.style import WIDTH, figure
from studio.study.answers import Answer
from studio.study.kept import picture_pixels
from studio.study.measures import measure_of
from studio.study.study import Value

SERIES = ("#d55e00", "#0b6e8a", "#8a5aa8", "#009e73", "#b58900", "#3d5a80")
"""Of cells, and of series by one method, which has but one colour."""
MARKS = "x+1|_."
MOST = len(SERIES)
REACH = 8.0
"""Robust sigmas of the errors that their panel shows; the others stand at its edges."""
ROOM = 0.2
"""Of the truth's own extent, shown on either side of it."""
Shown = Callable[[Value], str]


def profile_figure(answer: Answer, shown: Shown) -> Any:
    """The line's positions, its depths and their errors, along the scan lines, with the truth."""
    with figure(3.6) as made:
        panels = made.subplots(1, 3, sharey=True)
        several = len({one.point for one in answer.kept}) > 1
        far = _reach([one.content["error"] for one in answer.kept])
        for number, one in enumerate(answer.kept[:MOST]):
            found = one.content
            error = 1e6 * np.array(found["error"], dtype=np.float64)  # nothing becomes NaN
            if number == 0:
                for axes, name, scale in ((panels[0], "true_position", 1.0), (panels[1], "true_depth", 1e3)):
                    true = scale * np.array(found[name])
                    label = "truth" if axes is panels[0] else None
                    axes.plot(true, found["true_line"], "o", ms=3.5, mew=0, color=TRUTH, alpha=0.6, label=label)
                    if len(true):
                        room = ROOM * max(float(np.ptp(true)), 1e-6)
                        axes.set_xlim(true.min() - room, true.max() + room)
            words = [method_name(one.method), *(map(shown, one.point) if several else ())]
            known = np.abs(error[np.isfinite(error)])
            words.append(f"{np.mean(known > far):.1%} at the edges on the right" if len(known) else "nothing measured")
            style: dict[str, Any] = {"marker": MARKS[number], "ms": 2.5, "mew": 0.6, "ls": "", "color": SERIES[number]}
            panels[0].plot(found["position"], found["line"], **style, label=", ".join(words))
            panels[1].plot(1e3 * np.array(found["depth"]), found["line"], **style)
            panels[2].plot(np.clip(error, -far, far), found["line"], **style)
        panels[2].axvline(0.0, color=MUTED, lw=0.6)
        panels[2].set_xlim(-1.05 * far, 1.05 * far)
        panels[0].invert_yaxis()
        panels[0].set(xlabel="line (px)", ylabel="image row", title="Line found")
        panels[1].set(xlabel="depth (mm)", title="Depth")
        panels[2].set(xlabel="depth error (µm)", title="Less the truth")
        if answer.kept:
            made.legend(loc="outside lower center", ncols=4, markerscale=2.0)
        return made


def _reach(errors: list[list[float | None]]) -> float:
    """µm to either side that show how precise the most precise one is."""
    found = [1e6 * np.array(one, dtype=np.float64) for one in errors]
    spreads = [robust_sigma(one[np.isfinite(one)]) for one in found if np.isfinite(one).any()]
    return max(REACH * min(spreads, default=1.0), 1e-3)


def pictures_figure(answer: Answer, shown: Shown) -> Any:
    """The image of each point by the first method, with what the chart measures below it."""
    kept = [one for one in answer.kept if one.method == answer.kept[0].method][:MOST]
    images = [picture_pixels(one.content) for one in kept]
    tall = max((image.shape[0] / image.shape[1] for image in images), default=0.6)
    with figure(0.7 + tall * WIDTH / max(len(images), 1)) as made:
        panels = np.atleast_1d(made.subplots(1, max(len(images), 1)))
        measure = measure_of(answer.sweep.measure)
        by_place = {(spot.point, spot.method): spot for spot in answer.spots}
        for axes, one, image in zip(panels, kept, images, strict=False):
            spot = by_place[one.point, one.method]
            axes.imshow(image, cmap="gray", vmin=0, vmax=255, interpolation="antialiased")
            value = f"{spot.measure.mean * measure.scale:.3g} {measure.unit}".rstrip()
            axes.set_title(", ".join(map(shown, one.point)))
            axes.set_xlabel(f"{measure.label} {value}\n{spot.seconds:.2g} s a frame", fontsize=6.3)
        for axes in panels:
            axes.set(xticks=[], yticks=[])
            axes.grid(visible=False)
        return made
