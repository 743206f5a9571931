"""The signal that Design tells is that of the material: as bright as a render of its direct light."""

from __future__ import annotations

import numpy as np
import pytest

from render.material.material import Coated, Conductor, Lambertian, Material, Subsurface
from studio.notebook.frame import render
from studio.preview.inspection import laser_views
from studio.preview.preview import Preview
from studio.preview.readouts import readouts
from studio.preview.reflected_light import from_below
from studio.project.project import Project
from studio.scan.stages import scaled

SCALE = 0.25
MATERIALS = (
    Lambertian(albedo=0.8),
    Conductor(metal="steel", roughness=0.1, roughness_across=0.35),
    Conductor(metal="copper", roughness=0.4),
    Coated(albedo=0.02, roughness=0.1),
)
NAMES = ("white", "ground steel", "rolled copper", "black plastic")


def made_of(material: Material) -> Project:
    """The sample's staircase and table."""
    project = Project.load("step_block")
    objects = {f"scene.objects[{i}].material": material for i in range(len(project.scene.objects))}
    # for the image: how a pixel moves the line takes most of a render, and is nobody's question here
    render = {"render.goal": None, "render.transport": "direct"}
    changed = {**objects, **render, "scene.lights": (), "scene.environment": {}}
    return scaled(project.replaced(changed), SCALE).in_folder(project.folder)


@pytest.mark.parametrize("material", MATERIALS, ids=NAMES)
def test_the_peak_of_any_opaque_material_is_as_rendered(material: Material) -> None:
    """Ground steel was told to saturate by 15 times where its render had a hundredth of that."""
    project = made_of(material)
    told = readouts(Preview().look(project, project.folder), 0)
    (seen,) = laser_views(project, render(project))
    assert told.peak_electrons is not None and seen.peak_electrons is not None
    assert told.peak_electrons.middle == pytest.approx(seen.peak_electrons, rel=0.15)


@pytest.mark.parametrize("material", MATERIALS, ids=NAMES)
def test_the_line_of_the_live_picture_is_as_bright_as_rendered(material: Material) -> None:
    """On ground steel it was that of a white wall, and painted as saturated."""
    project = made_of(material)
    (seen,) = render(project).laser_direct
    (live,) = Preview().look(project, project.folder).image(1.0).laser
    rows = seen.sum(axis=1)
    some = rows > 0.1 * np.median(rows)
    # one ray a pixel: rows differ, their middle hardly
    assert np.median(live.sum(axis=1)[some] / rows[some]) == pytest.approx(1.0, rel=0.1)


def test_a_mirror_sends_nothing_of_the_line_to_the_camera() -> None:
    project = made_of(Conductor(metal="silver", roughness=0.0))
    told = readouts(Preview().look(project, project.folder), 0)
    assert told.laser_electrons == pytest.approx(0.0, abs=1e-9)


def test_light_from_below_is_that_of_a_half_space() -> None:
    """Nothing is lost where scattering loses nothing; the open half-space is van de Hulst's, 0.7949 at 0.99."""
    assert from_below(Subsurface(scattering_albedo=0.99999, index=1.01), 450.0) == pytest.approx(1.0, abs=0.015)
    by_index = [from_below(Subsurface(scattering_albedo=0.99, index=n), 450.0) for n in (1.01, 1.3, 1.5)]
    assert by_index[0] == pytest.approx(0.79, abs=0.01) and np.all(np.diff(by_index) < 0.0)


def test_what_is_not_opaque_is_told() -> None:
    project = Project.load("sphere")
    last = len(project.scene.objects) - 1
    wax = project.replaced({f"scene.objects[{last}].material": Subsurface()}).in_folder(project.folder)
    for one, spreads in ((project, False), (wax, True)):
        assert readouts(Preview().look(one, project.folder), 0).spreads == spreads


@pytest.mark.parametrize(("f_number", "focus"), [(4.0, 0.6), (1.4, 0.6), (1.4, 0.4)])
def test_the_peak_and_the_width_of_a_line_out_of_focus_are_as_rendered(f_number: float, focus: float) -> None:
    """Blurred over 10 px it was told to saturate, of a render that was at half of that."""
    project = made_of(Lambertian(albedo=0.5))
    lens = {"model": "thin-lens", "f_number": f_number, "focus_distance": focus}
    changed = {f"scene.rig.camera.lens.{name}": value for name, value in lens.items()}
    project = project.replaced(changed).in_folder(project.folder)
    told = readouts(Preview().look(project, project.folder), 0)
    (seen,) = laser_views(project, render(project))
    assert told.peak_electrons is not None and told.width_px is not None and seen.peak_electrons is not None
    assert told.peak_electrons.middle == pytest.approx(seen.peak_electrons, rel=0.15)
    if told.width_px.middle > 1.0:
        assert told.width_px.middle == pytest.approx(seen.width_px, rel=0.15)
