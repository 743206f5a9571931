"""Where compiled kernels are kept: a folder for each state of their source, so that none outlives a change.

Numba looks at the file of a kernel only, not at the kernels and constants that it takes from other files: after an
update of the program it would go on with machine code of before.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import sys
import time
from contextlib import suppress
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
ROOMS = ("render", "analysis")
KEPT = 2
"""Folders that stay in any case: the one in use and the one before."""
UNUSED = 24 * 3600.0
"""s; older folders may still be in use by a program that was started before the change."""
IMPORT = re.compile(rb"^from ((?:render|analysis)[\w.]*) import (\([^)]*\)|.*)", re.MULTILINE)
CONSTANT = re.compile(rb"\b(?:[A-Z][A-Z0-9_]+|Flag)\b")


def source_key(root: Path = ROOT) -> str:
    """16 hexadecimal digits of all files in `render` and `analysis` with kernels, or with constants of kernels."""
    texts = {}
    for room in ROOMS:
        for folder, _, names in os.walk(root / room):
            for name in names:
                if name.endswith(".py"):
                    path = os.path.join(folder, name)
                    with open(path, "rb") as file:
                        texts[os.path.relpath(path, root).replace(os.sep, "/")] = file.read()
    kernels = {path for path, text in texts.items() if b"@njit" in text}
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
    """Let numba keep machine code in the folder of the present source; folders long out of use go.

    Returns the folder; None: NUMBA_CACHE_DIR names another, or none can be made, and numba decides.
    """
    folder = cache_folder(root)
    given = os.environ.get("NUMBA_CACHE_DIR")
    if given and Path(given).parent != folder:  # one of ours comes from the program that started this one
        return None
    kept = folder / source_key(root)
    try:
        kept.mkdir(parents=True, exist_ok=True)
        os.utime(kept)
    except OSError:
        return None
    _remove_old(folder)
    os.environ["NUMBA_CACHE_DIR"] = str(kept)
    if "numba" in sys.modules:
        sys.modules["numba"].config.CACHE_DIR = str(kept)
    return kept


def _remove_old(folder: Path) -> None:
    with suppress(OSError):
        ages = sorted(((time.time() - other.stat().st_mtime, other) for other in folder.iterdir()), key=lambda p: p[0])
        for age, other in ages[KEPT:]:
            if age > UNUSED:
                shutil.rmtree(other, ignore_errors=True)
