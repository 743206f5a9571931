"""A study on a Dask cluster of two workers gives the table of one process."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from render.base.errors import InputError
from studio.runtime.cluster import cluster
from studio.runtime.workers import Engine
from tests.studio.study.test_run import DATA, run

pytestmark = pytest.mark.validation


def test_a_cluster_gives_the_same_table_as_one_process(scheduler: str, tmp_path: Path) -> None:
    (tmp_path / "study.json").write_text(json.dumps(DATA))
    assert run(tmp_path / "here") == run(tmp_path / "there", engine=Engine(scheduler=scheduler))


def test_a_scheduler_that_is_not_there_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr("studio.runtime.cluster.PATIENCE", "2s")
    with pytest.raises(InputError, match="no Dask scheduler answers"), cluster("tcp://127.0.0.1:1", print):
        pass
