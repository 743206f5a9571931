"""Every number of a project has limits, and at each limit the program measures or refuses: never NaN, never a fault."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import numpy as np
import pytest
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from analysis.line.settings import ExtractionSettings
from render.base.errors import InputError
from render.base.pose import Pose
from render.camera.camera import Camera, Lens
from render.laser.laser import LineLaser, Waist
from render.material.material import Coated, Conductor, Emitter, Glass, Lambertian, Material, Subsurface
from render.scene.lights import Environment, PointLight, RectangleLight
from render.scene.motion import LinearStage, Motion, NoMotion, PoseList, Turntable
from render.scene.scene import Rig, Scene, SceneObject
from render.scene.settings import RenderSettings
from render.scene.shape import Box, Cylinder, Plane, Shape, Sphere, StepBlock, VGroove, WeldTee
from render.sensor.sensor import BandPass, Sensor, SpectralCurve
from studio.project.document import FieldPath, replaced
from studio.project.project import MAX_SEED, Project
from studio.scan.options import ScanOptions
from studio.scan.scan import run_scan

SIDE = 40
ROOT = Path("/nowhere")
HEAVY = ("width", "height", "segments", "triangles", "light_paths", "ambient_samples")


def numbers(annotation: Any, metadata: list[Any], where: str) -> Iterator[tuple[str, type, list[Any]]]:
    """Each number in a type, unions, tuples and models followed: where it is, float or int, and its constraints."""
    origin = get_origin(annotation)
    if origin is Annotated:
        inner, *extra = get_args(annotation)
        for item in extra:
            metadata = metadata + (list(item.metadata) if isinstance(item, FieldInfo) else [item])
        yield from numbers(inner, metadata, where)
    elif origin in (Union, UnionType):
        for part in get_args(annotation):
            yield from numbers(part, metadata, where)
    elif origin is tuple:
        for i, part in enumerate(get_args(annotation)):
            yield from numbers(part, [], f"{where}[{i}]")
    elif isinstance(annotation, type) and issubclass(annotation, BaseModel):
        for name, field in annotation.model_fields.items():
            yield from numbers(field.annotation, list(field.metadata), f"{where}.{name}")
    elif annotation in (float, int):
        yield where, annotation, metadata
    else:
        assert origin is Literal or annotation in (str, bool, type(None), Ellipsis), (where, annotation)


def ends(metadata: list[Any]) -> tuple[float | None, float | None]:
    """Lowest and highest number that the constraints name."""
    low = [getattr(item, name) for item in metadata for name in ("ge", "gt") if getattr(item, name, None) is not None]
    high = [getattr(item, name) for item in metadata for name in ("le", "lt") if getattr(item, name, None) is not None]
    return max(low, default=None), min(high, default=None)


def test_every_number_of_a_project_has_a_lower_and_an_upper_limit() -> None:
    found = {where: ends(metadata) for where, _, metadata in numbers(Project, [], "project")}
    assert len(found) > 150
    assert [where for where, both in found.items() if any(end is None or not math.isfinite(end) for end in both)] == []


def test_no_number_may_come_as_near_to_zero_as_it_likes_where_zero_is_refused() -> None:
    """Of "more than 0" 1e-300 is allowed, whose square is 0."""
    for where, kind, metadata in numbers(Project, [], "project"):
        assert kind is int or all(getattr(item, "gt", None) != 0 for item in metadata), where


def base(
    shape: Shape | None = None, material: Material | None = None, motion: Motion | None = None, **lights: Any
) -> Project:
    """A camera of few pixels 0.5 m above a thing, by default a grey plane at rest; every optional number is there."""
    camera = Camera(
        width=SIDE, height=SIDE, fx=60, fy=60, cx=19.5, cy=19.5, pixel_pitch=1e-4,
        distortion=(-0.1, 0.01, 1e-4, 1e-4, 1e-3, 0.01, 1e-3, 1e-3, 1e-4, 1e-4, 1e-4, 1e-4, 0.01, 0.01),
        lens=Lens(f_number=8.0, focus_distance=0.5),
    )  # fmt: skip
    beside = Pose(translation=(0.15, 0.0, 0.0), rotation=(0.0, -0.29, 0.0))
    lasers = (LineLaser(name="a", T_rig_laser=beside), LineLaser(name="b", sheet=Waist(), T_rig_laser=beside))
    rig = Rig(T_world_rig=Pose(translation=(0, 0, 0.5), rotation=(math.pi, 0, 0)), camera=camera, lasers=lasers)
    thing = SceneObject(name="thing", shape=shape or Plane(), material=material or Lambertian())
    sensor = Sensor(
        efficiency=(SpectralCurve(wavelength_nm=(400, 700), value=(0.5, 0.5)),), band_pass=BandPass(), gain=0.3
    )
    return Project(
        seed=1,
        scene=Scene(rig=rig, objects=(thing,), motion=motion or NoMotion(), **lights),
        sensor=sensor,
        render=RenderSettings(transport="direct", max_bounces=2, clamp=1.0, laser_clamp=1.0, ambient_samples=1),
        extraction=ExtractionSettings(width=1.0, nearest=0.1, farthest=1.0),
    )


STARTS = {
    "plane": base(),
    **{type(shape).__name__: base(shape=shape) for shape in (
        Box(), Sphere(segments=16), Cylinder(segments=16), StepBlock(), VGroove(), WeldTee(triangles=500))},
    **{type(material).__name__: base(material=material) for material in (
        Conductor(roughness_across=0.2), Coated(), Glass(index=1.5), Subsurface(), Emitter())},
    **{type(motion).__name__: base(motion=motion) for motion in (
        LinearStage(steps=2), Turntable(steps=2), PoseList(poses=(Pose(),)))},
    "lights": base(
        lights=(PointLight(T_world_light=Pose(translation=(0, 0, 1))), RectangleLight()),
        environment=Environment(radiance=(0.1, 0.1, 0.1)),
    ),
}  # fmt: skip


def leaves(
    node: Any, annotation: Any, metadata: list[Any], path: FieldPath
) -> Iterator[tuple[FieldPath, float, float]]:
    """Path and both ends of each number that is there."""
    if isinstance(node, BaseModel):
        for name, field in type(node).model_fields.items():
            yield from leaves(getattr(node, name), field.annotation, list(field.metadata), (*path, name))
    elif isinstance(node, tuple):
        for i, item in enumerate(node):
            kinds = [part for part in (get_args(annotation) or ()) if get_origin(part) is tuple] or [annotation]
            while get_origin(kinds[0]) is Annotated:
                kinds = [get_args(kinds[0])[0]]
            yield from leaves(item, get_args(kinds[0])[0], [], (*path, i))
    elif isinstance(node, float | int) and not isinstance(node, bool):
        for _, kind, found in numbers(annotation, metadata, ""):
            low, high = ends(found)
            assert low is not None and high is not None
            yield path, kind(low), kind(high)
            break


def cases() -> list[Any]:
    """Each number of each start at either end, once: what the first start holds is not repeated by the others.

    Each fourth is tried in any case, all of them by `make validate`.
    """
    found, seen = [], set()
    for name, project in STARTS.items():
        for path, low, high in leaves(project, Project, [], ()):
            key = path if path[:2] != ("scene", "objects") else (type(project.scene.objects[0].shape), *path)
            key = (type(project.scene.motion), *key) if "motion" in path else key
            key = (type(project.scene.objects[0].material), *key) if "material" in path else key
            if key in seen or path[0] == "schema_version":
                continue
            seen.add(key)
            where = ".".join(map(str, path))
            for value in (low, high):
                if not (path[-1] in HEAVY and value > 1000):  # allowed, but more work than a test may take
                    marks = [] if len(found) % 12 == 0 else [pytest.mark.validation]
                    found.append(pytest.param(name, path, value, id=f"{name}-{where}-{value:g}", marks=marks))
    return found


def check(project: Project, folder: Path) -> None:
    """Measure one frame: finite figures, or a refusal in words."""
    try:
        done = run_scan(project, ROOT, out=folder, options=ScanOptions(steps=1, threads=1, report=False))
    except InputError as error:
        assert "nan" not in str(error).replace("NaN or infinite", "")
    else:
        json.dumps(done.manifest["results"], allow_nan=False)


@pytest.mark.parametrize(("start", "path", "value"), cases())
def test_at_its_limit_every_number_gives_finite_figures_or_is_refused(
    start: str, path: FieldPath, value: float, tmp_path: Path
) -> None:
    try:
        project = replaced(STARTS[start], path, value)
    except InputError:
        return
    check(project, tmp_path)


@pytest.mark.parametrize(
    "number", [pytest.param(n, marks=[] if n < 20 else pytest.mark.validation) for n in range(400)]
)
def test_several_numbers_at_their_limits_give_finite_figures_or_are_refused(number: int, tmp_path: Path) -> None:
    random = np.random.default_rng(number)
    project = list(STARTS.values())[number % len(STARTS)]
    ends = [end for end in leaves(project, Project, [], ()) if end[0] != ("schema_version",)]
    for i in random.choice(len(ends), 4, replace=False):
        path, low, high = ends[i]
        value = low if random.random() < 0.5 else high
        if not (path[-1] in HEAVY and value > 1000):
            with suppress(InputError):
                project = replaced(project, path, value)
    check(project, tmp_path)


@pytest.mark.parametrize("seed", [2**53, MAX_SEED])
def test_the_largest_seeds_work_for_every_light_group(seed: int, tmp_path: Path) -> None:
    lit = STARTS["lights"]
    render = RenderSettings(transport="interreflection", light_paths=2**20, indirect_error=1.0, ambient_samples=1)
    sensor = lit.sensor.model_copy(update={"speckle": "polarised"})
    extraction = ExtractionSettings(exposures=2)
    project = lit.model_copy(update={"seed": seed, "render": render, "sensor": sensor, "extraction": extraction})
    assert run_scan(project, ROOT, out=tmp_path, options=ScanOptions(threads=1, report=False)).manifest["seed"] == seed
