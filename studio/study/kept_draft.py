"""The study of a project that is being put together, kept beside the preferences until the project is opened again.

A study becomes a file when it is saved or run; what was put together before must not go with the window.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from render.base.errors import InputError
from render.base.files import atomic_write
from studio.project.project import Project
from studio.runtime.preferences import state_folder
from studio.study.draft import Data, varies_nothing
from studio.study.store import bases_data, bases_from

KEPT = 100
"""Of the last projects."""
RESULTS, BASES = "results", "bases"
"""Beside what a study's file has: its folder, and base projects of its own."""
LARGEST = 1 << 20
"""Bytes of a file that is read."""


def keep_draft(
    project: Path, draft: Data, folder: Path | None = None, bases: Mapping[str, Project] = MappingProxyType({})
) -> None:
    """Of the project's file, with its folder of results, and bases that are not that project.

    A draft that varies nothing is nothing to keep; a full disk keeps none and is no fault.
    """
    file = _file(project)
    with contextlib.suppress(OSError):
        if not asks_something(draft):
            file.unlink(missing_ok=True)
            return
        file.parent.mkdir(parents=True, exist_ok=True)
        with atomic_write(file) as temporary:
            results = {} if folder is None else {RESULTS: str(folder.resolve())}
            temporary.write_text(json.dumps({**draft, **results, BASES: bases_data(bases)}), encoding="utf-8")
        others = sorted(file.parent.glob("*.json"), key=lambda other: other.stat().st_mtime)
        for old in others[:-KEPT]:
            old.unlink(missing_ok=True)


def kept_draft(project: Path, base: str) -> tuple[Data, dict[str, Project]] | None:
    """As it was kept, of the open project by its name in studies, and its own bases; None: there is none any more."""
    kept = _read(project)
    draft = {name: value for name, value in kept.items() if name not in (RESULTS, BASES)}
    with contextlib.suppress(InputError, KeyError, TypeError, AttributeError):
        bases = bases_from(kept.get(BASES, {}), _file(project))
        if draft.get("base") not in bases:
            draft["base"] = base
        return (draft, bases) if _is_draft(draft) else None
    return None


def kept_folder(project: Path) -> Path | None:
    """Where the results of the kept study are; None: there are none, or the folder is there no longer."""
    name = _read(project).get(RESULTS)
    folder = Path(name) if isinstance(name, str) else None
    with contextlib.suppress(OSError, ValueError):
        return folder if folder is not None and folder.is_dir() else None
    return None


def _read(project: Path) -> Data:
    """What is kept; empty: nothing that can be read."""
    file = _file(project)
    try:
        if file.stat().st_size > LARGEST:
            return {}
        return dict(json.loads(file.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return {}


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


def asks_something(draft: Data) -> bool:
    """Some sweep varies a field: what a person would not want to put together again."""
    return any(not varies_nothing({"sweeps": [sweep]}) for sweep in draft["sweeps"])


def _file(project: Path) -> Path:
    name = hashlib.sha256(str(project.resolve()).encode()).hexdigest()[:32]
    return state_folder() / "studies" / f"{name}.json"
