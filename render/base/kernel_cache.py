"""Where compiled kernels are kept: a folder for each state of their source, so that none outlives a change.

Numba checks the file of a kernel only, not the kernels and constants that it imports from other files: after an update
of the program it would run outdated machine code.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import re
import shutil
import sys
import time
from contextlib import suppress
from functools import cache
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.metadata import version
from pathlib import Path
from types import ModuleType

ROOT = Path(__file__).resolve().parents[2]
ROOMS = ("render", "analysis")
KEPT = 2
"""Number of folders that are never removed: the one in use and the one before."""
UNUSED = 24 * 3600.0
"""Age, s, above which other folders are removed; a program started before the change may still use a younger one."""
DISPATCHER = "numba.core.dispatcher"
KNOWN_NUMBA = "0.68."
"""Versions of numba whose inside `kernel_dispatcher` was made for, and is tested with."""
CALLEE = ".callee"
"""End of the names of files that hold what kernels call, which go as soon as all kernels are there."""
IMPORT = re.compile(rb"^from ((?:render|analysis)[\w.]*) import (\([^)]*\)|.*)", re.MULTILINE)
MARKS = b"njit", b"peak_kernel", b"intrinsic"
"""Decorators of what is compiled."""
KERNEL = re.compile(rb"^[ \t]*@(?:numba\.)?(?:%s)\b" % b"|".join(MARKS), re.MULTILINE)
CONSTANT = re.compile(rb"\b(?:[A-Z][A-Z0-9_]+|Flag)\b")
_handing_over: list[bool] = []


def source_key(root: Path = ROOT) -> str:
    """16 hexadecimal digits of all files in `render` and `analysis` with kernels, or with constants of kernels."""
    texts, above = {}, len(os.path.join(root, ""))
    for room in ROOMS:
        for folder, _, names in os.walk(root / room):
            for name in names:
                if name.endswith(".py"):
                    path = os.path.join(folder, name)
                    with open(path, "rb", buffering=0) as file:
                        texts[path[above:].replace(os.sep, "/")] = file.read()
    # a plain search for the words first: every start of the program waits for this
    marked = {path: text for path, text in texts.items() if any(mark in text for mark in MARKS)}
    kernels = {path for path, text in marked.items() if KERNEL.search(text)}
    sources = {
        found[1].decode().replace(".", "/") + ".py"
        for path in kernels
        for found in IMPORT.finditer(texts[path])
        if CONSTANT.search(found[2])
    }
    digest = hashlib.sha256()
    for path in sorted(kernels | sources & texts.keys()):
        digest.update(path.encode() + b"\0" + texts[path] + b"\0")
    return digest.hexdigest()[:16]


def cache_folder(root: Path = ROOT) -> Path:
    """Beside the program where it is a checkout that may be written to, else in the user's own cache."""
    if (root / "pyproject.toml").is_file() and os.access(root, os.W_OK):
        return root / ".cache" / "kernels"
    from platformdirs import user_cache_path

    return user_cache_path("blazer-studio", appauthor=False) / "kernels"


def keep_kernels(root: Path = ROOT) -> Path | None:
    """Keep machine code, sealed, in the folder of the present source; folders long out of use go.

    Returns the folder, which need not be one that can be written; None: NUMBA_CACHE_DIR names another.
    """
    _seal_caches()
    folder = cache_folder(root)
    given = os.environ.get("NUMBA_CACHE_DIR")
    if given and Path(given).parent != folder:  # one of ours comes from the program that started this one
        return None
    kept = folder / source_key(root)
    with suppress(OSError):
        kept.mkdir(parents=True, exist_ok=True)
        os.utime(kept)
        _remove_old(folder, kept)
    os.environ["NUMBA_CACHE_DIR"] = str(kept)
    if "numba" in sys.modules:
        sys.modules["numba"].config.CACHE_DIR = str(kept)
    return kept


@cache
def kept_in() -> str:
    """The folder that is used as long as this program runs, its own or the one that NUMBA_CACHE_DIR names."""
    return os.environ.get("NUMBA_CACHE_DIR") or str(cache_folder() / source_key())


def hand_over_callees() -> None:
    """From now on what is compiled for kernels is shared with a process that compiles at the same time."""
    _handing_over.append(True)


def hands_over() -> bool:
    return bool(_handing_over)


def remove_callees() -> None:
    """What was handed over: every kernel is there."""
    _handing_over.clear()
    for path in Path(kept_in()).glob(f"*/*{CALLEE}"):
        with suppress(OSError):
            path.unlink()


def _remove_old(folder: Path, kept: Path) -> None:
    """Folders out of use, and what a kill left behind while a file was written."""
    now = time.time()
    ages = sorted(((now - other.stat().st_mtime, other) for other in folder.iterdir()), key=lambda p: p[0])
    for age, other in ages[KEPT:]:
        if age > UNUSED:
            shutil.rmtree(other, ignore_errors=True)
    for left in kept.glob("*/*.tmp.*"):
        if now - left.stat().st_mtime > UNUSED:
            left.unlink()


def _seal_caches() -> None:
    """From now on numba asks `render.base.sealed_cache` for a function's cache; numba need not be there yet."""
    if DISPATCHER in sys.modules:
        _use_seals(sys.modules[DISPATCHER])
    elif not any(isinstance(finder, _Dispatcher) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Dispatcher())


class _Dispatcher(MetaPathFinder):
    """Finds numba's dispatcher as others do, and has it changed as soon as it is imported."""

    def find_spec(self, name: str, path: object = None, target: object = None) -> ModuleSpec | None:
        if name != DISPATCHER:
            return None
        sys.meta_path.remove(self)
        spec = importlib.util.find_spec(name)
        if spec is not None and spec.loader is not None:
            execute = spec.loader.exec_module

            def execute_and_change(module: ModuleType) -> None:
                execute(module)
                _use_seals(module)
                _compile_less(module)

            spec.loader.exec_module = execute_and_change  # type: ignore[method-assign]
        return spec


def _use_seals(dispatcher: ModuleType) -> None:
    def sealed(kernel: object) -> object:
        from render.base.sealed_cache import cache_of

        return cache_of(kernel)

    dispatcher.FunctionCache = sealed  # type: ignore[attr-defined]


def _compile_less(dispatcher: ModuleType) -> None:
    """Only before numba derives others from its dispatcher, and of the numba whose inside it was made for; else kernels
    are as good, but take longer to compile."""
    if "render.base.kernel_dispatcher" in sys.modules:  # which somebody imports before numba, and waits for it
        return
    if not version("numba").startswith(KNOWN_NUMBA):
        return
    from render.base.kernel_dispatcher import KernelDispatcher

    dispatcher.Dispatcher = KernelDispatcher  # type: ignore[attr-defined]
