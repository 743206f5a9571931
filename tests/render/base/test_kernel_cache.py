"""Compiled kernels are never older than the source that they were made of."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from render.base.kernel_cache import KEPT, ROOT, UNUSED, keep_kernels, source_key

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
        "render/__init__.py": "from render.base.kernel_cache import keep_kernels\n\nkeep_kernels()\n",
        "render/base/kernel_cache.py": (ROOT / "render/base/kernel_cache.py").read_text(encoding="utf-8"),
        "render/base/kernel_dispatcher.py": (ROOT / "render/base/kernel_dispatcher.py").read_text(encoding="utf-8"),
        "render/base/sealed_cache.py": (ROOT / "render/base/sealed_cache.py").read_text(encoding="utf-8"),
        "render/inner.py": INNER,
        "render/outer.py": OUTER,
        "render/numbers.py": "TEN = 10\n",
        "render/words.py": "GREETING = 'hello'\n",
        "analysis/__init__.py": "",
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


def run(program: Path, code: str) -> str:
    done = subprocess.run([sys.executable, "-c", code], cwd=program, capture_output=True, text=True, check=True)
    return done.stdout.strip()


def folders(program: Path) -> list[Path]:
    return list((program / ".cache" / "kernels").iterdir())


def test_every_file_with_a_kernel_counts_however_it_names_numba(tmp_path: Path) -> None:
    (tmp_path / "render").mkdir()
    keys = set()
    for kernel in (
        "@njit\n",
        "@njit(cache=True)\n",
        "@numba.njit\n",
        "    @numba.njit(nogil=True)\n",
        "# njit, in words only\n",
    ):
        for body in ("1", "2"):
            (tmp_path / "render/one.py").write_text(f"{kernel}def one():\n    return {body}\n")
            keys.add(source_key(tmp_path))
    assert len(keys) == 2 * 4 + 1, "a changed kernel is another key, and words are none"


def test_a_change_in_an_inlined_kernel_or_a_constant_reaches_the_kernels_that_use_it(program: Path) -> None:
    call = "from render.outer import outer; print(outer())"
    assert run(program, call) == "10"
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


CALL = (
    "from render.inner import inner; inner(); "
    "from render.outer import outer; print(outer(), sum(outer.stats.cache_hits.values()))"
)
"""What the outer kernel returns, and 1 where its machine code came from the cache."""


def kept_files(program: Path) -> list[Path]:
    return sorted((program / ".cache" / "kernels" / source_key(program)).rglob("*.nb?"))


DAMAGE: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda data: b"",
    "cut": lambda data: data[: len(data) // 2],
    "one byte short": lambda data: data[:-1],
    "one bit": lambda data: data[:-200] + bytes([data[-200] ^ 4]) + data[-199:],
    "another program's": lambda data: pickle.dumps(("0.0", [1])),
    "zeros, as a power cut leaves them": lambda data: bytes(len(data)),
}


@pytest.mark.parametrize("how", ["cut", pytest.param("each", marks=pytest.mark.validation)])
@pytest.mark.parametrize("suffix", [".nbi", ".nbc"])
def test_a_damaged_file_costs_compiling_anew_and_is_mended(program: Path, suffix: str, how: str) -> None:
    assert run(program, CALL) == "10 0"
    damaged = [path for path in kept_files(program) if path.suffix == suffix]
    assert len(damaged) == 2
    for name in DAMAGE if how == "each" else (how,):
        for path in damaged:
            path.write_bytes(DAMAGE[name](path.read_bytes()))
        assert run(program, CALL) == "10 0", name
    assert run(program, CALL) == "10 1"


def test_the_machine_code_of_another_kernel_is_not_taken_for_ones_own(program: Path) -> None:
    assert run(program, CALL) == "10 0"
    inner, outer = (path for path in kept_files(program) if path.suffix == ".nbc")
    outer.write_bytes(inner.read_bytes())
    assert run(program, CALL) == "10 0"


@pytest.mark.validation
def test_what_two_processes_saved_at_once_under_one_name_is_not_mixed_up(program: Path) -> None:
    """Both found the index empty: its last writer says that file 1 is the integers', but the floats' is in it."""
    (program / "render/twice.py").write_text(
        "from numba import njit\n\n\n@njit(cache=True)\ndef twice(x):\n    return 2 * x\n"
    )
    ask = "from render.twice import twice; print(twice({}), sum(twice.stats.cache_hits.values()))"
    assert run(program, ask.format("0.25")) == "0.5 0"
    (data,) = (path for path in kept_files(program) if path.suffix == ".nbc")
    floats = data.read_bytes()
    for path in kept_files(program):
        path.unlink()
    assert run(program, ask.format("3")) == "6 0"
    data.write_bytes(floats)
    assert run(program, ask.format("3")) == "6 0"
    assert run(program, ask.format("3")) == "6 1"


FULL = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0)); "
"""Every write to a file fails from now on, as on a full disk."""


@pytest.mark.skipif(sys.platform != "linux", reason="limits of POSIX")
def test_on_a_full_disk_kernels_are_compiled_and_the_reason_why_they_are_not_kept_is_told(program: Path) -> None:
    done = subprocess.run([sys.executable, "-c", FULL + CALL], cwd=program, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, "10 0\n")
    assert done.stderr.count("cannot be kept") == 1 and "File too large" in done.stderr
    assert kept_files(program) == []


@pytest.mark.parametrize("place", ["no folder", "given"])
def test_without_a_folder_that_can_be_written_kernels_are_compiled(
    program: Path, place: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    (program / ".cache").write_text("not a folder")
    if place == "given":
        monkeypatch.setenv("NUMBA_CACHE_DIR", str(program / ".cache" / "mine"))
    assert run(program, CALL) == "10 0"


@pytest.mark.skipif(sys.platform != "linux", reason="limits of POSIX")
def test_a_cache_that_can_only_be_read_is_read(program: Path) -> None:
    assert run(program, CALL) == "10 0"
    assert run(program, FULL + CALL) == "10 1"


@pytest.mark.validation
def test_many_processes_fill_one_cache(program: Path) -> None:
    command = [sys.executable, "-c", CALL]
    started = [subprocess.Popen(command, cwd=program, stdout=subprocess.PIPE, text=True) for _ in range(4)]
    assert {process.communicate()[0].split()[0] for process in started} == {"10"}
    assert run(program, CALL) == "10 1"
    assert not list((program / ".cache").rglob("*.tmp.*"))


def test_what_a_kill_left_half_written_goes(program: Path) -> None:
    run(program, CALL)
    old, fresh = (kept_files(program)[0].with_suffix(f".nbc.tmp.{name}") for name in ("0", "1"))
    for path in (old, fresh):
        path.write_bytes(b"half")
    os.utime(old, (time.time() - UNUSED - 60,) * 2)
    assert run(program, CALL) == "10 1"
    assert fresh.exists() and not old.exists()


def test_functions_of_others_are_left_to_numba(program: Path) -> None:
    (program / "mine.py").write_text(INNER.replace("inner", "mine"))
    code = "import render; from mine import mine; mine(); print(type(mine._cache).__module__)"
    assert run(program, code) == "numba.core.caching"
