"""A project file is either a whole valid project or one message that says what to change."""

from __future__ import annotations

import copy
import errno
import json
import os
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from render.base.errors import InputError
from render.scene.shape import MeshFile
from studio.project import migrations, strict_json
from studio.project.project import Project, project_file
from studio.project.templates import DESCRIPTIONS, new_project, template_folder

SAMPLE_FILE = template_folder("weld_seam") / "project.json"
SAMPLE = json.loads(SAMPLE_FILE.read_text(encoding="utf-8"))
OLD_FILES = sorted((Path(__file__).parent / "projects").glob("v*.json"))


def changed(path: list[str | int], value: Any, *, rename: str | None = None) -> dict[str, Any]:
    """The sample with one value replaced, or one key renamed."""
    data = copy.deepcopy(SAMPLE)
    place: Any = data
    for part in path[:-1]:
        place = place[part]
    if rename is not None:
        place[rename] = place.pop(path[-1])
    else:
        place[path[-1]] = value
    return data


def refusal(data: Any) -> str:
    with pytest.raises(InputError) as caught:
        Project.from_data(data, "weld.json")
    return str(caught.value)


def paths_of(value: Any, prefix: tuple[str | int, ...] = ()) -> list[tuple[str | int, ...]]:
    """Every place in a JSON value."""
    found = [prefix] if prefix else []
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, child in items:
        found += paths_of(child, (*prefix, key))
    return found


ALL_PATHS = paths_of(SAMPLE)


class TestRoundTrip:
    def test_what_is_saved_is_what_is_loaded(self, tmp_path: Path) -> None:
        project = Project.load(SAMPLE_FILE)
        project.save(tmp_path / "a.json")
        assert Project.load(tmp_path / "a.json") == project

    def test_saving_is_canonical(self, tmp_path: Path) -> None:
        project = Project.load(SAMPLE_FILE)
        project.save(tmp_path / "a.json")
        Project.load(tmp_path / "a.json").save(tmp_path / "b.json")
        assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()

    def test_every_number_survives_to_the_last_bit(self, tmp_path: Path) -> None:
        data = changed(["scene", "rig", "lasers", 0, "power"], np.nextafter(0.02, 1))
        project = Project.from_data(data)
        assert Project.from_text(project.to_text()).scene.lasers[0].power == np.nextafter(0.02, 1)

    def test_a_saved_mesh_carries_its_digest_and_a_missing_one_keeps_the_old(self, tmp_path: Path) -> None:
        shape = {"kind": "file", "path": "part.stl", "sha256": "0" * 64}
        project = Project.from_data(changed(["scene", "objects", 0, "shape"], shape))
        missing = project.save(tmp_path / "a.json").scene.objects[0].shape
        assert isinstance(missing, MeshFile) and missing.sha256 == "0" * 64
        (tmp_path / "part.stl").write_bytes(b"abc")
        there = project.save(tmp_path / "a.json").scene.objects[0].shape
        # SHA-256 of "abc": FIPS 180-2, appendix B.1
        digest = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
        assert isinstance(there, MeshFile) and there.sha256 == digest

    @pytest.mark.parametrize("file", OLD_FILES, ids=lambda file: file.stem)
    def test_every_version_ever_released_still_loads(self, file: Path) -> None:
        assert Project.load(file).schema_version == migrations.CURRENT

    def test_there_is_a_file_of_every_version(self) -> None:
        assert [file.stem for file in OLD_FILES] == [f"v{n}" for n in range(1, migrations.CURRENT + 1)]

    @pytest.mark.parametrize("template", DESCRIPTIONS)
    def test_every_template_is_a_valid_project_at_the_current_version(self, template: str, tmp_path: Path) -> None:
        made = new_project(template, tmp_path / "new")
        assert Project.load(made.project).to_text() == made.project.read_text(encoding="utf-8")


class TestTemplates:
    def test_the_weld_seam_is_the_papers_rig(self) -> None:
        """Plane of the founding paper, section 4.3: normal (cos 13 deg, 0, sin 13 deg), through (0.2, 0, 0) m."""
        plane = Project.load(SAMPLE_FILE).scene.laser_plane(0)
        normal = np.array([np.cos(np.radians(13)), 0.0, np.sin(np.radians(13))])
        np.testing.assert_allclose(plane, [*normal, -0.2 * normal[0]], atol=1e-6)

    def test_a_template_never_overwrites_unasked(self, tmp_path: Path) -> None:
        made = new_project("plane", tmp_path)
        made.project.write_text("mine")
        with pytest.raises(InputError, match="there already"):
            new_project("plane", tmp_path)
        assert made.project.read_text() == "mine"
        new_project("plane", tmp_path, force=True)
        assert Project.load(made.project).name

    @pytest.mark.parametrize("there", [False, True])
    def test_a_full_disk_leaves_no_half_of_a_project(
        self, there: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        target = tmp_path / "made"
        if there:
            target.mkdir()
        copied, copy = [], shutil.copyfile

        def full(source: Path, destination: Path) -> None:
            if copied:
                raise OSError(errno.ENOSPC, "No space left on device", str(destination))
            copied.append(copy(source, destination))

        monkeypatch.setattr(shutil, "copyfile", full)
        with pytest.raises(InputError, match="made: the project cannot be written; found No space"):
            new_project("weld_seam", target)
        assert copied and [*tmp_path.rglob("*")] == ([target] if there else [])

    def test_a_folder_with_one_project_stands_for_it(self, tmp_path: Path) -> None:
        made = new_project("plane", tmp_path)
        (tmp_path / ".other.0123abcd.json").write_text("left by a program that was killed")
        made.project.rename(tmp_path / "part.json")
        assert project_file(tmp_path) == tmp_path / "part.json"
        with pytest.raises(InputError, match="does not hold one project"):
            project_file(tmp_path.parent)


class TestMessages:
    """Each wrong file: the message names the field, what was found and what is allowed."""

    @pytest.mark.parametrize(
        ("path", "value", "parts"),
        [
            (["scene", "rig", "camera", "width"], "2448", ["weld.json: scene.rig.camera.width", '"2448"', "integer"]),
            (["scene", "rig", "camera", "width"], 0, ["scene.rig.camera.width", "found 0", "greater than 0"]),
            (["scene", "rig", "camera", "width"], True, ["scene.rig.camera.width", "true", "integer"]),
            (["scene", "rig", "lasers", 0, "power"], -1, ["scene.rig.lasers[0].power", "-1", "or equal to 0"]),
            (["scene", "rig", "camera", "distortion"], [1, 2, 3], ["distortion", "3 coefficients", "0, 4, 5, 8, 12"]),
            (["scene", "objects", 0, "material", "albedo"], 2, ["objects[0].material.albedo", "found 2", "equal to 1"]),
            (["scene", "objects", 0, "material", "albedo"], {"path": 3}, ["albedo.path", "found 3", "string"]),
            (["scene", "objects", 0, "shape", "kind"], "weld-tee", ["shape.kind", "weld-tee", "mean weld_tee?"]),
            (["scene", "objects", 0, "shape"], {}, ["objects[0].shape", "kind is missing", "v_groove"]),
            (["scene", "objects", 0, "shape", "leg"], 9.0, ["objects[0].shape.leg", "found 9.0"]),
            (["scene", "motion"], {"kind": "linear", "moves": "rigs"}, ["motion.moves", '"rigs"', "'rig'"]),
            (["sensor", "bits"], 9, ["sensor.bits", "found 9", "8, 10, 12 or 16"]),
            (["seed"], 10**400, ["seed", "less than or equal to"]),
            (["sensor", "exposure_time"], 1e-300, ["sensor.exposure_time", "found 1e-300", "or equal to 1e-09 s"]),
            (["scene", "rig", "T_world_rig", "rotation", 0], 1e160, ["rotation[0]", "1e+160", "or equal to 1000 rad"]),
            (["scene", "rig", "T_world_rig", "translation", 2], 1e20, ["translation[2]", "or equal to 100000 m"]),
            (["name"], "", ["name", 'found ""']),
            (["scene"], None, ["scene", "found null", "object"]),
        ],
    )
    def test_a_wrong_value_is_named_with_what_is_allowed(self, path: Any, value: Any, parts: list[str]) -> None:
        message = refusal(changed(path, value))
        assert all(part in message for part in parts), message
        assert "\n" not in message

    def test_an_unknown_key_suggests_the_nearest(self) -> None:
        message = refusal(changed(["scene", "rig", "camera", "width"], None, rename="widht"))
        assert "scene.rig.camera.widht: unknown key; did you mean width?" in message
        assert "scene.rig.camera.width: the field is missing" in message

    def test_many_problems_are_listed_up_to_five(self) -> None:
        message = refusal(changed(["scene", "objects"], [1] * 9))
        assert message.startswith("weld.json: 9 problems") and "and 4 more" in message
        assert message.count("scene.objects[") == 5

    def test_two_objects_of_one_name_are_refused(self) -> None:
        message = refusal(changed(["scene", "objects"], [SAMPLE["scene"]["objects"][0]] * 2))
        assert "used twice" in message

    def test_a_newer_project_says_so(self) -> None:
        message = refusal(changed(["schema_version"], migrations.CURRENT + 1))
        assert "newer" in message and f"found {migrations.CURRENT + 1}" in message and "update" in message

    @pytest.mark.parametrize("version", ["1", True, 1.0, 0, -1, None])
    def test_what_is_no_version_is_refused(self, version: object) -> None:
        assert "schema_version" in refusal(changed(["schema_version"], version))

    def test_a_missing_version_is_named(self) -> None:
        data = copy.deepcopy(SAMPLE)
        del data["schema_version"]
        assert "schema_version: the field is missing" in refusal(data)


class TestDamagedFiles:
    def write(self, path: Path, data: bytes) -> str:
        path.write_bytes(data)
        with pytest.raises(InputError) as caught:
            Project.load(path)
        assert str(path) in str(caught.value)
        return str(caught.value)

    def test_no_file(self, tmp_path: Path) -> None:
        with pytest.raises(InputError, match="no such project file"):
            Project.load(tmp_path / "a.json")

    def test_a_folder_without_a_project(self, tmp_path: Path) -> None:
        with pytest.raises(InputError, match="the folder does not hold one project; found none"):
            Project.load(tmp_path)

    def test_a_word_that_is_no_path_and_no_template(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.chdir(tmp_path)
        with pytest.raises(InputError, match=r"no such project; found weld_sea.*v_groove.*did you mean weld_seam"):
            Project.load("weld_sea")

    def test_an_empty_file(self, tmp_path: Path) -> None:
        assert "is empty" in self.write(tmp_path / "a.json", b" \n")

    def test_a_truncated_file_names_its_end(self, tmp_path: Path) -> None:
        message = self.write(tmp_path / "a.json", b'{\n  "schema_version": 1,\n  "na')
        assert "line 3, column 3" in message

    def test_not_text(self, tmp_path: Path) -> None:
        message = self.write(tmp_path / "a.json", b'{"a": "\xff"}')
        assert "UTF-8" in message and "byte 7" in message and "0xff" in message

    @pytest.mark.parametrize("number", [b"NaN", b"Infinity", b"-Infinity", b"1e999", b"9" * 5000])
    def test_numbers_that_are_none(self, number: bytes, tmp_path: Path) -> None:
        assert len(self.write(tmp_path / "a.json", b'{"schema_version": 1, "seed": ' + number + b"}")) < 400

    def test_a_key_given_twice(self, tmp_path: Path) -> None:
        assert '"seed" appears twice' in self.write(tmp_path / "a.json", b'{"seed": 1, "seed": 2}')

    @pytest.mark.parametrize("depth", [strict_json.MAX_DEPTH + 1, 5000, 200_000])
    def test_deep_nesting(self, depth: int, tmp_path: Path) -> None:
        text = b'{"a":' + b"[" * depth + b"]" * depth + b"}"
        assert "nested too deeply" in self.write(tmp_path / "a.json", text)

    def test_too_big(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(strict_json, "MAX_BYTES", 1000)
        assert "too big" in self.write(tmp_path / "a.json", b"{" + b" " * 1000 + b"}")

    def test_a_great_many_unknown_keys_are_counted_without_a_search_for_each(self, tmp_path: Path) -> None:
        keys = ", ".join(f'"k{i}": 1' for i in range(50_000))
        message = self.write(tmp_path / "a.json", f'{{"schema_version": 1, {keys}}}'.encode())
        assert "this is hardly a project; found 5" in message and "a.json" in message and len(message) < 300

    def test_a_key_of_any_length_fits_the_message(self, tmp_path: Path) -> None:
        data = SAMPLE | {"x" * 1_000_000: 1, "name": "n" * 1_000_000}
        message = self.write(tmp_path / "a.json", json.dumps(data).encode())
        assert "xxx...: unknown key" in message and len(message) < 600

    def test_a_pipe_is_not_waited_for(self, tmp_path: Path) -> None:
        os.mkfifo(tmp_path / "a.json")
        with pytest.raises(InputError, match=r"a\.json: the project file is not a regular file"):
            Project.load(tmp_path / "a.json")

    def test_not_an_object(self, tmp_path: Path) -> None:
        assert "not a JSON object" in self.write(tmp_path / "a.json", b"[1, 2]")

    def test_a_byte_order_mark_is_harmless(self, tmp_path: Path) -> None:
        path = tmp_path / "a.json"
        path.write_bytes(b"\xef\xbb\xbf" + SAMPLE_FILE.read_bytes())
        assert Project.load(path) == Project.load(SAMPLE_FILE)


def with_every_material() -> dict[str, Any]:
    """The sample with an object of every material, each with all it may have."""
    data, grey = copy.deepcopy(SAMPLE), {"path": "a.png", "scale": 0.5}
    normals, bumps = {"kind": "normal_map", "path": "n.png"}, {"kind": "bump_map", "path": "h.png", "height": 1e-3}
    rgb = [0.9, 0.8, 0.7]
    materials: list[dict[str, Any]] = [
        {"kind": "conductor", "metal": "gold", "roughness": grey, "roughness_across": 0.2, "relief": normals},
        {"kind": "coated", "albedo": rgb, "roughness": grey, "relief": bumps},
        {"kind": "glass", "substance": "SF11", "index": 1.7, "roughness": grey, "tint": rgb, "relief": normals},
        {"kind": "subsurface", "mean_free_path": [1e-3, 2e-3, 3e-3], "scattering_albedo": rgb, "anisotropy": 0.5},
        {"kind": "emitter", "radiance": [1, 2, 3], "albedo": {"source": "mesh"}, "relief": bumps},
        {"kind": "blend", "base": {"kind": "lambertian"}, "over": {"kind": "coated"}, "mask": {"path": "m.png"}},
    ]
    for i, material in enumerate(materials):
        shape = {"kind": "sphere", "radius": 0.01}
        item = {"name": f"ball {i}", "shape": shape, "material": material, "crease_angle": 0.5}
        data["scene"]["objects"].append(item)
    return data


CROWDED = with_every_material()
CROWDED_PATHS = [*ALL_PATHS, *(path for path in paths_of(CROWDED) if path not in ALL_PATHS for _ in range(3))]

ODD_VALUES = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.sampled_from([10**400, -(2**63), 2**64, -1, 0]),
    st.floats(),
    st.sampled_from([1e308, -1e-320, 5e-324]),
    st.text(max_size=20),
    st.sampled_from(["\ud800", "../../etc/passwd", "/etc/passwd", "C:\\a.ply", "a\0b"]),
    st.lists(st.integers() | st.text(max_size=3), max_size=5),
    st.dictionaries(st.text(max_size=8), st.integers(), max_size=3),
)


def valid_or_refused(data: bytes, path: Path) -> None:
    """The property: a whole project that survives saving, or an InputError whose message can be printed."""
    path.write_bytes(data)
    try:
        project = Project.load(path)
    except InputError as error:
        assert str(path.name) in str(error) and len(str(error)) < 4000
    else:
        assert Project.from_text(project.to_text()) == project
    assert path.read_bytes() == data and [file.name for file in path.parent.iterdir()] == [path.name]


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("any") / "a.json"


class TestAnyFile:
    def test_every_material_is_a_valid_start(self) -> None:
        project = Project.from_text(json.dumps(CROWDED))
        assert {item.material.kind for item in project.scene.objects} == {
            *("lambertian", "conductor", "coated", "glass", "subsurface", "emitter", "blend")
        }
        assert Project.from_text(project.to_text()) == project

    @settings(max_examples=300, deadline=None)
    @given(data=st.data())
    def test_mutated_projects_are_valid_or_refused(self, path: Path, data: st.DataObject) -> None:
        project = copy.deepcopy(CROWDED)
        for _ in range(data.draw(st.integers(1, 3))):
            *parents, last = data.draw(st.sampled_from(CROWDED_PATHS))
            place: Any = project
            try:
                for part in parents:
                    place = place[part]
                action = data.draw(st.sampled_from(["replace", "drop", "insert"]))
                if action == "replace":
                    place[last] = data.draw(ODD_VALUES)
                elif action == "drop":
                    del place[last]
                elif isinstance(place, dict):
                    place[data.draw(st.text(max_size=10))] = data.draw(ODD_VALUES)
                elif isinstance(place, list):
                    place.append(data.draw(ODD_VALUES))
            except (KeyError, IndexError, TypeError):
                pass  # an earlier change took the place away
        valid_or_refused(json.dumps(project).encode(), path)

    @settings(max_examples=150, deadline=None)
    @given(cut=st.integers(0, len(SAMPLE_FILE.read_bytes())), junk=st.binary(max_size=20))
    def test_cut_and_spoilt_bytes_are_valid_or_refused(self, path: Path, cut: int, junk: bytes) -> None:
        valid_or_refused(SAMPLE_FILE.read_bytes()[:cut] + junk, path)


class TestWhatLoadTakes:
    def test_a_template_by_its_name_a_folder_and_a_file_are_the_same_project(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.chdir(tmp_path)
        folder = template_folder("plane")
        named = Project.load("plane")
        assert named == Project.load(folder) == Project.load(str(folder / "project.json"))
        assert named.folder == folder

    def test_what_lies_there_comes_before_the_template_of_its_name(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.chdir(tmp_path)
        Project.load("sphere").save(tmp_path / "plane" / "own.json")
        assert Project.load("plane").name == Project.load("sphere").name

    def test_copies_keep_the_folder_of_the_files_and_saving_moves_it(self, tmp_path: Path) -> None:
        project = Project.load("plane")
        assert project.model_copy(update={"seed": 5}).folder == project.folder
        assert project.save(tmp_path / "a.json").folder == tmp_path
        assert Project.from_text(project.to_text()).folder == Path()


def test_saving_removes_what_a_killed_save_left_long_ago(tmp_path: Path) -> None:
    old, new, strange = (tmp_path / f".project.{end}.json" for end in ("0123abcd", "0123abce", "words"))
    for left in (old, new, strange):
        left.write_text("{")
    os.utime(old, (0.0, 0.0))
    Project.load(template_folder("plane") / "project.json").save(tmp_path / "project.json")
    assert not old.exists() and new.exists() and strange.exists()
