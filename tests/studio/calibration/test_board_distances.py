"""Virtual boards are held where the project's lines lie, so that the depth error told is that over its parts."""

from __future__ import annotations

import json

import numpy as np
import pytest

from render.base.errors import InputError
from studio.calibration.material import LEAST_SPAN, NOWHERE, board_distances
from studio.preview.preview import Preview
from studio.project.project import Project


def changed(name: str, **scene: object) -> Project:
    project = Project.load(name)
    data = json.loads(project.to_text())
    data["scene"] |= scene
    return Project.from_data(data, "test").in_folder(project.folder)


def test_boards_reach_from_the_nearest_to_the_farthest_of_the_line_on_the_parts() -> None:
    project = Project.load("weld_seam")
    depth = Preview().look(project, project.folder).lit_curve(0).depth_z
    assert board_distances(project, None, None) == (depth.min(), depth.max())


def test_about_a_part_without_depth_they_reach_a_tenth_to_either_side() -> None:
    project = Project.load("plane")
    (depth,) = set(np.round(Preview().look(project, project.folder).lit_curve(0).depth_z, 6))
    np.testing.assert_allclose(board_distances(project, None, None), [0.9 * depth, 1.1 * depth], rtol=1e-5)


def test_parts_that_move_are_followed_to_the_last_step() -> None:
    still = board_distances(Project.load("plane"), None, None)
    stage = {"kind": "linear", "moves": "objects", "step": [0.0, 0.0, 0.01], "steps": 21}
    near, far = board_distances(changed("plane", motion=stage), None, None)
    # raised by 0.2 m towards a camera that looks down
    assert near < still[0] - 0.05 and far == pytest.approx(0.8663, abs=1e-3)


def test_without_a_part_they_are_about_where_the_laser_meets_the_axis() -> None:
    project = changed("plane", objects=[])
    *_, c, d = project.scene.laser_plane(0)
    expected = -d / c * np.array([1.0 - NOWHERE, 1.0 + NOWHERE])
    np.testing.assert_allclose(board_distances(project, None, None), expected, rtol=1e-12)


def test_what_is_asked_for_is_kept_and_the_other_end_lies_beyond_it() -> None:
    project = Project.load("plane")
    assert board_distances(project, 0.3, 0.4) == (0.3, 0.4)
    near, far = board_distances(project, 2.0, None)
    assert near == 2.0 and far >= (1.0 + 2.0 * LEAST_SPAN) * near
    with pytest.raises(InputError, match="not beyond the nearest"):
        board_distances(project, None, 0.1)
