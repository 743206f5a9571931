"""A scan's folder with broken frames, sidecars, manifests, their digests set right or not."""

from __future__ import annotations

import hashlib
import json
import shutil
from pathlib import Path
from random import Random

from tests.mutations import images, values
from tests.mutations.damage import damaged
from tests.mutations.project_cases import json_or_not, quick
from tests.mutations.sources import Sources, copy_scan


def frame(sources: Sources, place: Path, rng: Random, harm: bool) -> list[str]:
    scan = _scan(sources, place, rng, harm)
    before = _digests(scan)
    file = rng.choice(sorted(scan.glob("frame_*.exr")) * 3 + sorted(scan.glob("frame_*.png")))
    content = file.read_bytes()
    if harm:
        channels = file.suffix == ".exr" and rng.random() < 0.5
        file.write_bytes(images.other_channels(content, rng) if channels else damaged(content, rng))
        if rng.random() < 0.7:
            _sign_again(scan, before)
        if rng.random() < 0.2:
            return ["extract", f"scan/{file.name}", "--out", "out", *json_or_not(rng)]
    return measure(rng)


def sidecar(sources: Sources, place: Path, rng: Random, harm: bool) -> list[str]:
    scan = _scan(sources, place, rng, harm)
    before = _digests(scan)
    found = sorted(scan.glob("frame_*.json"))
    file = rng.choice(found)
    if harm:
        fault = rng.choices(("values", "bytes", "exchange", "other"), (12, 2, 1, 1))[0]
        if fault == "values":
            file.write_bytes(values.mutated(json.loads(file.read_bytes()), rng))
        elif fault == "bytes":
            file.write_bytes(damaged(file.read_bytes(), rng))
        elif fault == "exchange":
            first, last = found[0].read_bytes(), found[-1].read_bytes()
            found[0].write_bytes(last)
            found[-1].write_bytes(first)
        else:
            shutil.copy(sources.folder / rng.choice(("still", "moving")) / "scan" / "frame_0000.json", file)
        if rng.random() < 0.7:
            _sign_again(scan, before)
    return measure(rng)


def manifest(sources: Sources, place: Path, rng: Random, harm: bool) -> list[str]:
    scan = _scan(sources, place, rng, harm)
    before = _digests(scan)
    if harm:
        file = scan / rng.choice(("scan.json", "scan_project.json"))
        data = json.loads(file.read_bytes())
        content = values.mutated(data, rng, sources.limits)
        file.write_bytes(quick(content))
        if rng.random() < 0.7:
            _sign_again(scan, before)
    return measure(rng)


def report(sources: Sources, place: Path, rng: Random, harm: bool) -> list[str]:
    """Hostile words and values in what a report shows; slow, so seldom."""
    scan = _scan(sources, place, rng, harm)
    if harm:
        before = _digests(scan)
        name = rng.choice(("frame_0000.json", "scan.json", "scan_project.json"))
        (scan / name).write_bytes(quick(values.mutated(json.loads((scan / name).read_bytes()), rng, sources.limits)))
        _sign_again(scan, before)
    return ["report", "scan", *json_or_not(rng)]


def _scan(sources: Sources, place: Path, rng: Random, harm: bool) -> Path:
    copy_scan(sources, rng.choice(("still", "moving")) if harm else "moving", place)
    return place / "scan"


def measure(rng: Random) -> list[str]:
    """A command that reads a scan's folder."""
    again = rng.choices(
        (
            ["reconstruct", "scan", "--out", "out"],
            ["reconstruct", "scan"],
            ["reconstruct", "scan", "--project", "project.json", "--out", "out"],
            ["run", "project.json", "--steps", "2", "--no-report", "--time-limit", "2", "--out", "scan", "--resume"],
            ["render", "project.json", "--steps", "2", "--time-limit", "2", "--out", "scan", "--resume"],
        ),
        (10, 3, 3, 3, 1),
    )[0]
    return [*again, *json_or_not(rng)]


def _digests(scan: Path) -> dict[Path, str]:
    return {file: hashlib.sha256(file.read_bytes()).hexdigest() for file in sorted(scan.iterdir())}


def _sign_again(scan: Path, before: dict[Path, str]) -> None:
    """Put the digests of changed files into the files that tell them, so that what is changed is also looked at."""
    for _ in range(3):  # a manifest tells the digest of a sidecar, which tells that of an image
        after = _digests(scan)
        changed = {before[file].encode(): after[file].encode() for file in before if before[file] != after[file]}
        for file in scan.glob("*.json"):
            content = file.read_bytes()
            for old, new in changed.items():
                content = content.replace(old, new)
            file.write_bytes(content)
