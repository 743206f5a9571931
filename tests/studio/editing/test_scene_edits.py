"""Adding, copying, removing and importing: what is new can be seen, lit and told apart, and nothing else changes."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path

import numpy as np
import pytest
import trimesh

from analysis.gauges.gauge import Gauge
from render.base.errors import InputError
from render.base.pose import invert
from render.material.conductor import Conductor
from render.mesh.trimesh_reader import side_files
from render.scene.lights import PointLight, RectangleLight
from render.scene.motion import LinearStage, NoMotion, PoseList, Turntable
from render.scene.shape import Box, Cylinder, Plane, Sphere, StepBlock, VGroove, WeldTee
from render.world.placement_checks import check_placement
from render.world.world import build_world
from studio.editing import scene_edits
from studio.editing.placement import field_of_view, target, working_distance
from studio.editing.scene_edits import LASERS, LIGHTS, OBJECTS
from studio.project.document import replaced, value_at
from studio.project.mesh_import import ImportedMesh, copied_beside, import_mesh, needs_copy
from studio.project.project import Project
from studio.project.templates import DESCRIPTIONS, template_folder

PRIMITIVES = (Plane, Box, Sphere, Cylinder, StepBlock, VGroove, WeldTee)


@pytest.fixture
def project() -> Project:
    return Project.load(template_folder("scan") / "project.json")


def in_camera(project: Project, point: np.ndarray) -> np.ndarray:
    return (invert(project.scene.T_world_camera()) @ [*point, 1.0])[:3]


class TestPlacement:
    @pytest.mark.parametrize("template", DESCRIPTIONS)
    def test_the_working_distance_is_where_the_sheet_crosses_the_cameras_axis(self, template: str) -> None:
        scene = Project.load(template_folder(template) / "project.json").scene
        a, b, c, d = scene.laser_plane(0)
        point = (invert(scene.T_world_camera()) @ [*target(scene), 1.0])[:3]
        assert point == pytest.approx([0, 0, working_distance(scene)], abs=1e-9)
        assert np.dot([a, b, c], point) + d == pytest.approx(0, abs=1e-9)

    @pytest.mark.parametrize("kind", PRIMITIVES)
    @pytest.mark.parametrize("template", ["scan", "weld_seam"])
    def test_a_new_object_is_in_view_and_of_a_size_that_suits(self, template: str, kind: type) -> None:
        folder = template_folder(template)
        project = Project.load(folder / "project.json")
        alone = replaced(project, OBJECTS, ())
        made, path = scene_edits.add_primitive(alone, kind)
        world = build_world(made.scene, folder)
        check_placement(world, made.scene)
        points = (invert(made.scene.T_world_camera()) @ np.c_[world.vertices, np.ones(len(world.vertices))].T)[:3]
        assert (points[2] > 0).all()
        extent = np.ptp(world.vertices, axis=0).max()
        assert 0.04 * field_of_view(made.scene) < extent < field_of_view(made.scene)
        pixels, valid = made.scene.camera.project(np.median(points, axis=1))
        assert valid
        assert 0 < pixels[0] < made.scene.camera.width and 0 < pixels[1] < made.scene.camera.height
        assert path == (*OBJECTS, 0)

    def test_a_plane_that_the_camera_would_see_edge_on_is_turned_to_face_it(self, project: Project) -> None:
        level = project.model_copy(deep=True)
        level = replaced(level, ("scene", "rig", "T_world_rig"), {"rotation": (math.pi / 2, 0.0, 0.0)})
        made, path = scene_edits.add_primitive(level, Plane)
        normal = value_at(made, path).T_world_object.matrix[:3, 2]
        assert normal @ made.scene.T_world_camera()[:3, 2] == pytest.approx(-1)

    def test_new_lasers_cross_the_axis_at_the_working_distance_and_keep_apart(self, project: Project) -> None:
        distance = working_distance(project.scene)
        for _ in range(9):
            project, _ = scene_edits.add_laser(project)
        scene = project.scene
        origins = [scene.T_camera_laser(i)[:3, 3] for i in range(len(scene.lasers))]
        for i in range(1, len(scene.lasers)):
            plane = scene.laser_plane(i)
            assert plane[:3] @ [0, 0, distance] + plane[3] == pytest.approx(0, abs=1e-6)
            assert abs(plane[3]) > 0.01  # it can be triangulated
            # the fan opens across the baseline
            assert abs(scene.T_camera_laser(i)[:3, 1] @ origins[i]) < 1e-6
        pairs = [np.linalg.norm(a - b) for i, a in enumerate(origins) for b in origins[:i]]
        assert min(pairs) > 0.02
        assert len({laser.name for laser in scene.lasers}) == 10

    def test_the_first_laser_of_a_rig_finds_its_place_too(self, project: Project) -> None:
        bare = replaced(project, LASERS, ())
        made, path = scene_edits.add_laser(bare)
        assert path == (*LASERS, 0)
        plane = made.scene.laser_plane(0)
        assert plane[:3] @ [0, 0, working_distance(bare.scene)] + plane[3] == pytest.approx(0, abs=1e-6)

    def test_an_aimed_laser_lights_the_point_of_the_world_at_any_step(self) -> None:
        project = Project.load(template_folder("scan") / "project.json")
        point = target(project.scene) + np.array([0.013, -0.02, 0.004])
        made, path = scene_edits.aim_laser(project, 0, point, step=2)
        x, y, z, _ = np.linalg.inv(made.scene.T_world_laser(0, 2)) @ [*point, 1.0]
        assert path == (*scene_edits.LASERS, 0) and z > 0.0
        assert math.hypot(x, y) < 1e-8

    def test_lights_shine_on_what_the_camera_looks_at_from_its_side(self, project: Project) -> None:
        for kind in (PointLight, RectangleLight):
            made, path = scene_edits.add_light(project, kind)
            pose = value_at(made, path).T_world_light.matrix
            towards = target(made.scene) - pose[:3, 3]
            assert pose[:3, 2] @ towards / np.linalg.norm(towards) == pytest.approx(1, abs=1e-6)
            assert in_camera(made, pose[:3, 3])[2] < working_distance(made.scene)


class TestLists:
    def test_adding_changes_nothing_else(self, project: Project) -> None:
        made, path = scene_edits.add_primitive(project, Box)
        assert made.scene.objects[:-1] == project.scene.objects
        assert path == (*OBJECTS, len(project.scene.objects))
        assert made.scene.rig == project.scene.rig

    def test_names_are_unique_and_counted_on(self) -> None:
        assert scene_edits.unique_name("laser", set()) == "laser"
        assert scene_edits.unique_name("laser", {"laser", "laser 2"}) == "laser 3"
        assert scene_edits.unique_name("laser 2", {"laser", "laser 2"}) == "laser 3"
        assert scene_edits.unique_name("x" * 100, {"x" * 100}) == "x" * 90 + " 2"

    def test_a_copy_stands_beside_its_original_under_a_new_name(self, project: Project) -> None:
        path = (*OBJECTS, 1)
        original = value_at(project, path)
        made, copy_path = scene_edits.duplicate(project, path)
        copy = value_at(made, copy_path)
        assert copy_path == (*OBJECTS, 2)
        assert copy.shape == original.shape and copy.name == f"{original.name} 2"
        assert copy.T_world_object.translation != original.T_world_object.translation
        for other in ((*LASERS, 0), (*LIGHTS, 0)):
            made, copy_path = scene_edits.duplicate(project, other)
            assert value_at(made, copy_path).name.endswith(" 2")

    def test_removing_leaves_the_neighbour_selected(self, project: Project) -> None:
        made, path = scene_edits.remove(project, (*OBJECTS, 1))
        assert path == (*OBJECTS, 0)
        assert len(made.scene.objects) == 1
        made, path = scene_edits.remove(made, path)
        assert path == OBJECTS
        assert made.scene.objects == ()

    def test_what_is_no_item_of_a_list_is_not_removed(self, project: Project) -> None:
        for path in (("scene", "rig", "camera"), ("sensor",), ()):
            with pytest.raises((KeyError, IndexError)):
                scene_edits.remove(project, path)

    def test_items_change_places(self, project: Project) -> None:
        made, path = scene_edits.move(project, (*OBJECTS, 0), 1)
        assert path == (*OBJECTS, 1)
        assert made.scene.objects == project.scene.objects[::-1]
        assert scene_edits.move(project, (*OBJECTS, 1), 99)[0] == project

    def test_measures_follow_their_laser_and_go_with_it(self, project: Project) -> None:
        """Of a rig whose first laser was deleted its measures read the second one's line, under their old names."""
        two, first = scene_edits.add_laser(project)[0], (*LASERS, 0)
        measures = tuple(
            Gauge(name=f"of {laser}", kind="angle", laser=laser, regions=((-0.1, 0.0), (0.0, 0.1))) for laser in (0, 1)
        )
        two = two.model_copy(update={"measures": measures})

        def left(changed: Project) -> list[tuple[str, int]]:
            return [(gauge.name, gauge.laser) for gauge in changed.measures]

        assert left(scene_edits.remove(two, first)[0]) == [("of 1", 0)]
        assert left(scene_edits.remove(two, (*LASERS, 1))[0]) == [("of 0", 0)]
        assert left(scene_edits.move(two, first, 1)[0]) == [("of 0", 1), ("of 1", 0)]
        copied, at = scene_edits.duplicate(two, first)
        assert left(copied) == [("of 0", 0), ("of 1", 2)] and at == (*LASERS, 1)
        assert [laser.name for laser in copied.scene.lasers][::2] == [laser.name for laser in two.scene.lasers]
        assert left(scene_edits.remove_all(copied, [first, at])[0]) == [("of 1", 0)]

    def test_a_taken_name_is_refused_in_words(self, project: Project) -> None:
        first, second = (item.name for item in project.scene.objects)
        with pytest.raises(InputError, match="another object has this name"):
            scene_edits.rename(project, (*OBJECTS, 1), first)
        assert scene_edits.rename(project, (*OBJECTS, 1), f" {second} ") == project
        with pytest.raises(InputError):
            scene_edits.rename(project, (*OBJECTS, 1), "  ")
        assert scene_edits.rename(project, (), "Another").name == "Another"

    def test_the_report_goes_on_judging_an_object_that_is_renamed(self, project: Project) -> None:
        second = project.scene.objects[1].name
        judged = replaced(project, ("delivery", "surface_of"), second)
        assert scene_edits.rename(judged, (*OBJECTS, 1), "part").delivery.surface_of == "part"
        assert scene_edits.rename(judged, (*OBJECTS, 0), "part").delivery.surface_of == second
        assert scene_edits.rename(project, (*OBJECTS, 1), "part").delivery.surface_of == ""

    def test_another_file_is_shaded_as_an_import_of_it_and_pose_scale_and_material_stay(self, project: Project) -> None:
        box = (0.0, 0.0, 0.0), (0.1, 0.1, 0.1)
        step = ImportedMesh("meshes/housing/lid.ply", "mm", box, 12, "lid", closed=True)
        scan = ImportedMesh("meshes/bunny.stl", "in", box, 12)
        imported, path = scene_edits.add_parts(project, [step])
        item = value_at(imported, path).model_copy(update={"scale": 2.0, "material": Conductor()})
        part = replaced(replaced(imported, path, item), ("delivery", "surface_of"), "lid")
        assert item.crease_angle == scene_edits.SMOOTH_BELOW
        made = scene_edits.replace_mesh_of(part, path, scan)
        now = value_at(made, path)
        assert (now.shape.path, now.shape.unit, now.crease_angle) == ("meshes/bunny.stl", "in", 0.0)
        # the name was the file's, and is the new one's
        assert now.name == made.delivery.surface_of == "bunny"
        kept = {"shape": item.shape, "crease_angle": item.crease_angle, "name": item.name}
        assert now.model_copy(update=kept) == item
        back = value_at(scene_edits.replace_mesh_of(made, path, step), path)
        assert (back.name, back.crease_angle) == ("lid", scene_edits.SMOOTH_BELOW)
        named = scene_edits.rename(part, path, "reference part")
        assert value_at(scene_edits.replace_mesh_of(named, path, scan), path).name == "reference part"

    def test_hidden_objects_are_hidden(self, project: Project) -> None:
        made = scene_edits.set_visible(project, (*OBJECTS, 0), False)
        assert [item.name for item in made.scene.visible_objects] == [project.scene.objects[1].name]

    def test_another_kind_of_motion_keeps_what_moves(self, project: Project) -> None:
        moves = project.scene.motion.moves  # type: ignore[union-attr]
        for kind in (Turntable, LinearStage, PoseList):
            made, _ = scene_edits.set_motion(project, kind)
            assert isinstance(made.scene.motion, kind)
            assert made.scene.motion.moves == moves
            if isinstance(made.scene.motion, Turntable):  # ten frames of a degree each had gone round by nine
                assert made.scene.motion.angle_step * made.scene.motion.steps == pytest.approx(2.0 * np.pi)
        assert scene_edits.set_motion(project, NoMotion)[0].scene.frame_count == 1

    @pytest.mark.parametrize("template", ["sphere", "v_groove", "step_block", "weld_seam"])
    def test_a_new_stage_moves_across_the_line(self, template: str) -> None:
        still = scene_edits.set_motion(Project.load(template_folder(template) / "project.json"), NoMotion)[0]
        made, path = scene_edits.set_motion(still, LinearStage)
        step, normal = np.array(made.scene.motion.step), made.scene.T_world_laser(0)[:3, 0]  # type: ignore[union-attr]
        assert abs(step @ normal) > 0.6 * np.linalg.norm(step) == pytest.approx(0.6e-3)
        slower = replaced(made, (*path, "step"), (0.0, 0.0, 0.0005))
        assert scene_edits.set_motion(slower, LinearStage)[0] == slower


class TestMeshImport:
    def mesh(self, file: Path, size: tuple[float, float, float] = (0.1, 0.2, 0.05)) -> Path:
        file.parent.mkdir(parents=True, exist_ok=True)
        box = trimesh.creation.box(size)
        box.apply_translation([7 * size[0], 0, 0])
        box.export(file)
        return file

    def test_a_file_from_outside_is_copied_and_its_middle_put_in_view(self, project: Project, tmp_path: Path) -> None:
        root, file = tmp_path / "project", self.mesh(tmp_path / "downloads" / "part.stl")
        assert needs_copy(file, root)
        found = import_mesh(file, root, field_of_view(project.scene))
        assert (found.path, found.unit, found.triangles) == ("meshes/part.stl", "m", 12)
        assert found.size == pytest.approx((0.1, 0.2, 0.05), rel=1e-5)
        made, path = scene_edits.add_mesh(project, found.path, found.unit, found.bounds)
        item = value_at(made, path)
        world = build_world(replaced(made, OBJECTS, (item,)).scene, root)
        assert (world.vertices.min(axis=0) + world.vertices.max(axis=0)) / 2 == pytest.approx(
            target(made.scene), abs=1e-6
        )
        assert item.name == "part"

    def test_a_file_in_the_folder_stays_where_it_is(self, tmp_path: Path) -> None:
        file = self.mesh(tmp_path / "sub" / "part.ply")
        assert import_mesh(file, tmp_path, 0.5).path == "sub/part.ply"
        assert not (tmp_path / "meshes").exists()

    def test_a_mesh_in_millimetres_is_told_by_its_size(self, tmp_path: Path) -> None:
        found = import_mesh(self.mesh(tmp_path / "part.stl", (100, 200, 50)), tmp_path, 0.5)
        assert found.unit == "mm"
        assert found.size == pytest.approx((0.1, 0.2, 0.05), rel=1e-5)
        small = import_mesh(self.mesh(tmp_path / "small.stl", (8, 4, 2)), tmp_path, 0.5)
        assert small.unit == "mm"

    def test_the_same_file_twice_is_copied_once_and_another_of_that_name_beside_it(self, tmp_path: Path) -> None:
        root = tmp_path / "project"
        first = import_mesh(self.mesh(tmp_path / "a" / "part.stl"), root, 0.5)
        again = import_mesh(tmp_path / "a" / "part.stl", root, 0.5)
        other = import_mesh(self.mesh(tmp_path / "b" / "part.stl", (0.3, 0.1, 0.1)), root, 0.5)
        assert (first.path, again.path, other.path) == ("meshes/part.stl", "meshes/part.stl", "meshes/part 2.stl")

    def test_materials_and_buffers_come_along(self, tmp_path: Path) -> None:
        file = tmp_path / "in" / "part.obj"
        self.mesh(file)
        text = file.read_text().replace("mtllib material.mtl\n", "")
        file.write_text("mtllib part.mtl\n" + text)
        (file.parent / "part.mtl").write_text("newmtl a\nKd 1 0 0\nmap_Kd -s 1 1 1 wood.png\n")
        (file.parent / "wood.png").write_bytes(b"png")
        assert side_files(file, file.parent) == ["part.mtl", "wood.png"]
        import_mesh(file, tmp_path / "project", 0.5)
        copied = sorted(copy.name for copy in (tmp_path / "project" / "meshes").iterdir())
        assert copied == ["part.mtl", "part.obj", "wood.png"]
        gltf = self.mesh(tmp_path / "in" / "scene.gltf")
        buffers = [entry["uri"] for entry in json.loads(gltf.read_text())["buffers"]]
        assert side_files(gltf, gltf.parent) == buffers
        assert import_mesh(gltf, tmp_path / "project", 0.5).triangles == 12

    def test_side_files_outside_the_meshs_folder_are_not_fetched(self, tmp_path: Path) -> None:
        (tmp_path / "secret.mtl").write_text("newmtl a\n")
        file = self.mesh(tmp_path / "in" / "part.obj")
        file.write_text("mtllib ../secret.mtl\n" + file.read_text())
        import_mesh(file, tmp_path / "project", 0.5)
        assert not list((tmp_path / "project").rglob("secret*"))

    @pytest.mark.parametrize("library", ["/dev/full", "pipe.mtl", "link.mtl", "../outside.mtl", "folder.mtl"])
    def test_a_material_library_is_read_by_the_projects_own_rules(self, tmp_path: Path, library: str) -> None:
        file = self.mesh(tmp_path / "in" / "part.obj")
        (tmp_path / "outside.mtl").write_text("newmtl a\nmap_Kd wood.png\n")
        os.mkfifo(file.parent / "pipe.mtl")
        (file.parent / "link.mtl").symlink_to(tmp_path / "outside.mtl")
        (file.parent / "folder.mtl").mkdir()
        file.write_text(f"mtllib {library}\n" + file.read_text())
        root = tmp_path / "project"
        if library == "pipe.mtl":  # it is there, and would be copied without end
            with pytest.raises(InputError, match=r"pipe\.mtl: the file that the mesh names is not a regular file"):
                import_mesh(file, root, 0.5)
        else:
            assert import_mesh(file, root, 0.5).triangles == 12
        assert not list(root.rglob("*.mtl"))

    def test_a_bad_file_leaves_nothing_behind(self, tmp_path: Path) -> None:
        broken = tmp_path / "broken.stl"
        broken.write_bytes(b"solid nothing\nendsolid\n")
        cloud = tmp_path / "cloud.ply"
        trimesh.PointCloud(np.eye(3)).export(cloud)
        for file in (broken, cloud, tmp_path / "absent.stl", tmp_path / "notes.txt"):
            with pytest.raises(InputError):
                import_mesh(file, tmp_path / "project", 0.5)
        assert not list((tmp_path / "project").rglob("*.*"))

    def test_images_are_copied_beside_the_project(self, tmp_path: Path) -> None:
        image = tmp_path / "wood.png"
        image.write_bytes(b"png")
        assert copied_beside(image, tmp_path / "project", "textures") == "textures/wood.png"
        assert copied_beside(image, tmp_path, "textures") == "wood.png"
