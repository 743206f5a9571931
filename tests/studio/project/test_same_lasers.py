"""Lasers are the same by their names, renamed ones by their places; measures go with them."""

from __future__ import annotations

import pytest

from analysis.gauges.gauge import Gauge
from render.scene.scene import Scene
from studio.editing.scene_edits import LASERS
from studio.project.document import replaced
from studio.project.project import Project
from studio.project.same_lasers import same_lasers
from studio.scan.redevelop import development


def with_lasers(*names: str) -> Project:
    """The plane's, whose powers are 1 mW, 2 mW ... in the order of the alphabet."""
    project = Project.load("plane")
    laser = project.scene.lasers[0]
    lasers = [laser.model_copy(update={"name": name, "power": 1e-3 * (1 + ord(name[0]) - ord("a"))}) for name in names]
    return replaced(project, LASERS, tuple(lasers))


def scene_of(names: str) -> Scene:
    return with_lasers(*names).scene


@pytest.mark.parametrize(
    ("names", "others", "same"),
    [
        ("ab", "ab", {0: 0, 1: 1}),
        ("ab", "ba", {0: 1, 1: 0}),
        ("b", "ab", {0: 1}),
        ("abc", "ac", {0: 0, 2: 1}),
        ("ac", "ab", {0: 0, 1: 1}),
        ("cba", "abd", {1: 1, 2: 0}),  # the place of the renamed one is another's
        ("ca", "a", {1: 0}),
        ("", "a", {}),
    ],
)
def test_lasers_are_known_by_their_names(names: str, others: str, same: dict[int, int]) -> None:
    assert same_lasers(scene_of(names), scene_of(others)) == same


def test_a_measure_is_read_off_the_laser_that_it_was_made_for() -> None:
    now = with_lasers("b", "c").model_copy(
        update={
            "measures": tuple(Gauge(name=f"of {i}", kind="radius", laser=i, regions=((0.0, 0.01),)) for i in range(2))
        }
    )
    rendered = with_lasers("a", "b")
    assert [(one.name, one.laser) for one in rendered.read_as(now).measures] == [("of 0", 1)]
    how = development(rendered, now)
    assert [(one.name, one.laser) for one in how.project.measures] == [("of 0", 1)]
    # the power of the one that is gone is that which it was rendered with
    assert how.laser_power == pytest.approx((1e-3, 2e-3))
    brighter = replaced(now, (*LASERS, 0, "power"), 7e-3)
    assert development(rendered, brighter).laser_power == pytest.approx((1e-3, 7e-3))
