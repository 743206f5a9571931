"""Fifty kills at random moments of a study: nothing is lost, nothing is done twice, the table stays the same."""

from __future__ import annotations

import json
import random
import subprocess
import time
from pathlib import Path

import pytest

from studio.study.store import FILE, Store
from tests.studio.study.test_run import DATA, command, run, study
from tests.validation.killed import killed

pytestmark = pytest.mark.validation

KILLS = 50
SEED = 11


def test_a_study_killed_fifty_times_gives_the_table_of_one_that_was_not(tmp_path: Path) -> None:
    whole = run(tmp_path / "whole")
    file, chance = tmp_path / "study.json", random.Random(SEED)
    file.write_text(json.dumps(DATA))
    chosen = study()
    digest = chosen.digest(chosen.bases(tmp_path))
    kills, folder = 0, 0
    while kills < KILLS:
        out, counts = tmp_path / f"out{folder}", [0]
        run_it = command("run", file, "--out", out, "--workers", "2", "--json")
        while kills < KILLS:
            if not killed(run_it, chance.uniform(0.5, 20.0)):
                break  # it came to its end
            kills += 1
            if (out / FILE).exists():
                with Store(out, digest) as store:
                    counts.append(store.count())
            time.sleep(0.1)
        done = subprocess.run(run_it, capture_output=True, text=True, timeout=900)
        assert done.returncode == 0, done.stderr
        assert (out / "table.csv").read_bytes() == whole
        assert counts == sorted(counts)
        folder += 1
