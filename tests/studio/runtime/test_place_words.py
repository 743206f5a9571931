"""What the window says names things as its scene tree does."""

from __future__ import annotations

import pytest

from render.base.errors import InputError
from render.mesh.primitives import primitive_mesh
from render.scene.scene import SceneObject
from render.scene.shape import Box
from render.world.material_checks import scene_warnings
from render.world.placement_checks import check_placement
from studio.runtime.error_messages import trouble
from studio.runtime.jobs import explain
from studio.runtime.place_words import in_words
from tests.render.scenes import moved, paper_camera, paper_laser, scene_of, world_of


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("scene.rig.lasers[0] (left): its light meets no object", "“left”: its light meets no object"),
        ("scene.objects[3] (weld seam): no normals", "“weld seam”: no normals"),
        ("scene.rig.lasers[1]: it is behind", "laser 2: it is behind"),
        ("scene.rig.camera.distortion", "the camera's distortion"),
        ("scene.rig.lasers", "the lasers"),
        ("scene.objects: none", "the objects: none"),
    ],
)
def test_items_are_called_by_their_names(text: str, words: str) -> None:
    assert in_words(text) == words


@pytest.mark.parametrize("text", ["a.json: scene.objects[0].material.albedo is high", "scene.rig.camera.lens.f_number"])
def test_fields_deeper_down_stay_as_the_file_has_them(text: str) -> None:
    assert in_words(text) == text


def test_a_laser_that_lights_nothing_is_called_by_its_name() -> None:
    scene = scene_of(paper_camera(0.05), paper_laser())
    beside = moved(primitive_mesh(Box(size_x=0.02, size_y=0.02)), (0.15, 0, 0.9))
    (told, *_) = scene_warnings(world_of(scene, beside), scene)
    assert in_words(told).startswith("“laser”: its light meets no object")


def test_an_empty_scene_is_told_without_the_files_words() -> None:
    scene = scene_of(paper_camera(0.05), paper_laser(), objects=0)
    hidden = scene.model_copy(update={"objects": (SceneObject(name="plate", shape=Box(), visible=False),)})
    with pytest.raises(InputError) as caught:
        check_placement(world_of(scene), hidden)
    told = trouble(caught.value, "render")
    assert told.cause == (
        "The scene has no visible object.\nWhere: the objects\nFound: 1 hidden\nAllowed: at least one visible object"
    )
    assert told.cure == "Add an object, or make one visible."
    assert explain(caught.value, "render").text.startswith(
        "the objects: the scene has no visible object; found 1 hidden"
    )
