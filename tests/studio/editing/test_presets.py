"""Presets bring figures with their sources, and are one edit that leaves the rest of the project alone."""

from __future__ import annotations

import json
import math
from typing import get_args

import numpy as np
import pytest

from render.material.material import Blend, Subsurface
from render.sensor.response import laser_response
from studio.editing.presets import Preset, PresetKind, leaves_focus_open, presets, presets_for, with_preset
from studio.project.document import Document, replaced, value_at
from studio.project.project import Project
from studio.project.templates import template_folder

LASER = ("scene", "rig", "lasers", 0)
CAMERA = ("scene", "rig", "camera")
OBJECT = ("scene", "objects", 0)
ALL = [(kind, preset) for kind in get_args(PresetKind) for preset in presets(kind)]


@pytest.fixture(scope="module")
def project() -> Project:
    return Project.load(template_folder("weld_seam") / "project.json")


def named(kind: PresetKind, part: str) -> Preset:
    return next(preset for preset in presets(kind) if part in preset.name)


def place(kind: str) -> tuple[str | int, ...]:
    return {"lasers": LASER, "cameras": CAMERA, "sensors": ("sensor",), "materials": OBJECT}[kind]


@pytest.mark.parametrize(("kind", "preset"), ALL, ids=[preset.name for _, preset in ALL])
def test_every_preset_fits_and_says_where_its_figures_come_from(project: Project, kind: str, preset: Preset) -> None:
    assert len(preset.source) > 40
    changed = with_preset(project, place(kind), preset)
    if kind == "materials":
        before, after = project.scene.objects[0], changed.scene.objects[0]
        assert before.model_copy(update={"material": after.material}) == after
        # every field as the file says, and a row of numbers for the kernels
        written = preset.values["object"]["material"]
        dumped = json.loads(after.material.model_dump_json())
        assert {name: dumped[name] for name in written} == written
        assert not isinstance(after.material, Blend)
        assert np.isfinite(after.material.pack((660.0, 520.0, 450.0))).all()
    else:
        assert changed.scene.objects == project.scene.objects
    assert changed.scene.camera.T_rig_camera == project.scene.camera.T_rig_camera
    assert changed.scene.lasers[0].T_rig_laser == project.scene.lasers[0].T_rig_laser
    assert changed.scene.lasers[0].name == project.scene.lasers[0].name
    assert changed.sensor.exposure_time == project.sensor.exposure_time
    camera = changed.scene.camera
    assert (camera.cx, camera.cy) == ((camera.width - 1) / 2, (camera.height - 1) / 2)
    again = Project.from_text(changed.to_text())
    assert again == changed


def test_names_are_told_apart() -> None:
    names = [preset.name for _, preset in ALL]
    assert len(set(names)) == len(names)


def test_the_papers_camera_has_the_papers_matrix(project: Project) -> None:
    small = with_preset(project, CAMERA, named("cameras", "1.6 mega"))
    camera = with_preset(small, CAMERA, named("cameras", "STC-MCS500U3V")).scene.camera
    assert camera.matrix.tolist() == [[pytest.approx(3478.26, abs=0.01), 0, 1223.5],
                                      [0, pytest.approx(3478.26, abs=0.01), 1023.5], [0, 0, 1]]  # fmt: skip
    assert (camera.lens.f_number, camera.lens.focus_distance) == (1.4, 1.0)


def test_the_papers_laser_has_the_power_colour_and_fan_of_its_name(project: Project) -> None:
    red = with_preset(project, LASER, named("lasers", "660"))
    laser = with_preset(red, LASER, named("lasers", "Z20M18H3-F-450-lp45")).scene.lasers[0]
    assert (laser.power, laser.wavelength_nm) == (0.02, 450.0)
    assert laser.fan_angle == pytest.approx(math.radians(45))


def test_media_have_the_coefficients_of_their_table(project: Project) -> None:
    # Jensen et al. 2001, table 1, per mm
    for name, scattering, absorption in (
        ("Marble", (2.19, 2.62, 3.00), (0.0021, 0.0041, 0.0071)),
        ("Skin", (0.74, 0.88, 1.01), (0.032, 0.17, 0.48)),
    ):
        material = with_preset(project, OBJECT, named("materials", name)).scene.objects[0].material
        assert isinstance(material, Subsurface)
        free, albedo = np.array(material.mean_free_path), np.array(material.scattering_albedo)
        assert albedo / free / 1e3 == pytest.approx(scattering, rel=1e-3)
        assert (1 - albedo) / free / 1e3 == pytest.approx(absorption, rel=1e-2)


def test_another_sensor_keeps_the_lens(project: Project) -> None:
    changed = with_preset(project, ("sensor",), named("sensors", "IMX174"))
    camera = changed.scene.camera
    assert (camera.width, camera.height, camera.pixel_pitch) == (1920, 1200, 5.86e-6)
    assert camera.fx * camera.pixel_pitch == pytest.approx(0.012, rel=1e-6)
    assert changed.sensor.full_well == 32691.0
    # 77 % at 525 nm, as measured: electrons per joule over photons per joule
    photons = 525e-9 / (6.62607015e-34 * 299792458.0)
    assert laser_response(changed.sensor, 525.0)[0, 0] / photons == pytest.approx(0.77, abs=1e-3)


def test_a_lens_preset_clears_the_distortion_of_the_lens_before(project: Project) -> None:
    bent = replaced(project, (*CAMERA, "distortion"), (-0.1, 0.0, 0.0, 0.0))
    bent = replaced(bent, (*CAMERA, "cx"), 1202.3)
    camera = with_preset(bent, CAMERA, named("cameras", "16 mm")).scene.camera
    assert camera.distortion == ()
    assert camera.cx == 1223.5


def test_a_lens_without_a_stated_focus_is_focused_where_it_is_asked_to_and_stays_that_lens(project: Project) -> None:
    """It was focused far away, whatever stood before it, and a lens of 25 mm focused at hand is no longer one."""
    stated, open_ = named("cameras", "STC-MCS500U3V"), named("cameras", "12 mega")
    assert leaves_focus_open(open_) and not leaves_focus_open(stated)
    assert not any(leaves_focus_open(preset) for preset in presets("sensors"))
    camera = with_preset(project, CAMERA, open_, focus=0.403).scene.camera
    assert camera.lens.focus_distance == 0.403
    assert camera.focal_length == pytest.approx(0.025)
    assert camera.fx * 3.45e-6 == pytest.approx(1.0 / (1.0 / 0.025 - 1.0 / 0.403))
    assert with_preset(project, CAMERA, stated, focus=0.403).scene.camera.lens.focus_distance == 1.0
    too_near = with_preset(project, CAMERA, open_, focus=0.03).scene.camera
    assert too_near.lens.focus_distance is None and too_near.focal_length == pytest.approx(0.025)


def test_a_preset_is_one_undoable_edit(project: Project) -> None:
    document = Document(project)
    document.apply("preset", with_preset(project, ("sensor",), named("sensors", "IMX273")))
    document.undo()
    assert document.project == project
    assert document.undo_label is None


def test_items_without_presets_offer_none(project: Project) -> None:
    assert presets_for(project, ("scene", "motion")) == ()
    assert presets_for(project, ()) == ()
    for kind in ("lasers", "cameras", "sensors", "materials"):
        assert presets_for(project, place(kind)) == presets(kind)  # type: ignore[arg-type]
        assert value_at(project, place(kind)) is not None
