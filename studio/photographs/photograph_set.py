"""What a set of photographs shows of its line, before any of them is measured: axis, colour, channel, and why."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from analysis.line.along.curve import LONGEST
from analysis.line.detection.channel import check_image
from analysis.line.result import Axis
from analysis.line.series.subtract import subtract_off
from analysis.line.settings import ExtractionSettings
from render.base.errors import InputError
from studio.photographs.evidence import (
    COLOURS,
    ENOUGH,
    FAINT,
    Chain,
    Colour,
    Evidence,
    Shrunk,
    chains_of,
    find_evidence,
    shrink,
)
from studio.photographs.evidence_words import OPTIONS, Words, told_of, warnings_of
from studio.photographs.image_files import Photograph, load_photograph, read_photograph
from studio.photographs.laser_light import ALL_FOUND, MOST_FOUND, TIE, Channel, channels_to_try, scatter_of
from studio.photographs.mosaic import moved_by
from studio.photographs.off_images import pair_offs
from studio.photographs.region import Region

TRIED = 3
"""Photographs on which channels are compared."""
NEARBY = 2.5
"""Scan lines, the longest smoothing along the line that nobody asked for. White noise falls as in a mean over 9, and
neighbours a JPEG's block apart err nearly for themselves. Of rendered photographs errors within 6 scan lines of corners
and steps are within a twentieth of their least, which longer ones exceed by up to a quarter, and all errors on folded
and stepped surfaces within a tenth; planes and other smooth surfaces gain by more, up to two fifths (12 scenes, 40
draws of noise and place each, `tests/validation/photograph_draws.py`)."""
KEPT = 2**28
"""Bytes of photographs that are kept in memory from looking to measuring."""


@dataclass(frozen=True)
class Wishes:
    """What is not to be found by the photographs themselves; None: by evidence."""

    axis: Axis | None = None
    colour: Colour | None = None
    channel: Channel | None = None
    off: tuple[Path, ...] = ()
    region: Region = field(default_factory=Region)
    shape: Literal["plane", "sphere"] = "plane"
    """Of what points are to lie on, for the report."""
    count_lines: bool = False
    """As many peaks as lines stand out, whatever the settings say."""
    longest: float = LONGEST
    """Scan lines, of smoothing along the line at most, where the settings ask for it."""
    words: Words = OPTIONS
    """In which a person is told what to choose."""


@dataclass(frozen=True)
class Look:
    """How the photographs of a set are to be measured, and what is said of it."""

    settings: ExtractionSettings
    evidence: Evidence | None
    channel: Channel
    region: Region
    offs: dict[Path, Path | None]
    told: list[tuple[str, str]]
    warnings: list[str]
    named: str | None = None
    """The colour that was asked for, which every photograph must have."""
    kept: dict[Path, Photograph] = field(default_factory=dict)
    chains: dict[Path, tuple[Chain, ...]] = field(default_factory=dict)
    """Of the photographs that were looked at."""
    longest: float = LONGEST
    """Scan lines, of smoothing along the line at most, where the settings ask for it."""

    @property
    def stands_out(self) -> bool:
        """The line is clearer than all else."""
        return self.evidence is not None and self.evidence.score >= FAINT

    @property
    def coloured(self) -> bool:
        """A colour selects, and a channel that also sees other light measures."""
        return self.evidence is not None and self.evidence.combination.difference and self.channel != "difference"

    def record(self) -> dict[str, Any]:
        """For programs: what was chosen, and why."""
        evidence = self.evidence
        return {
            "axis": self.settings.axis,
            "colour": None if evidence is None else evidence.colour,
            "seen_in": None if evidence is None else evidence.combination.name,
            "measured_in": self.channel,
            "evidence": {} if evidence is None else evidence.scores,
            "told": dict(self.told),
            "warnings": self.warnings,
        }

    def read(self, path: Path) -> tuple[Photograph, NDArray[Any] | None]:
        """A photograph and its laser-off image, of one shape. InputError: one of them cannot be read."""
        taken = self.kept.pop(path, None) or read_photograph(path)
        off = self.offs.get(path)
        return taken, None if off is None else alike(taken.pixels, _recent(off))

    def lines(self, path: Path, image: NDArray[Any], off: NDArray[Any] | None) -> Sequence[Chain]:
        """The chains of ridges that are the lines of a photograph, as its region shows it."""
        assert self.evidence is not None
        known = self.chains.get(path, ())
        if len(known) >= self.settings.peaks:
            return known[: self.settings.peaks]
        shrunk = shrink(image, off, self.region.closed)
        return chains_of(shrunk, self.evidence.combination, self.evidence.axis, self.settings.peaks)


@dataclass(frozen=True)
class Seen:
    """A photograph of the set in its region, less what a Bayer pattern takes apart, and the same to be looked at."""

    image: NDArray[Any]
    off: NDArray[Any] | None
    lossy: bool
    shrunk: Shrunk


_recent = lru_cache(maxsize=2)(load_photograph)
"""One laser-off image serves many photographs."""


def alike(image: NDArray[Any], off: NDArray[Any]) -> NDArray[Any]:
    """The laser-off image as colour where only the other shows colour. InputError: another size or type."""
    if image.ndim == 3 and off.ndim == 2:
        off = np.repeat(off[..., None], 3, axis=2)
    if image.shape[:2] != off.shape[:2] or image.dtype != off.dtype:
        subtract_off(image, off)  # raises
    return off if image.ndim == off.ndim else off.mean(axis=2).astype(off.dtype)


def look_at(paths: Sequence[Path], settings: ExtractionSettings, wishes: Wishes) -> Look:
    """Image files of one set -> how to measure them. Unreadable ones are passed over: who measures them tells.

    InputError: laser-off images that do not go with the images.
    """
    partners, how = pair_offs(paths, wishes.off)
    offs = dict(zip(paths, partners, strict=True))
    look = Look(settings, None, wishes.channel or "mono", wishes.region, offs, [], [], _named(wishes))
    look = replace(look, longest=wishes.longest)
    seen: dict[Path, Seen] = {}
    kept: dict[Path, Photograph] = {}
    turned: list[str] = []
    spread = np.unique(np.linspace(0, len(paths) - 1, min(ENOUGH, len(paths))).astype(int))
    for path in (paths[k] for k in spread):
        try:
            taken, off = look.read(path)
            image = mosaic(wishes.region.part(check_image(taken.pixels)), settings)
            dark = None if off is None else mosaic(wishes.region.part(off), settings)
            if not image.size:  # a raw image of less than two pixels a side
                continue
            closed = None if settings.pattern is not None else wishes.region.closed
            seen[path] = Seen(image, dark, taken.lossy, shrink(image, dark, closed))
        except InputError:
            continue
        turned += [taken.turned] if taken.turned else []
        if sum(one.pixels.nbytes for one in kept.values()) + taken.pixels.nbytes < KEPT:
            kept[path] = taken
    told = wishes.region.told() + ([("laser off", how)] if how else [])
    if turned:
        told.append(("upright", f"{', '.join(dict.fromkeys(turned))}, as EXIF says"))
    settings = settings.model_copy(update={"axis": wishes.axis or settings.axis})
    if not seen:
        return replace(look, settings=settings, told=told)
    evidence = find_evidence([one.shrunk for one in seen.values()], wishes.axis, wishes.colour)
    told = told_of(evidence, wishes.words) + told
    settings = settings.model_copy(update={"axis": evidence.axis, "channel": "auto"})
    if wishes.count_lines:
        settings = settings.model_copy(update={"peaks": evidence.lines})
    look = replace(look, settings=settings, told=told, warnings=warnings_of(evidence, wishes.words), kept=kept)
    if settings.pattern is not None:
        found = evidence.colour if evidence.colour != "mono" else "auto"
        return replace(look, settings=settings.model_copy(update={"channel": found}))
    channel, why = _measuring(list(seen.values()), evidence, wishes.channel)
    if any(one.image.ndim == 3 for one in seen.values()):
        told.append(("measured in", f"{channel} ({why})"))
    return replace(look, evidence=evidence, channel=channel, chains=dict(zip(seen, evidence.chains, strict=True)))


def _named(wishes: Wishes) -> str | None:
    return next((one for one in (wishes.channel, wishes.colour) if one in COLOURS), None)


def mosaic(image: NDArray[Any], settings: ExtractionSettings) -> NDArray[Any]:
    """A raw image (h, w) with a Bayer pattern -> colours (h/2, w/2, 3) to look at; others as they are."""
    if settings.pattern is None or image.ndim != 2:
        return image
    height, width = image.shape[0] // 2 * 2, image.shape[1] // 2 * 2
    planes: dict[str, list[NDArray[Any]]] = {letter: [] for letter in "RGB"}
    for k, letter in enumerate(settings.pattern):
        planes[letter].append(image[k // 2 : height : 2, k % 2 : width : 2])
    colours = np.empty((height // 2, width // 2, 3), np.float32)
    for k, letter in enumerate("RGB"):
        colours[..., k] = planes[letter][0]
        for more in planes[letter][1:]:
            colours[..., k] += more
        colours[..., k] /= len(planes[letter])
    return colours


def _measuring(seen: Sequence[Seen], evidence: Evidence, wished: Channel | None) -> tuple[Channel, str]:
    """The channel that scatters least about a smooth line, of those that see nearly all of it; and the reason."""
    pairs = zip(seen, (line for line, _ in evidence.chains), strict=True)
    coloured = [(one, line) for one, line in pairs if one.image.ndim == 3]
    if wished is not None or not coloured:
        return wished or "mono", "given"
    lossy = any(one.lossy for one, _ in coloured)
    names = channels_to_try(evidence.colour, evidence.combination.difference, lossy)
    if evidence.score < FAINT / 10.0:
        return names[0], "by default"
    scatters: dict[Channel, list[float]] = {name: [] for name in names}
    counts = dict.fromkeys(names, 0)
    for one, line in sorted(coloured, key=lambda pair: -pair[1].score)[:TRIED]:
        for name in names:
            tried = scatter_of(one.image, one.off, line, name, evidence.colour, evidence.axis, one.lossy)
            # what a mosaic moves all scan lines by makes none of them scatter
            moved = float(moved_by(name, tried.width, tried.height)) if lossy else 0.0
            scatters[name].append(math.hypot(tried.scatter, moved))
            counts[name] += tried.found
    typical = {name: float(np.median(scatters[name])) for name in names}
    # another colour has only what is left over of the light, and must see as good as all of it
    own = ALL_FOUND * counts.get(evidence.colour, 0)
    least_found = {name: own if name in COLOURS and name != evidence.colour else 1 for name in names}
    most = max(counts.values())
    enough = [name for name in names if counts[name] >= max(MOST_FOUND * most, least_found[name])]
    least = min((typical[name] for name in enough), default=np.inf)
    if not np.isfinite(least):
        return names[0], "by default"
    best = next(name for name in enough if typical[name] <= (1.0 + TIE) * least)
    listed = ", ".join(f"{name} {typical[name]:.2f}" for name in names if np.isfinite(typical[name]))
    what = "scatter along the line and the mosaic" if lossy else "scatter along the line"
    return best, f"{what}, px: {listed}"
