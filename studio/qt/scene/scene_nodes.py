"""The items of the scene tree, worked out from the project: what each is called, and what it stands for."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtCore import Qt

from analysis.report.colour import method_name
from studio.editing.forms import kind_label
from studio.editing.scene_edits import LASERS, LIGHTS, OBJECTS
from studio.editing.units import Unit
from studio.project.document import FieldPath
from studio.project.project import Project
from studio.qt.scene.scene_icons import icon_name

PATH, DETAIL = Qt.ItemDataRole.UserRole, Qt.ItemDataRole.UserRole + 1
NAME, EYE = 0, 1


@dataclass(frozen=True)
class Node:
    """One line of the tree."""

    path: FieldPath
    parent: FieldPath | None
    name: str
    detail: str = ""
    icon: tuple[str, str] = ("", "")
    visible: bool | None = None
    """None: it cannot be hidden."""
    problem: str = ""
    """Why it is not as it is set."""


def nodes(project: Project) -> list[Node]:
    """The tree from top to bottom."""
    scene = project.scene
    rig: FieldPath = ("scene", "rig")
    camera = scene.camera
    found = [
        Node((), None, project.name),
        Node(rig, (), "Rig"),
        Node((*rig, "camera"), rig, "Camera", f"{camera.width} x {camera.height}"),
        Node(LASERS, rig, "Lasers"),
    ]
    for i, laser in enumerate(scene.lasers):
        detail = f"{Unit.of('W').with_unit(laser.power)}, {laser.wavelength_nm:g} nm"
        found.append(Node((*LASERS, i), LASERS, laser.name, detail))
    found.append(Node(OBJECTS, (), "Objects"))
    for i, item in enumerate(scene.objects):
        kind = kind_label(type(item.shape)).lower()
        kind = "" if item.name.startswith(kind) else kind
        found.append(Node((*OBJECTS, i), OBJECTS, item.name, kind, visible=item.visible))
    found.append(Node(LIGHTS, (), "Lights"))
    found += [
        Node((*LIGHTS, i), LIGHTS, light.name, kind_label(type(light)).lower()) for i, light in enumerate(scene.lights)
    ]
    frames = "" if scene.motion.kind == "none" else f", {scene.frame_count} frames"
    motion = "single frame" if scene.motion.kind == "none" else kind_label(type(scene.motion)).lower() + frames
    found += [
        Node(("scene", "environment"), (), "Environment"),
        Node(("scene", "motion"), (), "Motion", motion),
        Node(("sensor",), (), "Sensor", Unit.of("s").with_unit(project.sensor.exposure_time)),
        Node(("render",), (), "Render"),
        Node(("extraction",), (), "Extraction", method_name(project.extraction.method)),
        Node(("delivery",), (), "Report", project.delivery.customer),
    ]
    return [Node(n.path, n.parent, n.name, n.detail, icon_name(project, n.path), n.visible) for n in found]
