"""Compiled kernels are never older than the source that they were made of."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from render.kernel_cache import KEPT, ROOT, UNUSED, keep_kernels, source_key

INNER = "from numba import njit\n\n\n@njit(cache=True)\ndef inner():\n    return 1\n"
OUTER = (
    "from numba import njit\nfrom render.inner import inner\nfrom render.numbers import TEN\n\n\n"
    "@njit(cache=True)\ndef outer():\n    return TEN * inner()\n"
)


@pytest.fixture
def program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A checkout with a kernel that takes another in, and a constant, from other files."""
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    files = {
        "pyproject.toml": "",
        "render/__init__.py": "from render.kernel_cache import keep_kernels\n\nkeep_kernels()\n",
        "render/kernel_cache.py": (ROOT / "render" / "kernel_cache.py").read_text(encoding="utf-8"),
        "render/inner.py": INNER,
        "render/outer.py": OUTER,
        "render/numbers.py": "TEN = 10\n",
        "render/words.py": "GREETING = 'hello'\n",
        "analysis/__init__.py": "",
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


def run(program: Path, code: str) -> str:
    done = subprocess.run([sys.executable, "-c", code], cwd=program, capture_output=True, text=True, check=True)
    return done.stdout.strip()


def folders(program: Path) -> list[Path]:
    return list((program / ".cache" / "kernels").iterdir())


def test_a_change_in_an_inlined_kernel_or_a_constant_reaches_the_kernels_that_use_it(program: Path) -> None:
    call = "from render.outer import outer; print(outer())"
    assert run(program, call) == "10"
    assert len([*(program / ".cache").rglob("*.nbc")]) == 2
    (program / "render/inner.py").write_text(INNER.replace("return 1", "return 2"))
    assert run(program, call) == "20"
    (program / "render/numbers.py").write_text("TEN = 11\n")
    assert run(program, call) == "22"
    assert len(folders(program)) == 3


def test_numba_that_is_there_already_is_told(program: Path) -> None:
    run(program, "import numba; from render.outer import outer; outer()")
    assert len([*(program / ".cache" / "kernels" / source_key(program)).rglob("*.nbc")]) == 2


def test_files_without_kernels_change_nothing(program: Path) -> None:
    before = source_key(program)
    (program / "render/words.py").write_text("GREETING = 'good day'\n")
    assert source_key(program) == before
    (program / "render/outer.py").rename(program / "analysis/outer.py")
    assert source_key(program) != before


def test_a_folder_that_the_user_names_is_left_to_numba(program: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(program / "mine"))
    assert keep_kernels(program) is None
    assert os.environ["NUMBA_CACHE_DIR"] == str(program / "mine")
    assert not (program / ".cache").exists()


def test_a_folder_inherited_from_an_older_source_is_not_used(program: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(program / ".cache" / "kernels" / "0123456789abcdef"))
    assert run(program, "import os, render; print(os.environ['NUMBA_CACHE_DIR'])").endswith(source_key(program))


def test_an_installed_program_uses_the_users_cache(program: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (program / "pyproject.toml").unlink()
    monkeypatch.setenv("XDG_CACHE_HOME", str(program / "home"))
    run(program, "import render")
    assert not (program / ".cache").exists()
    assert [path.name for path in program.glob("home/**/kernels/*")] == [source_key(program)] or sys.platform != "linux"


def test_folders_long_out_of_use_go_and_the_newest_stay(program: Path) -> None:
    now = time.time()
    for days in range(1, 6):
        folder = program / ".cache" / "kernels" / f"{days:016x}"
        folder.mkdir(parents=True)
        os.utime(folder, (now, now - days * (UNUSED + 60)))
    in_use = program / ".cache" / "kernels" / f"{9:016x}"
    in_use.mkdir()
    run(program, "import render")
    assert {path.name for path in folders(program)} == {source_key(program), in_use.name}
    assert KEPT == 2


def test_the_key_takes_a_few_milliseconds() -> None:
    def seconds() -> float:
        start = time.perf_counter()
        source_key()
        return time.perf_counter() - start

    assert min(seconds() for _ in range(20)) < 0.01
