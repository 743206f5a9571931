"""A form for any model of the project, worked out from the model's own fields: labels, units, limits, kinds, help.

`describe` lists what a form shows; `edited` makes the change that a form asks for. Nothing here knows a window.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from analysis.line.settings import ExtractionSettings
from analysis.report.delivery import Delivery
from render.base.pose import Pose
from render.camera.camera import Camera
from render.laser.laser import Divergence, LineLaser, Waist
from render.material.material import Texture
from render.scene.lights import PointLight, RectangleLight
from render.scene.motion import PoseList
from render.scene.scene import Scene, SceneObject
from render.scene.settings import RenderSettings
from render.sensor.sensor import Sensor, SpectralCurve
from studio.editing.linked_fields import DERIVED, FOCUS, LINKED, with_focus
from studio.editing.units import FACTORS, Unit
from studio.project.document import FieldPath, replaced, value_at
from studio.project.project import Project

Kind = Literal[
    "number", "integer", "text", "file", "flag", "choice", "numbers", "pose", "curve", "model", "union", "list"
]

ITEMS = (Camera, Scene, Sensor, RenderSettings, ExtractionSettings, LineLaser, SceneObject, PointLight, RectangleLight,
         Delivery)  # fmt: skip
"""What the scene tree shows as items of their own, and so no form of another item repeats."""
HIDDEN = ("kind", "source", "schema_version", "sha256", "calibration", "measures", "measured_in")
FINE_UNITS = {(Camera, "pixel_pitch"): "µm", (Waist, "radius"): "µm", (Divergence, "full_angle"): "mrad",
              (Delivery, "lower"): "µm", (Delivery, "upper"): "µm"}  # fmt: skip
PLAIN = Unit()
BLANKS = str.maketrans("_-", "  ")
LABELS = {"T_rig_camera": "Pose on the rig", "T_rig_laser": "Pose on the rig", "T_world_rig": "Pose in the world",
          "T_world_object": "Pose in the world", "T_world_light": "Pose in the world"}  # fmt: skip
NAMES = {"MeshFile": "Mesh file", "FromMesh": "From the mesh file", "PointLight": "Point", "Waist": "Focused",
         "RectangleLight": "Rectangle", "NoMotion": "None, a single frame", "Divergence": "Diverging",
         "Texture": "Image", "GreyTexture": "Image", "PoseList": "List of poses",
         "Processing": "Photograph", "likelihood": "Maximum likelihood", "srgb": "sRGB"}  # fmt: skip


class _Required:
    def __repr__(self) -> str:
        return "REQUIRED"


UNITS = {unit for units in FACTORS.values() for unit in units}
"""Their case is part of their name."""
REQUIRED = _Required()
"""The default of a field that has none."""


@dataclass(frozen=True)
class Alternative:
    """One kind that a field may have. type: a model class, float, tuple, or None for "not there"."""

    label: str
    help: str
    type: Any
    file: bool = False
    """Choosing it needs a file first."""


@dataclass(frozen=True)
class FieldSpec:
    """One line, or one group, of a form. Values and limits are as stored (SI); `unit` shows and reads them."""

    name: str
    label: str
    help: str
    kind: Kind
    value: Any
    default: Any = REQUIRED
    unit: Unit = PLAIN
    low: float | None = None
    high: float | None = None
    low_open: bool = False
    high_open: bool = False
    choices: tuple[Any, ...] = ()
    labels: tuple[str, ...] = ()
    """Of the choices, where they are names that a person gave."""
    optional: bool = False
    """May be empty (None)."""
    length: int | None = None
    """Of "numbers": fixed, or None."""
    fields: tuple[FieldSpec, ...] = ()
    """Of "model", of the chosen kind of "union", of the items of "list"."""
    alternatives: tuple[Alternative, ...] = ()
    chosen: int = -1
    """Of "union": which alternative the value is."""
    assign: Callable[[Any, Any], dict[str, Any]] | None = None
    """(owner, value) -> the fields that change together."""

    @property
    def structure(self) -> Any:
        """What decides the widgets of a form; a change of value alone keeps it."""
        fields = tuple(field.structure for field in self.fields)
        return self.name, self.kind, self.chosen, self.length, self.labels, fields

    def problem(self, value: Any) -> str | None:
        """Why a value is refused, in shown units, or None; only the field's own limits are asked."""
        numbers = value if isinstance(value, tuple) else (value,)
        for number in numbers:
            if not isinstance(number, int | float) or isinstance(number, bool):
                continue
            if self.low is not None and (number < self.low or (self.low_open and number == self.low)):
                return f"must be {'more than' if self.low_open else 'at least'} {self.unit.with_unit(self.low)}"
            if self.high is not None and (number > self.high or (self.high_open and number == self.high)):
                return f"must be {'less than' if self.high_open else 'at most'} {self.unit.with_unit(self.high)}"
        return None

    def clamped(self, value: float) -> float:
        """The nearest value within closed limits, and just inside open ones; for drags."""
        span = 1e-3 / self.unit.factor
        if self.low is not None and (value < self.low or (self.low_open and value <= self.low)):
            value = self.low + (
                min(span, 1e-3 * abs(self.high)) if self.low_open and self.high else span * self.low_open
            )
        if self.high is not None and (value > self.high or (self.high_open and value >= self.high)):
            value = self.high - span * self.high_open
        return value


def describe(model: BaseModel) -> tuple[FieldSpec, ...]:
    """What a form for this model shows, in order; items that have a place of their own in the tree are left out."""
    owner = type(model)
    specs = []
    for name, field in owner.model_fields.items():
        if name in HIDDEN or (get_origin(field.annotation) is Literal and len(get_args(field.annotation)) < 2):
            continue
        if _is_item(field.annotation):
            continue
        spec = _field(owner, name, field, getattr(model, name))
        specs.append(spec)
    for derived in DERIVED.get(owner, ()):
        place = next(i for i, spec in enumerate(specs) if spec.name == derived.before)
        limits: dict[str, Any] = {"unit": Unit.of(derived.unit), "low": 0.0, "low_open": True}
        value, stored = derived.read(model), specs[place]
        if stored.high is not None and stored.value:
            limits["high"] = stored.high * value / stored.value  # as much as what it is stored as, told in its own unit
        if (below := derived.below(model)) is not None:
            limits |= {"high": below, "high_open": True}
        specs.insert(
            place,
            FieldSpec(derived.name, derived.label, derived.help, "number", value, assign=derived.assign, **limits),
        )
    return tuple(specs)


def describe_item(project: Project, path: FieldPath) -> FieldSpec:
    """One item of the tree, or any model in the project, as a "model" or "union". KeyError: nothing is there."""
    value = value_at(project, path)
    if not path:
        return FieldSpec("", "Project", "", "model", project, fields=describe(project))
    last = len(path) - 1 if isinstance(path[-1], str) else len(path) - 2
    owner, name = value_at(project, path[:last]), str(path[last])
    field = type(owner).model_fields[name]
    annotation, limits = _open(field.annotation, field.metadata)
    if last < len(path) - 1:
        annotation, limits = _open(get_args(annotation)[0], [])
    spec = _spec(type(owner), name, annotation, limits, value, REQUIRED, _label(name, field), field.description or "")
    return _with_objects(project, spec) if isinstance(value, Delivery) else spec


def _with_objects(project: Project, spec: FieldSpec) -> FieldSpec:
    """The object of a report's verdict is chosen from those that there are; one that is gone stays to be seen."""
    found = dict.fromkeys(("", *(item.name for item in project.scene.visible_objects), project.delivery.surface_of))
    chosen: dict[str, Any] = {"kind": "choice", "choices": tuple(found), "labels": ("All objects", *tuple(found)[1:])}
    return replace(
        spec, fields=tuple(replace(one, **chosen) if one.name == "surface_of" else one for one in spec.fields)
    )


def edited(project: Project, owner: FieldPath, spec: FieldSpec, value: Any) -> Project:
    """The project with one field of the model at `owner` changed, and what is linked to it. InputError: refused."""
    path = field_path(owner, spec)
    owner, assign = (path[:-2], with_focus) if path == FOCUS else (owner, spec.assign)
    if assign is None:
        return replaced(project, path, value)
    model = value_at(project, owner)
    # as plain fields, so that they are validated together
    fields = {name: getattr(model, name) for name in type(model).model_fields}
    return replaced(project, owner, fields | assign(model, value))


def field_path(owner: FieldPath, spec: FieldSpec) -> FieldPath:
    """Where a field of the model (or list) at `owner` stands; the value of a union stands at the union itself."""
    if not spec.name:
        return owner
    return (*owner, int(spec.name) if spec.name.isdigit() else spec.name)


def start_value(alternative: Alternative, before: Any, file: str = "") -> Any:
    """What a field holds when this kind is chosen: defaults, with what the former kind has in common kept.

    file: of an alternative that needs one, relative to the project.
    """
    kind = alternative.type
    if kind is None:
        return None
    if kind is float:
        return sum(before) / len(before) if isinstance(before, tuple) else 0.5
    if kind is tuple:
        return (before,) * 3 if isinstance(before, float) else (0.5, 0.5, 0.5)
    values: dict[str, Any] = {"poses": (Pose(),)} if kind is PoseList else {}
    if isinstance(before, BaseModel):
        for name in type(before).model_fields.keys() & kind.model_fields.keys() - set(HIDDEN):
            same = type(before).model_fields[name].annotation == kind.model_fields[name].annotation
            if same and type(before).model_fields[name].title == kind.model_fields[name].title:
                values[name] = getattr(before, name)
    for name in _files(kind):
        values[name] = file if name == "path" else {"path": file, "srgb": False}
    return kind(**values)


def _files(kind: type[BaseModel]) -> list[str]:
    """Fields that a person must choose a file for before this kind can be."""
    return [
        name
        for name, field in kind.model_fields.items()
        if field.is_required() and (name == "path" or field.annotation is Texture)
    ]


def choice_label(value: Any) -> str:
    """What one value of a choice is called."""
    if value in UNITS:
        return str(value)
    return "None" if value is None else words(value) if isinstance(value, str) else str(value)


def words(name: str) -> str:
    """WeldTee, weld_tee, weld-tee -> Weld tee; what is written in capitals stays."""
    if name.isupper() or name in NAMES:
        return NAMES.get(name, name)
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", " ", name).translate(BLANKS).lower()
    return spaced[:1].upper() + spaced[1:]


def kind_label(model: type[BaseModel]) -> str:
    """What a kind of shape, light or motion is called."""
    return NAMES.get(model.__name__, words(model.__name__))


def _field(owner: type[BaseModel], name: str, field: FieldInfo, value: Any) -> FieldSpec:
    annotation, limits = _open(field.annotation, field.metadata)
    default = REQUIRED if field.default is PydanticUndefined else field.default
    extra = field.json_schema_extra
    stored = str(extra.get("unit", "")) if isinstance(extra, dict) else ""
    unit = Unit.of(stored, FINE_UNITS.get((owner, name), ""))
    return _spec(owner, name, annotation, limits, value, default, _label(name, field), field.description or "", unit)


def _label(name: str, field: FieldInfo) -> str:
    return field.title or LABELS.get(name) or words(name)


def _spec(owner: type[BaseModel], name: str, annotation: Any, limits: list[Any], value: Any, default: Any, label: str,  # noqa: PLR0913
          help: str, unit: Unit = PLAIN) -> FieldSpec:  # fmt: skip
    members = [annotation]
    if get_origin(annotation) in (Union, UnionType):
        members = list(get_args(annotation))
    optional = NoneType in members
    members = [member for member in members if member is not NoneType]
    only, own_limits = _open(members[0], limits)
    models = all(isinstance(_open(m, [])[0], type) and issubclass(_open(m, [])[0], BaseModel) for m in members)
    common: dict[str, Any] = {
        "name": name,
        "label": label,
        "help": help,
        "value": value,
        "default": default,
        "unit": unit,
    }
    if len(members) > 1 or (optional and models):
        return _union(common, [None] * optional + members, value)
    common |= {"optional": optional, "assign": LINKED.get((owner, name)), **_limits(own_limits)}
    origin = get_origin(only)
    if origin is Literal:
        return FieldSpec(kind="choice", choices=(None,) * optional + get_args(only), **common)
    if origin is tuple:
        return _tuple(owner, common, get_args(only), value)
    if only is Pose:
        return FieldSpec(kind="pose", **common)
    if only is SpectralCurve:
        return FieldSpec(kind="curve", **common)
    if isinstance(only, type) and issubclass(only, BaseModel):
        common["help"] = help or first_sentence(only)
        return FieldSpec(kind="model", fields=describe(value), **common)
    kinds: dict[Any, Kind] = {
        bool: "flag",
        int: "integer",
        float: "number",
        str: "file" if name in ("path", "logo") else "text",
    }
    return FieldSpec(kind=kinds[only], **common)


def _union(common: dict[str, Any], members: list[Any], value: Any) -> FieldSpec:
    alternatives, chosen = [], -1
    for i, member in enumerate(members):
        kind, limits = (None, []) if member is None else _open(member, [])
        if get_origin(kind) is tuple:
            kind = tuple
        is_model = isinstance(kind, type) and issubclass(kind, BaseModel)
        if kind is None:
            alternatives.append(Alternative("None", "", None))
        elif is_model:
            alternatives.append(Alternative(kind_label(kind), first_sentence(kind), kind, bool(_files(kind))))
        else:
            alternatives.append(Alternative("One value" if kind is float else "R, G, B", "", kind))
        if value is None if kind is None else isinstance(value, kind):
            chosen = i
    fields: tuple[FieldSpec, ...] = ()
    if isinstance(value, BaseModel):
        fields = describe(value)
    elif value is not None:
        kind, limits = _open(members[chosen], [])
        inner = {
            **common,
            "name": "",
            "default": REQUIRED,
            "help": "",
            "label": "Values" if kind is not float else "Value",
        }
        fields = (
            (_tuple(Camera, inner, get_args(kind), value),)
            if isinstance(value, tuple)
            else (FieldSpec(kind="number", **inner, **_limits(limits)),)
        )
    return FieldSpec(kind="union", alternatives=tuple(alternatives), chosen=chosen, fields=fields, **common)


def _tuple(owner: type[BaseModel], common: dict[str, Any], args: tuple[Any, ...], value: tuple[Any, ...]) -> FieldSpec:
    element, limits = _open(args[0], [])
    if element in (float, int):
        length = None if args[-1] is Ellipsis else len(args)
        return FieldSpec(kind="numbers", length=length, **common | _limits(limits))
    numbered = len(value) > 1
    items = [
        _spec(owner, str(i), element, limits, item, REQUIRED, f"{common['label']} {i + 1}" if numbered else "Curve", "")
        for i, item in enumerate(value)
    ]
    if common["name"] == "efficiency" and len(items) == 3:
        items = [_renamed(item, band) for item, band in zip(items, ("Red", "Green", "Blue"), strict=True)]
    return FieldSpec(kind="list", fields=tuple(items), **common)


def _renamed(spec: FieldSpec, label: str) -> FieldSpec:
    return replace(spec, label=label)


def first_sentence(model: type[BaseModel]) -> str:
    """Of the class's docstring."""
    return re.split(r"(?<=[.:])\s", (model.__doc__ or "").strip(), maxsplit=1)[0].rstrip(":")


def _open(annotation: Any, metadata: list[Any]) -> tuple[Any, list[Any]]:
    """The type in an Annotated, and the limits that were on it."""
    limits = list(metadata)
    while get_origin(annotation) is Annotated:
        annotation, *extra = get_args(annotation)
        for item in extra:
            limits += item.metadata if isinstance(item, FieldInfo) else [item]
    return annotation, limits


def _limits(metadata: list[Any]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for item in metadata:
        for key, name, is_open in (
            ("ge", "low", False),
            ("gt", "low", True),
            ("le", "high", False),
            ("lt", "high", True),
        ):
            if (limit := getattr(item, key, None)) is not None:
                found |= {name: float(limit), f"{name}_open": is_open}
    return found


def _is_item(annotation: Any) -> bool:
    """The field holds an item of the tree, or several."""
    annotation = _open(annotation, [])[0]
    if get_origin(annotation) in (tuple, Union, UnionType):
        return any(_is_item(part) for part in get_args(annotation))
    return annotation in ITEMS
