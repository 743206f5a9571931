"""The ambient light that Design tells beneath a line is that of the material: as a render of the same has it."""

from __future__ import annotations

import numpy as np
import pytest

from render.base.pose import Pose
from render.material.material import Coated, Conductor, Glass, Lambertian, Material, Subsurface
from render.scene.lights import Environment, Light, PointLight, RectangleLight
from render.sensor.develop import expected_electrons
from studio.notebook.frame import render
from studio.preview.estimates import ambient_electrons, line_pixels
from studio.preview.preview import Preview
from studio.project.project import Project
from studio.scan.stages import scaled

SCALE = 0.1
SLAB = {"kind": "box", "size_x": 0.5, "size_y": 0.5, "size_z": 0.02}
STEEL, COPPER = Conductor(metal="steel", roughness=0.15), Conductor(metal="copper", roughness=0.4, roughness_across=0.2)
PLASTIC = Coated(albedo=0.3, roughness=0.2)
LAMP = PointLight(intensity=(0.2, 0.1, 0.3), T_world_light=Pose(translation=(0.3, -0.2, 0.6)))
PANEL = RectangleLight(
    radiance=(2.0, 3.0, 1.0),
    width=0.3,
    height=0.2,
    T_world_light=Pose(rotation=(np.pi, 0.0, 0.0), translation=(0, 0, 0.8)),
)


def made_of(material: Material, lights: tuple[Light, ...], radiance: float) -> Project:
    """A plate that nothing stands on."""
    project = Project.load("plane")
    changed = {
        "scene.objects[0].shape": SLAB,
        "scene.objects[0].material": material,
        "scene.lights": lights,
        "scene.environment": Environment(radiance=(radiance, 0.5 * radiance, 2.0 * radiance)),
        "render.transport": "direct",
        "render.goal": None,
        "render.ambient_samples": 256,
    }
    return scaled(project.replaced(changed), SCALE).in_folder(project.folder)


def told(project: Project) -> float:
    """Median electrons beneath the line, by Design."""
    look = Preview().look(project, project.folder)
    lit = look.lit(0)
    return float(np.median(ambient_electrons(look, lit, line_pixels(lit))))


def rendered(project: Project) -> float:
    """The same, by a render."""
    u, v = np.round(line_pixels(Preview().look(project, project.folder).lit(0))).astype(int).T
    image = expected_electrons(render(project), project.scene, project.sensor, laser_power=[0.0])
    return float(np.median(image[v, u])) - project.sensor.dark_current * project.sensor.exposure_time


@pytest.mark.parametrize("lights", [(), (LAMP,), (PANEL,)], ids=["sky", "lamp", "panel"])
@pytest.mark.parametrize("material", [Lambertian(albedo=0.6), STEEL, COPPER, PLASTIC], ids=lambda m: m.kind)
def test_the_light_beneath_the_line_is_as_rendered(material: Material, lights: tuple[Light, ...]) -> None:
    project = made_of(material, lights, 0.0 if lights else 0.7)
    expected = rendered(project)
    assert expected > 0.0
    assert told(project) == pytest.approx(expected, rel=0.05)


def test_a_mirror_shows_the_environment_and_no_lamp() -> None:
    mirror = Conductor(metal="silver", roughness=0.0)
    both = made_of(mirror, (LAMP,), 0.7)
    assert told(both) == pytest.approx(rendered(both), rel=0.02)
    assert told(made_of(mirror, (LAMP,), 0.0)) == 0.0


def test_in_a_uniform_environment_glass_cannot_be_seen() -> None:
    """What it does not reflect it lets through, of an environment that is as bright everywhere."""
    white = told(made_of(Lambertian(albedo=1.0), (), 0.7))
    assert told(made_of(Glass(), (), 0.7)) == pytest.approx(white, rel=0.01)


def test_wax_that_absorbs_nothing_is_white_under_a_lamp() -> None:
    wax = Subsurface(scattering_albedo=0.99999, index=1.01)
    white = told(made_of(Lambertian(albedo=1.0), (PANEL,), 0.0))
    assert told(made_of(wax, (PANEL,), 0.0)) == pytest.approx(white, rel=0.02)
