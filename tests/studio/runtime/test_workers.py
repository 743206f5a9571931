"""A cluster that is not there is told before anything is written for its work."""

import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

import main

COMMANDS = [["study", "run", "quick"], ["dataset", "plane", "--count", "1"]]


@pytest.mark.parametrize("command", COMMANDS, ids=["study", "dataset"])
def test_without_dask_a_scheduler_is_refused_and_no_folder_is_made(command, tmp_path: Path, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    out = tmp_path / "out"
    done = CliRunner().invoke(main.cli, [*command, "--scheduler", "tcp://127.0.0.1:1", "--out", str(out)])
    assert done.exit_code == 2, done.output
    assert "dask.distributed is not installed" in done.output and "cluster" in done.output
    assert not out.exists()
