"""The charts of a study: every mark a mean with its 95 % interval, told apart in colour and in black and white."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter, NullLocator

from analysis.report.colour import INK, MUTED, PAPER, method_colour, method_name
from analysis.report.labels import Name, name_marks
from analysis.report.style import WIDTH, figure
from studio.study.answers import Answer, Spot
from studio.study.boundary_chart import DASHES, draw_edges
from studio.study.bounds import Bound
from studio.study.budget_chart import budget_figure
from studio.study.kept import KEPT
from studio.study.kept_charts import SERIES, pictures_figure, profile_figure
from studio.study.measures import Measure, measure_of
from studio.study.ray_units import MILLION, Throughput
from studio.study.study import Parameter, Value

MARKERS = "osD^vP*X<>"
KNEE = 12.0
"""Diameter of its ring, in points."""
MOST_IN_LEGEND = 5
"""Methods; more are named at their marks."""


def chart(answer: Answer, labels: dict[str, str], size: tuple[float, float] = (WIDTH, 3.4)) -> Any:
    """A matplotlib figure of one sweep. labels: of the fields, with their units; size: width and height, inches, for
    which names of marks find their places.
    """
    if answer.sweep.chart == "budget":
        return budget_figure(answer.budgets[0])
    if answer.sweep.chart in KEPT:
        return (profile_figure if answer.sweep.chart == "profile" else pictures_figure)(answer, shown)
    draw = {"sweep": _sweep, "speed": _speed, "map": _boundary if answer.edges else _map}[answer.sweep.chart]
    with figure(size[1], size[0]) as made:
        axes = made.subplots()
        draw(axes, answer, labels)
        made.supxlabel(_repeats(answer), x=0.99, ha="right", fontsize=6.0, color=MUTED, wrap=True)
        for axis in (axes.xaxis, axes.yaxis):
            if axis.get_scale() == "log":  # matplotlib's own ticks are formulas
                low, high = axis.get_view_interval()
                if high < 5.0 * low:  # less than two of them may lie between
                    axis.set_major_locator(MaxNLocator(6, steps=(1, 2, 5, 10)))
                    axis.set_minor_locator(NullLocator())
                elif high < 100.0 * low:
                    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
                axis.set_major_formatter(_tick)
                axis.set_minor_formatter(NullFormatter())
        if answer.sweep.chart == "speed":
            _name_spots(axes, answer)
        return made


def _repeats(answer: Answer) -> str:
    """How many repeats stand behind a mark, and what its bar is."""
    counts = [spot.measure.count for spot in answer.spots]
    low, high = min(counts, default=0), max(counts, default=0)
    number = f"N = {high}" if low == high else f"N = {low} to {high}"
    if high == 1:
        return f"{number}: no interval is known of a single repeat{_at_scale(answer)}"
    shown_as = {"map": "bands: 95 % intervals" if answer.edges else "means"}
    return f"{number} repeats, {shown_as.get(answer.sweep.chart, 'bars: 95 % intervals')}{_at_scale(answer)}"


def _at_scale(answer: Answer) -> str:
    """That the figures are not the scanner's, where its image was another one."""
    scale = answer.image_scale
    return "" if scale == 1.0 else f"; measured at image scale {scale:.3g}: not the scanner's own figures"


def places(answer: Answer) -> np.ndarray:
    """(spots, 2) where each spot stands in the chart's own units; NaN: it is not drawn."""
    sweep, scale, spots = answer.sweep, measure_of(answer.sweep.measure).scale, answer.spots
    if sweep.chart in KEPT:
        return np.full((len(spots), 2), math.nan)
    if sweep.chart == "map":
        found = [(*spot.point, spot.method == spots[0].method) for spot in spots]
        return np.array([(x, y) if drawn else (math.nan, math.nan) for x, y, drawn in found], dtype=np.float64)
    if sweep.chart == "speed":
        x = [spot.seconds if spot.measure.mean > 0.0 else math.nan for spot in spots]
    else:
        x = _along(answer)
    return np.array([(a, spot.measure.mean * scale) for a, spot in zip(x, spots, strict=True)]).reshape(-1, 2)


def _along(answer: Answer) -> list[float]:
    """The first parameter of each spot, as a number; of names, their order."""
    first = [spot.point[0] for spot in answer.spots]
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in first):
        return [float(value) for value in first]  # type: ignore[arg-type]
    names = list(dict.fromkeys(first))
    return [float(names.index(value)) for value in first]


def _tick(value: float, place: object) -> str:
    return f"{value:g}"


def field_label(parameter: Parameter, labels: dict[str, str]) -> str:
    return parameter.label or labels.get(parameter.field, parameter.field)


def shown(value: Value) -> str:
    """A value as text on a chart."""
    if isinstance(value, float) and math.isfinite(value):
        text = f"{value:.3g}"
        return text if "e" not in text else f"{value:.2e}".replace("e-0", "e-").replace("e+0", "e")
    return str(value).replace("_", " ")


def _bands(spots: list[Spot], measure: Measure) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean, lower and upper end of each mark, in the unit shown."""
    rows = np.array([(spot.measure.mean, spot.measure.low, spot.measure.high) for spot in spots]).reshape(-1, 3)
    mean, low, high = rows.T * measure.scale
    return mean, low, high


def _axis_label(measure: Measure) -> str:
    return f"{measure.label} ({measure.unit})" if measure.unit else measure.label


def _sweep(axes: Any, answer: Answer, labels: dict[str, str]) -> None:
    """A measure over the first parameter, a line for each method and each combination of the others."""
    sweep, measure = answer.sweep, measure_of(answer.sweep.measure)
    series: dict[tuple[Any, ...], list[Spot]] = {}
    for spot in answer.spots:
        series.setdefault((spot.method, *spot.point[1:]), []).append(spot)
    numbers = all(
        isinstance(spot.point[0], int | float) and not isinstance(spot.point[0], bool) for spot in answer.spots
    )
    names = list(dict.fromkeys(spot.point[0] for spot in answer.spots))
    for number, (key, spots) in enumerate(series.items()):
        spots = sorted(spots, key=lambda one: one.point[0] if numbers else names.index(one.point[0]))  # type: ignore[arg-type,return-value]
        x = np.array([spot.point[0] if numbers else names.index(spot.point[0]) for spot in spots], dtype=np.float64)
        mean, low, high = _bands(spots, measure)
        others = [f"{field_label(p, labels)} {shown(v)}" for p, v in zip(sweep.vary[1:], key[1:], strict=True)]
        one_method = len({name for name, *_ in series}) == 1 and len(series) > 1
        label = ", ".join(others if one_method else [method_name(key[0]), *others])
        style: dict[str, Any] = {
            "color": SERIES[number % len(SERIES)] if one_method else method_colour(key[0]),
            "marker": MARKERS[number % len(MARKERS)],
            "ls": DASHES[number % len(DASHES)],
            # what lies on what is drawn before shows as a ring around it
            "ms": 4 if number == 0 else 6,
            "mfc": None if number == 0 else "none",
        }
        axes.errorbar(x, mean, yerr=np.abs([mean - low, high - mean]), lw=1.2, capsize=2, label=label, **style)
    if sweep.limit is not None and sweep.limit.measure == sweep.measure:
        height = sweep.limit.value * measure.scale
        axes.axhline(height, color=INK, lw=0.8, ls=(0, (6, 2)))
        style = {"fontsize": 6.0, "color": INK}
        words = f"limit {height:.4g} {measure.unit}".rstrip()
        axes.annotate(words, (0.01, height), (0, 3), axes.get_yaxis_transform(), "offset points", **style)
    _breakdowns(axes, answer)
    for reference, _ in answer.beside:
        value = reference.point[0]
        if reference.measure == sweep.measure and (numbers or value in names):
            place = float(value) if numbers else names.index(value), reference.value * measure.scale  # type: ignore[arg-type]
            axes.plot(*place, "D", ms=6, mfc="none", mec=INK)
            _note(axes, reference.label, place, INK, 6.5, (7, -2))
    if numbers:
        axes.set_xscale("log" if sweep.vary[0].spacing == "logarithmic" else "linear")
    else:
        axes.set_xticks(range(len(names)), [shown(name) for name in names])
    _vertical(axes, answer)
    axes.set(xlabel=field_label(sweep.vary[0], labels), ylabel=_axis_label(measure))
    axes.legend()


def _breakdowns(axes: Any, answer: Answer) -> None:
    """Each method's interval as a bar of its own above the chart, as many break at the same place."""
    above = axes.get_xaxis_transform()
    for row, found in enumerate(one for one in answer.broken if one.breakdown.ending == "found"):
        ended, colour, height = found.breakdown, method_colour(found.method), 1.025 + 0.03 * row
        bar: dict[str, Any] = {"transform": above, "clip_on": False, "color": colour}
        axes.plot([ended.low, ended.high], [height] * 2, lw=2.0, alpha=0.6, solid_capstyle="butt", **bar)
        axes.plot([ended.value], [height], "|", ms=7.0, mew=1.5, **bar)
        axes.axvline(ended.value, color=colour, lw=0.8, ls=":", zorder=0)


def _vertical(axes: Any, answer: Answer) -> None:
    """Logarithmic where errors with their intervals span more than one power of ten."""
    ends = np.array([(one.measure.mean, one.measure.low, one.measure.high) for one in answer.spots]).ravel()
    theirs = [one.value for one, _ in answer.beside if one.measure == answer.sweep.measure]
    positive = np.append(ends[np.isfinite(ends) & (ends > 0.0)], theirs)
    errors = answer.sweep.measure.endswith(("rmse", "sigma", "p95", "angle", "error"))
    if errors and len(positive) and positive.min() > 0.0 and np.ptp(np.log10(positive)) > 1.0:
        axes.set_yscale("log")


def _speed(axes: Any, answer: Answer, labels: dict[str, str]) -> None:
    """Error over seconds on logarithmic axes; what nothing beats is joined, the knee is ringed and named."""
    measure = measure_of(answer.sweep.measure)
    methods = list(dict.fromkeys(spot.method for spot in answer.spots))
    named = len(methods) > MOST_IN_LEGEND
    for number, method in enumerate(methods):
        spots = [spot for spot in answer.spots if spot.method == method and spot.measure.mean > 0.0]
        mean, low, high = _bands(spots, measure)
        low = np.maximum(low, 1e-3 * mean)  # a logarithmic axis has no 0
        style: dict[str, Any] = {"fmt": MARKERS[number % len(MARKERS)], "color": method_colour(method), "ms": 5}
        error = np.abs([mean - low, high - mean])
        axes.errorbar([spot.seconds for spot in spots], mean, yerr=error, capsize=2, label=method_name(method), **style)
    front = answer.front
    if front is not None:
        on = _on_front(answer)
        axes.plot([s.seconds for s in on], [s.measure.mean * measure.scale for s in on], color=INK, lw=0.8, zorder=0)
        if front.knee is not None:
            spot = answer.spots[front.knee]
            axes.plot(spot.seconds, spot.measure.mean * measure.scale, "o", ms=KNEE, mfc="none", mec=INK)
    for bound in answer.bounds:
        _bound(axes, bound, len(answer.bounds) > 1, measure, answer)
    what = {"frame": "frame", "line": "line's extraction", "calibration": "calibration"}[answer.sweep.time]
    axes.set(xscale="log", yscale="log", xlabel=f"processor time of a {what} (s)", ylabel=_axis_label(measure))
    if answer.throughput is not None:
        _rays(axes, answer.throughput, answer.sweep.time == "frame")
    _roomy(axes)
    if not named and len(methods) > 1:
        axes.legend()


def _name_spots(axes: Any, answer: Answer) -> None:
    """The knee's name first, then of every mark what the legend does not tell: its method, its values, or both."""
    scale = measure_of(answer.sweep.measure).scale
    spots = [spot for spot in answer.spots if spot.measure.mean > 0.0 and spot.seconds > 0.0]
    named = len({spot.method for spot in answer.spots}) > MOST_IN_LEGEND
    varied = len({spot.point for spot in answer.spots}) > 1
    places = {id(spot): (spot.seconds, spot.measure.mean * scale) for spot in spots}
    names, front = list[Name](), answer.front
    if front is not None and front.knee is not None:
        sure = f"knee, {front.knee_probability[front.knee]:.0%} sure"
        names.append(Name(sure, places[id(answer.spots[front.knee])], INK, 7.0, KNEE / 2.0))
    for spot in spots if named or varied else ():
        words = [method_name(spot.method)] * named + list(map(shown, spot.point)) * varied
        names.append(Name(", ".join(words), places[id(spot)], MUTED, 6.0))
    least = axes.get_ylim()[0]  # a lower end at 0 is not on a logarithmic axis
    bars = [
        [(one.seconds, max(one.measure.low * scale, least)), (one.seconds, one.measure.high * scale)] for one in spots
    ]
    name_marks(axes, names, [*bars, [places[id(one)] for one in _on_front(answer) if id(one) in places]])


def _on_front(answer: Answer) -> list[Spot]:
    """From the cheapest on."""
    if answer.front is None:
        return []
    return sorted((answer.spots[i] for i in np.flatnonzero(answer.front.member)), key=lambda spot: spot.seconds)


def _bound(axes: Any, bound: Bound, several: bool, measure: Measure, answer: Answer) -> None:
    """A line of what no method can beat, named where the marks are widest apart."""
    height = bound.all * measure.scale
    words = "Cramér-Rao bound" if bound.speckle is None else "Cramér-Rao bound and speckle"
    at = f", {', '.join(map(shown, bound.point))}" if several else ""
    axes.axhline(height, color=MUTED, lw=0.9, ls=(0, (1, 2)))
    seconds = np.sort([spot.seconds for spot in answer.spots if spot.seconds > 0.0 and spot.measure.mean > 0.0])
    style: dict[str, Any] = {"fontsize": 6.0, "color": MUTED}
    if len(seconds) > 1:
        widest = int(np.argmax(seconds[1:] / seconds[:-1]))
        place, within = math.sqrt(seconds[widest] * seconds[widest + 1]), axes.transData
    else:
        place, within = 0.99, axes.get_yaxis_transform()
    ha = "center" if len(seconds) > 1 else "right"
    axes.annotate(words + at, (place, height), (0, 3), within, "offset points", ha=ha, **style)


def _rays(axes: Any, throughput: Throughput, whole_frame: bool) -> None:
    """Time in the machine's own rays along the top, and the least that the rays of a frame take."""
    speed = throughput.rays_per_second / MILLION
    top = axes.secondary_xaxis("top", functions=(lambda seconds: seconds * speed, lambda rays: rays / speed))
    top.set_xlabel("million rays of this machine")
    top.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    top.xaxis.set_major_formatter(_tick)
    top.xaxis.set_minor_formatter(NullFormatter())
    if whole_frame:
        axes.axvline(throughput.frame_seconds, color=MUTED, lw=0.9, ls=(0, (4, 2, 1, 2)))
        up = axes.get_xaxis_transform()
        style: dict[str, Any] = {"fontsize": 6.0, "color": MUTED, "rotation": 90, "va": "top"}
        axes.annotate("one ray a pixel", (throughput.frame_seconds, 0.98), (3, 0), up, "offset points", **style)


def _note(axes: Any, text: str, place: tuple[float, float], colour: str, size: float, off: tuple[int, int]) -> None:
    axes.annotate(text, place, xytext=off, textcoords="offset points", fontsize=size, color=colour)


def _roomy(axes: Any) -> None:
    """At least a factor of two to see along a logarithmic axis, so that small differences do not look like large."""
    for get, put in ((axes.get_xlim, axes.set_xlim), (axes.get_ylim, axes.set_ylim)):
        low, high = get()
        if not low > 0.0:
            continue  # nothing is drawn along it
        widen = max(1.0, math.sqrt(2.0 * low / high))
        put(low / widen, high * widen)


def _map(axes: Any, answer: Answer, labels: dict[str, str]) -> None:
    """A measure over two parameters, of the first method, with the limit as a line where there is one."""
    import matplotlib.colors

    sweep, measure = answer.sweep, measure_of(answer.sweep.measure)
    method = answer.spots[0].method if answer.spots else ""
    spots = [spot for spot in answer.spots if spot.method == method]
    x, y = (sorted({float(spot.point[i]) for spot in spots}) for i in (0, 1))  # type: ignore[arg-type]
    z = np.full((len(y), len(x)), math.nan)
    for spot in spots:
        z[y.index(float(spot.point[1])), x.index(float(spot.point[0]))] = spot.measure.mean * measure.scale  # type: ignore[arg-type]
    positive = z[np.isfinite(z) & (z > 0.0)]
    spread = len(positive) > 0 and positive.max() > 10.0 * positive.min() and not np.any(z <= 0.0)
    norm = matplotlib.colors.LogNorm() if spread else None
    mesh = axes.pcolormesh(x, y, z, cmap="cividis", norm=norm, shading="nearest")
    axes.figure.colorbar(mesh, ax=axes, label=_axis_label(measure))
    said = [method_name(method)]
    if sweep.limit is not None and sweep.limit.measure == sweep.measure and min(z.shape) > 1:
        height = sweep.limit.value * measure.scale
        axes.contour(x, y, z, levels=[height], colors="white", linewidths=1.5)
        said.append(f"white line: limit {height:.4g} {measure.unit}".rstrip())
    if np.isnan(z).any():
        axes.patch.set(facecolor=PAPER, hatch="////", edgecolor=MUTED)
        said.append("hatched: nothing measured")
    _label_map(axes, answer, labels)
    axes.set_title("; ".join(said), fontweight="normal")


def _boundary(axes: Any, answer: Answer, labels: dict[str, str]) -> None:
    """Where the limit is crossed over two parameters, by each method."""
    draw_edges(axes, answer)
    _label_map(axes, answer, labels)
    for axis, parameter in zip("xy", answer.sweep.vary, strict=True):
        axes.set(**{f"{axis}lim": sorted((parameter.at(0.0), parameter.at(1.0)))})


def _label_map(axes: Any, answer: Answer, labels: dict[str, str]) -> None:
    for axis, parameter in zip("xy", answer.sweep.vary, strict=True):
        axes.set(**{f"{axis}label": field_label(parameter, labels), f"{axis}scale": _scale(parameter)})


def _scale(parameter: Parameter) -> str:
    return "log" if parameter.spacing == "logarithmic" else "linear"
