"""A scan's folder belongs to one scan: nothing of another is in it, and nothing else is taken for the truth."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from analysis.cloud import read_ply
from render.base.errors import InputError
from render.base.pose import Pose
from render.material.material import Lambertian
from studio.commands.commands import rebuild_report, run_project
from studio.project.document import replaced
from studio.project.project import Project
from studio.scan import scan_folder
from studio.scan.folder_lock import LOCK, hold
from studio.scan.options import Listener
from studio.scan.reconstruct import reconstruct_folder
from studio.scan.stages import Clock
from tests.quick_reports import drawn_quickly
from tests.studio.small_scan import SCALE, contents, scan, small_project, write_plate


@pytest.fixture(scope="module")
def original(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the project in `project`, its finished scan in `out`."""
    folder = tmp_path_factory.mktemp("original")
    with drawn_quickly():
        scan(small_project(folder / "project"), folder / "out", report=True)
    return folder


@pytest.fixture
def made(original: Path, tmp_path: Path) -> Path:
    """A copy of it to spoil."""
    shutil.copytree(original, tmp_path, dirs_exist_ok=True)
    return tmp_path


def reconstruct(
    made: Path, project: Project | None = None, out: Path | None = None, root: Path | None = None, **options
):
    found = scan_folder.open_folder(made / "out")
    clock = Clock(lambda stage, done: None, lambda: False)
    return reconstruct_folder(
        found, project or found.project, root or found.root, out or made / "second", clock, report=False, **options
    )


def small(made: Path) -> Project:
    """The project as it was run."""
    return Project.load(made / "out" / "scan_project.json")


def edit(path: Path, change: Callable[[dict], None]) -> None:
    data = json.loads(path.read_text())
    change(data)
    path.write_text(json.dumps(data))


class TestTheLock:
    def test_a_second_program_is_told_who_holds_the_folder(self, original: Path, tmp_path: Path) -> None:
        with (
            hold(tmp_path / "out"),
            pytest.raises(InputError, match=rf"works in this folder.*found process {os.getpid()} on"),
        ):
            scan(original / "project" / "project.json", tmp_path / "out")
        scan(original / "project" / "project.json", tmp_path / "out", measure=False)
        assert not (tmp_path / "out" / LOCK).exists()

    def test_a_program_that_died_holds_nothing(self, tmp_path: Path) -> None:
        script = "import os,sys,pathlib; from studio.scan.folder_lock import hold; k=hold(pathlib.Path(sys.argv[1]))\n"
        script += "k.__enter__(); os.kill(os.getpid(), 9)"
        subprocess.run([sys.executable, "-c", script, tmp_path], check=False)
        assert (tmp_path / LOCK).exists()
        with hold(tmp_path):
            assert json.loads((tmp_path / LOCK).read_text())["pid"] == os.getpid()
        assert not (tmp_path / LOCK).exists()

    @pytest.mark.parametrize("held", ["out", "second"])
    def test_frames_that_another_program_works_on_are_not_measured(self, made: Path, held: str) -> None:
        with hold(made / held), pytest.raises(InputError, match="another program works in this folder"):
            reconstruct(made)


class TestANewScan:
    def test_nothing_of_the_old_one_stays_and_nothing_of_others_goes(self, made: Path) -> None:
        out = made / "out"
        photograph = (made / "project" / "grain.png").read_bytes()
        (out / "frame_0099.png").write_bytes(photograph)
        (out / "notes.txt").write_text("mine")
        (out / ".frame_0000.0123abcd.exr").write_bytes(b"left by a kill")
        scan(made / "project" / "project.json", out, steps=1, measure=False)
        frame = {f"frame_0000.{kind}" for kind in ("exr", "png", "json")}
        assert {path.name for path in out.iterdir()} == frame | {
            "scan.json", "scan_project.json", "frame_0099.png", "notes.txt"
        }  # fmt: skip
        assert (out / "frame_0099.png").read_bytes() == photograph

    def test_left_over_temporary_files_go_with_resume_too(self, made: Path) -> None:
        left = made / "out" / ".frame_0001.0123abcd.exr"
        left.write_bytes(b"left by a kill")
        scan(made / "project" / "project.json", made / "out", resume=True)
        assert not left.exists()

    @pytest.mark.parametrize("name", ["frame_0001.png", "points.ply", "points.csv", "scan.json", "scan_project.json"])
    def test_a_file_that_no_scan_wrote_is_not_replaced(self, name: str, original: Path, tmp_path: Path) -> None:
        (tmp_path / name).write_text("mine")
        with pytest.raises(InputError, match=rf"{re.escape(name)}: .* did not write"):
            scan(original / "project" / "project.json", tmp_path)
        assert [path.name for path in tmp_path.iterdir()] == [name] and (tmp_path / name).read_text() == "mine"

    def test_an_edited_project_of_a_scan_is_not_replaced(self, made: Path) -> None:
        edit(made / "out" / "scan_project.json", lambda data: data["sensor"].update(exposure_time=1e-4))
        with pytest.raises(InputError, match="edited since"):
            scan(made / "project" / "project.json", made / "out")
        assert scan_folder.MANIFEST in os.listdir(made / "out")

    def test_the_frames_of_another_scene_are_not_gone_on_with(self, made: Path) -> None:
        before = contents(made / "out")
        moved = replaced(Project.load(made / "project" / "project.json"), ("scene", "rig", "lasers", 0, "power"), 0.5)
        with pytest.raises(InputError, match=r"scene\.rig\.lasers\[0\]\.power: 0\.\d+ in the frames, 0\.5 in the proj"):
            scan(made / "project" / "project.json", made / "out", project=moved, resume=True)
        assert contents(made / "out") == before and (made / "out" / "scan.json").exists()


class TestWhatIsRead:
    def test_a_scan_into_its_project_s_own_folder_leaves_the_project_alone(self, made: Path) -> None:
        file = made / "out" / "scan_project.json"
        before = file.read_bytes()
        for name in ("plate.obj", "grain.png"):
            shutil.copy(made / "project" / name, made / "out")
        with pytest.raises(InputError, match=r"scan_project\.json: a result would replace a file that is read"):
            run_project(file, out=made / "out", threads=1, seed=None, scale=0.5, steps=None, quiet=True, as_json=False)
        assert file.read_bytes() == before

    @pytest.mark.parametrize("name", ["scan.json", "frame_0001.json", "report.json"])
    def test_a_project_named_like_a_result_is_not_written_over(self, name: str, original: Path, tmp_path: Path) -> None:
        shutil.copytree(original / "project", tmp_path, dirs_exist_ok=True)
        file = (tmp_path / "project.json").rename(tmp_path / name)
        before = file.read_bytes()
        if name == "report.json":  # which is none
            scan(file, tmp_path)
        else:
            with pytest.raises(InputError, match="that is read"):
                scan(file, tmp_path)
        assert file.read_bytes() == before

    @pytest.mark.parametrize("link", [False, True])
    def test_a_mesh_named_like_a_result_is_not_written_over(self, link: bool, original: Path, tmp_path: Path) -> None:
        """Also where the result's name is another name of the same file."""
        import trimesh

        shutil.copytree(original / "project", tmp_path / "p")
        trimesh.creation.box((0.2, 0.2, 0.02)).export(tmp_path / "p" / "points.ply")
        out = tmp_path / "out" if link else tmp_path / "p"
        if link:
            out.mkdir()
            os.link(tmp_path / "p" / "points.ply", out / "points.ply")
        before = (tmp_path / "p" / "points.ply").read_bytes()
        project = Project.load(tmp_path / "p" / "project.json")
        item = project.scene.objects[0]
        shape = item.shape.model_copy(update={"path": "points.ply", "sha256": None})
        item = item.model_copy(update={"shape": shape, "material": Lambertian()})
        boxed = project.model_copy(update={"scene": project.scene.model_copy(update={"objects": (item,)})})
        with pytest.raises(InputError, match=r"points\.ply: a result would replace a file that is read"):
            scan(tmp_path / "p" / "project.json", out, project=boxed)
        assert (tmp_path / "p" / "points.ply").read_bytes() == before
        assert "scan_project.json" not in os.listdir(out)


RIG, LASER, PLATE = ("scene", "rig"), ("scene", "rig", "lasers", 0), ("scene", "objects", 0)
DIFFERENT = {
    "scene.rig.lasers[0].T_rig_laser.translation[0]": ((*LASER, "T_rig_laser"), Pose(translation=(0.3, 0, 0))),
    "scene.rig.camera.fx": ((*RIG, "camera", "fx"), 100.0),
    "scene.rig.camera.distortion": ((*RIG, "camera", "distortion"), (0.1, 0.0, 0.0, 0.0)),
    "scene.rig.T_world_rig.translation[2]": ((*RIG, "T_world_rig"), Pose(translation=(0, 0, 2), rotation=(3.1, 0, 0))),
    "scene.objects[0].T_world_object.translation[2]": ((*PLATE, "T_world_object"), Pose(translation=(0, 0, 0.01))),
    "scene.objects[0].scale": ((*PLATE, "scale"), 1.1),
    "scene.objects[0].shape.path": ((*PLATE, "shape", "path"), "other.obj"),
    "scene.objects[0].material.albedo": ((*PLATE, "material", "albedo"), 0.3),
    "scene.motion.step[0]": (("scene", "motion", "step"), (0.004, 0.0, 0.0)),
    "scene.motion.steps": (("scene", "motion", "steps"), 3),
    "scene.environment.radiance[1]": (("scene", "environment", "radiance"), (0.0, 1.0, 0.0)),
    "render.transport": (("render", "transport"), "interreflection"),
    "render.laser_error": (("render", "laser_error"), 0.01),
    "extraction.axis": (("extraction", "axis"), "columns"),
    "seed": (("seed",), 12345),
}  # fmt: skip


class TestMeasuringFrames:
    @pytest.mark.parametrize("field", DIFFERENT)
    def test_another_project_is_refused_by_the_field_that_differs(self, field: str, original: Path) -> None:
        path, value = DIFFERENT[field]
        project = Project.load(original / "out" / "scan_project.json")
        with pytest.raises(InputError, match=re.escape(field) + r": .* in the frames, .* in the project"):
            reconstruct(original, replaced(project, path, value), original / "refused")
        assert not (original / "refused").exists()

    def test_names_sensor_and_extraction_are_free_and_the_power_scales_the_light(self, made: Path) -> None:
        file = made / "project" / "project.json"
        wide = Project.load(file)  # a line that its pixels resolve, so that its sigma is noise
        scan(file, made / "out", project=replaced(wide, ("scene", "rig", "lasers", 0, "sheet", "full_angle"), 0.02))
        project = Project.load(made / "out" / "scan_project.json")
        project = replaced(project, ("scene", "rig", "lasers", 0, "name"), "violet")
        project = replaced(project, ("scene", "objects", 0, "name"), "part")
        project = replaced(project, ("sensor", "dsnu"), 0.0)
        project = replaced(project, ("extraction", "method"), "gaussian")
        dim = replaced(project, ("scene", "rig", "lasers", 0, "power"), project.scene.lasers[0].power / 10)
        for name, chosen in (("same", project), ("dim", dim)):
            reconstruct(made, chosen, made / name)
        sigma = [np.median(read_ply(made / name / "points.ply")["sigma_random"]) for name in ("same", "dim")]
        assert 2.5 < sigma[1] / sigma[0] < 10.0  # a tenth of the light: by its root, or by all of it with read noise

    def test_an_edited_project_in_the_folder_is_refused_by_what_was_edited(self, made: Path) -> None:
        file = made / "out" / "scan_project.json"
        edit(file, lambda data: data["scene"]["rig"]["camera"].update(fx=99.0))
        with pytest.raises(InputError, match=r"edited since: scene\.rig\.camera\.fx: .* in the frames, 99\.0"):
            scan_folder.open_folder(made / "out")

    def test_also_where_its_hash_was_brought_up_to_date(self, made: Path) -> None:
        file = made / "out" / "scan_project.json"
        edit(file, lambda data: data["scene"]["rig"]["camera"].update(fx=99.0))
        edit(made / "out" / "scan.json", lambda data: data["sha256"].update(project=scan_folder.sha256(file)))
        with pytest.raises(InputError, match=r"frame_0000\.json: .*scene\.rig\.camera\.fx: .* in the frames, 99\.0"):
            reconstruct(made)

    def test_an_edited_frame_is_refused(self, made: Path) -> None:
        edit(made / "out" / "frame_0001.json", lambda data: data["lasers"][0]["curve"]["position"].reverse())
        with pytest.raises(InputError, match=r"frame_0001\.json: the frame's description has changed"):
            reconstruct(made)

    def test_what_the_points_were_measured_with_is_kept_for_the_report(self, made: Path, quick_reports: None) -> None:
        assert scan_folder.measured_project(scan_folder.open_folder(made / "out")) == small(made)
        other = replaced(small(made), ("extraction", "method"), "centre_of_mass")
        reconstruct(made, other, made / "out")
        assert scan_folder.measured_project(scan_folder.open_folder(made / "out")) == other
        rebuild_report(made / "out", threads=1, quiet=True, as_json=False)
        results = json.loads((made / "out" / "scan.json").read_text())["results"]
        assert results[0]["method"] == "centre_of_mass"

    @pytest.mark.parametrize("record", [5, {"scene": {}}, {"extraction": {"method": "guess"}}])
    def test_a_record_of_the_measurement_that_is_none_is_named(self, record: object, made: Path) -> None:
        edit(made / "out" / "scan.json", lambda data: data.update(measured_with=record))
        with pytest.raises(InputError, match="measured_with"):
            scan_folder.measured_project(scan_folder.open_folder(made / "out"))

    def test_in_the_scan_s_own_folder_the_manifest_tells_the_new_result(self, made: Path) -> None:
        out = made / "out"
        project = replaced(Project.load(out / "scan_project.json"), ("extraction", "method"), "gaussian")
        reconstruct(made, project, out)
        manifest = json.loads((out / "scan.json").read_text())
        assert manifest["results"][0]["method"] == "gaussian" and manifest["report"] == []
        assert manifest["measured_with"]["extraction"]["method"] == "gaussian"
        assert not (out / "report.html").exists() and not (out / "report.pdf").exists()
        reconstruct(made, None, out)
        assert "measured_with" not in json.loads((out / "scan.json").read_text())

    def test_the_results_of_another_scan_are_not_replaced(self, made: Path) -> None:
        shutil.copytree(made / "out", made / "other")
        before = contents(made / "other")
        with pytest.raises(InputError, match="holds another scan"):
            reconstruct(made, None, made / "other")
        assert contents(made / "other") == before

    def test_the_same_command_replaces_its_own_results_and_no_others(self, made: Path) -> None:
        for _ in range(2):
            reconstruct(made)
        (made / "second" / "points.csv").write_text("my,own,table\n1,2,3\n")
        with pytest.raises(InputError, match=r"points\.csv: .* did not write"):
            reconstruct(made)
        assert (made / "second" / "points.csv").read_text().startswith("my,own")


class TestInputFiles:
    @pytest.mark.parametrize("name", ["plate.obj", "grain.png"])
    def test_an_edited_input_is_refused_by_name_with_both_hashes(self, name: str, made: Path) -> None:
        before = scan_folder.sha256(made / "project" / name)[:16]
        with open(made / "project" / name, "ab") as file:
            file.write(b"\n# edited\n")
        after = scan_folder.sha256(made / "project" / name)[:16]
        project = made / "project" / "project.json"
        told = re.escape(name)
        with pytest.raises(
            InputError, match=rf"changed since the scan: .*{told} \(SHA-256 now {after}, then {before}\)"
        ):
            reconstruct(made)
        with pytest.raises(InputError, match=rf"something else: {told} \(SHA-256 now {after}, then {before}\)"):
            scan(project, made / "out", resume=True)
        with pytest.raises(InputError, match=f"changed since the scan: .*{told}"):
            rebuild_report(made / "out", threads=1, quiet=True, as_json=False)

    def test_a_mesh_edited_while_the_scan_runs_ends_it_unfinished(self, made: Path) -> None:
        done = []

        def edited(frame: object) -> None:
            write_plate(made / "project", rise=0.03 + 0.01 * len(done))
            done.append(frame)

        with pytest.raises(InputError, match=r"plate\.obj"):
            scan(made / "project" / "project.json", made / "out", Listener(measured=edited))
        assert not (made / "out" / "scan.json").exists()

    def test_a_manifest_that_points_elsewhere_is_not_followed(self, made: Path, tmp_path: Path) -> None:
        elsewhere = tmp_path / "elsewhere"
        shutil.copytree(made / "project", elsewhere)
        edit(made / "out" / "scan.json", lambda data: data.update(project_folder=str(elsewhere)))
        reconstruct(made)  # the same files are as good there
        write_plate(elsewhere, rise=0.03)
        with pytest.raises(InputError, match="have changed since the scan"):
            reconstruct(made)

    def test_a_pipe_in_place_of_a_mesh_is_not_waited_for(self, made: Path) -> None:
        (made / "project" / "plate.obj").unlink()
        os.mkfifo(made / "project" / "plate.obj")
        with pytest.raises(InputError, match=r"plate\.obj \(SHA-256 now of no file, then"):
            reconstruct(made)

    def test_a_moved_scan_is_measured_with_its_project_given(self, made: Path, tmp_path: Path) -> None:
        shutil.move(made / "project", tmp_path / "moved")
        with pytest.raises(InputError, match="say with --project"):
            reconstruct(made)
        reconstruct(made, root=tmp_path / "moved")
        assert (made / "second" / "points.ply").read_bytes() == (made / "out" / "points.ply").read_bytes()


def test_the_scale_is_named_where_the_whole_project_is_given(made: Path) -> None:
    with pytest.raises(InputError, match=rf"camera\.width.*--scale {SCALE}"):
        reconstruct(made, Project.load(made / "project" / "project.json"))


@pytest.mark.parametrize("place", ["second", "second/scan"])
def test_input_files_that_are_beside_the_scan_by_now_are_those_of_it(made: Path, place: str) -> None:
    """A project that was saved after its scan, and carried its meshes along."""
    scanned = made / "second" / "scan"
    shutil.copytree(made / "out", scanned)
    there = scan_folder.open_folder(made / "out")
    for name in there.inputs:
        (made / place / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(there.root / name, made / place / name)
    assert there.inputs, "the project has a mesh"
    assert scan_folder.open_folder(scanned).root == (made / place).resolve()
    for name in there.inputs:
        (made / place / name).write_bytes(b"another")
    assert scan_folder.open_folder(scanned).root != (made / place).resolve(), "only with the hashes that they had"
