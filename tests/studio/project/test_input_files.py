"""Files beside a project, each known by its hash: what differs is named, whatever a damaged record holds."""

from __future__ import annotations

from typing import Any

import pytest

from studio.project.input_files import changed_files


@pytest.mark.parametrize("damaged", [{"path": "x"}, ["x"], 7, None, "y" * 64])
def test_a_record_that_holds_something_else_than_a_hash_is_told_as_a_change(damaged: Any) -> None:
    (told,) = changed_files({"mesh.ply": damaged}, {"mesh.ply": "a" * 64})
    assert told.startswith("mesh.ply (SHA-256 now aaaa") and str(damaged)[:8] in told


def test_files_that_are_the_same_are_not_told() -> None:
    assert changed_files({"a": "1" * 64}, {"a": "1" * 64}) == []
