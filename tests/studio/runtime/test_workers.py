"""A cluster that is not there is told before anything is written for its work; workers end with their driver."""

import os
import signal
import subprocess
import sys
import time
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


DRIVER = """
import os, time
from render.run import never
from studio.runtime.workers import Engine, team
from tests.studio.runtime.test_workers import nothing, sleep_and_tell

if __name__ == "__main__":
    with team(Engine(workers=2), sleep_and_tell, nothing, never) as workers:
        for _ in range(2):
            workers.submit(0)
        time.sleep(600)
"""


def nothing() -> None:
    """What a worker does first."""


def sleep_and_tell(task: object, cancelled: object) -> None:
    """A task that takes long."""
    print(os.getpid(), flush=True)
    time.sleep(600)


def test_workers_of_a_killed_driver_end_as_well(tmp_path: Path) -> None:
    """They lived on with half a gigabyte each."""
    script = tmp_path / "driver.py"
    script.write_text(DRIVER)
    here = {**os.environ, "PYTHONPATH": str(Path(main.__file__).parent)}
    with subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True, env=here) as driver:
        assert driver.stdout is not None
        workers = [int(driver.stdout.readline()) for _ in range(2)]
        driver.send_signal(signal.SIGKILL)
        driver.wait()
        deadline = time.monotonic() + 60.0
        while any(_lives(worker) for worker in workers) and time.monotonic() < deadline:
            time.sleep(0.1)
        assert not [worker for worker in workers if _lives(worker)]


def _lives(process: int) -> bool:
    try:
        state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"
