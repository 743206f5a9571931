"""Point clouds survive their files, and broken files say what is wrong with them."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from analysis.cloud import (
    UNITS,
    SpooledCloud,
    at_first_step,
    at_step,
    cloud,
    merge,
    ply_pieces,
    read_csv,
    read_ply,
    write_csv,
    write_ply,
)
from analysis.triangulate import PointFlag, Points
from render.base.errors import InputError
from render.camera.camera import Camera
from render.scene.motion import LinearStage, Turntable
from render.scene.scene import Rig, Scene


def some_points(count: int, seed: int = 0) -> Points:
    """Random points, every seventh without coordinates."""
    random = np.random.default_rng(seed)
    flag = np.where(np.arange(count) % 7 == 3, PointFlag.BEHIND, PointFlag.OK).astype(np.uint8)
    xyz = np.where((flag == PointFlag.OK)[:, None], random.standard_normal((count, 3)), np.nan)
    return Points(
        "rows", random.uniform(0, 2000, (count, 2)), np.arange(count), np.zeros(count, np.intp), xyz, xyz, xyz,
        random.standard_normal((count, 3)), random.random(count), 1.0 + random.random(count), None, flag,
    )  # fmt: skip


@pytest.mark.parametrize(("write", "read", "name"), [(write_ply, read_ply, "p.ply"), (write_csv, read_csv, "p.csv")])
@pytest.mark.parametrize("count", [0, 1, 300])
def test_a_cloud_comes_back_bit_for_bit(tmp_path, write, read, name, count):
    columns = cloud(some_points(count), None, laser=2, step=5)
    write(tmp_path / name, columns)
    back = read(tmp_path / name)
    assert list(back) == list(columns) == list(UNITS)
    for key, column in columns.items():
        assert back[key].dtype == column.dtype
        assert np.array_equal(back[key], column, equal_nan=column.dtype.kind == "f")


def test_a_cloud_is_read_in_pieces_that_are_no_larger_than_asked_for(tmp_path):
    columns = cloud(some_points(300), None, laser=1, step=0)
    write_ply(tmp_path / "p.ply", columns)
    pieces = list(ply_pieces(tmp_path / "p.ply", rows=100))
    assert [len(piece["x"]) for piece in pieces] == [100, 100, 57]
    assert np.array_equal(merge(pieces)["sigma_random"], columns["sigma_random"])


def test_only_points_with_coordinates_are_kept():
    points = some_points(70)
    columns = cloud(points, None, 0, 0)
    assert len(columns["x"]) == 60
    assert np.isfinite(columns["x"]).all()
    assert np.array_equal(columns["row"], points.index[points.valid])


def test_what_the_truth_predicts_of_the_sheet_is_systematic_and_of_photographs_nothing_is():
    points = some_points(70)
    bias = np.where(np.arange(70) % 2 == 0, np.nan, 0.3)
    nothing = np.full(70, np.nan)
    errors = SimpleNamespace(sheet_bias=bias, depth=nothing, off_surface=nothing)
    errors.sigma_off_surface = errors.systematic_off_surface = nothing
    told, alone = cloud(points, errors, 0, 0), cloud(points, None, 0, 0)
    moved = 0.3 * np.abs(points.gradient[points.valid])
    unknown = np.isnan(bias[points.valid])
    np.testing.assert_allclose(told["sigma_depth_systematic"], np.where(unknown, 0.0, moved[:, 2]))
    np.testing.assert_allclose(told["sigma_systematic"], np.where(unknown, 0.0, np.linalg.norm(moved, axis=1)))
    assert not alone["sigma_systematic"].any() and not alone["sigma_depth_systematic"].any()


def test_other_programs_read_the_ply(tmp_path):
    import open3d as o3d
    import trimesh

    columns = cloud(some_points(300), None, 0, 0)
    write_ply(tmp_path / "p.ply", columns)
    xyz = np.stack([columns[key] for key in "xyz"], axis=1)
    assert np.array_equal(trimesh.load(tmp_path / "p.ply").vertices, xyz)
    assert np.array_equal(np.asarray(o3d.io.read_point_cloud(str(tmp_path / "p.ply")).points), xyz)


def test_what_is_not_known_is_an_empty_cell(tmp_path):
    """Spreadsheets and databases read one as missing, "nan" as text."""
    write_csv(tmp_path / "p.csv", cloud(some_points(3), None, 0, 0))
    text = (tmp_path / "p.csv").read_text()
    assert ",," in text and "nan" not in text
    assert np.isnan(read_csv(tmp_path / "p.csv")["error_depth"]).all()


def test_the_table_names_its_units(tmp_path):
    write_csv(tmp_path / "p.csv", cloud(some_points(3), None, 0, 0))
    assert (tmp_path / "p.csv").read_text().splitlines()[0] == (
        "x_m,y_m,z_m,sigma_random_m,sigma_systematic_m,sigma_depth_random_m,sigma_depth_systematic_m,"
        "sigma_surface_random_m,sigma_surface_systematic_m,"
        "correlation_length_rows,error_depth_m,error_surface_m,sheet_bias_px,u_px,v_px,row,laser,step"
    )


def test_clouds_merge_in_order():
    parts = [cloud(some_points(10, seed), None, 0, seed) for seed in (1, 2)]
    merged = merge(parts)
    assert merged["step"].tolist() == [1] * 9 + [2] * 9
    assert np.array_equal(merged["x"], np.concatenate([part["x"] for part in parts]))
    assert list(merge([])) == list(UNITS)


def test_points_on_moving_objects_go_back_to_the_first_step():
    camera = Camera(width=10, height=10, fx=10, fy=10, cx=4.5, cy=4.5)
    on_part = np.array([[0.1, 0.0, 0.2], [0.3, -0.4, 0.5]])
    quarter = Turntable(centre=(0.1, 0.0, 0.0), angle_step=math.pi / 2, steps=4)
    scene = Scene(rig=Rig(camera=camera), motion=quarter)
    turned = np.array([[0.1, 0.0, 0.2], [0.5, 0.2, 0.5]])
    assert np.allclose(at_first_step(turned, scene, 1), on_part, atol=1e-15)
    assert np.allclose(at_step(on_part, scene, 1), turned, atol=1e-15), "and from there to any other"
    still = Scene(rig=Rig(camera=camera), motion=LinearStage(moves="rig"))
    assert np.array_equal(at_first_step(on_part, still, 3), on_part)
    assert np.array_equal(at_step(on_part, still, 3), on_part)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "not a PLY"),
        (b"solid stl", "not a PLY"),
        (b"ply\nformat ascii 1.0\nelement vertex 0\nproperty double x\nend_header\n", "format"),
        (b"ply\nformat binary_little_endian 1.0\nelement vertex 5\nproperty double x\nend_header\n123", "cut short"),
        (b"ply\nformat binary_little_endian 1.0\nelement vertex -5\nproperty double x\nend_header\n", "element"),
        (b"ply\nformat binary_little_endian 1.0\nelement face 5\nproperty double x\nend_header\n", "element"),
        (
            b"ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty list uchar int x\nend_header\n",
            "property",
        ),
    ],
)
def test_a_broken_ply_is_refused_in_words(tmp_path, content, message):
    (tmp_path / "p.ply").write_bytes(content)
    with pytest.raises(InputError, match=message):
        read_ply(tmp_path / "p.ply")


@pytest.mark.parametrize("content", ["x_m,row\n1.0\n", "x_m,row\n1.0,two\n", "x_m,row\n1.0,99999999999999\n"])
def test_a_broken_table_is_refused_in_words(tmp_path, content):
    (tmp_path / "p.csv").write_text(content)
    with pytest.raises(InputError, match="row"):
        read_csv(tmp_path / "p.csv")
    with pytest.raises(InputError, match="there is no such table"):
        read_csv(tmp_path / "absent.csv")


def test_a_failed_write_leaves_the_old_file(tmp_path):
    (tmp_path / "p.ply").write_bytes(b"old")
    bad = cloud(some_points(3), None, 0, 0) | {"naïve": np.zeros(3)}
    with pytest.raises(ValueError):
        write_ply(tmp_path / "p.ply", bad)
    assert (tmp_path / "p.ply").read_bytes() == b"old"
    assert [path.name for path in tmp_path.iterdir()] == ["p.ply"]


def test_a_cloud_on_disk_is_written_as_the_same_cloud_in_memory(tmp_path, monkeypatch):
    monkeypatch.setattr("analysis.cloud.PART", 7)
    monkeypatch.setattr("analysis.spool.IN_MEMORY", 1)
    parts = [cloud(some_points(count), None, 0, step) for step, count in enumerate((5, 0, 11, 12))]
    spooled = SpooledCloud(tmp_path)
    for part in parts:
        spooled.add(part)
    for write, name in ((write_ply, "p.ply"), (write_csv, "p.csv")):
        write(tmp_path / name, spooled)
        write(tmp_path / f"whole_{name}", merge(parts))
        assert (tmp_path / name).read_bytes() == (tmp_path / f"whole_{name}").read_bytes()
    spooled.close()


def test_a_cloud_without_points_on_disk_has_its_columns(tmp_path):
    write_ply(tmp_path / "p.ply", SpooledCloud(tmp_path))
    assert {name: len(column) for name, column in read_ply(tmp_path / "p.ply").items()} == dict.fromkeys(UNITS, 0)


def test_distances_of_older_files_turn_their_sign(tmp_path: Path) -> None:
    """They were positive towards the camera; what is read is positive away from it, as the depth error is."""
    now = np.array([1e-5, -2e-5, np.nan])
    old = {"x": now, "error_distance": -now}
    write_ply(tmp_path / "old.ply", old)
    (tmp_path / "old.csv").write_text("x_m,error_distance_m\n" + "".join(f"0,{-v!r}\n" for v in now[:2].tolist()))
    for found, count in ((read_ply(tmp_path / "old.ply"), 3), (read_csv(tmp_path / "old.csv"), 2)):
        assert "error_distance" not in found
        np.testing.assert_array_equal(found["error_surface"], now[:count])
