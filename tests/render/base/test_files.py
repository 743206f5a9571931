"""Files are whole or absent, and paths stay inside the project folder."""

from __future__ import annotations

import errno
import hashlib
import os
from pathlib import Path

import pytest

from render.base.errors import InputError
from render.base.files import atomic_write, check_regular, inside, read_bytes, sha256


def test_a_written_file_appears_whole_with_its_folder(tmp_path: Path) -> None:
    target = tmp_path / "new" / "folder" / "result.json"
    with atomic_write(target) as temporary:
        assert temporary.parent == target.parent and temporary.suffix == ".json"
        temporary.write_text("{}")
        assert not target.exists()
    assert target.read_text() == "{}"
    assert os.listdir(target.parent) == ["result.json"]


def test_a_new_file_has_the_ordinary_permissions(tmp_path: Path) -> None:
    (tmp_path / "plain").touch()
    with atomic_write(tmp_path / "atomic") as temporary:
        temporary.write_text("x")
    assert (tmp_path / "atomic").stat().st_mode == (tmp_path / "plain").stat().st_mode


@pytest.mark.parametrize("failure", [KeyboardInterrupt, RuntimeError, SystemExit])
def test_a_failure_keeps_the_old_file_and_leaves_nothing_else(tmp_path: Path, failure: type[BaseException]) -> None:
    target = tmp_path / "points.ply"
    target.write_text("old")
    with pytest.raises(failure), atomic_write(target) as temporary:
        temporary.write_text("half")
        raise failure
    assert target.read_text() == "old"
    assert os.listdir(tmp_path) == ["points.ply"]


def test_a_full_disk_is_told_and_keeps_the_old_file(tmp_path: Path) -> None:
    target = tmp_path / "points.ply"
    target.write_text("old")
    with pytest.raises(InputError, match=r"points\.ply.*No space left"), atomic_write(target) as temporary:
        temporary.write_text("half")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    assert target.read_text() == "old"
    assert os.listdir(tmp_path) == ["points.ply"]


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full here")
def test_a_real_device_without_space_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="No space left"), atomic_write(tmp_path / "a") as temporary:
        temporary.unlink()
        temporary.symlink_to("/dev/full")
        temporary.write_text("x")
    assert os.listdir(tmp_path) == []


def test_a_folder_that_cannot_be_made_or_written_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    for path in (tmp_path / "file" / "below" / "out.csv", Path("/proc/nowhere/out.csv")):
        with pytest.raises(InputError, match="cannot be written"), atomic_write(path):
            pass
    with pytest.raises(InputError, match="a folder of that name"), atomic_write(tmp_path):
        pass


def test_an_error_about_another_file_is_not_blamed_on_the_output(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError), atomic_write(tmp_path / "out") as temporary:
        temporary.write_bytes((tmp_path / "absent").read_bytes())
    assert os.listdir(tmp_path) == []


def test_writing_through_a_symbolic_link_keeps_the_link(tmp_path: Path) -> None:
    (tmp_path / "real").write_text("old")
    (tmp_path / "link").symlink_to("real")
    with atomic_write(tmp_path / "link") as temporary:
        temporary.write_text("new")
    assert (tmp_path / "link").is_symlink() and (tmp_path / "real").read_text() == "new"


def test_a_path_below_the_root_resolves(tmp_path: Path) -> None:
    assert inside(tmp_path, "meshes/part.ply", "path") == tmp_path.resolve() / "meshes" / "part.ply"
    assert inside(tmp_path, "meshes/../part.ply", "path") == tmp_path.resolve() / "part.ply"


@pytest.mark.parametrize(
    "relative", ["", "/etc/passwd", "../part.ply", "a/../../part.ply", "C:\\part.ply", "\\\\host\\part.ply", "a\0b"]
)
def test_a_path_that_leaves_the_root_is_refused(tmp_path: Path, relative: str) -> None:
    with pytest.raises(InputError, match=r"^objects\[0\]\.shape\.path: "):
        inside(tmp_path, relative, "objects[0].shape.path")


def test_a_symbolic_link_out_of_the_root_is_refused(tmp_path: Path) -> None:
    root = tmp_path / "project"
    root.mkdir()
    (tmp_path / "secret").write_text("x")
    (root / "inner").write_text("x")
    (root / "out").symlink_to(tmp_path / "secret")
    (root / "fine").symlink_to("inner")
    (root / "loop").symlink_to("loop")
    with pytest.raises(InputError, match="leaves the project folder"):
        inside(root, "out", "path")
    assert inside(root, "fine", "path") == root.resolve() / "inner"
    assert inside(root, "loop", "path").is_relative_to(root.resolve())


def test_a_neighbour_whose_name_begins_alike_is_outside(tmp_path: Path) -> None:
    (tmp_path / "project").mkdir()
    with pytest.raises(InputError):
        inside(tmp_path / "project", "../project-2/part.ply", "path")


@pytest.mark.parametrize("linked", [False, True])
def test_a_device_or_a_pipe_is_never_replaced(linked: bool, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    path = tmp_path / "link" if linked else tmp_path / "pipe"
    if linked:
        path.symlink_to("pipe")
    before = sorted(tmp_path.iterdir())
    with pytest.raises(InputError, match="it is a device or a pipe"), atomic_write(path) as temporary:
        temporary.write_text("never")
    assert (tmp_path / "pipe").is_fifo() and sorted(tmp_path.iterdir()) == before


def test_sha256_is_that_of_the_bytes(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"laser" * 100_000)
    assert sha256(tmp_path / "a") == hashlib.sha256(b"laser" * 100_000).hexdigest()
    with pytest.raises(InputError, match="there is no such file"):
        sha256(tmp_path / "absent")


def test_a_regular_file_is_read_up_to_its_limit(tmp_path: Path) -> None:
    (tmp_path / "data").write_bytes(b"12345")
    assert read_bytes(tmp_path / "data", 5) == b"12345"
    check_regular(tmp_path / "data", 5)
    with pytest.raises(InputError, match=r"data: the image is too big; found 5 bytes; allowed: 4 bytes"):
        read_bytes(tmp_path / "data", 4, "image")


def test_pipes_devices_folders_and_names_without_a_file_are_refused_before_they_are_opened(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")  # nobody ever writes to it: a plain open would wait for ever
    for path, problem in (
        (tmp_path / "pipe", "not a regular file"),
        (Path("/dev/zero"), "not a regular file"),
        (tmp_path, "the mesh is a folder"),
        (tmp_path / "none", "there is no such mesh"),
        (tmp_path / "a\0b", "cannot be read"),
    ):
        for refuse in (read_bytes, check_regular):
            with pytest.raises(InputError, match=problem):
                refuse(path, 10, "mesh")


def test_a_pipe_has_no_hash(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="pipe: the file is not a regular file"):
        sha256(tmp_path / "pipe")


def test_a_pipe_is_not_replaced_by_a_file_also_where_a_link_leads_to_it(tmp_path: Path) -> None:
    pipe, link = tmp_path / "pipe.json", tmp_path / "link.json"
    os.mkfifo(pipe)
    link.symlink_to(pipe)
    for path in (pipe, link):
        with (
            pytest.raises(
                InputError, match=rf"{path.name}: the file cannot be written; found it is a device or a pipe"
            ),
            atomic_write(path) as temporary,
        ):
            temporary.write_text("new")
        assert pipe.is_fifo() and sorted(tmp_path.iterdir()) == [link, pipe]
