"""What a render has done so far, kept so that it can go on later: in memory, and in a file beside its frame.

Only what took long is kept: the sums of the reflected and of the ambient light, and what they learnt. The rest is
computed anew, with the same numbers. What goes on ends in the same image, bit for bit, as without interruption.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from render.base.errors import InputError
from render.base.files import atomic_write, check_regular
from render.base.kernel_cache import source_key
from render.run import Arrays, Sums
from render.scene.scene import Scene
from render.scene.settings import RenderSettings
from render.world.world import World

T = TypeVar("T")

CHANGEABLE = {"goal", "indirect_error", "light_paths", "ambient_error", "ambient_samples", "truth_images"}
"""Settings that say when to end, which may be others when a render goes on."""
MAX_BYTES = 2**33
CURE = "delete it, or render without --resume"
WRITE_INTERVAL = 30.0
"""s between two writings of the file."""


@dataclass
class RenderState:
    """The state of one frame's render; hand it to the renderer, and again to go on."""

    marks: dict[str, str]
    """Of what it is a render."""
    path: Path | None = None
    """The file that follows; None: in memory only."""
    saved: dict[str, Arrays] = field(default_factory=dict)
    """By part (`Run.part`): what to go on from."""
    under_way: dict[str, Sums] = field(default_factory=dict)
    """By part: what is rendered now."""
    written: float = field(default_factory=time.monotonic)

    def keep(self, part: str, sums: Sums) -> None:
        """Hold on to the sums of a part, which change from then on; they go to the file every now and then."""
        self.under_way[part] = sums
        if self.path is not None and time.monotonic() - self.written > WRITE_INTERVAL:
            self.write()

    def restore(self, part: str, load: Callable[[Arrays], T]) -> T | None:
        """What `load` makes of a saved part; None: nothing of it is there. InputError: it is damaged."""
        if part not in self.saved:
            return None
        try:
            return load(self.saved[part])
        except InputError:
            raise
        except (KeyError, ValueError, IndexError, TypeError):
            raise _damaged(str(self.path or "")) from None

    def pause(self) -> None:
        """What is under way becomes what to go on from; what would be half a wave is given up."""
        self.saved |= self._consistent()
        self.under_way = {}

    def write(self) -> bool:
        """Bring the file up to date; False: there is nothing worth a file. InputError: it cannot be written."""
        parts = self.saved | self._consistent()
        if self.path is None or not parts:
            return False
        named = {f"{part}/{name}": array for part, arrays in parts.items() for name, array in arrays.items()}
        marks = {f"of/{name}": np.array(mark) for name, mark in self.marks.items()}
        with atomic_write(self.path) as temporary, open(temporary, "wb") as file:
            np.savez(file, allow_pickle=False, **marks, **named)
        self.written = time.monotonic()
        return True

    def _consistent(self) -> dict[str, Arrays]:
        return {part: sums.arrays() for part, sums in self.under_way.items() if sums.consistent}

    def remove(self) -> None:
        """The frame is finished: no file stays."""
        if self.path is not None:
            self.path.unlink(missing_ok=True)


def state_of(
    world: World,
    scene: Scene,
    settings: RenderSettings,
    *,
    step: int = 0,
    seed: int = 0,
    path: Path | None = None,
    plan: str | None = None,
) -> RenderState:
    """A render that has not begun; plan: the mark of a plan made for a whole scan (`render.scan_plan`)."""
    marks = fingerprint(world, scene, settings, step=step, seed=seed)
    return RenderState(marks if plan is None else {**marks, "plan of the light": plan}, path)


def read_state(state: RenderState) -> RenderState:
    """What the file of a new state holds; the state itself where there is no file.

    InputError: the file is damaged, or of another scene, other settings or another version of the program.
    """
    if state.path is None or not state.path.is_file():
        return state
    where = str(state.path)
    check_regular(state.path, MAX_BYTES, "saved render")
    try:
        with np.load(state.path, allow_pickle=False) as file:
            found: dict[str, Arrays] = {}
            for key in file.files:
                part, _, name = key.partition("/")
                found.setdefault(part, {})[name] = file[key]
        marks = {name: str(mark) for name, mark in found.pop("of").items()}
    except Exception as error:  # a damaged archive fails in any way, also by asking for memory without end
        raise _damaged(where, "data cut short or changed") from error
    others = [name for name, mark in state.marks.items() if marks.get(name) != mark]
    if others:
        raise InputError(
            "the saved render is of something else",
            where=where,
            found=f"another {' and another '.join(others)}",
            allowed="a render of the same scene with the same settings; only targets may differ",
            cure=CURE,
        )
    return RenderState(state.marks, state.path, found)


def _damaged(where: str, found: str = "arrays that are missing or of another shape") -> InputError:
    return InputError("the saved render is damaged", where=where, found=found, cure=CURE)


def fingerprint(
    world: World, scene: Scene, settings: RenderSettings, *, step: int = 0, seed: int = 0
) -> dict[str, str]:
    """What of scene and settings decides the numbers of a render, part by part."""
    arrays = [value for value in vars(world).values() if isinstance(value, np.ndarray)]
    materials = "".join(f"{type(material).__name__}{material.model_dump_json()}" for material in world.materials)
    rest = scene.model_dump(mode="json", exclude={"objects"})
    return {
        "mesh, place or texture": _digest(*arrays),
        "material": _digest(materials),
        "camera, laser, lamp or motion": _digest(repr(rest)),
        "render setting": _digest(repr(settings.model_dump(mode="json", exclude=CHANGEABLE))),
        "step or seed": f"{step}, {seed}",
        "version of the program": _program(),
    }


@cache
def _program() -> str:
    """Of the kernels as they were when they were loaded."""
    return source_key()


def _digest(*parts: NDArray[Any] | str) -> str:
    digest = hashlib.sha256()
    for part in parts:
        if isinstance(part, str):
            digest.update(part.encode())
        else:
            digest.update(f"{part.shape}{part.dtype}".encode())
            digest.update(np.ascontiguousarray(part).tobytes())
    return digest.hexdigest()[:32]
