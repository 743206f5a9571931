"""The folder of a scan: frames, points, report, the project as it was run, and a manifest that is written last.

A folder without its manifest `scan.json` is an unfinished scan, so that half a result is never taken for a whole one.
The manifest goes first when a scan begins, then what an earlier one left, then the new project is written: wherever
that ends, no frame lies beside another scan's manifest. The manifest holds the SHA-256 of the project, of every frame's
sidecar (which holds the image's) and of every input file; each sidecar says what scene its frame shows.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeGuard

from render.base.errors import InputError
from render.base.files import atomic_write, inside, remove_all_unfinished, sha256
from studio.project.input_files import check_unchanged, listed
from studio.project.project import READ_OFF, Project
from studio.project.strict_json import pretty, read_object
from studio.scan.folder_lock import hold
from studio.scan.own_files import check_replaceable, is_own
from studio.scan.rendered_from import check_rendered_from, differences, made_of

MANIFEST, PROJECT = "scan.json", "scan_project.json"
POINTS, REPORT = ("points.ply", "points.csv", "measures.csv"), ("report.html", "report.pdf")
FORMAT, FORMAT_VERSION = "blazer-scan", 2
MEASURED = ("results", "measures", "measures_note", "extraction", "notes", "remarks", "measured_with")
"""What a manifest tells of points, beside the report's files."""
MEASURED_WITH = ("sensor", "extraction", *READ_OFF)
"""Parts of a project that may be others than those that its frames were rendered with."""
FRAME = re.compile(r"frame_(\d{4,})(\.state\.npz|\.png|\.exr|\.json)")
"""A PNG goes before the files that tell whose it is."""


@dataclass(frozen=True)
class Begun:
    """A scan under way, which no other program can write into."""

    folder: Path
    inputs: Mapping[str, str]
    """SHA-256 of every input file, by its path relative to `root`."""
    project: Project
    root: Path


@dataclass(frozen=True)
class ScanFolder:
    """A finished scan as found on disk."""

    folder: Path
    project: Project
    """As the frames were rendered."""
    root: Path
    """Where the project's meshes and textures are, as the manifest says; they are read only where the hashes agree."""
    frames: tuple[Path, ...]
    """The frames' sidecars, in the order of their steps."""
    inputs: Mapping[str, str]
    manifest: dict[str, Any]


@contextmanager
def begin(
    folder: Path,
    project: Project,
    root: Path,
    inputs: Mapping[str, str],
    *,
    count: int,
    resume: bool = False,
    reads: Iterable[Path] = (),
) -> Iterator[Begun]:
    """Keep the folder for this scan of `count` frames, remove what an earlier one left there, write the project.

    resume: the frames stay. reads: further files that the run reads.
    InputError: another program works there; the folder holds a file that the scan reads, or one that it would replace
    and that no scan wrote; with `resume`, frames of another scene or of input files that have changed since.
    """
    with hold(folder):
        reads = [*reads, *(inside(root, name, "input files") for name in inputs)]
        if resume:
            _check_resumable(folder, project, inputs)
        _clear(folder, count, reads, keep_frames=resume)
        with atomic_write(folder / PROJECT) as temporary:
            temporary.write_text(project.to_text(), encoding="utf-8")
        yield Begun(folder, inputs, project, root)


def frame_stem(step: int) -> str:
    """Name of a frame's files, without suffix."""
    return f"frame_{step:04d}"


def finish(scan: Begun, result: dict[str, Any]) -> dict[str, Any]:
    """Write the manifest: the result, what it is of, and where the project came from; `result["frames"]` are names.

    InputError: an input file has changed while the scan ran, so that frames may differ in it.
    """
    check_unchanged(scan.inputs, scan.project.scene, scan.root, cure="run it again")
    try:
        source = os.path.relpath(scan.root, scan.folder)
    except ValueError:  # another drive
        source = str(scan.root.resolve())
    manifest = {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "project_folder": source,
        **result,
        "sha256": {
            "project": sha256(scan.folder / PROJECT),
            "frames": [sha256(scan.folder / name) for name in result["frames"]],
            "inputs": dict(scan.inputs),
        },
    }
    return _write_manifest(scan.folder, manifest)


def is_project(file: Path) -> bool:
    """A project that is called as a scan's manifest is, as one of the template "Scan" may be."""
    try:
        found = read_object(file)
    except InputError:
        return False
    return "format" not in found and "scene" in found


def open_folder(folder: Path) -> ScanFolder:
    """Read a finished scan.

    InputError: no manifest, of another kind or version, files missing, or the project or a frame is not as it was when
    the scan ended.
    """
    where = str(folder / MANIFEST)
    if not (folder / MANIFEST).is_file():
        cure = (
            "render or run the project first" if not folder.exists() else "the scan there did not finish: run it again"
        )
        raise InputError("there is no finished scan in this folder", where=str(folder), allowed=MANIFEST, cure=cure)
    manifest = read_object(folder / MANIFEST, "scan manifest")
    version = manifest.get("format_version")
    if manifest.get("format") != FORMAT or version != FORMAT_VERSION:
        found = f"{manifest.get('format')} {version}"
        cure = "run the project again: it was not recorded then what frames were made of" if version == 1 else ""
        raise InputError(
            "unknown kind of manifest", where=where, found=found, allowed=f"{FORMAT} {FORMAT_VERSION}", cure=cure
        )
    names, source, hashes = manifest.get("frames"), manifest.get("project_folder"), manifest.get("sha256")
    if not (_are_texts(names) and isinstance(source, str) and isinstance(hashes, dict)):
        raise InputError("frames, project_folder or sha256 is missing or of the wrong type", where=where)
    inputs, of_frames = hashes.get("inputs"), hashes.get("frames")
    if not (isinstance(inputs, dict) and _are_texts(list(inputs.values())) and _are_texts(of_frames)):
        raise InputError("inputs or frames is missing or of the wrong type", where=f"{where}: sha256")
    frames = tuple(inside(folder, name, f"{where}: frames") for name in names)
    if len(of_frames) != len(names):
        found = f"{len(of_frames)} for {len(names)} frames"
        raise InputError("every frame needs its hash", where=f"{where}: sha256.frames", found=found)
    project = Project.load(folder / PROJECT)
    if sha256(folder / PROJECT) != hashes.get("project"):
        raise _edited(folder, project, frames)
    for file, recorded in zip(frames, of_frames, strict=True):
        if sha256(file) != recorded:
            raise InputError(
                "the frame's description has changed since the scan ended", where=str(file), cure="render again"
            )
    return ScanFolder(folder, project, _root_of(folder, source, inputs), frames, inputs, manifest)


def _root_of(folder: Path, source: str, inputs: Mapping[str, str]) -> Path:
    """Where the manifest says that the input files are; where they are no longer, the scan's folder or the one that it
    lies in, if they are there as they were: of a project that was saved, or carried along, since."""
    recorded = (folder / source).resolve()
    if all((recorded / name).is_file() for name in inputs):
        return recorded
    for other in (folder.resolve(), folder.resolve().parent):
        with suppress(InputError, OSError):
            if all(sha256(inside(other, name, "input files")) == digest for name, digest in inputs.items()):
                return other
    return recorded


def image_scale_of(found: ScanFolder) -> float:
    """Of the scan's images, to the scanner's. InputError: the manifest holds none."""
    scale = found.manifest.get("image_scale", 1.0)
    if isinstance(scale, bool) or not isinstance(scale, float | int) or not 0.01 <= scale <= 4.0:
        where = f"{found.folder / MANIFEST}: image_scale"
        raise InputError("the image scale is none", where=where, found=scale, allowed="0.01 to 4")
    return float(scale)


def measured_project(found: ScanFolder) -> Project:
    """The project with the parts of `MEASURED_WITH` that the folder's points were made with, which may be others.

    InputError: the manifest's record of them is none.
    """
    record = found.manifest.get("measured_with")
    if record is None:
        return found.project
    data = found.project.model_dump(mode="json")
    if not isinstance(record, dict) or not record.keys() <= set(MEASURED_WITH):
        where = f"{found.folder / MANIFEST}: measured_with"
        raise InputError("the settings of the measurement are none", where=where, allowed=", ".join(MEASURED_WITH))
    return Project.from_data({**data, **record}, f"{found.folder / MANIFEST}: measured_with")


def check_kept(found: ScanFolder) -> None:
    """InputError: the scan kept no frames, so that there is nothing to look at or to measure again."""
    if found.manifest.get("frames_kept") != "none":
        return
    raise InputError(
        "the scan kept none of its frames (--frames none)",
        where=str(found.folder),
        cure="run it again with --frames all or band; what it measured is in the folder",
    )


def check_measures(found: ScanFolder, project: Project) -> None:
    """InputError: frames rendered from the folder's project cannot be measured as `project`; it names what differs."""
    scale = image_scale_of(found)
    cure = "render the project again" + ("" if scale == 1.0 else f"; these frames are of --scale {scale}")
    check_rendered_from(made_of(found.project, {}, found.inputs), project, found.inputs, str(found.folder), cure=cure)


def check_frame(found: ScanFolder, sidecar: Path) -> None:
    """InputError: the frame was rendered from another project than the folder's; it names what differs."""
    record = read_object(sidecar, "frame").get("made_of")
    check_rendered_from(record if isinstance(record, dict) else {}, found.project, found.inputs, str(sidecar))


@contextmanager
def measuring(found: ScanFolder, root: Path, out: Path) -> Iterator[None]:
    """Keep both folders while the scan's frames, whose input files are below `root`, are measured anew into `out`.

    InputError: another program works there, `out` holds another scan, a file in the way is no result or is read, or
    an input file has changed since the scan.
    """
    own = _is_same(found.folder, out)
    with ExitStack() as held:
        held.enter_context(hold(found.folder, reading=not own))
        if read_object(found.folder / MANIFEST, "scan manifest") != found.manifest:
            raise InputError("the scan has changed while it was read", where=str(found.folder), cure="try again")
        cure = "restore them, run the project again, or say with --project where the right ones are"
        check_unchanged(found.inputs, found.project.scene, root, cure=cure)
        if not own:
            held.enter_context(hold(out))
            for name in (MANIFEST, PROJECT):
                if (out / name).exists():
                    cure = "choose another folder with --out"
                    raise InputError("the output folder holds another scan", where=str(out / name), cure=cure)
        reads = [inside(root, name, "input files") for name in found.inputs]
        check_replaceable([out / name for name in (*POINTS, *REPORT)], reads)
        _remove_unfinished(out)
        yield


@contextmanager
def replacing(found: ScanFolder, out: Path) -> Iterator[dict[str, Any]]:
    """While points and report are written into `out`; the dictionary takes what the manifest is to tell of them.

    In the scan's own folder the old ones go first, and until all are there the manifest tells of the frames only.
    """
    measured: dict[str, Any] = {}
    if not _is_same(found.folder, out):
        yield measured
        return
    of_frames = {name: value for name, value in found.manifest.items() if name not in MEASURED} | {"report": []}
    _write_manifest(out, of_frames)
    for name in (*reversed(REPORT), *POINTS):
        (out / name).unlink(missing_ok=True)
    yield measured
    _write_manifest(out, of_frames | measured)


def _is_same(a: Path, b: Path) -> bool:
    return a.resolve() == b.resolve()


def _are_texts(values: Any) -> TypeGuard[list[str]]:
    return isinstance(values, list) and all(isinstance(value, str) for value in values)


def _write_manifest(folder: Path, manifest: dict[str, Any]) -> dict[str, Any]:
    with atomic_write(folder / MANIFEST) as temporary:
        temporary.write_text(pretty(manifest) + "\n", encoding="utf-8")
    return manifest


def _edited(folder: Path, project: Project, frames: Iterable[Path]) -> InputError:
    """The folder's project is not the one that was run: in what it differs from the first frame."""
    told: list[str] = []
    for sidecar in frames:
        record = read_object(sidecar, "frame").get("made_of")
        told = differences(record if isinstance(record, dict) else {}, project)
        break
    what = listed(told) or "other settings of sensor or extraction, or other spelling"
    return InputError(
        f"the project of the scan has been edited since: {what}",
        where=str(folder / PROJECT),
        allowed="the project as it was run",
        cure="undo the change; other settings for the same frames are given with reconstruct --project",
    )


def _check_resumable(folder: Path, project: Project, inputs: Mapping[str, str]) -> None:
    """InputError: the frames there, which all are of one scan, show another scene than the project's."""
    for sidecar in sorted(folder.glob("frame_*.json")):
        if FRAME.fullmatch(sidecar.name) and is_own(sidecar):
            record = read_object(sidecar, "frame").get("made_of")
            if isinstance(record, dict) and "scene" in record:  # frames of earlier versions are rendered anew
                cure = "without --resume a new scan takes their place"
                check_rendered_from(record, project, inputs, str(sidecar), resume=True, cure=cure)
            return


def _clear(folder: Path, count: int, reads: list[Path], *, keep_frames: bool) -> None:
    """Remove what scans left in the folder, the manifest first; nothing of others, and nothing before it is checked."""
    names = sorted(os.listdir(folder))
    frames = [name for name in names if FRAME.fullmatch(name)]
    written = [name for name in frames if int(FRAME.fullmatch(name)[1]) < count]  # type: ignore[index]
    results = [name for name in (MANIFEST, *reversed(REPORT), *POINTS) if name in names]
    check_replaceable([folder / name for name in (*written, *results)], reads)
    gone = results
    if not keep_frames:
        order = {suffix: i for i, suffix in enumerate((".state.npz", ".png", ".exr", ".json"))}
        gone += sorted(
            (name for name in frames if is_own(folder / name)),
            key=lambda name: (name.split(".", 1)[0], order["." + name.split(".", 1)[1]]),
        )
        check_replaceable([folder / name for name in gone], reads)
    _check_project(folder, reads)
    for name in gone:
        (folder / name).unlink(missing_ok=True)
    _remove_unfinished(folder)


def _remove_unfinished(folder: Path) -> None:
    remove_all_unfinished(folder, lambda name: FRAME.fullmatch(name) or name in (MANIFEST, PROJECT, *POINTS, *REPORT))


def _check_project(folder: Path, reads: list[Path]) -> None:
    """InputError: the project in the folder is read by this run, or it is no project that a scan left."""
    path = folder / PROJECT
    if not path.exists():
        return
    what, cure = "", "move it away, or choose another folder with --out"
    if any(path.samefile(file) for file in reads if file.exists()):
        what, cure = "a result would replace a file that is read", "choose another folder with --out"
    elif is_own(folder / MANIFEST):
        hashes = read_object(folder / MANIFEST, "scan manifest").get("sha256")
        if isinstance(hashes, dict) and sha256(path) != hashes.get("project"):
            what = "the project of the scan there has been edited since"
    else:
        try:
            Project.load(path)
        except InputError:
            what = "a result would replace a file that this program did not write"
    if what:
        raise InputError(what, where=str(path), cure=cure)
