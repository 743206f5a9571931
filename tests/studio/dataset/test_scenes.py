"""Scenes: the same however the work is split, and none that shows nothing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from render.base.errors import InputError
from studio.dataset.recipe import Draw, Recipe, base_of
from studio.dataset.scenes import Scene, drawn_scene, winding_number
from studio.preview.preview import Preview

TILT = Draw(field="scene.objects[0].T_world_object.rotation[0]", low=-0.3, high=0.3)
NOISE = Draw(field="sensor.read_noise", low=1.0, high=8.0)
RECIPE = Recipe(base="plane", image_scale=0.1, images=3, draw=(TILT, NOISE))


def drawn(recipe: Recipe, number: int, root: Path = Path()) -> Scene:
    return drawn_scene(recipe, base_of(recipe, root), root, number, Preview(1))


def test_a_field_more_changes_no_other_value() -> None:
    more = RECIPE.model_copy(
        update={"draw": (Draw(field="scene.objects[0].material.albedo", low=0.1, high=0.9), TILT, NOISE)}
    )
    for number in (0, 5):
        one, other = drawn(RECIPE, number), drawn(more, number)
        for mine, theirs in zip(one.drawn, other.drawn, strict=True):
            assert all(theirs[field] == value for field, value in mine.items())


def test_images_of_a_scene_share_what_is_lit_and_have_a_sensor_of_their_own() -> None:
    scene = drawn(RECIPE, 4)
    assert len({one[TILT.field] for one in scene.drawn}) == 1
    assert len({one[NOISE.field] for one in scene.drawn}) == 3
    assert len({project.seed for project in scene.projects}) == 3


def test_scenes_that_show_no_line_are_drawn_anew_and_counted() -> None:
    hidden = Draw(field="scene.objects[0].visible", kind="choice", values=(False, False, True))
    recipe = RECIPE.model_copy(update={"draw": (hidden,)})
    scenes = [drawn(recipe, k) for k in range(6)]
    assert all(scene.drawn[0][hidden.field] is True for scene in scenes)
    rejected = [reason for scene in scenes for reason in scene.rejected]
    assert len(rejected) > 2 and set(rejected) == {"too little of the line is seen"}


def test_a_recipe_that_never_shows_a_line_is_told() -> None:
    recipe = RECIPE.model_copy(update={"set": {"scene.objects[0].visible": False}})
    with pytest.raises(InputError, match=r"show no line.*50 x too little of the line is seen"):
        drawn(recipe, 0)


def test_splits_have_the_shares_asked_for() -> None:
    recipe = Recipe(base="plane", image_scale=0.02, split=(0.5, 0.3, 0.2), least_rows=0.0)
    base, preview = base_of(recipe, Path()), Preview(1)
    found = [drawn_scene(recipe, base, Path(), k, preview).split for k in range(200)]
    for name, share in zip(("train", "validation", "test"), recipe.split, strict=True):
        assert abs(found.count(name) / 200 - share) < 4 * (share * (1 - share) / 200) ** 0.5


def test_parts_come_from_a_folder_of_meshes(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    for k in range(3):
        trimesh.creation.box((0.2, 0.2, 0.01 + 0.01 * k)).export(tmp_path / "parts" / f"{k}.stl")
    draw = Draw(field="scene.objects[0].shape", kind="mesh", folder="parts")
    # of a ready-made base, which has no files of its own, and of one beside the recipe
    base_of(Recipe(base="plane"), tmp_path).save(tmp_path / "project.json")
    for name in ("plane", "project.json"):
        recipe = Recipe(base=name, image_scale=0.05, draw=(draw,))
        found = {drawn(recipe, k, tmp_path).projects[0].scene.objects[0].shape.path for k in range(12)}  # type: ignore[union-attr]
        assert found == {"parts/0.stl", "parts/1.stl", "parts/2.stl"}
    with pytest.raises(InputError, match="no such folder of meshes"):
        drawn(recipe.model_copy(update={"draw": (draw.model_copy(update={"folder": "none"}),)}), 0, tmp_path)
    with pytest.raises(InputError, match="files of its own"):
        base_of(recipe.model_copy(update={"base": "weld_seam"}), tmp_path)


def test_the_winding_number_is_one_inside_a_closed_part_and_nothing_outside() -> None:
    ball = trimesh.creation.icosphere(subdivisions=2)
    vertices, triangles = np.asarray(ball.vertices, float), np.asarray(ball.faces, np.int32)
    assert winding_number(vertices, triangles, np.array([0.3, 0.2, -0.5])) == pytest.approx(1.0, abs=1e-9)
    assert winding_number(vertices, triangles, np.array([1.5, 0.0, 0.4])) == pytest.approx(0.0, abs=1e-9)
    square = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])  # one side of a cube of 2: a sixth
    found = winding_number(square, np.array([[0, 1, 2], [0, 2, 3]], np.int32), np.array([0.0, 0.0, -1.0]))
    assert found == pytest.approx(1.0 / 6.0, abs=1e-12)


def test_a_camera_inside_a_part_is_drawn_anew() -> None:
    where = [0.0, 0.0, 0.0]
    base = base_of(RECIPE, Path())
    where = base.scene.T_world_camera(0)[:3, 3].tolist()
    ball = {"scene.objects[0].shape": {"kind": "sphere", "radius": 0.05, "segments": 32}}
    at = {f"scene.objects[0].T_world_object.translation[{k}]": where[k] for k in range(3)}
    recipe = Recipe(base="plane", image_scale=0.05, least_rows=0.0, set={**ball, **at})
    with pytest.raises(InputError, match="50 x the camera is inside a part"):
        drawn(recipe, 0)
