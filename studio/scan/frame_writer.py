"""Frames written while the next one is rendered: on a thread of its own, in their order, one at a time."""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from types import TracebackType

import numpy as np
from numpy.typing import NDArray

from analysis.line.extract import CANDIDATES
from render.checkpoint import RenderState
from render.frame import Frame
from render.output.band import band_about
from render.output.frame_files import write_frame
from render.sensor.develop import Image, develop
from studio.project.project import Project
from studio.scan import scan_folder
from studio.scan.line_extraction import extract_line
from studio.scan.options import Scan
from studio.scan.rendered_from import made_of
from studio.scan.resume import settle


class FrameWriter:
    """Writes the frames of a scan as its options say; with the one that is written, two are in memory at most."""

    def __init__(self, scan: Scan) -> None:
        self.files: list[Path] = []
        """All that are written, in their order."""
        self.names: list[str] = []
        """Of their sidecars."""
        self._scan = scan
        self._thread = ThreadPoolExecutor(1, "frame writer")
        self._under_way: Future[list[Path]] | None = None

    def __enter__(self) -> FrameWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """The frame under way is written first, also where the scan was stopped."""
        self._thread.shutdown(wait=True)

    def add(self, frame: Frame, state: RenderState, images: list[Image]) -> None:
        """Begin to write a frame, once the one before is there. Raises what became of that one, as `write_frame`."""
        with self._scan.clock.stage("writing frames"):
            self._finish()
            if self._scan.options.frames != "none":
                self._under_way = self._thread.submit(_write, self._scan, frame, state, images)

    def finish(self) -> None:
        """Wait for the last frame. Raises as `add`."""
        with self._scan.clock.stage("writing frames"):
            self._finish()

    def _finish(self) -> None:
        under_way, self._under_way = self._under_way, None
        if under_way is not None:
            files = under_way.result()
            self.files += files
            self.names.append(files[-1].name)


def _write(scan: Scan, frame: Frame, state: RenderState, images: list[Image]) -> list[Path]:
    """The frame's files; its state goes, or stays, once they are there."""
    project, whole = scan.project, scan.options.frames == "all"
    files = write_frame(
        scan.begun.folder,
        scan_folder.frame_stem(frame.step),
        frame,
        _together(project, frame, images) if whole else None,
        project.scene,
        sensor=project.sensor,
        made_of=made_of(project, state.marks, scan.begun.inputs),
        band=None if whole else line_band(project, frame, images),
    )
    settle(frame, state)
    return files


def line_band(project: Project, frame: Frame, images: list[Image]) -> NDArray[np.bool_]:
    """(h, w): the pixels about the exact line of each laser, and about all peaks that are found in its image."""
    # by the quickest method: it is the detection, the same for all, that tells where peaks are
    settings = {
        "peaks": CANDIDATES,
        "select": "strongest",
        "geometry": False,
        "spacetime": False,
        "smooth_along": False,
    }
    extraction = project.extraction.model_copy(update=settings)
    every = project.model_copy(update={"extraction": extraction})
    lines = [(curve.index.astype(np.float64), curve.position) for curve in frame.curves]
    for laser, image in enumerate(images):
        line = extract_line(every, image, laser, 1, "centre_of_mass")
        lines.append((line.v.ravel(), line.u.ravel()))
    return band_about(frame.shape, extraction.axis, lines)


def _together(project: Project, frame: Frame, images: list[Image]) -> Image:
    """The image to keep as a file: the only laser's own, else one with all lasers at once."""
    if len(images) == 1:
        return images[0]
    return develop(frame, project.scene, project.sensor, seed=project.seed)
