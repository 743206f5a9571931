"""Pictures and read-outs of a render."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from render.render import render_world
from render.world.world import build_world
from studio.preview.preview import Preview
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.scan.frame_views import SATURATED, all_light, at_pixel, live_picture, picture, views
from studio.scan.redevelop import develop_again, development
from studio.scan.stages import scaled


@pytest.fixture(scope="module")
def rendered():
    project = Project.load(template_folder("weld_seam") / "project.json")
    small = scaled(project, 0.1)
    world = build_world(small.scene, template_folder("weld_seam"))
    settings = small.render.model_copy(update={"ambient_samples": 1, "transport": "interreflection"})
    frame = render_world(world, small.scene, settings=settings)
    return small, frame, develop_again(frame, development(small, project, 0.1))


def test_every_view_of_a_render_has_a_picture(rendered):
    project, frame, images = rendered
    found = views(project.scene, frame)
    assert [view.kind for view in found] == ["image", "laser", "reflected", "ambient", "light", "depth"]
    for view in found:
        drawn = picture(view, project.scene, frame, images, bright=True)
        assert drawn is not None and drawn.shape == frame.shape and len(np.unique(drawn)) > 3


def test_a_blue_laser_is_blue_in_all_light(rendered):
    project, frame, _ = rendered
    row, column = np.unravel_index(int(frame.laser_direct[0].argmax()), frame.shape)
    total = all_light(project.scene, frame)
    assert total[row, column, 2] > 3 * total[row, column, 1]


def test_the_readout_names_what_is_under_the_cursor(rendered):
    project, frame, images = rendered
    curve = frame.curves[0]
    middle = len(curve.index) // 2
    row, column = int(curve.index[middle]), round(float(curve.position[middle]))
    told = dict(at_pixel(project.scene, frame, images, row, column))
    assert told["object"] in {item.name for item in project.scene.visible_objects}
    assert float(told["depth"].split()[0]) == pytest.approx(1e3 * curve.depth_z[middle], abs=2)
    assert told["DN"].startswith(str(images[0].pixels[row, column]))
    assert at_pixel(project.scene, frame, images, -1, 0) == []


def test_saturated_pixels_alone_are_painted(rendered):
    project, frame, images = rendered
    image = images[0]
    full = np.sort(image.pixels, axis=None)[-50]  # as if the sensor held no more than the brightest of them
    cut = replace(image, saturation=int(full), pixels=np.minimum(image.pixels, full))
    view = views(project.scene, frame)[0]
    plain, painted = (picture(view, project.scene, frame, [cut], True, paint) for paint in (False, True))
    assert np.array_equal(plain != painted, cut.pixels == full)
    assert set(np.unique(painted[cut.pixels == full])) == {0xFF000000 | int(SATURATED[1:], 16)}


def test_the_live_picture_paints_what_would_saturate():
    project = Project.load(template_folder("sphere") / "project.json")
    bright = project.model_copy(update={"sensor": project.sensor.model_copy(update={"exposure_time": 0.5})})
    look = Preview().look(bright, template_folder("sphere"))
    image = look.image(scale=0.1)
    painted = live_picture(bright, image, True) == (0xFF000000 | int(SATURATED[1:], 16))
    assert painted.any() and not (painted & (sum(image.laser) == 0.0)).any()
    short = project.model_copy(update={"sensor": project.sensor.model_copy(update={"exposure_time": 1e-6})})
    assert np.array_equal(live_picture(short, image, True), live_picture(short, image))
