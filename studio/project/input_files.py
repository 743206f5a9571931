"""The files that a scan reads beside its project: meshes, textures and what they name, each known by its SHA-256."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from render.base.errors import InputError
from render.base.files import check_regular, inside, sha256
from render.mesh.mesh_headers import MAX_FILE_BYTES
from render.mesh.trimesh_reader import side_files
from render.scene.scene import Scene
from studio.project.project_files import named_files

MOST_NAMED = 6
"""Things that a message names one by one."""
SHOWN = 16
"""Digits of a hash in a message."""


def input_files(scene: Scene, root: Path) -> dict[str, Path]:
    """Path relative to the project folder `root` -> file, of all regular files that loading the visible objects reads.

    A missing one is passed over: loading tells it better. InputError: a path leaves the project folder.
    """
    seen = scene.model_copy(update={"objects": scene.visible_objects})
    found: dict[str, Path] = {}
    for relative, where in named_files(seen, "scene").items():
        file = inside(root, relative, where)
        if not file.is_file():
            continue
        found[Path(relative).as_posix()] = file
        for name in side_files(file, root):
            beside = (Path(relative).parent / name).as_posix()
            with suppress(InputError):  # the mesh reader takes none from outside either
                side = inside(root, beside, where)
                if side.is_file():
                    found[beside] = side
    return found


def input_hashes(scene: Scene, root: Path) -> dict[str, str]:
    """Path relative to `root` -> SHA-256 of every input file. InputError: one is too big or cannot be read."""
    hashes = {}
    for relative, file in sorted(input_files(scene, root).items()):
        check_regular(file, MAX_FILE_BYTES, "input file")
        hashes[relative] = sha256(file)
    return hashes


def check_unchanged(recorded: Mapping[str, str], scene: Scene, root: Path, *, cure: str) -> None:
    """InputError: the input files below `root` are not those of the record; it names them with both hashes."""
    told = changed_files(recorded, input_hashes(scene, root))
    if told:
        raise InputError(
            f"input files have changed since the scan: {listed(told)}",
            where=str(root),
            allowed="the files that the frames were rendered from, which are also the truth that points are held to",
            cure=cure,
        )


def changed_files(then: Mapping[str, str], now: Mapping[str, str]) -> list[str]:
    """The files whose hashes differ, each with both; what a damaged record holds in place of one is shown as text."""
    return [
        f"{name} (SHA-256 now {now.get(name, 'of no file')[:SHOWN]}, then {str(then.get(name, 'of no file'))[:SHOWN]})"
        for name in sorted({*then, *now})
        if then.get(name) != now.get(name)
    ]


def listed(told: Sequence[str]) -> str:
    """The first few of them, and how many more there are."""
    more = [f"{len(told) - MOST_NAMED} more"] if len(told) > MOST_NAMED else []
    return "; ".join([*told[:MOST_NAMED], *more])
