"""Files that hold no mesh are told by what they lack."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.render.mesh.test_mesh_input import TRIANGLE, message_of_text


@pytest.mark.parametrize(
    "content", [np.random.default_rng(5).bytes(100_000), b"dear diary,\nvery little happened\n"], ids=["noise", "prose"]
)
def test_a_file_of_which_nothing_reads_as_obj_is_no_point_cloud(tmp_path: Path, content: bytes) -> None:
    text = message_of_text(tmp_path, "a.obj", content)
    assert f"cannot be read as OBJ; found no line of a vertex in {len(content)} bytes" in text
    assert "point" not in text


def test_an_stl_of_no_triangles_has_no_points_that_could_be_meshed(tmp_path: Path) -> None:
    text = message_of_text(tmp_path, "a.stl", bytes(84))
    assert "no triangles; found neither vertices nor faces" in text and "point" not in text


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_vertices_without_faces_may_be_a_point_cloud(tmp_path: Path, end: str) -> None:
    assert "no faces (a point cloud?)" in message_of_text(tmp_path, "a.obj", TRIANGLE.replace("\n", end))
