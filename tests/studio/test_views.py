"""Pictures and read-outs of a render."""

from __future__ import annotations

import numpy as np
import pytest

from render.render import render_world
from render.world import build_world
from studio.project import Project
from studio.redevelop import develop_again, development
from studio.stages import scaled
from studio.templates import template_folder
from studio.tone import colour, colour_table, grey, mapped, pyramid, white_level
from studio.views import all_light, at_pixel, picture, views


def red(picture):
    return (picture >> 16) & 255


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_grey_runs_from_black_to_white_and_clips(dtype):
    image = np.array([[0, 10, 60, 110, 200]], dtype=dtype)
    assert red(grey(image, 10, 110)).tolist() == [[0, 0, 128, 255, 255]]
    assert np.all(grey(image, 10, 110) >> 24 == 255)


def test_bright_lifts_a_quarter_to_a_half():
    assert red(grey(np.array([[0.25]], np.float32), 0, 1, bright=True))[0, 0] == 128


def test_nan_is_black_in_grey_and_empty_in_a_colour_map():
    image = np.array([[np.nan, 1.0]], np.float32)
    assert red(grey(image, 0, 1)).tolist() == [[0, 255]]
    table = colour_table("viridis")
    assert mapped(image, 0, 1, table, 0xFF123456).tolist() == [[0xFF123456, int(table[-1])]]


def test_colour_keeps_its_channels_apart():
    image = np.array([[[1.0, 0.5, 0.0]]], np.float32)
    assert colour(image, 1.0)[0, 0] == 0xFFFF8000


def test_a_pyramid_halves_and_keeps_the_mean():
    random = np.random.default_rng(1)
    image = random.integers(0, 256, (1031, 1200)).astype(np.uint8)
    levels = pyramid(grey(image, 0, 255))
    assert [level.shape for level in levels] == [(1031, 1200), (516, 600), (258, 300)]
    # the mean of 1.2 million flat bytes has a standard deviation of 0.07; rounding twice adds less than one
    assert red(levels[-1]).mean() == pytest.approx(image.mean(), abs=0.5)


def test_the_white_level_ignores_what_is_dark():
    image = np.zeros((400, 400), np.float32)
    image[:, 200:204] = 2.0
    assert white_level(image) == 2.0 and white_level(np.zeros((8, 8), np.float32)) == 1.0


@pytest.fixture(scope="module")
def rendered():
    project = Project.load(template_folder("weld_seam") / "project.json")
    small = scaled(project, 0.1)
    world = build_world(small.scene, template_folder("weld_seam"))
    settings = small.render.model_copy(update={"ambient_samples": 1})
    frame = render_world(world, small.scene, settings=settings)
    return small, frame, develop_again(frame, development(small, project, 0.1))


def test_every_view_of_a_render_has_a_picture(rendered):
    project, frame, images = rendered
    found = views(project.scene, frame)
    assert [view.kind for view in found] == ["image", "laser", "ambient", "light", "depth"]
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
