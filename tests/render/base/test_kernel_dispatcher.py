"""What only kernels call is compiled for them alone, and is whole as soon as Python calls it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from render.base.kernel_cache import ROOT

BASE = ("kernel_cache", "kernel_dispatcher", "sealed_cache")
KERNELS = """
import numpy as np
from numba import njit, types


@njit(cache=True, error_model="numpy")
def quotient(a, b):
    if b == 0.0:
        raise ZeroDivisionError("nothing to divide by")
    return a / b


@njit(cache=True, error_model="numpy", forceinline=True)
def twice(a, b=2.0):
    return b * a


@njit(error_model="numpy")
def factorial(n):
    return 1 if n < 2 else n * factorial(n - 1)


@njit(cache=True, error_model="numpy")
def outer(values):
    result = np.empty(len(values))
    for i in range(len(values)):
        result[i] = twice(quotient(6.0, values[i]))
    return result


@njit(error_model="numpy")
def ways(n):
    return 0.5 * factorial(n)


@njit(cache=True, error_model="numpy")
def lower(x):
    return x - 1.0


@njit(types.float64(types.FunctionType(types.float64(types.float64)), types.float64))
def applied(function, x):
    return function(x)


@njit(cache=True, error_model="numpy")
def twice_lower(x):
    return lower(x) + applied(lower, x)
"""


@pytest.fixture
def program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    (tmp_path / "render" / "base").mkdir(parents=True)
    (tmp_path / "pyproject.toml").touch()
    (tmp_path / "render/__init__.py").write_text(
        "from render.base.kernel_cache import keep_kernels\n\nkeep_kernels()\n"
    )
    for name in BASE:
        path = f"render/base/{name}.py"
        (tmp_path / path).write_text((ROOT / path).read_text(encoding="utf-8"), encoding="utf-8")
    (tmp_path / "render/kernels.py").write_text(KERNELS)
    return tmp_path


def run(program: Path, code: str) -> list[str]:
    code = "import numpy as np\nimport render\nfrom render.kernels import *\n" + code
    done = subprocess.run([sys.executable, "-c", code], cwd=program, capture_output=True, text=True, check=True)
    return done.stdout.split()


def kept(program: Path) -> list[str]:
    return sorted(path.name.split(".")[1].split("-")[0] for path in (program / ".cache").rglob("*.nbc"))


CALL = "print(*outer(np.array([1.0, 2.0])))"


def test_only_what_python_calls_is_kept_and_it_is_whole(program: Path) -> None:
    for _ in range(2):  # compiled, then loaded
        assert run(program, CALL) == ["12.0", "6.0"]
        assert kept(program) == ["outer"]


def test_what_kernels_called_before_answers_python_as_well(program: Path) -> None:
    first = CALL + "\nprint(quotient(1.0, 4.0), twice(4.0), twice(4.0, 3.0))\n"
    assert run(program, first) == ["12.0", "6.0", "0.25", "8.0", "12.0"]
    assert kept(program) == ["outer", "quotient", "twice", "twice"]
    assert run(program, "print(quotient(1.0, 4.0))\n" + CALL) == ["0.25", "12.0", "6.0"]


@pytest.mark.validation
def test_what_python_called_before_is_taken_from_the_cache_by_a_kernel(program: Path) -> None:
    run(program, "quotient(1.0, 4.0)")
    assert run(program, CALL + "\nprint(sum(quotient.stats.cache_misses.values()))") == ["12.0", "6.0", "0"]


@pytest.mark.parametrize("before", [CALL, pytest.param("", marks=pytest.mark.validation)])
def test_an_error_within_what_a_kernel_calls_is_told_in_its_words(program: Path, before: str) -> None:
    """Also by machine code that was loaded, where what raises it was never compiled."""
    code = f"{before}\ntry:\n    outer(np.zeros(1))\nexcept ZeroDivisionError as error:\n    print(error.args[0])"
    for _ in range(2):
        assert " ".join(run(program, code)).endswith("nothing to divide by")


def test_a_function_may_call_itself(program: Path) -> None:
    assert run(program, "print(ways(4), factorial(3))") == ["12.0", "6"]


def test_a_function_that_a_kernel_hands_on_has_an_address(program: Path) -> None:
    for _ in range(2):
        assert run(program, "print(twice_lower(4.0))") == ["6.0"]


def test_numbas_own_functions_are_made_once_for_all_that_inherit_the_same_options(program: Path) -> None:
    """However they are compiled themselves: for Python, or for a kernel."""
    (program / "render/more.py").write_text(
        "import numpy as np\nfrom numba import njit\n\n\n"
        '@njit(cache=True, nogil=True, error_model="numpy")\ndef inner(n):\n    return np.empty(n).size\n\n\n'
        '@njit(cache=True, error_model="numpy")\ndef both(n):\n    return inner(n) + np.empty(n).size\n'
    )
    code = """
from numba.core import event
from render.more import both
made = []
class Made(event.Listener):
    def on_start(self, told):
        made.append(told.data["dispatcher"].py_func.__qualname__)
    def on_end(self, told):
        pass
event.register("numba:compile", Made())
print(both(2), made.count("ol_np_empty.<locals>.impl"))
"""
    assert run(program, code) == ["4", "1"]


HANDING = "from render.base.kernel_cache import hand_over_callees, remove_callees\nhand_over_callees()\n"
COUNT = """
from numba.core import event
made = []
class Made(event.Listener):
    def on_start(self, told):
        made.append(told.data["dispatcher"].py_func.__name__)
    def on_end(self, told):
        pass
event.register("numba:compile", Made())
"""


def left(program: Path) -> list[Path]:
    return list((program / ".cache").rglob("*.callee"))


def test_what_one_process_compiled_for_a_kernel_another_takes(program: Path) -> None:
    """Errors within it as well; a damaged file is compiled anew, and the files go when they are asked to."""
    (program / "render/more.py").write_text(
        "from numba import njit\nfrom render.kernels import quotient, twice\n\n\n"
        '@njit(cache=True, error_model="numpy")\ndef other(x):\n    return quotient(twice(x), x - 1.0)\n'
    )
    run(program, HANDING + CALL)
    assert len(left(program)) == 2  # quotient and twice
    use = HANDING + COUNT + "from render.more import other\n"
    broken = "try:\n    other(1.0)\nexcept ZeroDivisionError as error:\n    print(error.args[0])\n"
    told = run(program, use + "print(other(3.0))\n" + broken + "print(*made)")
    assert " ".join(told) == "3.0 nothing to divide by other"
    for path in left(program):
        path.write_bytes(path.read_bytes()[:-1] + b"?")
    for path in (program / ".cache").rglob("*other-*"):
        path.unlink()
    told = run(program, use + "print(other(3.0), *sorted(made))\nremove_callees()")
    assert told == ["3.0", "other", "quotient", "twice"] and not left(program)


def test_numbers_known_beforehand_and_narrower_ones_need_no_function_of_their_own(program: Path) -> None:
    (program / "render/more.py").write_text(
        'from numba import njit\n\n\n@njit(error_model="numpy")\ndef third(a, i):\n    return a[i] + i\n\n\n'
        '@njit(error_model="numpy")\ndef picked(a, i):\n    return third(a, 2) + third(a, i) + third(a, -i)\n'
    )
    code = COUNT + "from render.more import picked\nprint(picked(np.arange(4.0), np.int32(1)), made.count('third'))"
    assert run(program, code) == ["8.0", "1"]
