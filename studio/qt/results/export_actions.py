"""The export menu: asks where to, and lets a job write it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QFileDialog, QWidget

from analysis.line.settings import Method
from analysis.report.colour import method_name
from render.base.threads import Cancel
from render.output.frame_files import black_in_viewers
from studio.qt.core.actions import Actions
from studio.qt.core.dialogs import show_trouble
from studio.qt.core.jobs import RENDER, JobRunner
from studio.qt.core.render import Render
from studio.qt.core.scan_progress import scan_progress
from studio.qt.core.scan_steps import scan_steps
from studio.qt.core.session import Session
from studio.runtime.error_messages import trouble
from studio.runtime.jobs import Job, Progress
from studio.runtime.preferences import PreferencesFile
from studio.scan.film import export_film
from studio.scan.height_map import export_height_map, left_out_of
from studio.scan.logo import logo_remarks
from studio.scan.own_files import check_replaceable
from studio.scan.redevelop import Development, develop_again, development, measure_again
from studio.scan.remarks import scale_notes
from studio.scan.scan_results import ScanResults
from studio.scan.stages import Clock

if TYPE_CHECKING:
    from studio.project.project import Project
    from studio.scan.export import Exported, Writer

KEEP_ALL = "The export of the Height map tab (Alt+Z) keeps them by All heights."
KINDS = {
    "export_html": ("Report (*.html)", ".html", "report"),
    "export_pdf": ("Report (*.pdf)", ".pdf", "report"),
    "export_exr": ("OpenEXR frame (*.exr)", ".exr", "frame"),
    "export_png": ("PNG image (*.png)", ".png", "image"),
    "export_ply": ("PLY points, metres (*.ply)", ".ply", "points"),
    "export_csv": ("CSV table, metres (*.csv)", ".csv", "points"),
    "export_pcd": ("PCD points, metres (*.pcd)", ".pcd", "points"),
    "export_xyz": ("XYZ points, metres (*.xyz)", ".xyz", "points"),
    "export_las": ("LAS points, metres (*.las)", ".las", "points"),
    "export_e57": ("E57 points, metres (*.e57)", ".e57", "points"),
    "export_film": ("Film (*.mp4)", ".mp4", "film"),
    "export_heightmap": ("Height map, 16 bit (*.png)", ".png", "height map"),
}
"""Command -> filter of the file dialog, suffix, what it is."""
LANE = "export"
WHOLE = ("report", "points")
"""What is of all steps of a scan while the figures on the screen are."""


class ExportActions(QObject):
    """Follows the session, so that nothing can be exported that is not there."""

    def __init__(
        self, window: QWidget, session: Session, runner: JobRunner, preferences: PreferencesFile, actions: Actions
    ) -> None:
        super().__init__(window)
        self.window, self.session, self.runner, self.preferences = window, session, runner, preferences
        self.actions = actions
        for key in KINDS:
            actions.connect(key, partial(self.ask, key))
        actions.connect("screenshot", self.screenshot)
        for signal in (session.renders_changed, session.measured, session.developed):
            signal.connect(self.refresh)
        self._jobs: list[Job[list[Path]]] = []
        """That run, or wait for others."""
        self.whole: Callable[[], ScanResults | None] = lambda: None
        """The scan of whose steps together the figures on the screen are."""
        runner.cancelled.connect(self._tell_cancelled)
        self.refresh()

    def follow(self, results: Any) -> None:
        """The panel that says whether figures are of a step or of all."""
        self.whole = lambda: results.scan_bar.whole

    def refresh(self) -> None:
        """Offer what can be had."""
        render = self.session.shown
        for key, (_, _, what) in KINDS.items():
            self.actions[key].setEnabled(render is not None and _is_there(what, render))

    def ask(self, key: str) -> None:
        """Ask for a file, then write it."""
        name_filter, suffix, _ = KINDS[key]
        render = self.session.shown
        # the name says what the figures inside are of
        size = f" at {render.scanner_scale:.3g} x" if render is not None and render.scanner_scale != 1.0 else ""
        name = f"{self.session.project.name.replace('/', '-')}{size}{suffix}"
        start = str(self.session.last_place / name)
        title = f"Export {self._of_what(key)}".strip()
        chosen, _ = QFileDialog.getSaveFileName(self.window, title, start, name_filter)
        if chosen:
            path = Path(chosen)
            self.write(key, path if path.suffix.lower() == suffix else path.with_name(path.name + suffix))

    def write(self, key: str, path: Path) -> None:
        """Write in the background; the message says what was written."""
        from studio.scan import export

        render = self.session.shown
        if render is None:
            return
        now = render.developed_by(self.session.project)
        how = development(render.project, now, render.image_scale)
        kind, current, noise = KINDS[key][2], render.is_measured(how), render.noise
        whole = self.whole() if kind in WHOLE else None
        of = self._of_what(key)
        shown = export.Exported(
            how.powered,
            render.project,
            self.session.document.root,
            render.world,
            render.frame,
            tuple(render.images),
            dict(render.measurements),
            render.scanner_scale,
            repeatable=render.repeatable(now),
            finished=render.final and not render.frame.unfinished,
            part_of=f"This is {of} in {render.scan.found.folder.name} alone." if render.scan is not None else "",
        )
        writers: dict[str, export.Writer] = {
            "report": export.export_report,
            "frame": export.export_frame,
            "image": export.export_image,
            "points": export.export_points,
            "height map": partial(export_height_map, render.scan),
        }

        def work(progress: Progress, cancelled: Cancel) -> list[Path]:
            progress("", 0.0)  # how far it is, nobody knows, and the job's name has the file's
            writers["film"] = partial(export_film, render.scan, progress=progress, cancelled=cancelled)
            writer = writers[kind]
            if whole is not None:
                clock = Clock(scan_progress(progress, whole.count), cancelled)
                writer = _of_all_steps(kind, whole, how.powered, shown.root, clock)
            as_shown = whole is not None or current or kind in ("frame", "height map", "film")
            what = shown if as_shown else _measured(shown, how, noise, cancelled)
            if kind == "height map":  # nobody was asked about the file beside the picture
                check_replaceable([path.with_suffix(".json")])
            written = export.export_unless(cancelled, writer, path, what)
            if kind == "image" or (kind == "frame" and len(what.images) == 1):
                known.extend(filter(None, [black_in_viewers(what.images[0].bits)]))
            if kind == "height map" and (beyond := left_out_of(written[1])):
                left_out.append(f"{beyond} {KEEP_ALL}")
            return written

        left_out: list[str] = []
        known = list(scale_notes(render.scanner_scale))
        notes = logo_remarks(now, self.session.document.root) if kind == "report" else []

        def then(written: list[Path]) -> None:
            if kind == "report" and whole is None:
                render.report = written[0]
            method = (how.project if whole is None else scan_steps(self.session).measured_as(render)).extraction.method
            own = "the project's own method" if whole is None else "as the scan was measured last"
            said = f", the points in metres by {method_name(method)}, {own}" if kind == "points" else ""
            self._tell(written, said + (f", of {of}" if of else ""), (*notes, *left_out), known)

        self._tell_wait(path)
        job = self.runner.run(LANE, f"export {path.name}", work, then, in_turn=True)
        self._jobs = [job, *(before for before in self._jobs if before in self.runner.jobs(LANE))]
        self.session.chose(path)

    def _tell_wait(self, path: Path) -> None:
        """At once, where it will take a while: the status bar shows the render, and not what is written beside it."""
        running, rendering = self.runner.job(LANE), self.runner.job(RENDER)
        if running is not None:
            told = f"{path.name} is written after: {', '.join(job.name for job in self.runner.jobs(LANE))}"
        elif rendering is not None:
            told = f"{path.name} is being written beside the {rendering.name}, which takes longer"
        else:
            return
        self.session.message.emit("info", f"{told}. A message tells when it is there")

    def _of_what(self, key: str) -> str:
        """Of a scan: "all 8 steps", or "step 3 of 8"."""
        render, kind = self.session.shown, KINDS[key][2]
        if render is None or render.scan is None or kind in ("film", "height map"):
            return ""
        count = render.scan.count
        if kind in WHOLE and self.whole() is not None:
            return f"all {count} steps"
        return f"step {render.frame.step + 1} of {count}"

    def screenshot(self) -> None:
        """The window as it is, as a PNG."""
        picture = self.window.grab()  # before the dialog covers it
        start = str(self.session.last_place / f"{self.session.project.name}.png")
        chosen, _ = QFileDialog.getSaveFileName(self.window, "Save the screenshot", start, "PNG image (*.png)")
        if not chosen:
            return
        path = Path(chosen).with_suffix(".png")
        if picture.save(str(path)):
            self.session.message.emit("info", f"Wrote {path}")
        else:
            error = OSError(None, "the file cannot be written", str(path))
            show_trouble(self.window, trouble(error, "save the screenshot"))

    def _tell_cancelled(self, job: Job[list[Path]]) -> None:
        if job in self._jobs:
            self.session.message.emit("info", f"Cancelled: {job.name}. No file was written")

    def _tell(self, written: list[Path], of: str, notes: tuple[str, ...], known: Sequence[str]) -> None:
        """notes: what a file has not as was asked; known: what is so of what was asked, and no warning."""
        # of a message of several lines the bar shows the first: it has the reason for its colour
        first = ". ".join([f"Wrote {', '.join(str(path) for path in written)}{of}", *notes])
        self.session.message.emit("warning" if notes else "info", "\n".join([first, *known]))


def _is_there(what: str, render: Render) -> bool:
    """What is exported of a render can be had."""
    if what == "film":
        return render.scan is not None
    if what == "height map":
        return render.scan is not None and render.scan.measured
    return what == "frame" or bool(render.images if what == "image" else render.measurements)


def _of_all_steps(kind: str, scan: ScanResults, project: Project, root: Path, clock: Clock) -> Writer:
    from studio.scan import whole_scan

    if kind == "points":
        return partial(whole_scan.export_scan_points, scan)
    return partial(whole_scan.export_scan_report, scan, project, root, clock)


def _measured(shown: Exported, how: Development, noise: bool, cancelled: Cancel) -> Exported:
    """Developed and measured like this: what is shown lags behind a setting just changed, or light just refined."""
    images = develop_again(shown.frame, how, noise=noise, cancelled=cancelled)
    others = [method for method in get_args(Method) if method in shown.measurements]
    methods = tuple(dict.fromkeys([how.project.extraction.method, *others]))
    found = measure_again(shown.frame, shown.world, how, images, methods, cancelled=cancelled)
    return replace(shown, images=tuple(images), measurements=found)
