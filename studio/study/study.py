"""The study file: a base project, what to vary, by which methods, how often, and what to draw."""

from __future__ import annotations

import difflib
import hashlib
import json
import re
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal, Self

from pydantic import Field, model_validator

from analysis.line.settings import Method
from render.base.errors import InputError
from render.base.files import inside
from render.base.model import Model, quantity
from studio.project.project import Project
from studio.project.ready_made import load_model, names_in
from studio.project.templates import DESCRIPTIONS, template_folder
from studio.study.boards import of_project
from studio.study.effects import STATES
from studio.study.measures import MEASURES, measure_of, part_names

FOLDER = Path(__file__).resolve().parents[2] / "assets" / "studies"
BASES = FOLDER / "bases"
"""Projects of ready-made studies that are no templates."""
MOST_VALUES, MOST_CELLS, MOST_VARIED, MOST_SWEEPS = 10_000, 1_000_000, 8, 100
Value = bool | int | float | str | None
SEARCHES = ("bisection", "boundary")
"""Samplings that go on by what they have measured, each method for itself."""
EFFECTS_FIELD = "effects"
"""What a sweep of effects varies in place of a field: `studio.study.effects.STATES`."""


class Parameter(Model):
    """A field of the project by its path, and its values: a list, or a range."""

    field: str = quantity(label="Field", help="Path in the project file: sensor.exposure_time.", max_length=200)
    label: str = quantity("", label="Label", help="On the charts; empty: the field's own.", max_length=100)
    values: tuple[Value, ...] = quantity((), label="Values", max_length=MOST_VALUES)
    low: float | None = quantity(None, label="From")
    high: float | None = quantity(None, label="To")
    count: int = quantity(5, label="How many", ge=2, le=MOST_VALUES)
    spacing: Literal["linear", "logarithmic"] = "linear"

    @model_validator(mode="after")
    def _has_values(self) -> Self:
        if (self.low is None) != (self.high is None):
            raise ValueError("a range has two ends; allowed: both low and high")
        ranged = self.low is not None
        if bool(self.values) == ranged:
            found = "both values and a range" if ranged else "neither values nor a range"
            raise ValueError(f"it has {found}; allowed: values, or low and high")
        if ranged and self.spacing == "logarithmic" and not (self.low > 0 and self.high > 0):  # type: ignore[operator]
            raise ValueError("a logarithmic range reaches 0; allowed: low and high above 0, or a plain range")
        if ranged and self.low == self.high:
            raise ValueError("the range is empty; allowed: low and high that differ")
        if len({json.dumps(value) for value in self.values}) < len(self.values):
            raise ValueError("a value is there twice; allowed: each once")
        return self

    def at(self, place: float) -> float:
        """The value at a place in the range, 0 to 1."""
        assert self.low is not None and self.high is not None
        if place in (0.0, 1.0):
            return self.high if place else self.low
        if self.spacing == "logarithmic":
            return float(self.low * (self.high / self.low) ** place)
        return self.low + place * (self.high - self.low)

    def grid(self) -> tuple[Value, ...]:
        """All values."""
        return self.values or tuple(self.at(i / (self.count - 1)) for i in range(self.count))


class Limit(Model):
    """A bar of a measure that a set-up has to keep."""

    measure: str = quantity(label="Measure")
    value: float = quantity(label="Limit", help="In the unit of the measure.")
    above: bool = quantity(True, label="Broken above", help="Off: broken by what is below it.")

    @model_validator(mode="after")
    def _is_known(self) -> Self:
        check_measure(self.measure)
        return self


class Reference(Model):
    """What others say of a point: a paper's figure, or a data sheet's."""

    label: str = quantity(label="What", min_length=1, max_length=100)
    measure: str = quantity(label="Measure")
    value: float = quantity(label="Value", help="In the SI unit of the measure.")
    point: tuple[Value, ...] = quantity(label="Point", help="A value for each field that is varied.")
    method: Method | None = quantity(None, label="Method", help="None: the first.")

    @model_validator(mode="after")
    def _is_known(self) -> Self:
        check_measure(self.measure)
        return self


class Sweep(Model):
    """One chart's worth of runs: some parameters varied, all else as the study has it."""

    name: str = quantity(label="Name", min_length=1, max_length=100)
    question: str = quantity("", label="Question", max_length=500)
    base: str | None = quantity(None, label="Base project", help="In place of the study's.")
    set: dict[str, Value] = Field(default_factory=dict, description="Fields of the project that are fixed.")
    vary: tuple[Parameter, ...] = ()
    sampling: Literal["grid", "sobol", "bisection", "boundary", "effects"] = quantity(
        "grid",
        label="Sampling",
        help="grid: all combinations. sobol: quasi-random in the ranges. bisection: where the limit is crossed, from "
        "low, where it is to hold, to high. boundary: the same along the second parameter, at each value of the "
        "first. effects: what makes the error, each effect switched off and on alone.",
    )
    samples: int = quantity(64, label="Samples", help="Of sobol.", ge=2, le=65536)
    tolerance: float = quantity(0.01, label="Tolerance", help="Of bisection, as a share of the range.", gt=1e-6, le=0.5)
    methods: tuple[Method, ...] = Field(default=(), description="In place of the study's.")
    chart: Literal["sweep", "speed", "map", "budget", "profile", "pictures"] = quantity(
        "sweep",
        label="Chart",
        help="sweep: a measure over the first parameter. speed: a measure over processor time. map: over two. budget: "
        "what each effect makes of the depth error. profile: positions, depths and their errors along the line. "
        "pictures: the images, side by side.",
    )
    time: Literal["frame", "line", "calibration"] = quantity(
        "frame",
        label="Time",
        help="Of a chart of speed: the whole frame, finding the line in its image, or calibrating on the boards.",
    )
    measure: str = quantity("depth_rmse", label="Measure")
    limit: Limit | None = None
    references: tuple[Reference, ...] = quantity((), label="Figures of others", max_length=100)

    @model_validator(mode="after")
    def _effects_are_all(self) -> Self:
        """What effects vary is not a field of the project, and chosen by no one."""
        if self.sampling != "effects":
            return self
        if any(one.field != EFFECTS_FIELD for one in self.vary):
            raise ValueError("effects are switched, and no field is varied; allowed: no vary")
        states = Parameter(field=EFFECTS_FIELD, label="Effects", values=STATES)
        return self.model_copy(update={"vary": (states,), "chart": "budget"})

    @model_validator(mode="after")
    def _boundary_is_a_map(self) -> Self:
        """What a boundary measures is of no use along one parameter."""
        return self.model_copy(update={"chart": "map"}) if self.sampling == "boundary" else self

    @model_validator(mode="after")
    def _fits(self) -> Self:
        check_measure(self.measure)
        if (self.chart == "budget") != (self.sampling == "effects"):
            raise ValueError("a budget is of effects; allowed: sampling effects")
        if not 1 <= len(self.vary) <= MOST_VARIED:
            raise ValueError(f"{len(self.vary)} fields are varied; allowed: 1 to {MOST_VARIED}")
        fields = [one.field for one in self.vary]
        if len(set(fields)) < len(fields) or set(fields) & self.set.keys():
            raise ValueError("a field is there twice; allowed: each once in vary and set together")
        if self.sampling in ("sobol", *SEARCHES) and any(one.values for one in self.vary):
            raise ValueError(f"{self.sampling} takes ranges; allowed: low and high for every parameter")
        if self.sampling == "bisection" and (len(self.vary) != 1 or self.limit is None):
            raise ValueError("bisection looks for one limit along one parameter; allowed: one in vary, and a limit")
        if self.sampling == "boundary" and (len(self.vary) != 2 or self.limit is None):
            raise ValueError("a boundary is of one limit in a map of two parameters; allowed: two in vary, and a limit")
        if any(len(one.point) != len(self.vary) for one in self.references):
            raise ValueError("a reference is of no point; allowed: a value for each field that is varied")
        for one in self.references if self.sampling == "grid" else ():
            for parameter, value in zip(self.vary, one.point, strict=True):
                if value not in parameter.grid():
                    values = ", ".join(map(str, parameter.grid()[:20]))
                    raise ValueError(f"a reference is at {parameter.field} {value}; allowed: one of {values}")
        if self.chart == "map" and len(self.vary) != 2:
            raise ValueError(f"a map has two parameters; found {len(self.vary)}; allowed: two in vary")
        return self

    @property
    def asked(self) -> tuple[str, ...]:
        """Every measure that it draws, limits or holds against figures of others."""
        limit = () if self.limit is None else (self.limit.measure,)
        return tuple(dict.fromkeys((self.measure, *limit, *(one.measure for one in self.references))))


class Study(Model):
    """Frozen; what a file leaves out takes the defaults, and what it should not hold is refused."""

    schema_version: Literal[1] = 1
    name: str = quantity("study", label="Name", min_length=1, max_length=100)
    question: str = quantity("", label="Question", max_length=500)
    base: str = quantity(
        label="Base project", help="A template's name, a ready-made study's own base, or a path beside the study file."
    )
    image_scale: float = quantity(1.0, label="Image scale", ge=0.01, le=4.0)
    laser: int = quantity(0, label="Laser", help="Index of the laser that is measured.", ge=0, le=63)
    methods: tuple[Method, ...] = ("likelihood",)
    repeats: int = quantity(8, label="Repeats", help="Of every cell, each with a seed of its own.", ge=1, le=10_000)
    set: dict[str, Value] = Field(default_factory=dict, description="Fields of the project that are fixed.")
    sweeps: tuple[Sweep, ...]

    @model_validator(mode="after")
    def _names_are_apart(self) -> Self:
        names = [sweep.name for sweep in self.sweeps]
        if not 1 <= len(names) <= MOST_SWEEPS or not self.methods:
            raise ValueError(f"there is nothing to run; allowed: a method, and 1 to {MOST_SWEEPS} sweeps")
        if len(set(names)) < len(names):
            raise ValueError("two sweeps have one name; allowed: each its own")
        if self.repeats < 3 and any(sweep.sampling in (*SEARCHES, "effects") for sweep in self.sweeps):
            raise ValueError("searches and effects tell noise from change by repeats; allowed: repeats of at least 3")
        return self

    @classmethod
    def load(cls, path: Path | str) -> tuple[Self, Path]:
        """A study and the folder that its paths start from: `load_model`, with the ready-made ones of `FOLDER`."""
        return load_model(cls, path, FOLDER, "study")

    def digest(self, bases: dict[str, Project]) -> str:
        """What decides a cell's numbers beside its key, as SHA-256: the program, the bases, what is fixed.

        Bases count by what is in them: their files may have other names since.
        """
        said = {
            "program": program_digest(),
            "image_scale": self.image_scale,
            "laser": self.laser,
            "set": self.set,
            "bases": sorted({json.dumps(base.model_dump(mode="json"), sort_keys=True) for base in bases.values()}),
        }
        return hashlib.sha256(json.dumps(said, sort_keys=True).encode()).hexdigest()

    def bases(self, root: Path) -> dict[str, Project]:
        """Every base project by its name in the file.

        InputError: one cannot be read, lies outside `root` or has no such laser as is measured.
        """
        names = {self.base, *(sweep.base for sweep in self.sweeps if sweep.base is not None)}
        found = {name: base_project(name, root) for name in sorted(names)}
        for name, project in found.items():
            require_laser(project, self.laser, f"laser, of {name}")
        return found


@lru_cache(maxsize=1)
def program_digest() -> str:
    """SHA-256 of the code that measures, so that rows of two versions are never of one table."""
    root, digest = Path(__file__).resolve().parents[2], hashlib.sha256()
    for file in sorted(file for room in ("analysis", "render", "studio") for file in (root / room).rglob("*.py")):
        name = file.relative_to(root).as_posix()
        if not name.startswith("studio/qt/"):
            digest.update(f"{name}\0".encode() + file.read_bytes() + b"\0")
    return digest.hexdigest()


def ready_made() -> list[str]:
    """Names of the studies that come with the program."""
    return names_in(FOLDER)


def named_bases() -> tuple[str, ...]:
    """Base projects that come with the program, by their names: templates, and those of ready-made studies."""
    return (*DESCRIPTIONS, *names_in(BASES))


def base_project(name: str, root: Path) -> Project:
    """One of `named_bases`, or a project beside the study file. InputError: neither."""
    if name in named_bases():
        return Project.load(template_folder(name) if name in DESCRIPTIONS else BASES / f"{name}.json")
    path = inside(root, name, "base")
    if not path.exists():
        allowed = f"a project file beside the study, or one of: {', '.join(named_bases())}"
        raise InputError("there is no such base project", where="base", found=name, allowed=allowed)
    return Project.load(path)


def require_laser(project: Project, laser: int, where: str) -> int:
    """The laser's index. InputError: the rig has no such laser."""
    count = len(project.scene.lasers)
    if laser >= count:
        allowed = f"0 to {count - 1}" if count > 1 else "0" if count else "none: the rig has no laser"
        raise InputError("there is no such laser in the project", where=where, found=laser, allowed=allowed)
    return laser


def told_laser(study: Study, bases: Mapping[str, Project], base: str | None = None) -> list[str]:
    """Of several lasers of a base, None: the study's own, the one that is measured, in words; of a single one none."""
    lasers = bases[base or study.base].scene.lasers
    return [f"of {lasers[study.laser].name}, one of {len(lasers)} lasers"] if len(lasers) > 1 else []


def with_fields(project: Project, values: dict[str, Value], where: str) -> Project:
    """The project with fields at their paths replaced, those of the boards left out.

    InputError: no such field, or a value that it does not allow.
    """
    data = project.model_dump(mode="json")
    for path, value in of_project(values).items():
        place, part = field_place(data, path, where)
        place[part] = value
    return Project.from_data(data, where).in_folder(project.folder)


def check_measure(name: str) -> None:
    """ValueError: no such measure; of the part, `check_part` asks the project."""
    try:
        measure_of(name)
    except KeyError:
        near = difflib.get_close_matches(name, MEASURES, n=1)
        cure = f"; did you mean {near[0]}?" if near else ""
        raise ValueError(f"there is no measure {name[:60]!r}; allowed: {', '.join(MEASURES)}{cure}") from None


def check_part(name: str, project: Project, where: str) -> None:
    """InputError: the measure is of the part, and the project has none of that name and kind."""
    there = part_names(project.measures)
    if ":" in name and name not in there:
        allowed = ", ".join(there) or "none: the project has no measures of the part"
        raise InputError("the project has no such measure of the part", where=where, found=name, allowed=allowed)


def parts_of(path: str) -> list[str | int]:
    return [int(part) if part.isdigit() else part for part in re.findall(r"[^.\[\]]+", path)]


def field_place(data: dict[str, Any], path: str, where: str) -> tuple[Any, str | int]:
    """What holds a field of a project's data, and the field's name or index there. InputError: no such field."""
    parts = parts_of(path)
    place: Any = data
    for part in parts[:-1]:
        place = _child(place, part, path, where)
    _child(place, parts[-1] if parts else "", path, where)
    return place, parts[-1]


def _child(place: Any, part: str | int, path: str, where: str) -> Any:
    if isinstance(place, dict) and part in place:
        return place[part]
    if isinstance(place, list) and isinstance(part, int) and part < len(place):
        return place[part]
    names = list(place) if isinstance(place, dict) else []
    if isinstance(place, list):
        names = [str(i) for i in range(len(place))]
    near = difflib.get_close_matches(str(part), names, n=1)
    raise InputError(
        "the project has no such field",
        where=where,
        found=f"{path}: {part}",
        allowed=", ".join(names) or "nothing below a plain value",
        cure=f"did you mean {near[0]}?" if near else "",
    )
