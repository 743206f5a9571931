"""Fifty kills at random moments of a dataset: what is left goes on to the bytes of one that was not killed."""

from __future__ import annotations

import random
import subprocess
import sys
from pathlib import Path

import pytest

from tests.studio.dataset.test_images import RECIPE, contents
from tests.validation.killed import killed

pytestmark = pytest.mark.validation

ROOT = Path(__file__).resolve().parents[2]
KILLS, SEED, SCENES = 50, 7, 12


def test_a_dataset_killed_fifty_times_is_the_same_bytes(tmp_path: Path) -> None:
    file, chance = tmp_path / "recipe.json", random.Random(SEED)
    file.write_text(RECIPE.model_dump_json())

    def command(out: Path) -> list[str]:
        words = ["dataset", file, "--count", SCENES, "--out", out, "--workers", 2, "--quiet"]
        return [sys.executable, str(ROOT / "main.py"), *map(str, words)]

    subprocess.run(command(tmp_path / "whole"), check=True, capture_output=True, timeout=900)
    whole = contents(tmp_path / "whole")
    kills, folder = 0, 0
    while kills < KILLS:
        out = tmp_path / f"out{folder}"
        while kills < KILLS:
            if not killed(command(out), chance.uniform(0.5, 15.0)):
                break  # it came to its end
            kills += 1
        done = subprocess.run(command(out), capture_output=True, text=True, timeout=900)
        assert done.returncode == 0, done.stderr
        assert contents(out) == whole
        folder += 1
