"""What a render can still answer: the sensor, a pinhole's lens and the lasers' power change without rendering again.

A render is stale when the project has changed in anything else that light meets.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.line.settings import Method
from render.base.errors import Cancelled
from render.base.threads import Cancel
from render.camera.camera import Lens
from render.frame import Frame
from render.scene.motion import NoMotion
from render.scene.scene import Scene
from render.scene.shape import MeshFile
from render.sensor.develop import Image, develop
from render.world.world import World
from studio.project.project import Project
from studio.project.same_lasers import same_lasers
from studio.scan.exposure import expose
from studio.scan.stages import Clock, Measurement, measure_step, scaled


@dataclass(frozen=True)
class Development:
    """How to develop a frame: the project as it is now, as far as the frame allows."""

    project: Project
    """The render's scene with the present sensor, lens, extraction and calibration."""
    laser_power: tuple[float, ...]
    """W, of each laser."""

    @property
    def powered(self) -> Project:
        """The project whose lasers have these powers."""
        scene = self.project.scene
        lasers = tuple(
            laser.model_copy(update={"power": power})
            for laser, power in zip(scene.lasers, self.laser_power, strict=True)
        )
        rig = scene.rig.model_copy(update={"lasers": lasers})
        return self.project.model_copy(update={"scene": scene.model_copy(update={"rig": rig})})


def is_stale(rendered: Project, now: Project, *, still: bool = False) -> bool:
    """Another render would show something that developing again cannot. Both projects at full scale.

    still: it is of the first step alone, which a motion that begins there leaves as it was.
    """
    if rendered.extraction.axis != now.extraction.axis:
        return True
    before, scene = rendered.scene, now.scene
    if before is scene:
        return False
    if len(before.lasers) != len(scene.lasers):
        return True
    if still:
        before, scene = _at_rest(before), _at_rest(scene)
    # a laser that was off left no light to scale
    lit = any(a.power == 0.0 < b.power for a, b in zip(before.lasers, scene.lasers, strict=True))
    return lit or light_path(_signed_alike(before, scene)) != light_path(_signed_alike(scene, before))


def _at_rest(scene: Scene) -> Scene:
    """Without its motion, where that begins with the poses as they are."""
    begins = np.array_equal(scene.motion.displacement(0), np.eye(4))
    return scene.model_copy(update={"motion": NoMotion()}) if begins else scene


def _signed_alike(scene: Scene, other: Scene) -> Scene:
    """Without the digests of mesh files that the other does not have: saving writes them, and nothing is another."""
    if len(scene.objects) != len(other.objects):
        return scene
    objects = []
    for item, its in zip(scene.objects, other.objects, strict=True):
        if isinstance(item.shape, MeshFile) and isinstance(its.shape, MeshFile) and its.shape.sha256 is None:
            item = item.model_copy(update={"shape": item.shape.model_copy(update={"sha256": None})})
        objects.append(item)
    return scene.model_copy(update={"objects": tuple(objects)})


def light_path(scene: Scene) -> Scene:
    """The scene without what developing decides, and without names."""
    lens = scene.camera.lens
    # a thin lens is rendered through its aperture; all else of it only scales the light
    rendered = {"transmission": 1.0, "vignetting": True}
    lens = lens.model_copy(update=rendered) if lens.model == "thin-lens" else Lens()
    camera = scene.camera.model_copy(update={"lens": lens})
    lasers = tuple(laser.model_copy(update={"power": 1.0, "name": "laser"}) for laser in scene.lasers)
    objects = tuple(item.model_copy(update={"name": "object"}) for item in scene.visible_objects)
    lights = tuple(light.model_copy(update={"name": "light"}) for light in scene.lights)
    rig = scene.rig.model_copy(update={"camera": camera, "lasers": lasers})
    return scene.model_copy(update={"rig": rig, "objects": objects, "lights": lights})


def _developing_lens(rendered: Lens, now: Lens) -> Lens:
    """The present lens, as far as a frame rendered through another can show it: an aperture stays in the frame."""
    kept = ("model", "f_number", "focus_distance") if rendered.model == "thin-lens" else ("model",)
    return now.model_copy(update={name: getattr(rendered, name) for name in kept})


def development(rendered: Project, now: Project, image_scale: float = 1.0) -> Development:
    """How the project, as it is now, develops a frame of `rendered`, which is at `image_scale`."""
    now = scaled(now, image_scale)
    scene = rendered.scene
    camera = scene.camera.model_copy(update={"lens": _developing_lens(scene.camera.lens, now.scene.camera.lens)})
    scene = scene.model_copy(update={"rig": scene.rig.model_copy(update={"camera": camera})})
    # the frame's exact line is along its own axis
    extraction = now.extraction.model_copy(update={"axis": rendered.extraction.axis})
    update: dict[str, object] = {
        "scene": scene,
        "sensor": now.sensor,
        "extraction": extraction,
        "seed": now.seed,
    }
    if len(now.scene.lasers) == len(scene.lasers) and _size(now.scene) == _size(scene):
        update["calibration"] = now.calibration
    powers = [laser.power for laser in scene.lasers]
    for i, its in same_lasers(now.scene, scene).items():
        powers[its] = now.scene.lasers[i].power
    allowed = [
        power if laser.power > 0.0 else 0.0 for power, laser in zip(powers, scene.lasers, strict=True)
    ]  # a laser that was off left no light
    return Development(rendered.read_as(now).model_copy(update=update), tuple(allowed))


def _size(scene: Scene) -> tuple[int, int]:
    return scene.camera.width, scene.camera.height


def is_developed_otherwise(rendered: Project, now: Project, image_scale: float = 1.0) -> bool:
    """`now` develops a frame of `rendered`, or finds its line, otherwise than that itself does."""
    now = now.read_as(rendered)
    how, before = development(rendered, now, image_scale), development(rendered, rendered)
    return (how.project.model_copy(update={"seed": rendered.seed}), how.laser_power) != (
        before.project,
        before.laser_power,
    )


def develop_again(
    frame: Frame, how: Development, *, noise: bool = True, threads: int | None = None, cancelled: Cancel | None = None
) -> list[Image]:
    """One image for each laser, fired one after the other, as in a scan. Raises InputError, Cancelled."""
    project, images = how.project, []
    for i in range(len(how.laser_power)):
        if cancelled is not None and cancelled():
            raise Cancelled
        power = [value if i == k else 0.0 for k, value in enumerate(how.laser_power)]
        images.append(expose(project, frame, power, i, noise=noise, threads=threads))
    if not images:
        images.append(develop(frame, project.scene, project.sensor, seed=project.seed, threads=threads, noise=noise))
    return images


def measure_again(
    frame: Frame,
    world: World,
    how: Development,
    images: list[Image],
    methods: tuple[Method, ...],
    *,
    cancelled: Cancel,
    threads: int | None = None,
) -> dict[str, list[Measurement]]:
    """Line, points and errors of every laser's image by each method. Raises InputError, Cancelled."""
    if not how.laser_power:
        return {}
    clock = Clock(progress=lambda stage, done: None, cancelled=cancelled)
    return {method: measure_step(how.project, frame, world, images, clock, threads, method) for method in methods}
