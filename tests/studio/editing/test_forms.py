"""Forms say of every field what it is called, its unit and limits; units and angles survive the way there and back."""

from __future__ import annotations

import json
import math
import random
from typing import Any

import numpy as np
import pytest
from pydantic import BaseModel
from scipy.spatial.transform import Rotation

from analysis.line.settings import ExtractionSettings
from render.base.errors import InputError
from render.base.pose import Pose
from render.camera.camera import Lens
from render.laser.laser import Divergence, Waist
from render.material.material import Texture
from render.scene.lights import PointLight, RectangleLight
from render.scene.motion import LinearStage, Turntable
from render.scene.shape import Box, Plane, Sphere
from studio.editing.euler_angles import euler_angles, rotation_from_euler
from studio.editing.forms import (
    REQUIRED,
    Alternative,
    FieldSpec,
    choice_label,
    describe,
    describe_item,
    edited,
    field_path,
    start_value,
)
from studio.editing.units import Unit
from studio.project.document import replaced, value_at
from studio.project.project import Project
from studio.project.templates import DESCRIPTIONS, template_folder

CAMERA = ("scene", "rig", "camera")
LASER = ("scene", "rig", "lasers", 0)


@pytest.fixture(scope="module")
def project() -> Project:
    return Project.load(template_folder("weld_seam") / "project.json")


def spec(model: BaseModel, name: str) -> FieldSpec:
    return next(field for field in describe(model) if field.name == name)


def leaves(fields: tuple[FieldSpec, ...], owner: tuple[Any, ...]) -> list[tuple[tuple[Any, ...], FieldSpec]]:
    """Every field that has an editor, with the path of its model."""
    found: list[tuple[tuple[Any, ...], FieldSpec]] = []
    for field in fields:
        if field.kind in ("model", "union", "list"):
            found += leaves(field.fields, field_path(owner, field))
        else:
            found.append((owner, field))
    return found


ITEMS = [(), ("scene", "rig"), CAMERA, LASER, ("scene", "objects", 0), ("scene", "environment"), ("scene", "motion"),
         ("sensor",), ("render",), ("extraction",)]  # fmt: skip


class TestDescription:
    def test_a_number_shows_its_label_unit_limits_default_and_help(self, project: Project) -> None:
        power = spec(project.scene.lasers[0], "power")
        assert (power.label, power.kind, power.unit.shown, power.default) == ("Power", "number", "mW", 0.02)
        assert "leaving the laser" in power.help
        assert power.unit.with_unit(power.value) == "20 mW"

    def test_every_quantity_has_the_unit_that_people_use_for_it(self, project: Project) -> None:
        fields = [field for field in describe(project.scene.camera) if field.kind == "number"]
        shown = {field.name: field.unit.with_unit(field.value) for field in fields}
        assert shown["pixel_pitch"] == "3.45 µm"
        assert shown["image_distance"] == "12 mm"
        assert spec(Divergence(), "full_angle").unit.with_unit(1.15e-3) == "1.15 mrad"
        assert spec(Waist(), "radius").unit.with_unit(1e-4) == "100 µm"
        assert spec(project.scene.lasers[0], "fan_angle").unit.with_unit(math.radians(45)) == "45 deg"
        assert spec(project.scene.lasers[0], "wavelength_nm").unit.with_unit(450.0) == "450 nm"
        assert spec(project.sensor, "exposure_time").unit.with_unit(0.0038) == "3.8 ms"

    @pytest.mark.parametrize("template", DESCRIPTIONS)
    def test_every_field_of_every_template_can_be_set_to_the_value_it_has(self, template: str) -> None:
        project = Project.load(template_folder(template) / "project.json")
        for path in ITEMS:
            for owner, field in leaves(describe_item(project, path).fields, path):
                assert field.problem(field.value) is None, field
                assert field.label and field.label[0] == field.label[0].strip()
                assert edited(project, owner, field, field.value) == project

    def test_limits_are_told_in_shown_units_and_open_ends_are_respected(self, project: Project) -> None:
        fan = spec(project.scene.lasers[0], "fan_angle")
        assert fan.problem(math.radians(45)) is None
        assert fan.problem(0.0) == "must be at least 0.001 deg"
        assert fan.problem(math.radians(171)) == "must be at most 170 deg"
        transmission = spec(project.scene.camera.lens, "transmission")
        assert transmission.problem(1.0) is None
        assert transmission.problem(1.01) == "must be at most 1"
        assert spec(ExtractionSettings(), "exposure_ratio").problem(1.0) == "must be more than 1"

    def test_a_drag_stays_where_values_are_allowed(self, project: Project) -> None:
        for path in ITEMS:
            for _, field in leaves(describe_item(project, path).fields, path):
                if field.kind in ("number", "integer"):
                    for value in (-1e12, -1.0, 0.0, 1e12):
                        assert field.problem(field.clamped(value)) is None, field

    def test_what_stands_in_the_tree_is_not_repeated_in_another_form(self, project: Project) -> None:
        assert [field.name for field in describe(project)] == ["name", "seed"]
        assert [field.name for field in describe(project.scene.rig)] == ["T_world_rig"]

    def test_optional_numbers_may_be_empty_and_optional_models_have_a_kind_none(self, project: Project) -> None:
        focus = spec(Lens(), "focus_distance")
        assert focus.optional and focus.value is None
        band_pass = spec(project.sensor, "band_pass")
        assert [kind.label for kind in band_pass.alternatives] == ["None", "Band pass"]
        assert band_pass.chosen == 0

    def test_unions_offer_their_kinds(self, project: Project) -> None:
        shape = spec(project.scene.objects[0], "shape")
        labels = [kind.label for kind in shape.alternatives]
        assert labels[:3] == ["Mesh file", "Plane", "Box"]
        assert labels[shape.chosen] == "Weld tee"
        albedo = next(f for f in spec(project.scene.objects[0], "material").fields if f.name == "albedo")
        assert [kind.label for kind in albedo.alternatives] == ["One value", "R, G, B", "Image", "From the mesh file"]
        assert describe_item(project, ("scene", "motion")).kind == "union"
        assert describe_item(project, ("scene", "lights", 0)).alternatives[1].type is RectangleLight

    def test_an_item_that_is_not_there_is_a_key_error(self, project: Project) -> None:
        with pytest.raises(KeyError):
            describe_item(project, ("scene", "objects", 7))


class TestKinds:
    def test_another_kind_keeps_what_both_have_and_takes_defaults_for_the_rest(self) -> None:
        light = start_value(
            Alternative("", "", RectangleLight), PointLight(name="top", T_world_light=Pose(translation=(1, 2, 3)))
        )
        assert (light.name, light.T_world_light.translation) == ("top", (1, 2, 3))
        stage = start_value(Alternative("", "", LinearStage), Turntable(steps=7, moves="rig"))
        assert (stage.steps, stage.moves) == (7, "rig")
        assert start_value(Alternative("", "", Sphere), Box(size_x=3)) == Sphere()

    def test_a_step_in_metres_is_not_taken_for_one_in_degrees(self) -> None:
        assert start_value(Alternative("", "", Turntable), LinearStage(step=(0.5, 0, 0))).angle_step == math.radians(1)

    def test_numbers_become_colours_and_back(self) -> None:
        assert start_value(Alternative("", "", tuple), 0.3) == (0.3, 0.3, 0.3)
        assert start_value(Alternative("", "", float), (0.1, 0.2, 0.6)) == pytest.approx(0.3)
        assert start_value(Alternative("", "", Texture, True), 0.3, "textures/a.png").path == "textures/a.png"

    def test_every_kind_that_is_offered_can_be_chosen(self, project: Project) -> None:
        unions = [(("scene", "objects", 0, "shape"), "meshes/a.stl"), (("scene", "objects", 0, "material"), "a.png"),
                  (("scene", "objects", 0, "material", "albedo"), "a.png"), (("scene", "motion"), ""),
                  ((*LASER, "sheet"), ""), (("scene", "lights", 0), ""), (("sensor", "band_pass"), "")]  # fmt: skip
        for path, file in unions:
            found = describe_item(project, path)
            for i, kind in enumerate(found.alternatives):
                value = start_value(kind, found.value, file)
                owner = describe_item(project, path[:-1]) if isinstance(path[-1], str) else None
                assert owner is None or owner.value is not None
                changed = edited(project, path[:-1], FieldSpec(str(path[-1]), "", "", "union", None), value)
                assert describe_item(changed, path).chosen == i


class TestMaterials:
    PATH = ("scene", "objects", 0, "material")

    def kinds(self, project: Project) -> tuple[Alternative, ...]:
        return describe_item(project, self.PATH).alternatives

    def test_every_material_is_offered_with_every_field_in_shown_units(self, project: Project) -> None:
        kinds = self.kinds(project)
        labels = ["Lambertian", "Conductor", "Coated", "Blend", "Glass", "Subsurface", "Emitter"]
        assert [kind.label for kind in kinds] == labels
        assert all(kind.help for kind in kinds)
        changed = edited(project, self.PATH[:-1], describe_item(project, self.PATH), start_value(kinds[5], None))
        free = next(field for field in describe_item(changed, self.PATH).fields if field.name == "mean_free_path")
        assert [choice.label for choice in free.alternatives] == ["One value", "R, G, B"]
        assert (free.unit.shown, free.unit.format(free.fields[0].value)) == ("mm", "0.5")

    @pytest.mark.parametrize("kind", [1, 2, 4, 5, 6])
    def test_each_part_of_a_material_takes_every_kind_it_offers(self, project: Project, kind: int) -> None:
        chosen = start_value(self.kinds(project)[kind], None)
        assert isinstance(chosen, BaseModel)
        project = edited(project, self.PATH[:-1], describe_item(project, self.PATH), chosen)
        parts = 0
        for field in describe_item(project, self.PATH).fields:
            for alternative in field.alternatives:
                value = start_value(alternative, field.value, "map.png")
                changed = edited(project, self.PATH, field, value)
                assert getattr(value_at(changed, self.PATH), field.name) == value
                assert Project.from_text(changed.to_text()) == changed
                parts += 1
        assert parts >= 5

    def test_glass_is_polished_unless_said_otherwise(self, project: Project) -> None:
        kinds = self.kinds(project)
        ground = start_value(kinds[1], None).model_copy(update={"roughness": 0.3})
        assert start_value(kinds[4], ground).roughness == 0.0
        assert start_value(kinds[2], start_value(kinds[4], ground)).roughness == 0.1

    @pytest.mark.parametrize(
        ("kind", "field", "value", "allowed"),
        [
            ("conductor", "roughness", -0.1, "greater than or equal to 0"),
            ("conductor", "tint", 1.2, "less than or equal to 1"),
            ("glass", "tint", [0.5, 1.5, 0.5], "less than or equal to 1"),
            ("glass", "index", 0.9, "greater than or equal to 1.01"),
            ("glass", "substance", "cheese", "polycarbonate"),
            ("subsurface", "roughness", 0.0, "greater than or equal to 0.05"),
            ("subsurface", "scattering_albedo", 1.1, "less than or equal to 0.99999"),
            ("emitter", "radiance", [1, -1, 1], "greater than or equal to 0"),
            ("lambertian", "relief", {"kind": "bump_map", "path": "a.png", "height": 5}, "less than or equal to 1"),
        ],
    )
    def test_what_cannot_be_is_refused_by_name(
        self, project: Project, kind: str, field: str, value: object, allowed: str
    ) -> None:
        data = json.loads(project.to_text())
        data["scene"]["objects"][0]["material"] = {"kind": kind, field: value}
        with pytest.raises(InputError) as error:
            Project.from_text(json.dumps(data))
        assert f"scene.objects[0].material.{field}" in str(error.value) and allowed in str(error.value)


class TestLinkedFields:
    def test_an_image_distance_is_bounded_as_fx_is_and_in_its_own_unit(self, project: Project) -> None:
        """1e9 mm was refused with the limit of fx, in px and without a unit, which it was below."""
        camera = project.scene.camera
        assert spec(camera, "image_distance").high == pytest.approx(1e7 * camera.pixel_pitch)

    def test_a_typed_image_distance_sets_fx_and_fy(self, project: Project) -> None:
        changed = edited(project, CAMERA, spec(project.scene.camera, "image_distance"), 0.016)
        assert changed.scene.camera.fx == pytest.approx(0.016 / 3.45e-6)
        assert changed.scene.camera.fy == changed.scene.camera.fx

    def test_a_focal_length_is_of_the_lens_that_is_focused(self, project: Project) -> None:
        """25 mm were told of a lens that is one of 23.54 mm when it is focused at 403 mm."""
        far = replaced(project, (*CAMERA, "lens", "focus_distance"), None)
        project = edited(far, CAMERA, spec(far.scene.camera, "image_distance"), 0.025)
        camera = project.scene.camera
        assert spec(camera, "focal_length").value == spec(camera, "image_distance").value == pytest.approx(0.025)
        near = replaced(project, (*CAMERA, "lens", "focus_distance"), 0.403)
        assert near.scene.camera.fx == camera.fx, "a calibrated camera keeps its geometry"
        own = spec(near.scene.camera, "focal_length")
        assert own.unit.with_unit(float(f"{own.value:.4g}")) == "23.54 mm"
        assert spec(near.scene.camera, "image_distance").value == pytest.approx(0.025)
        real = edited(near, CAMERA, own, 0.025).scene.camera
        assert real.fx * real.pixel_pitch == pytest.approx(1.0 / (1.0 / 0.025 - 1.0 / 0.403))
        assert real.focal_length == pytest.approx(0.025) and real.lens.focus_distance == 0.403
        assert own.problem(0.402) is None and own.problem(0.403) == "must be less than 403 mm"

    def test_a_centred_principal_point_stays_centred_and_another_stays_put(self, project: Project) -> None:
        width = spec(project.scene.camera, "width")
        assert edited(project, CAMERA, width, 1000).scene.camera.cx == 499.5
        off = edited(project, CAMERA, spec(project.scene.camera, "cx"), 1202.3)
        assert edited(off, CAMERA, width, 1000).scene.camera.cx == 1202.3

    def test_another_pixel_pitch_keeps_the_lens(self, project: Project) -> None:
        changed = edited(project, CAMERA, spec(project.scene.camera, "pixel_pitch"), 6.9e-6).scene.camera
        assert changed.fx * changed.pixel_pitch == pytest.approx(0.012, rel=1e-6)

    def test_a_sensor_made_colour_has_three_curves_and_goes_back_to_one(self, project: Project) -> None:
        colour = spec(project.sensor, "colour")
        bayer = edited(project, ("sensor",), colour, "bayer")
        assert [field.label for field in spec(bayer.sensor, "efficiency").fields] == ["Red", "Green", "Blue"]
        mono = project.sensor.efficiency[0]
        for curve in bayer.sensor.efficiency:
            assert np.all(
                np.interp(curve.wavelength_nm, mono.wavelength_nm, mono.value) >= np.array(curve.value) - 1e-4
            )
        peaks = [curve.wavelength_nm[int(np.argmax(curve.value))] for curve in bayer.sensor.efficiency]
        assert peaks[2] < 490 < peaks[1] < 590 < peaks[0]
        assert len(edited(bayer, ("sensor",), colour, "mono").sensor.efficiency) == 1

    def test_a_refused_value_names_the_reason(self, project: Project) -> None:
        groove = edited(project, ("scene", "objects", 0), spec(project.scene.objects[0], "shape"), {"kind": "v_groove"})
        depth = spec(groove.scene.objects[0].shape, "depth")
        with pytest.raises(InputError, match="thickness"):
            edited(groove, ("scene", "objects", 0, "shape"), depth, 0.031)


class TestUnits:
    @pytest.mark.parametrize(
        ("unit", "text", "value"),
        [
            (Unit.of("m"), "12", 0.012),
            (Unit.of("m"), "12,5", 0.0125),
            (Unit.of("m"), " 0.4 m ", 0.4),
            (Unit.of("m"), "2in", 0.0508),
            (Unit.of("m", "um"), "3.45", 3.45e-6),
            (Unit.of("m", "um"), "0.01 mm", 1e-5),
            (Unit.of("rad"), "-90", -math.pi / 2),
            (Unit.of("rad"), "1.5 rad", 1.5),
            (Unit.of("W"), "1e3", 1.0),
            (Unit.of("s"), "250 us", 2.5e-4),
            (Unit.of("e-"), "10500 e-", 10500.0),
            (Unit(), ".5", 0.5),
        ],
    )
    def test_typed_numbers_are_read_in_the_shown_unit_or_the_typed_one(
        self, unit: Unit, text: str, value: float
    ) -> None:
        assert unit.parse(text) == pytest.approx(value, rel=1e-15)

    @pytest.mark.parametrize("text", ["", "  ", "abc", "1 2", "12 kg", "1e999", "nan", "--3", "1.2.3"])
    def test_what_is_no_number_is_refused_with_a_reason(self, text: str) -> None:
        with pytest.raises(InputError):
            Unit.of("m").parse(text)

    def test_numbers_are_written_without_needless_digits(self) -> None:
        mm = Unit.of("m")
        assert [mm.format(v) for v in (0.0, -0.0, 0.2, 0.6196376724, 1e-17, 1.23e-6, -0.5)] == [
            "0", "0", "200", "619.6377", "0", "0.00123", "-500"]  # fmt: skip
        assert Unit.of("rad").format(-0.226893) == "-13"
        assert Unit("", "", 1.0).format(0.003) == "0.003"
        assert Unit("", "", 1.0).format(2.154) == "2.154"

    def test_writing_and_reading_loses_no_more_than_a_tenth_of_a_micrometre(self) -> None:
        mm, chosen = Unit.of("m"), random.Random(1)
        for _ in range(500):
            value = chosen.uniform(-5, 5) * 10 ** chosen.uniform(-4, 0)
            assert mm.parse(mm.format(value)) == pytest.approx(value, abs=0.6e-7)


class TestEulerAngles:
    def test_they_turn_about_the_fixed_axes_x_then_y_then_z(self) -> None:
        for angles in np.random.default_rng(0).uniform(-180, 180, (300, 3)):
            vector = rotation_from_euler(tuple(angles))
            expected = Rotation.from_euler("xyz", angles, degrees=True)
            assert (Rotation.from_rotvec(vector) * expected.inv()).magnitude() < 1e-14

    def test_they_give_the_rotation_back_even_at_gimbal_lock(self) -> None:
        random_angles = np.random.default_rng(1).uniform(-180, 180, (300, 3))
        random_angles[::3, 1] = 90.0
        random_angles[1::3, 1] = -90.0 + 1e-5
        for angles in random_angles:
            vector = rotation_from_euler(tuple(angles))
            again = rotation_from_euler(euler_angles(vector))
            assert (Rotation.from_rotvec(again) * Rotation.from_rotvec(vector).inv()).magnitude() < 1e-7

    def test_changing_one_angle_leaves_the_others_exactly_as_they_were(self) -> None:
        chosen = random.Random(5)
        shown = (12.3, -45.6, 78.9)
        for step in range(2000):
            axis = chosen.randrange(3)
            typed = list(shown)
            typed[axis] = chosen.choice([typed[axis] + chosen.uniform(-30, 30), 90.0, -90.0, 180.0, 270.0, 0.0])
            stored = rotation_from_euler((typed[0], typed[1], typed[2]))
            shown = euler_angles(stored, near=(typed[0], typed[1], typed[2]))
            assert shown == tuple(typed), step

    def test_a_rotation_made_elsewhere_is_shown_by_the_nearest_angles(self) -> None:
        shown = (170.0, 85.0, -170.0)
        for _ in range(60):
            vector = (Rotation.from_euler("xyz", (0, 0.5, 0.3), degrees=True)
                      * Rotation.from_rotvec(rotation_from_euler(shown))).as_rotvec()  # fmt: skip
            following = euler_angles(tuple(vector), near=shown)
            again = Rotation.from_euler("xyz", following, degrees=True)
            assert (again * Rotation.from_rotvec(vector).inv()).magnitude() < 1e-12
            assert max(abs(a - b) for a, b in zip(following, shown, strict=True)) < 45
            shown = following

    def test_paths_lead_to_the_values_that_forms_show(self, project: Project) -> None:
        for path in ITEMS:
            for owner, field in leaves(describe_item(project, path).fields, path):
                if field.default is not REQUIRED or field.kind == "pose":
                    assert value_at(project, field_path(owner, field)) == field.value
        assert Plane().width == 1.0


def test_units_keep_their_case_and_words_begin_with_a_capital() -> None:
    assert [choice_label(value) for value in ("m", "mm", "um", "in", "top-hat", "RGGB", None)] == [
        "m", "mm", "um", "in", "Top hat", "RGGB", "None"
    ]  # fmt: skip
