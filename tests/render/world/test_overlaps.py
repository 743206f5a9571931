"""Transparent bodies in one place: told by name, unless priorities say which is there."""

from __future__ import annotations

import re

import numpy as np
import pytest

from render.base.errors import InputError
from render.base.pose import Pose
from render.material.material import Conductor, Glass, Subsurface
from render.scene.scene import SceneObject
from render.scene.shape import Box, Sphere
from render.world.enclosure import objects_around
from render.world.material_checks import check_materials
from render.world.placement_checks import check_placement
from render.world.world import build_world
from tests.render.scenes import paper_camera, paper_laser, scene_of

SIZE = {"size_x": 0.1, "size_y": 0.1, "size_z": 0.1}


def item(name, material, shape=None, at=(0.0, 0.0, 0.9)):
    return SceneObject(name=name, shape=shape or Box(**SIZE), material=material, T_world_object=Pose(translation=at))


def made(tmp_path, *items):
    scene = scene_of(paper_camera(0.05), paper_laser()).model_copy(update={"objects": items})
    return build_world(scene, tmp_path), scene


CROSSING = item("water", Glass(substance="water"), at=(0.03, 0.02, 0.94))
AROUND = item("water", Glass(substance="water"), Sphere(radius=0.3, segments=32))
WITHIN = item("water", Glass(substance="water"), Sphere(radius=0.01, segments=32))
SLANTED = item("water", Glass(substance="water"), Sphere(radius=0.06, segments=16), at=(0.0, 0.0, 0.84))


@pytest.mark.parametrize("other", [CROSSING, AROUND, WITHIN, SLANTED])
def test_bodies_that_overlap_are_refused_by_both_names_unless_priorities_differ(other, tmp_path):
    world, scene = made(tmp_path, item("wall", Glass()), other)
    expected = r"object 'wall': material\.priority: two transparent bodies overlap.*'wall' and 'water' have priority 0"
    with pytest.raises(InputError, match=expected):
        check_materials(world, scene)
    for wall, water, ranked in ((1, 0, (1, 0)), (3, 7, (0, 1))):
        changed = other.material.model_copy(update={"priority": water})
        objects = item("wall", Glass(priority=wall)), other.model_copy(update={"material": changed})
        world, scene = made(tmp_path, *objects)
        check_materials(world, scene)
        assert world.nesting.ranked == ranked
        assert world.nesting.overlapping == ((0, 1),)


def test_wax_and_glass_are_told_as_well_and_metal_in_glass_is_not(tmp_path):
    world, scene = made(
        tmp_path, item("wax", Subsurface(priority=2)), item("pane", Glass(priority=2), at=(0.05, 0.01, 0.93))
    )
    with pytest.raises(InputError, match=re.escape("'wax' and 'pane' have priority 2")):
        check_materials(world, scene)
    world, scene = made(tmp_path, item("bolt", Conductor()), item("resin", Glass(), at=(0.03, 0.01, 0.93)))
    check_materials(world, scene)
    assert world.nesting.ranked == ()


@pytest.mark.parametrize("priority", [0, 1])
@pytest.mark.parametrize("at", [(0.1, 0.0, 0.9), (0.1, 0.03, 0.93), (0.1 + 1e-9, 0.0, 0.9)])
def test_faces_that_touch_are_refused_even_with_priorities(at, priority, tmp_path):
    world, scene = made(tmp_path, item("one", Glass()), item("two", Glass(priority=priority), at=at))
    with pytest.raises(InputError, match="facets of 'one' lie on facets of 'two'"):
        check_materials(world, scene)


def test_a_facet_that_lies_on_another_within_an_overlap_is_refused(tmp_path):
    """Water drawn into the wall of its glass, but level with its bottom."""
    low = item("water", Glass(substance="water"), Box(size_x=0.04, size_y=0.04, size_z=0.04), at=(0.04, 0.0, 0.93))
    world, scene = made(tmp_path, item("wall", Glass(priority=1)), low)
    with pytest.raises(InputError, match="touch"):
        check_materials(world, scene)


def test_bodies_apart_are_left_alone_however_near(tmp_path):
    for at in ((0.1 + 2e-5, 0.0, 0.9), (0.3, 0.0, 0.9)):
        world, scene = made(tmp_path, item("one", Glass()), item("two", Glass(), at=at))
        check_materials(world, scene)
        assert world.nesting.overlapping == world.nesting.touching == ()
        assert not np.any(world.surface.rows[:, -2:])


def test_more_bodies_than_a_path_can_tell_apart_are_refused(tmp_path):
    chain = [
        item(f"b{i}", Glass(priority=i % 2), at=(0.09 * i, 0.01 * (i % 2), 0.9 + 0.01 * (i % 2))) for i in range(63)
    ]
    world, scene = made(tmp_path, *chain[:62])
    check_materials(world, scene)
    world, scene = made(tmp_path, *chain)
    with pytest.raises(InputError, match="63 of them; allowed: at most 62"):
        check_materials(world, scene)


def test_a_camera_may_be_in_the_water_but_not_in_steel(tmp_path):
    sea, steel = (item("sea", material, Box(size_x=9, size_y=9, size_z=9)) for material in (Glass(), Conductor()))
    part = item("part", Conductor())
    world, scene = made(tmp_path, sea, part)
    check_placement(world, scene)
    assert objects_around(world, range(2), np.array([0.0, 0.0, 0.9])) == [0, 1]
    assert objects_around(world, range(2), np.zeros(3)) == [0]
    world, scene = made(tmp_path, steel, part)
    with pytest.raises(InputError, match="its centre lies within 'sea'"):
        check_placement(world, scene)
