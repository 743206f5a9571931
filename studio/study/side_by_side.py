"""Renders side by side: their figures with the differences from the first, and the settings in which they differ."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from analysis.gauges.read import Reading
from analysis.report.colour import method_name
from analysis.report.gauge_table import scale_and_unit, small_text, value_text
from analysis.report.units import digits, digits_of_percent
from render.base.csv_file import write_csv
from studio.editing.units import Unit
from studio.project.project import Project
from studio.scan.kept_renders import FIGURES, Kept
from studio.scan.redevelop import Development
from studio.scan.remarks import scale_head
from studio.scan.stages import scaled_sensor
from studio.study.changes import Change, changes

NONE = "-"
PIXELS = "px"
LABELS = {"Off the surface, RMSE": "Off the surface with false scan lines, RMSE"}
"""Of figures whose names in files do not say what they hold."""
DEVELOPING = ("sensor", "extraction", "scene.rig.camera.lens")
"""Fields that decide figures of the same light, beside the lasers' powers."""
MILLIMETRE = 1e-3
SURE = 5.0
"""Sigmas beyond which two readings differ."""
KEPT_AS_READ = "Keep with the project keeps a render as it is read now."


@dataclass(frozen=True)
class Row:
    """One line of the table: what it is of, and a text for each render."""

    label: str
    cells: tuple[str, ...]
    measured: bool
    """A figure, not a setting."""
    values: tuple[float, ...] = ()
    """Of a figure, all its digits, in the unit of the label."""
    notes: tuple[str, ...] = ()
    """Of a measure, for each render: why it has no value, or what a person must know before comparing it."""


def side_by_side(renders: Sequence[Kept], now: Project | None = None) -> list[Row]:
    """Figures first: "12.3 (-4.5)" is 4.5 less than the first render's; then every setting that is not the same.

    now: the open project; where a render was developed otherwise, or is kept, a row each tells by what.
    """
    if not renders:
        return []
    first = renders[0]
    one_scale = all(one.image_scale == first.image_scale for one in renders)
    scales = tuple(f"{one.image_scale:.3g}" for one in renders)
    rows = [Row("Image scale", scales, False)] if set(scales) != {"1"} else []
    if any(one.stopped for one in renders):
        rows.append(Row("Finished", tuple("stopped early" if one.stopped else "yes" for one in renders), False))
    for name, unit in FIGURES.items():
        values = [one.figures.get(name, math.nan) for one in renders]
        if not any(map(math.isfinite, values)):
            continue
        apart = unit == PIXELS and not one_scale  # pixels of another size have no difference
        alike = [one.image_scale == first.image_scale or not apart for one in renders]
        cells = [_cell(value, values[0] if k and alike[k] else math.nan, unit) for k, value in enumerate(values)]
        label = f"{LABELS.get(name, name)} / {unit}" + (" of its own image" if apart else "")
        rows.append(Row(label, tuple(cells), True, tuple(values)))
    rows += _measures(renders)
    developed = _developed_rows(renders, now)
    rows += developed.values()
    labels: dict[str, str] = {}
    found: list[dict[str, tuple[str, str]]] = []
    for one in renders:
        differing = {
            # of an exposure that was scaled to and fro the last digits may differ
            change.field: change
            for change in changes(_as_measured(first), _as_measured(one))
            if change.a != change.b
        }
        labels |= {field: change.label for field, change in differing.items()}
        found.append({field: (change.a, change.b) for field, change in differing.items()})
    for field, label in labels.items():
        if field in developed or field == "name" or field.startswith(("measures", "delivery")):
            continue  # it has its row, or all are read by those of now
        own = next(each[field][0] for each in found if field in each)
        rows.append(Row(label, tuple(each[field][1] if field in each else own for each in found), False))
    return rows


def developed_as(renders: Sequence[Kept], now: Project) -> str:
    """The line above the table: by which settings its figures are."""
    other = [one.name for one in renders if _developed_otherwise(_as_measured(one), now)]
    settings = ", ".join(text for _, text in _settings(now).values())
    if not other:
        return f"All developed as the project is now: {settings}. {KEPT_AS_READ}"
    who = "All" if len(other) == len(renders) else ", ".join(other)
    told = f"The project is now at {settings}. {who}: developed by other settings, which stand in the rows below."
    return f"{told} A render of this session is developed as the project is then whenever it is shown; {_lower()}"


def read_alike(one: Kept, other: Kept) -> bool:
    """Whether both are of one size and developed by the same settings."""
    apart = _developed_otherwise(_as_measured(one), _as_measured(other))
    return one.image_scale == other.image_scale and not apart


def scale_warnings(renders: Sequence[Kept]) -> list[str]:
    """Which columns are not the scanner's figures."""
    scales = dict.fromkeys(one.image_scale for one in renders if one.image_scale != 1.0)
    return [
        f"{', '.join(one.name for one in renders if one.image_scale == scale)}: {scale_head(scale)}" for scale in scales
    ]


def _lower() -> str:
    return KEPT_AS_READ[:1].lower() + KEPT_AS_READ[1:]


def _settings(project: Project) -> dict[str, tuple[str, str]]:
    """By its field: what the row of a setting is called, and its value; those by which renders are developed most."""
    sensor, ms, watts = project.sensor, Unit.of("s"), Unit.of("W")
    gain = "gain by full well" if sensor.gain is None else f"gain {sensor.gain:g} DN/e-"
    powers = {
        f"scene.rig.lasers[{laser.name}].power": (f"{laser.name}: Power", watts.with_unit(laser.power))
        for laser in project.scene.lasers
    }
    return {
        "sensor.exposure_time": ("Sensor: Exposure time", ms.with_unit(float(f"{sensor.exposure_time:.9g}"))),
        "sensor.gain": ("Sensor: Gain", gain),
        "sensor.bits": ("Sensor: Bit depth", f"{sensor.bits} bit"),
        **powers,
        "extraction.method": ("Extraction: Method", method_name(project.extraction.method)),
    }


def _developed_rows(renders: Sequence[Kept], now: Project | None) -> dict[str, Row]:
    """By field; none where the line above the table tells them of all."""
    if now is None or not any(one.folder or _developed_otherwise(_as_measured(one), now) for one in renders):
        return {}
    found = [_settings(_as_measured(one)) for one in renders]
    labels = {field: label for each in found for field, (label, _) in each.items()}
    return {
        field: Row(label, tuple(each[field][1] if field in each else NONE for each in found), False)
        for field, label in labels.items()
    }


def _developed_otherwise(render: Project, now: Project) -> bool:
    return any(_is_developing(change) and change.a != change.b for change in changes(render, now))


def _is_developing(change: Change) -> bool:
    return change.field.startswith(DEVELOPING) or change.field.endswith("].power")


def _as_measured(render: Kept) -> Project:
    """Its project with its lasers' powers, and the exposure of the scanner, which a smaller image has less of."""
    project = render.project
    if render.laser_power:
        project = Development(project, render.laser_power).powered
    sensor = scaled_sensor(project.sensor, 1.0 / render.image_scale)
    return project.model_copy(update={"sensor": sensor})


def _measures(renders: Sequence[Kept]) -> list[Row]:
    """A row for each measure of the part, with the difference from the first render's."""
    units = {one.gauge.name: one.gauge.unit for kept in renders for one in kept.readings}
    rows = []
    for name, unit in units.items():
        read = [next((one for one in kept.readings if one.gauge.name == name), None) for kept in renders]
        values = [math.nan if one is None else one.value for one in read]
        cells = [value_text(one.value, one.sigma, unit) if one is not None else NONE for one in read]
        for k, value in enumerate(values[1:], 1):
            if math.isfinite(value - values[0]):
                cells[k] += f" ({_difference(value - values[0], unit)})"
        scale, shown = scale_and_unit(unit)
        told = tuple(scale * value for value in values)
        notes = tuple(_note(one, read[0], renders[0].name) for one in read)
        rows.append(Row(f"{name} / {shown.strip()}", tuple(cells), True, told, notes))
    return rows


def _difference(value: float, unit: str) -> str:
    """In um up to a millimetre, beyond it in the unit of the values."""
    text = value_text(value, None, unit) if unit == "m" and abs(value) >= MILLIMETRE else small_text(value, unit)
    return f"{'+' if value > 0.0 else ''}{text}"


def _note(one: Reading | None, first: Reading | None, name: str) -> str:
    """What is told of a reading beside the first render's; where most of a difference is the part's own, so."""
    if one is None:
        return ""
    told = [text for text in (one.reason, one.remark) if text]
    if first is not None and one is not first:
        apart, own = one.value - first.value, one.truth - first.truth
        if abs(own) > 0.5 * abs(apart) and not abs(apart) <= SURE * math.hypot(one.sigma, first.sigma):
            exact = value_text(one.truth, None, one.gauge.unit), value_text(first.truth, None, one.gauge.unit)
            told.append(f"exact here {exact[0]}, in {name} {exact[1]}: the part in these regions is another")
    return "; ".join(told)


def write_table(path: Path, renders: Sequence[Kept], rows: Sequence[Row]) -> None:
    """As CSV. InputError: the file cannot be written."""
    header = ["", *(one.name for one in renders)]
    write_csv(path, header, ([row.label, *_for_file(row)] for row in rows))


def _for_file(row: Row) -> list[str]:
    """Numbers with all their digits, texts as they are."""
    return [f"{value:.9g}" if math.isfinite(value) else "" for value in row.values] or list(row.cells)


def _cell(value: float, first: float, unit: str) -> str:
    if not math.isfinite(value):
        return NONE
    told = digits_of_percent(value) if unit == "%" else digits(value)
    if not math.isfinite(first):
        return told
    change = value - first
    return f"{told} ({'+' if change > 0.0 else ''}{digits(change, 2)})"
