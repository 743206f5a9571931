"""What is kept of a scan while its frames come and go, in memory that does not grow with them but for a few numbers."""

from __future__ import annotations

import pickle
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from analysis.gauges.of_scan import Patch, read_scan
from analysis.gauges.read import Reading
from analysis.gauges.steps import over_steps
from analysis.measures import Measures
from analysis.report.frame_result import FrameResult, frame_rmse
from analysis.report.sample import IMAGE, MOST_LINES, ROW, Rows, Sample, rows_of
from analysis.report.sums import Sums
from analysis.report.total import Chosen, depth_measures
from analysis.spool import Spool
from render.base.counts import INDIRECT_ERROR, OF_GROUPS, UNASKED_INDIRECT_ERROR, Quantity
from render.scene.scene import Scene


@dataclass(frozen=True)
class LaserStep:
    """One laser at one step, by the first method."""

    rmse: float
    """RMSE of depth_z, m."""
    bias: float
    completeness: float


@dataclass(frozen=True)
class StepResult:
    """One step in a few numbers, all lasers together, by the first method."""

    step: int
    points: int
    completeness: float
    depth_z: Measures
    lasers: tuple[LaserStep, ...]


class ScanRecord:
    """What report and summary need of a scan's frames.

    Sums are exact; quantiles come from a sample, which is the whole scan where that fits. Some frames, those whose
    images are there, wait in a file for the report to show one of them.
    """

    def __init__(self, scene: Scene, folder: Path | None = None, *, most_lines: int = MOST_LINES) -> None:
        """folder: for the files of frames and sample, as `Spool`. most_lines: scan lines that the sample holds."""
        self.scene = scene
        self.steps: list[StepResult] = []
        self._readings: list[Reading] = []
        self._patches: list[Patch] = []
        self._of_all: tuple[Reading, ...] | None = None
        """Read from these when they are asked for, once; None: not since the last frame."""
        self.seconds: dict[str, float] = {}
        """Wall time of the frames by stage, s."""
        self.counts: dict[Quantity, tuple[float, int]] = {}
        """Sum over the frames, and number of frames that have it."""
        self._sums: dict[tuple[int, int], Sums] = {}
        self._sample = Sample(most_lines, folder)
        self._spool = Spool(folder)
        self._waiting: list[tuple[float, int, int]] = []
        """Depth RMSE, start and size in the spool of the frames with images."""
        self._first: tuple[int, int] = (0, 0)

    def add(self, frame: FrameResult) -> None:
        """InputError: as `Spool.append`."""
        self._keep(frame)
        firsts = []
        for i, laser in enumerate(frame.lasers):
            rows = [rows_of(one, self.scene, frame.step) for one in laser.extractions]
            for k, extraction in enumerate(laser.extractions):
                self._sums.setdefault((i, k), Sums()).add(extraction)
            self._sample.add(i, max(len(one.line.u) for one in laser.extractions), rows)
            firsts.append(rows[0])
        self.steps.append(_step(frame, firsts))
        self._readings += frame.readings
        self._patches += frame.patches
        self._of_all = None
        for stage, spent in frame.seconds.items():
            self.seconds[stage] = self.seconds.get(stage, 0.0) + spent
        for quantity, value in (*frame.counts.items(), *self._group_counts(frame)):
            so_far, frames = self.counts.get(quantity, (0.0, 0))
            self.counts[quantity] = so_far + value, frames + 1

    @property
    def readings(self) -> list[Reading]:
        """Of the project's measures: in the order of the steps, as of `over_steps`, then those of all steps."""
        if self._of_all is None:
            self._of_all = read_scan(self._patches)
        return [*over_steps(self._readings), *self._of_all]

    @staticmethod
    def _group_counts(frame: FrameResult) -> Iterator[tuple[Quantity, float]]:
        """What is counted of the light groups; lasers by their order, since a project measured anew may name others."""
        for group, quantities in OF_GROUPS.items():
            for i, one in enumerate(one for one in frame.quality if one.group == group):
                for name, quantity in quantities.items():
                    # of light for the line the error is of its position, in sigmas
                    value = one.image_error if name == "error" and one.of == "line" else getattr(one, name)
                    told = UNASKED_INDIRECT_ERROR if one.of == "line" and quantity == INDIRECT_ERROR else quantity
                    if value is not None and value == value:  # an error may not be known
                        yield told if one.laser is None else told.of(i), float(value)

    def close(self) -> None:
        self._spool.close()
        self._sample.close()

    def _keep(self, frame: FrameResult) -> None:
        whole = all(laser.image is not None for laser in frame.lasers)
        if whole or not self.steps:
            data = pickle.dumps(frame, protocol=pickle.HIGHEST_PROTOCOL)
            place = self._spool.append(data), len(data)
            self._first = self._first if self.steps else place
            if whole:
                self._waiting.append((frame_rmse(frame), *place))

    def chosen(self, laser: int | None = None, method: int = 0) -> Chosen:
        """Sums and sample of one method's lines, of one laser or of all."""
        sums = Sums()
        for (i, k), part in self._sums.items():
            if laser in (None, i) and method == k:
                sums.merge(part)
        kept, seen = self._sample.lines(laser)
        return Chosen(sums, self._sample.rows(laser, method), kept, seen)

    def method_count(self, laser: int) -> int:
        """Number of methods that measured a laser."""
        return sum(1 for i, _ in self._sums if i == laser)

    def shown_frame(self) -> FrameResult:
        """The frame to show in detail: of those with images the one of median depth RMSE, else the first."""
        measured = sorted((one for one in self._waiting if np.isfinite(one[0])), key=lambda one: one[0])
        shown = measured[len(measured) // 2 :] or self._waiting
        place = shown[0][1:] if shown else self._first
        frame: FrameResult = pickle.loads(self._spool.read(*place))  # our own, from a file that has no name
        return frame


def record_of(scene: Scene, frames: Iterable[FrameResult], folder: Path | None = None) -> ScanRecord:
    """The record of frames that are all in memory."""
    record = ScanRecord(scene, folder)
    for frame in frames:
        record.add(frame)
    return record


def _step(frame: FrameResult, rows: list[Rows]) -> StepResult:
    """rows: of each laser, by the first method."""
    errors = [laser.extractions[0].errors for laser in frame.lasers]
    for i, part in enumerate(rows):
        part["index"] += IMAGE * i
    truth = sum(one.truth_rows for one in errors)
    return StepResult(
        step=frame.step,
        points=sum(int(np.count_nonzero(part["valid"])) for part in rows),
        completeness=sum(one.measured_rows for one in errors) / truth if truth else float("nan"),
        depth_z=depth_measures(np.concatenate([np.empty(0, ROW), *rows])),
        lasers=tuple(LaserStep(one.depth_z.rmse, one.depth_z.bias, one.completeness) for one in errors),
    )
