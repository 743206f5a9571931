"""Cells: every run that a study asks for, and which of them share a render."""

from __future__ import annotations

import hashlib
import itertools
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np

from analysis.line.settings import Method
from analysis.study.boundary import Lattice, Node, next_nodes
from analysis.study.breakdown import Search, next_values
from render.base.errors import InputError
from render.sensor.sensor import Sensor
from studio.project.project import MAX_SEED, Project
from studio.study.boards import PREFIX, Boards, boards_of
from studio.study.effects import in_state
from studio.study.kept import KEPT
from studio.study.study import (
    EFFECTS_FIELD,
    MOST_CELLS,
    SEARCHES,
    Study,
    Sweep,
    Value,
    check_part,
    field_place,
    with_fields,
)

Point = tuple[Value, ...]
"""One value for each parameter of a sweep."""
R = TypeVar("R")
Rows = Mapping[str, Mapping[str, Any]]
"""Measured rows by the cell's key."""
DIGITS = 12
"""Of a number that is varied, by which its cells are named."""
NOTHING: Mapping[str, tuple[Value, Value]] = MappingProxyType({})


@dataclass(frozen=True)
class Cell:
    """One measurement: a sweep's point, a method and a repeat."""

    sweep: int
    point: Point
    method: str
    repeat: int
    seed: int
    varied: Project
    """With the point's values; shared by its methods and repeats."""
    key: str
    """Names the measurement by what decides it: the same in every study, shard and machine."""
    render_key: str
    """Cells with the same one differ only in sensor, laser power, method or boards."""
    boards: Boards | None = None
    """What the cell calibrates on; None: it takes the scene's camera and lasers."""
    assumed: Sensor | None = None
    """What line extraction takes the sensor to be, where an effect of it is off; None: what it is."""
    again: bool = False
    """The render is likely to be asked for again: the next step of a search may share it."""
    kept: str = ""
    """What is kept of it for a chart: one of `kept.KEPT`."""
    former_key: str = ""
    """By the values to their last bit, as folders were written before; empty: it is the same."""

    @property
    def project(self) -> Project:
        """With the point's values, the method and the repeat's seed."""
        extraction = self.varied.extraction.model_copy(update={"method": self.method})
        changed = self.varied.model_copy(update={"extraction": extraction, "seed": self.seed})
        return changed.in_folder(self.varied.folder)

    def part_key(self, study: Study) -> str:
        """Cells with the same one belong to one shard: those of a render, or of a search, which needs its own."""
        sweep = study.sweeps[self.sweep]
        return _hashed(_words([sweep.name, self.method])) if sweep.sampling in SEARCHES else self.render_key


@dataclass(frozen=True)
class Shard:
    """Part `number` of `count`, counted from 1."""

    number: int = 1
    count: int = 1

    def holds(self, key: str) -> bool:
        """By the key and not by the order, so that what is a shard's own stays so as a study grows."""
        return int(key, 16) % self.count == self.number - 1


WHOLE = Shard()


def search_of(sweep: Sweep) -> Search:
    """The bisection of a sweep."""
    parameter, limit = sweep.vary[0], sweep.limit
    assert limit is not None and parameter.low is not None and parameter.high is not None
    logarithmic = parameter.spacing == "logarithmic"
    return Search(parameter.low, parameter.high, limit.value, limit.above, logarithmic, sweep.tolerance)


def lattice_of(sweep: Sweep) -> Lattice:
    """The lattice of a boundary, of all combinations of both parameters' values."""
    columns, rows = (len(one.grid()) for one in sweep.vary)
    assert sweep.limit is not None
    return Lattice(columns, rows, sweep.limit.value, sweep.limit.above)


def methods_of(study: Study, sweep: Sweep) -> tuple[Method, ...]:
    return sweep.methods or study.methods


def points(sweep: Sweep) -> list[Point]:
    """What a sweep without a search measures, in order."""
    if sweep.sampling == "sobol":
        from scipy.stats import qmc

        places = qmc.Sobol(len(sweep.vary), scramble=True, seed=0).random(sweep.samples)
        return [tuple(one.at(float(u)) for one, u in zip(sweep.vary, row, strict=True)) for row in places]
    return list(itertools.product(*(one.grid() for one in sweep.vary)))


def check_size(study: Study) -> int:
    """The number of cells of all grids. InputError: too many."""
    total = 0
    for sweep in study.sweeps:
        many = sweep.samples if sweep.sampling == "sobol" else math.prod(len(one.grid()) for one in sweep.vary)
        # a boundary takes a part of its lattice, how large is not known before
        total += 0 if sweep.sampling == "bisection" else many * len(methods_of(study, sweep)) * study.repeats
    if total > MOST_CELLS:
        cure = "vary less, or fewer values"
        raise InputError("the study is too large", found=f"{total} cells", allowed=f"{MOST_CELLS}", cure=cure)
    return total


def cells_at(study: Study, number: int, bases: Mapping[str, Project], wanted: Sequence[Point]) -> Iterator[Cell]:
    """The cells of one sweep at some points. InputError: a field or value that the project does not allow."""
    sweep = study.sweeps[number]
    base = bases[sweep.base or study.base]
    for name in sweep.asked:
        check_part(name, base, f"sweeps[{number}]")
    where = f"sweep {sweep.name!r}"
    for point in wanted:
        values = {**study.set, **sweep.set, **{p.field: v for p, v in zip(sweep.vary, point, strict=True)}}
        state = values.pop(EFFECTS_FIELD, None)
        varied = with_fields(base, values, where)
        boards, assumed = boards_of(values, where), None
        if state is not None:
            whole, varied = varied, in_state(varied, str(state))
            assumed = whole.sensor if varied.sensor != whole.sensor else None
        meant = {p.field: (v, as_meant(v)) for p, v in zip(sweep.vary, point, strict=True) if v != as_meant(v)}
        told = varied.in_folder(base.folder), study.image_scale, boards, assumed
        names, former = _Names(*told, meant), _Names(*told) if meant else None
        seeds = [(varied.seed + repeat) % (MAX_SEED + 1) for repeat in range(study.repeats)]
        shared = [names.render_key(seed) for seed in seeds] if varied.render.goal is None else None
        again = sweep.sampling in SEARCHES and shared is not None
        for method, (repeat, seed) in itertools.product(methods_of(study, sweep), enumerate(seeds)):
            kept = sweep.chart if sweep.chart in KEPT and repeat == 0 else ""
            key = names.key(method, seed, kept)
            render_key = key if shared is None else shared[repeat]
            of_point = number, point, method, repeat, seed, names.project, key, render_key, boards, assumed, again, kept
            yield Cell(*of_point, "" if former is None else former.key(method, seed, kept))


def as_meant(value: Value) -> Value:
    """A number as a person means it: the same one in every range, whose arithmetic differs in the last bits."""
    return float(f"{value:.{DIGITS}g}") if isinstance(value, float) else value


def row_of(cell: Cell, rows: Mapping[str, R]) -> R | None:
    """What is measured of a cell; None: it is not."""
    found = rows.get(cell.key)
    return found if found is not None or not cell.former_key else rows.get(cell.former_key)


def next_cells(study: Study, bases: Mapping[str, Project], rows: Rows, shard: Shard = WHOLE) -> list[Cell]:
    """What is to be measured next of a shard, without what has been; empty: it is complete.

    A search goes on by what it has measured, each method for itself.
    """
    found: dict[str, Cell] = {}
    for number, sweep in enumerate(study.sweeps):
        if sweep.sampling not in SEARCHES:
            for cell in cells_at(study, number, bases, points(sweep)):
                found.setdefault(cell.key, cell)
            continue
        for method in methods_of(study, sweep):
            for cell in next_of_search(study, number, method, bases, rows):
                found.setdefault(cell.key, cell)
    return [cell for cell in found.values() if row_of(cell, rows) is None and shard.holds(cell.part_key(study))]


def next_of_search(study: Study, number: int, method: str, bases: Mapping[str, Project], rows: Rows) -> list[Cell]:
    """What a search asks for next by one method, measured or not; empty: it is over."""
    wanted = next_points(study.sweeps[number], searched(study, number, method, bases, rows))
    return [cell for cell in cells_at(study, number, bases, wanted) if cell.method == method]


def searched(
    study: Study, number: int, method: str, bases: Mapping[str, Project], rows: Rows
) -> dict[Point, np.ndarray]:
    """Repeats of a search's measure by point, as far as it has asked for them."""
    sweep = study.sweeps[number]
    known: dict[Point, np.ndarray] = {}
    while True:
        wanted = next_points(sweep, known)
        found = {point: _repeats(study, number, method, bases, rows, point) for point in wanted}
        complete = {point: repeats for point, repeats in found.items() if repeats is not None}
        known |= complete
        if not wanted or len(complete) < len(wanted):
            return known


def along(known: Mapping[Point, np.ndarray]) -> dict[float, np.ndarray]:
    """What a bisection has measured, by the parameter's value."""
    return {float(point[0]): repeats for point, repeats in known.items()}  # type: ignore[arg-type]


def on_lattice(sweep: Sweep, known: Mapping[Point, np.ndarray]) -> dict[Node, np.ndarray]:
    """What a boundary has measured, by column and row."""
    column, row = ({value: i for i, value in enumerate(one.grid())} for one in sweep.vary)
    return {(column[point[0]], row[point[1]]): repeats for point, repeats in known.items()}


def next_points(sweep: Sweep, known: Mapping[Point, np.ndarray]) -> list[Point]:
    """What a search asks for after the repeats that are known by point; empty: it is over."""
    if sweep.sampling == "bisection":
        return [(value,) for value in next_values(search_of(sweep), along(known))]
    first, second = (one.grid() for one in sweep.vary)
    return [(first[i], second[j]) for i, j in next_nodes(lattice_of(sweep), on_lattice(sweep, known))]


def _repeats(
    study: Study, number: int, method: str, bases: Mapping[str, Project], rows: Rows, point: Point
) -> np.ndarray | None:
    """None: not all repeats are measured."""
    limit = study.sweeps[number].limit
    assert limit is not None
    cells = [cell for cell in cells_at(study, number, bases, [point]) if cell.method == method]
    measured = [row for row in (row_of(cell, rows) for cell in cells) if row is not None]
    if len(measured) < len(cells):
        return None
    return np.array([row[limit.measure] for row in measured], dtype=np.float64)


def light_key(cell: Cell, image_scale: float) -> str:
    """Points with the same one would share their renders, had they no goal that has each rendered for its own noise."""
    return _Names(cell.varied, image_scale, cell.boards, cell.assumed).render_key(cell.varied.seed)


class _Names:
    """Keys of a point's cells. What the point decides is put into words once: a study may have a million cells."""

    def __init__(
        self,
        project: Project,
        image_scale: float,
        boards: Boards | None,
        assumed: Sensor | None,
        meant: Mapping[str, tuple[Value, Value]] = NOTHING,
    ) -> None:
        """meant: by field what it is, and the number by which it is named."""
        self.project = project
        data = {**project.model_dump(mode="json"), "image_scale": image_scale}
        on_boards = {} if boards is None else {"boards": boards.model_dump(mode="json")}
        for field, (value, named) in meant.items():
            with suppress(InputError):  # a value may have become another field's, which is named to its last bit
                place, part = field_place(on_boards if field.startswith(PREFIX) else data, field, field)
                if place[part] == value:
                    place[part] = named
        del data["name"], data["schema_version"]
        self.extraction = data["extraction"]
        self.whole = {name: _words(value) for name, value in data.items()}
        lasers = [{**one, "power": one["power"] > 0.0} for one in data["scene"]["rig"]["lasers"]]
        rig = {**data["scene"]["rig"], "lasers": lasers}  # light is scaled; a laser that is off leaves none to scale
        self.light = {**self.whole, "scene": _words({**data["scene"], "rig": rig})}
        self.light["axis"] = _words(self.extraction["axis"])
        del self.light["sensor"], self.light["extraction"]
        if boards is not None:
            self.whole["boards"] = _words(on_boards["boards"])
        if assumed is not None:
            self.whole["assumed"] = _words(assumed.model_dump(mode="json"))

    def key(self, method: str, seed: int, kept: str) -> str:
        words = {**self.whole, "extraction": _words({**self.extraction, "method": method}), "seed": _words(seed)}
        return _hashed(_object({**words, "kept": _words(kept)} if kept else words))

    def render_key(self, seed: int) -> str:
        """Of a render without a goal: with one, light is rendered for what one sensor measures."""
        return _hashed(_object({**self.light, "seed": _words(seed)}))


def _words(data: Any) -> str:
    return json.dumps(data, sort_keys=True)


def _object(parts: Mapping[str, str]) -> str:
    """The words of an object, from those of its fields."""
    return "{" + ", ".join(f'"{name}": {parts[name]}' for name in sorted(parts)) + "}"


def _hashed(words: str) -> str:
    return hashlib.sha256(words.encode()).hexdigest()[:32]
