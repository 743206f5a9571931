"""Points in the formats of others are read back by others' readers: Open3D, laspy, libE57, numpy."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from analysis.cloud import INTEGERS, UNITS, Cloud, merge
from analysis.cloud_formats import WRITERS, write_points
from render.base.errors import InputError


@pytest.fixture
def points() -> Cloud:
    rng = np.random.default_rng(1)
    made: Cloud = {
        name: rng.integers(0, 1000, 200).astype(np.int32) if name in INTEGERS else rng.normal(size=200)
        for name in UNITS
    }
    for name in "xyz":
        made[name] = 0.1 * made[name]
    return made


def places(points: Cloud) -> np.ndarray:
    return np.column_stack([points[name] for name in "xyz"])


def test_pcd_is_read_by_open3d_with_all_its_columns(points: Cloud, tmp_path: Path) -> None:
    import open3d as o3d

    write_points(tmp_path / "p.pcd", points)
    read = o3d.t.io.read_point_cloud(str(tmp_path / "p.pcd"))
    assert np.array_equal(read.point["positions"].numpy(), places(points))
    for name in ("sigma_random", "row", "step"):
        assert np.array_equal(read.point[name].numpy().ravel(), points[name])


def test_xyz_has_every_digit(points: Cloud, tmp_path: Path) -> None:
    write_points(tmp_path / "p.xyz", points)
    assert np.array_equal(np.loadtxt(tmp_path / "p.xyz"), places(points))


@pytest.mark.parametrize("size", [1.0, 1000.0])
def test_las_holds_places_to_its_step_and_the_rest_whole(points: Cloud, tmp_path: Path, size: float) -> None:
    import laspy

    for name in "xyz":
        points[name] = size * points[name]
    write_points(tmp_path / "p.las", points)
    read = laspy.read(tmp_path / "p.las")
    step = max(1e-9, float(np.ptp(places(points), axis=0).max()) / (2**31 - 1))
    assert np.abs(np.asarray(read.xyz) - places(points)).max() <= 0.51 * step
    assert np.array_equal(read["error_depth"], points["error_depth"]) and np.array_equal(read["row"], points["row"])


def test_e57_is_read_by_its_own_library(points: Cloud, tmp_path: Path) -> None:
    import pye57

    write_points(tmp_path / "p.e57", points)
    read = pye57.E57(str(tmp_path / "p.e57")).read_scan(0, intensity=True, ignore_missing_fields=True)
    found = np.column_stack([read[f"cartesian{axis}"] for axis in "XYZ"])
    half = 0.5 * np.ptp(places(points), axis=0).max()
    # single precision about the middle of the points
    assert np.abs(found - places(points)).max() <= half * np.finfo(np.float32).eps
    assert np.allclose(read["intensity"], points["error_depth"], rtol=np.finfo(np.float32).eps, atol=0.0)


@pytest.mark.parametrize("suffix", WRITERS)
def test_nothing_is_refused(suffix: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no points to write"):
        write_points(tmp_path / f"p{suffix}", merge([]))
    assert list(tmp_path.iterdir()) == []


def test_another_suffix_is_refused_with_those_there_are(points: Cloud, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.pcd, \.xyz, \.las, \.e57"):
        write_points(tmp_path / "p.dat", points)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("module", "suffix"), [("laspy", ".las"), ("pye57", ".e57")])
def test_a_missing_library_is_named_with_its_extra(
    points: Cloud, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, module: str, suffix: str
) -> None:
    found = __import__("importlib.util", fromlist=["find_spec"])
    real = found.find_spec
    monkeypatch.setattr(found, "find_spec", lambda name: None if name == module else real(name))
    with pytest.raises(InputError, match=r"blazer-studio\[points\]"):
        write_points(tmp_path / f"p{suffix}", points)
