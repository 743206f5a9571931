"""The study of a project that is being put together, kept beside the preferences until the project is opened again.

A study becomes a file when it is saved or run; what was put together before must not go with the window.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
from pathlib import Path

from render.base.files import atomic_write
from studio.runtime.preferences import state_folder
from studio.study.draft import Data, varies_nothing

KEPT = 100
"""Of the last projects."""
LARGEST = 1 << 20
"""Bytes of a file that is read."""


def keep_draft(project: Path, draft: Data) -> None:
    """Of the project's file. A draft that varies nothing is nothing to keep; a full disk keeps none and is no fault."""
    file = _file(project)
    with contextlib.suppress(OSError):
        if not any(map(_asks, draft["sweeps"])):
            file.unlink(missing_ok=True)
            return
        file.parent.mkdir(parents=True, exist_ok=True)
        with atomic_write(file) as temporary:
            temporary.write_text(json.dumps(draft), encoding="utf-8")
        others = sorted(file.parent.glob("*.json"), key=lambda other: other.stat().st_mtime)
        for old in others[:-KEPT]:
            old.unlink(missing_ok=True)


def kept_draft(project: Path, base: str) -> Data | None:
    """As it was kept, of the open project by its name in studies; None: there is none, or it is none any more."""
    file = _file(project)
    try:
        if file.stat().st_size > LARGEST:
            return None
        draft = json.loads(file.read_text(encoding="utf-8")) | {"base": base}
    except (OSError, ValueError, TypeError):
        return None
    return dict(draft) if _is_draft(draft) else None


def _is_draft(draft: Data) -> bool:
    """It has what a draft has, be it finished or not."""
    sweeps = draft.get("sweeps")
    if not isinstance(draft.get("name"), str) or not isinstance(sweeps, list) or not sweeps:
        return False
    return all(
        isinstance(sweep, dict)
        and isinstance(sweep.get("name"), str)
        and isinstance(sweep.get("vary"), list)
        and all(isinstance(one, dict) and isinstance(one.get("field"), str) for one in sweep["vary"])
        for sweep in sweeps
    )


def _asks(sweep: Data) -> bool:
    return not varies_nothing({"sweeps": [sweep]})


def _file(project: Path) -> Path:
    name = hashlib.sha256(str(project.resolve()).encode()).hexdigest()[:32]
    return state_folder() / "studies" / f"{name}.json"
