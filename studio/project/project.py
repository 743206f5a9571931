"""The project: everything that decides a scan, in one JSON file beside the meshes and textures it names."""

from __future__ import annotations

import difflib
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, Self

from pydantic import PrivateAttr, ValidationError, model_validator
from pydantic_core import to_jsonable_python

from analysis.gauges.gauge import MOST_GAUGES, Gauge
from analysis.line.settings import ExtractionSettings
from analysis.report.delivery import Delivery
from render.base.errors import InputError
from render.base.files import atomic_write, inside, remove_unfinished, sha256
from render.base.model import Model, quantity
from render.scene.scene import Scene
from render.scene.settings import RenderSettings
from render.scene.shape import MeshFile
from render.sensor.sensor import Sensor
from studio.project.calibration import Calibration, from_file_data, read_calibration_file
from studio.project.found_motion import motion_fault
from studio.project.migrations import migrate
from studio.project.same_lasers import of_same_lasers
from studio.project.strict_json import parse_object, pretty, read_object
from studio.project.templates import DESCRIPTIONS, template_folder
from studio.project.validation_messages import input_error

MAX_SEED = 2**63 - 1
ProfileSection = Literal["laser_plane", "upright", "across_x", "across_y", "across_z"]
"""A plane through the part: the laser's, a vertical one, or across an axis of the world."""
READ_OFF = ("measures", "measured_in", "delivery")
"""Fields that neither render nor develop nor find a line: they say what is read off it, and how it is told."""
_KEY = re.compile(r"([A-Za-z_]\w*)|\[(\d+)\]")
"""A part of a path: a name, or an index."""


class Project(Model):
    """Frozen; what a file leaves out takes the defaults, and what it should not hold is refused.

    >>> import studio as blazer
    >>> project = blazer.Project.load("plane")
    >>> project.scene.camera.width, project.scene.lasers[0].power
    (2448, 0.02)
    """

    schema_version: Literal[2] = 2
    name: str = quantity("untitled", label="Name", min_length=1, max_length=200)
    seed: int = quantity(0, label="Seed", help="Decides every random number of the scan.", ge=0, le=MAX_SEED)
    scene: Scene
    sensor: Sensor = Sensor()
    render: RenderSettings = RenderSettings()
    extraction: ExtractionSettings = ExtractionSettings()
    calibration: Calibration = Calibration()
    measures: tuple[Gauge, ...] = quantity(
        (), label="Measures", help="Dimensions of the part, read off every profile.", max_length=MOST_GAUGES
    )
    measured_in: ProfileSection = quantity(
        "laser_plane", label="Measured in", help="The section of the part that profiles and measures are of."
    )
    delivery: Delivery = Delivery()
    _folder: Path = PrivateAttr(default_factory=Path)

    @property
    def render_settings(self) -> RenderSettings:
        """`render`, with the truth of pixels wherever the sensor's defocus needs their depth."""
        if self.render.truth_images or not self.sensor.needs_depth(self.scene.camera.lens.model):
            return self.render
        return self.render.model_copy(update={"truth_images": True})

    @model_validator(mode="after")
    def _every_laser_is_calibrated(self) -> Self:
        found, given, lasers = self.calibration, self.calibration.laser_count, len(self.scene.lasers)
        if given not in (0, lasers):
            what = "covariances" if found.covariances else "planes"
            raise ValueError(f"calibration has {given} {what}; allowed: none, or {lasers}, one for each laser")
        if fault := motion_fault(found.motion, self.scene):
            raise ValueError(fault)
        camera = self.scene.camera
        if found.camera is not None and (found.camera.width, found.camera.height) != (camera.width, camera.height):
            # photographs cut or scaled have another principal point, and a covariance of other pixels
            theirs, own = (f"{one.width} x {one.height}" for one in (found.camera, camera))
            raise ValueError(f"calibration.camera is of {theirs} px; allowed: {own} px, as the scene's camera")
        terms = len(found.camera_of(camera).distortion)
        for i, rows in enumerate(found.covariances):
            if len(rows) not in (8, 8 + terms):
                raise ValueError(f"calibration.covariances[{i}] has {len(rows)} rows; allowed: 8 or {8 + terms}")
        return self

    @model_validator(mode="after")
    def _only_raw_images_are_combined(self) -> Self:
        if self.sensor.processing is not None and (self.extraction.exposures > 1 or self.extraction.spacetime):
            asked = "along time" if self.extraction.spacetime else f"{self.extraction.exposures} exposures"
            raise ValueError(
                f"extraction asks for {asked}, which needs raw images, and sensor.processing makes photographs; "
                "allowed: one of the two"
            )
        return self

    @model_validator(mode="after")
    def _every_measure_has_its_profile(self) -> Self:
        lasers, steps = len(self.scene.lasers), self.scene.frame_count
        names = [gauge.name for gauge in self.measures]
        for i, gauge in enumerate(self.measures):
            wrong = ""
            if gauge.laser >= lasers:
                wrong = f"laser is {gauge.laser}; allowed: less than {lasers}, the number of lasers"
            elif gauge.step is not None and gauge.step >= steps:
                wrong = f"step is {gauge.step}; allowed: less than {steps}, the number of steps"
            elif gauge.name in names[:i]:
                wrong = f"name is {gauge.name!r}, as of another; allowed: each name once"
            if wrong:
                raise ValueError(f"measures[{i}].{wrong}")
        return self

    @property
    def folder(self) -> Path:
        """What the paths of meshes and textures start from: the file's folder, of a project made in Python ".".

        Not part of the project: two that differ in nothing else are equal.
        """
        return self._folder

    def in_folder(self, folder: Path | str) -> Self:
        """The same project, whose meshes and textures are looked for below another folder."""
        copied = self.model_copy()
        copied._folder = Path(folder)
        return copied

    @classmethod
    def load(cls, path: Path | str) -> Self:
        """Read, migrate and validate a project: a file, a folder with one, or, as a str, the name of a template.

        What lies at the path comes before the template of that name.
        InputError: one message for all that is wrong with it.
        """
        try:
            file = project_file(template_or_path(path) if isinstance(path, str) else Path(path))
        except TypeError:
            kind = type(path).__name__
            allowed = "a template's name or a path"
            raise InputError("a project is loaded by name", found=kind, allowed=allowed) from None
        data = read_object(file)
        if isinstance(data.get("calibration"), str):
            data["calibration"] = _read_calibration(file, data["calibration"])
        return cls.from_data(data, str(file)).in_folder(file.parent)

    @classmethod
    def from_text(cls, text: str, where: str = "project") -> Self:
        """As `load`, from the file's text. `where` names the source in messages."""
        return cls.from_data(parse_object(text, where), where)

    @classmethod
    def from_data(cls, data: dict[str, Any], where: str = "project") -> Self:
        """As `load`, from the file's JSON object."""
        if "base" in data and "scene" not in data:
            kind, place = ("study", "Study") if "sweeps" in data else ("recipe of a dataset", "Dataset")
            raise InputError(f"a {kind}, not a project", where=where, cure=f"open it in the workspace {place}")
        data = migrate(data, where)
        try:
            # through JSON text, because only there strict validation takes a list for a tuple
            return cls.model_validate_json(json.dumps(data), strict=True)
        except ValidationError as error:
            raise input_error(error, cls, data, where) from None

    def replaced(self, values: Mapping[str, Any]) -> Self:
        """The same project with other values, by their places: {"scene.rig.lasers[0].power": 0.05}.

        values: models, or plain data as in the file; all are taken before the whole is checked.
        InputError: there is no such place, or a value is not allowed.

        >>> import studio as blazer
        >>> project = blazer.Project.load("plane").replaced({"seed": 3, "scene.rig.lasers[0].power": 0.05})
        >>> project.seed, project.scene.lasers[0].power
        (3, 0.05)
        """
        data = self.model_dump(mode="json")
        for place, value in values.items():
            keys = [int(index) if index else name for name, index in _KEY.findall(place)]
            node: Any = data
            for key in keys[:-1]:
                node = node[_there(key, node, place)]
            node[_there(keys[-1] if keys else place, node, place)] = to_jsonable_python(value)
        return self.from_data(data, "replaced").in_folder(self.folder)

    def read_as(self, other: Self) -> Self:
        """The same project, with what `other` reads off what was measured: measures of the part, each of the same laser
        as there, and the report; and with its name, by which a report is called."""
        own = of_same_lasers(other.measures, other.scene, self.scene)
        return self.model_copy(
            update={**{name: getattr(other, name) for name in READ_OFF}, "measures": own, "name": other.name}
        )

    def to_text(self) -> str:
        """The file's text: every value written out, so that a project outlives a change of defaults."""
        return pretty(self.model_dump(mode="json")) + "\n"

    def save(self, path: Path | str) -> Self:
        """Write the file, whole or not at all, with the digest of every mesh file; returns what was written."""
        target = Path(path)
        signed = self.with_digests(target.parent)
        with atomic_write(target) as temporary:
            temporary.write_text(signed.to_text(), encoding="utf-8")
        remove_unfinished(target)
        return signed.in_folder(target.parent)

    def with_digests(self, root: Path) -> Self:
        """The same project with the SHA-256 of each mesh file found below `root`; a missing mesh keeps what it had."""
        objects = []
        for i, item in enumerate(self.scene.objects):
            if isinstance(item.shape, MeshFile):
                file = inside(root, item.shape.path, f"scene.objects[{i}].shape.path")
                if file.is_file():
                    item = item.model_copy(update={"shape": item.shape.model_copy(update={"sha256": sha256(file)})})
            objects.append(item)
        scene = self.scene.model_copy(update={"objects": tuple(objects)})
        return self.model_copy(update={"scene": scene})


def _read_calibration(project: Path, name: str) -> dict[str, Any]:
    """What a project takes over from the calibration file that it names. InputError: it is none."""
    where = f"{project}: calibration"
    return from_file_data(read_calibration_file(inside(project.parent, name, where), f"{where} {name!r}"))


def _there(key: str | int, node: Any, place: str) -> Any:
    """The key. InputError: the node, an object or a list of the project file, does not have it."""
    keys = range(len(node)) if isinstance(node, list) else node if isinstance(node, dict) else ()
    if key not in keys:
        allowed = ", ".join(str(one) for one in keys) or "nothing below it"
        raise InputError("the project has no such place", where=f"{place!r}", found=str(key), allowed=allowed)
    return key


def template_or_path(name: str) -> Path:
    """What a word means. InputError: neither a path that is there nor a template, and it does not look like a path."""
    path = Path(name)
    if not name.strip() or path.exists() or path.suffix or len(path.parts) != 1:
        return path
    if name in DESCRIPTIONS:
        return template_folder(name)
    near = difflib.get_close_matches(name, DESCRIPTIONS, n=1)
    raise InputError(
        "there is no such project",
        found=name,
        allowed=f"a file, a folder, or a template: {', '.join(DESCRIPTIONS)}",
        cure=f"did you mean {near[0]}?" if near else "",
    )


def project_file(path: Path) -> Path:
    """The project file meant by a path: itself, or the only project in a folder. InputError: none, or several."""
    if not path.is_dir():
        return path
    found = sorted(file for file in path.glob("*.json") if not file.name.startswith("."))  # no half-written ones
    named = [file for file in found if file.name == "project.json"] or found
    if len(named) != 1:
        names = ", ".join(file.name for file in named[:5]) or "none"
        raise InputError("the folder does not hold one project", where=str(path), found=names, allowed="one .json file")
    return named[0]
