"""The measuring half of a scan: frames come and go, points go to disk, and a few numbers a frame stay."""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np

from analysis.cloud import SpooledCloud, cloud, write_csv, write_ply
from analysis.line.selection.learned import UNLIKE
from analysis.line.settings import Method
from analysis.report.frame_result import FrameResult
from analysis.report.picture import Drawing
from analysis.report.record import ScanRecord
from render.frame import Frame
from render.sensor.develop import Image
from render.world.world import World
from studio.project.date_and_time import now
from studio.project.project import Project
from studio.scan.gauging import write_measures
from studio.scan.image_lacks import image_lacks
from studio.scan.remarks import result_remarks
from studio.scan.results import compared_methods, measure_frame, report_input
from studio.scan.spacetime_window import Passing, Sweep, Taken
from studio.scan.stages import Clock

IMAGES_KEPT = 16
"""Of a long scan only so many frames wait for the report with their images, evenly spread."""
MOST_NOTES = 12


class Measuring:
    """Measures the frames of a scan in their order, each as soon as it can be."""

    def __init__(
        self,
        project: Project,
        folder: Path,
        clock: Clock,
        threads: int | None,
        count: int,
        each: Callable[[FrameResult], None] = lambda frame: None,
        *,
        compare_all: bool = True,
        report: bool = False,
    ) -> None:
        """folder: what does not stay in memory is in unnamed files there; count: of frames to come; each: hears of
        every frame once it is measured; compare_all: all frames are measured by the other methods too, else those
        alone whose images wait for the report; report: one is to come, whose drawing begins with the last frame.

        InputError: lines are to be measured along time, and nothing moves.
        """
        self.record = ScanRecord(project.scene, folder)
        self._project, self._clock, self._threads, self._each = project, clock, threads, each
        self._sweep = Sweep(project)
        self._points = SpooledCloud(folder)
        self._notes: list[Counter[str]] = [Counter() for _ in project.scene.lasers]
        self._compared: tuple[Method, ...] | None = None
        self._shown = set(np.linspace(0, count - 1, min(count, IMAGES_KEPT)).astype(int).tolist())
        self._compare_all = compare_all
        self.lacks: dict[str, str] = {}
        """As of `image_lacks`, by the first frames that tell."""
        self._last = count - 1 if report else None
        self._drawing: Drawing | None = None

    def add(self, frame: Frame, world: World, images: list[Image]) -> None:
        """The next frame with an image for each laser."""
        self._take(self._sweep.add(frame, world, images))

    def finish(self) -> None:
        """No more frames come."""
        self._take(self._sweep.finish())

    def _take(self, ready: Iterable[tuple[Taken, Passing | None]]) -> None:
        for one, passing in ready:
            if len(self.record.steps) == self._last:
                self._drawing = Drawing()
                threading.Thread(target=_prepare_report, name="report", daemon=True).start()
            shown = len(self.record.steps) in self._shown
            result = measure_frame(
                self._project,
                one.frame,
                one.world,
                one.images,
                self._clock,
                self._threads,
                keep=shown,
                passing=passing,
                compared=self._compared if shown or self._compare_all else (),
            )
            if self._compared is None:
                self._compared = compared_methods(result)
            chosen = [laser.extractions[0] for laser in result.lasers]
            self.lacks = image_lacks(self._project, chosen, self.lacks, result.step)
            for i, laser in enumerate(result.lasers):
                best = laser.extractions[0]
                self._points.add(cloud(best.points, best.errors, i, result.step, self._project.scene))
                self._notes[i][best.line.note] += 1
                _bound(self._notes[i])
            self.record.add(result)
            self._each(result)

    def notes(self) -> list[str]:
        """What was done to find each laser's line beyond its method, and in how many frames."""
        notes, frames = [], len(self.record.steps)
        for laser, of_laser in zip(self._project.scene.lasers, self._notes, strict=True):
            for note, times in of_laser.items():
                if note:
                    where = f" in {times} of {frames} frames" if times < frames else ""
                    notes.append(f"Line of {laser.name}{where}: {note}.")
        compared = min(len(self._shown), frames)
        if self._compared and not self._compare_all and compared < frames:
            notes.insert(0, f"Other methods, to compare with, measured {compared} of {frames} frames.")
        return notes[:MOST_NOTES]

    def remarks(self) -> list[str]:
        """What the results say beyond themselves, and images that the chooser did not judge."""
        unlike = [note for note in self.notes() if UNLIKE in note]
        return [*self.lacks.values(), *result_remarks(self.record), *unlike]

    def write_points(self, out: Path) -> list[Path]:
        """points.ply and points.csv of all frames and lasers, by the project's method, at the first step's pose.

        And measures.csv, where the project has measures.
        """
        with self._clock.stage("writing points"):
            write_ply(out / "points.ply", self._points)
            write_csv(out / "points.csv", self._points)
            if not self._project.measures:
                return [out / "points.ply", out / "points.csv"]
            write_measures(out / "measures.csv", self.record.readings)
        return [out / "points.ply", out / "points.csv", out / "measures.csv"]

    def write_reports(
        self,
        out: Path,
        world: World,
        *,
        logo_folder: Path,
        notes: Sequence[str],
        created: str | None = None,
        image_scale: float = 1.0,
        run: str = "",
    ) -> list[Path]:
        """report.html and report.pdf; `world` is that of step 0, `run` as of `run_text`."""
        from analysis.report.write import write_report

        data = report_input(
            self._project.in_folder(logo_folder),
            world,
            self.record,
            self._clock.seconds,
            notes=[*notes, *self.lacks.values(), *self.notes()],
            created=created or now(),
            image_scale=image_scale,
            run=run,
        )
        with self._clock.stage("report"):
            return list(write_report(out, data, self._drawing))

    def close(self) -> None:
        """Let go of what is on disk."""
        self.record.close()
        self._points.close()
        if self._drawing is not None:
            self._drawing.stop()


def _prepare_report() -> None:
    """Load what a report stands on, which takes most of a second."""
    from analysis.report.write import prepare_report

    prepare_report()


def _bound(notes: Counter[str]) -> None:
    """Keep the first notes only, so that figures in them cannot make a long scan grow."""
    if len(notes) > MOST_NOTES + 1:
        notes.popitem()
