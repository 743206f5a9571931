"""A dataset on a Dask cluster of two workers is the bytes of one that a single process made."""

from __future__ import annotations

from pathlib import Path

import pytest

from studio.dataset.run import Wanted, make_dataset
from studio.runtime.workers import Engine
from tests.studio.dataset.test_images import HERE, RECIPE, SCENES, contents

pytestmark = pytest.mark.validation


def test_a_cluster_makes_the_same_bytes_as_one_process(scheduler: str, tmp_path: Path) -> None:
    for name, engine in (("here", HERE), ("there", Engine(scheduler=scheduler))):
        result = make_dataset(RECIPE, Path(), Wanted(SCENES), tmp_path / name, engine=engine)
        assert result.made == SCENES
    assert contents(tmp_path / "here") == contents(tmp_path / "there")
