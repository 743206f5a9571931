"""What is said of the lens before it is rendered, a blur that is never done twice, and lenses that cannot be."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError

from render.base.errors import InputError
from render.camera.camera import Camera, Lens
from render.camera.focus import check_lens, focus_tilt, lens_steps, thin_lens
from render.frame import Truth
from render.sensor.develop import expected_electrons
from render.world.placement_checks import check_placement
from tests.render.camera.test_lens import thin_camera
from tests.render.scenes import paper_laser, plane_mesh, scene_of, world_of
from tests.render.sensor.test_develop import flat_frame, sensor_of
from tests.render.sensor.test_develop import scene_of as lit_scene


def tilted(tau_x, tau_y, **changes):
    return thin_camera((0.0,) * 12 + (math.radians(tau_x), math.radians(tau_y)), **changes)


def test_the_plan_says_which_blur_is_done_and_which_is_left_out():
    pinhole, thin = thin_camera().model_copy(update={"lens": Lens()}), thin_camera(f_number=2.8)
    assert thin_lens(pinhole) is None
    assert [(step.name, step.computed, step.reason) for step in lens_steps(pinhole)] == [
        ("defocus", False, "pinhole"),
        ("diffraction", False, "pinhole"),
    ]
    lens = thin_lens(thin)
    assert (lens.f_number, lens.focus_distance, lens.tilt, lens.blind) == (2.8, 0.8, 0.0, 0.0)
    assert lens.aperture == pytest.approx(2.0 * thin.aperture_radius, rel=1e-12)
    assert [(step.name, step.computed, step.reason) for step in lens_steps(thin)] == [
        ("defocus", True, "always"),
        ("diffraction", False, "sensor"),
    ]


def test_developing_never_blurs_a_thin_lens_again():
    scene = lit_scene(0.02)
    height, width = scene.camera.height, scene.camera.width
    image = np.zeros((height, width), np.float32)
    image[:, width // 2] = 1.0
    depth, flat = np.full((height, width), 0.87, np.float32), np.zeros((height, width, 3), np.float32)
    truth = Truth(depth, depth, flat, flat, np.zeros((height, width), np.int32))
    frame = replace(flat_frame(0.0), laser_direct=(image,), truth=truth)

    def lit_columns(model, **switches):
        lens = Lens(model=model, f_number=1.4, focus_distance=1.0)
        camera = scene.camera.model_copy(update={"lens": lens})
        lensed = scene.model_copy(update={"rig": scene.rig.model_copy(update={"camera": camera})})
        electrons = expected_electrons(frame, lensed, sensor_of(dark_current=0.0, **switches))
        return np.count_nonzero(electrons[height // 2] > 0.0)

    assert sensor_of(defocus=True).defocus_by("thin-lens") == "the rendered lens"
    assert sensor_of(defocus=True).defocus_by("pinhole").startswith("developing")
    assert lit_columns("pinhole", defocus=True) > lit_columns("pinhole") == 1
    assert lit_columns("thin-lens", defocus=True) == lit_columns("thin-lens") == 1


def test_scheimpflug_tilts_the_plane_of_focus_by_the_rule():
    # tan(tilt of focus) = tan(tilt of the sensor) s / v: the two planes meet the lens's in one line
    camera = tilted(0.0, 2.0, focus=0.8)
    ratio = 0.8 / (camera.fx * camera.pixel_pitch)
    assert math.tan(focus_tilt(camera)) == pytest.approx(math.tan(math.radians(2.0)) * ratio)
    assert thin_lens(camera).tilt == focus_tilt(camera) > 0.0
    assert focus_tilt(thin_camera()) == 0.0


def test_a_lens_that_cannot_be_is_refused_by_name():
    data = thin_camera().model_dump()
    for lens, message in (
        ({"f_number": 0.0}, "greater than or equal to 0.1"),
        ({"f_number": 0.4}, "0.5 or more"),
        ({"focus_distance": 0.011}, "more than the image distance, 12 mm"),
        ({"model": "fisheye"}, "thin-lens"),
    ):
        with pytest.raises(ValidationError, match=message):
            Camera.model_validate({**data, "lens": {**data["lens"], **lens}})
    # the pinhole does not mind
    Camera.model_validate({**data, "lens": {**data["lens"], "model": "pinhole", "focus_distance": 0.011}})


def test_a_tilt_that_leaves_nothing_in_focus_is_refused_before_rendering():
    check_lens(tilted(0.0, 3.0))
    # focused far away, with all of the image on the side where the sensor is too near
    behind = tilted(0.0, 10.0, focus=None).model_copy(update={"cx": -30.0})
    with pytest.raises(InputError, match=r"distortion: the plane of focus lies behind the camera.*tauY 10 deg"):
        check_lens(behind)
    with pytest.raises(InputError, match="sensor reaches into the lens"):
        check_lens(tilted(0.0, 79.9, f_number=1.4))
    scene = scene_of(behind, paper_laser())
    with pytest.raises(InputError, match="behind the camera"):
        check_placement(world_of(scene, plane_mesh((0, 0, 1), 0.9)), scene)
    half = tilted(0.0, 3.0, focus=None)
    check_lens(half)
    assert 0.5 <= thin_lens(half).blind < 0.6
