"""Blazer Studio as a package: from a project to points and their errors, in a few lines.

    import studio as blazer
    project = blazer.Project.load("weld_seam")           # a template's name, a file, or a folder
    frame   = blazer.render(project, error=0.01)         # light groups + truth; frame.plan, frame.quality
    image   = blazer.develop(frame)                      # electrons -> digital numbers; milliseconds
    line    = blazer.extract(image, method="likelihood") # u, v, sigma_u, width, flags
    points  = blazer.triangulate(line)
    errors  = blazer.compare(points, frame)              # errors.depth_z.rmse, errors.completeness
    blazer.write_report("report.html", frame, image, line, points, errors)

A scene can be made in Python as well: `Project(scene=Scene(rig=Rig(camera=..., lasers=(...,)), objects=(...,)))`.
What is bad about an input of a function or a file is one `InputError`; a model that is made with a bad value raises
pydantic's `ValidationError`, which names the field. Both are a `ValueError`.

Below are the program's rooms: project file, scan, desktop.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from analysis.line.result import Flag as Flag
    from analysis.line.settings import ExtractionSettings as ExtractionSettings
    from render.base.errors import Cancelled as Cancelled
    from render.base.errors import InputError as InputError
    from render.base.pose import Pose as Pose
    from render.camera.camera import Camera as Camera
    from render.camera.camera import Lens as Lens
    from render.laser.laser import Divergence as Divergence
    from render.laser.laser import LineLaser as LineLaser
    from render.laser.laser import Waist as Waist
    from render.material.material import Blend as Blend
    from render.material.material import Coated as Coated
    from render.material.material import Conductor as Conductor
    from render.material.material import Emitter as Emitter
    from render.material.material import Glass as Glass
    from render.material.material import Lambertian as Lambertian
    from render.material.material import Subsurface as Subsurface
    from render.material.material import Texture as Texture
    from render.plan import GroupQuality as GroupQuality
    from render.plan import Plan as Plan
    from render.plan import TransportStep as TransportStep
    from render.scene.lights import Environment as Environment
    from render.scene.lights import PointLight as PointLight
    from render.scene.lights import RectangleLight as RectangleLight
    from render.scene.motion import LinearStage as LinearStage
    from render.scene.motion import PoseList as PoseList
    from render.scene.motion import Turntable as Turntable
    from render.scene.scene import Rig as Rig
    from render.scene.scene import Scene as Scene
    from render.scene.scene import SceneObject as SceneObject
    from render.scene.settings import RenderSettings as RenderSettings
    from render.scene.shape import Box as Box
    from render.scene.shape import Cylinder as Cylinder
    from render.scene.shape import MeshFile as MeshFile
    from render.scene.shape import Plane as Plane
    from render.scene.shape import Sphere as Sphere
    from render.scene.shape import StepBlock as StepBlock
    from render.scene.shape import VGroove as VGroove
    from render.scene.shape import WeldTee as WeldTee
    from render.scene.wear import Wear as Wear
    from render.sensor.sensor import BandPass as BandPass
    from render.sensor.sensor import Sensor as Sensor
    from render.sensor.sensor import SpectralCurve as SpectralCurve
    from studio.notebook.frame import RenderedFrame as RenderedFrame
    from studio.notebook.frame import render as render
    from studio.notebook.measuring import DevelopedImage as DevelopedImage
    from studio.notebook.measuring import ExtractedLine as ExtractedLine
    from studio.notebook.measuring import PointErrors as PointErrors
    from studio.notebook.measuring import TriangulatedPoints as TriangulatedPoints
    from studio.notebook.measuring import compare as compare
    from studio.notebook.measuring import develop as develop
    from studio.notebook.measuring import extract as extract
    from studio.notebook.measuring import triangulate as triangulate
    from studio.notebook.report import write_report as write_report
    from studio.project.project import Project as Project

_HOMES = {
    "analysis.line.result": "Flag",
    "analysis.line.settings": "ExtractionSettings",
    "render.base.errors": "Cancelled InputError",
    "render.base.pose": "Pose",
    "render.camera.camera": "Camera Lens",
    "render.laser.laser": "Divergence LineLaser Waist",
    "render.material.material": "Blend Coated Conductor Emitter Glass Lambertian Subsurface Texture",
    "render.plan": "GroupQuality Plan TransportStep",
    "render.scene.lights": "Environment PointLight RectangleLight",
    "render.scene.motion": "LinearStage PoseList Turntable",
    "render.scene.scene": "Rig Scene SceneObject",
    "render.scene.settings": "RenderSettings",
    "render.scene.shape": "Box Cylinder MeshFile Plane Sphere StepBlock VGroove WeldTee",
    "render.scene.wear": "Wear",
    "render.sensor.sensor": "BandPass Sensor SpectralCurve",
    "studio.notebook.frame": "RenderedFrame render",
    "studio.notebook.measuring": "DevelopedImage ExtractedLine PointErrors TriangulatedPoints "
    "compare develop extract triangulate",
    "studio.notebook.report": "write_report",
    "studio.project.project": "Project",
}
"""Where each name is made; the imports above are the same for type checkers."""
_HOME = {name: module for module, names in _HOMES.items() for name in names.split()}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    """PEP 562: numba, numpy and pydantic are loaded with the first name that is used, not with the package."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    value = globals()[name] = getattr(import_module(_HOME[name]), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME})
