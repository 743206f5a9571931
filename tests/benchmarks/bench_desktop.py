"""How the desktop feels on the weld joint at full size: event loop, cancel, development, live picture, beside the bars.

Without a display a virtual one is used. Prints figures; nothing here passes or fails. Ticks are those of a 16 ms timer
in the window's thread: 62 a second when nothing disturbs it.
"""

from __future__ import annotations

import argparse
import itertools
import os
import sys
import time
from collections.abc import Callable
from itertools import chain
from pathlib import Path

from render.run import Run

os.environ.setdefault("QT_API", "pyside6")
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
from PySide6.QtCore import QEventLoop, QObject, Qt, QTimer
from PySide6.QtWidgets import QApplication
from virtual_display import display

from render.output.tone_mapping import pyramid
from render.progressive import refine
from render.world.world import build_world
from studio.project.document import Document
from studio.project.project import Project
from studio.qt.core.jobs import RENDER, JobRunner
from studio.qt.core.live_preview import live
from studio.qt.core.session import Session
from studio.qt.image.camera_view import CameraView
from studio.qt.render.develop_panel import DevelopPanel
from studio.qt.render.render_panel import RenderPanel
from studio.qt.scene.inspector import Inspector
from studio.scan.frame_views import picture, views
from studio.scan.kernel_warm_up import needed, warm_up
from studio.scan.redevelop import develop_again, development, measure_again

PROJECT = Path(__file__).parents[2] / "assets/projects/weld_seam/project.json"
TICK_MS = 16


class Ticker(QObject):
    """Counts the ticks of a timer and the longest time between two."""

    def __init__(self) -> None:
        super().__init__()
        self.times: list[float] = []
        self.timer = QTimer(self)
        self.timer.setTimerType(Qt.TimerType.PreciseTimer)
        self.timer.timeout.connect(lambda: self.times.append(time.perf_counter()))

    def watch(self, until: Callable[[], bool], seconds: float = 120.0) -> str:
        """Run the event loop until something is so; ticks a second, and the longest gap."""
        self.times = [time.perf_counter()]
        self.timer.start(TICK_MS)
        run_until(until, seconds)
        self.timer.stop()
        gaps = np.diff(self.times)
        if len(gaps) == 0:
            return "too short to tell"
        return f"{len(gaps) / gaps.sum():5.1f} ticks/s, longest gap {1e3 * gaps.max():4.0f} ms"


def run_until(until: Callable[[], bool], seconds: float = 120.0) -> None:
    loop, end = QEventLoop(), time.perf_counter() + seconds
    check = QTimer()
    check.timeout.connect(lambda: loop.quit() if until() or time.perf_counter() > end else None)
    check.start(5)
    loop.exec()
    check.stop()


def row(name: str, text: str, bar: str = "") -> None:
    print(f"{name:<48}{text:<44}{bar and 'bar ' + bar}", flush=True)


def after(seconds: float) -> Callable[[], bool]:
    end = time.perf_counter() + seconds
    return lambda: time.perf_counter() > end


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--project", type=Path, default=PROJECT)
    arguments.add_argument("--seconds", type=float, default=4.0, help="watched in each state")
    options = arguments.parse_args()
    app = QApplication([])
    project = Project.load(options.project)
    root = options.project.parent
    camera = project.scene.camera
    print(f"{camera.width} x {camera.height}, {len(os.sched_getaffinity(0))} processors, load {os.getloadavg()[0]:.1f}")
    ticker = Ticker()
    row("event loop, idle", ticker.watch(after(options.seconds)))

    # rendering alone
    runner, frames = JobRunner(), []
    world = build_world(project.scene, root)
    # ambient light to infinity, so that there is time to look
    long = project.render.model_copy(update={"ambient_samples": 65536, "ambient_error": 2e-4})

    warm_up(chain(*needed(project)), lambda stage, done: None, lambda: False)

    def render(progress, cancelled):  # type: ignore[no-untyped-def]
        world.__dict__.pop("rays", None)
        frames.clear()
        for frame in refine(world, project.scene, settings=long, progress=progress, run=Run(cancelled=cancelled)):
            frames.append(frame)

    runner.run(RENDER, "render", render)
    row("event loop, first frame", ticker.watch(lambda: len(frames) > 0), "55")
    row("event loop, laser light and truth", ticker.watch(lambda: frames[-1].ambient is not None), "55")
    row("event loop, ambient light", ticker.watch(after(options.seconds)), "55")
    runner.cancel()
    run_until(lambda: not runner.busy)

    # cancel, at moments spread over the stages
    waits = []
    for delay in np.linspace(0.02, 3.5, 24):
        runner.run(RENDER, "render", render)
        job = runner.job()
        assert job is not None
        run_until(after(float(delay)))
        start = time.perf_counter()
        job.cancel()
        job.join()
        waits.append((time.perf_counter() - start, job.stage))
        run_until(lambda: not runner.busy)
    worst = max(waits)
    typical = float(np.median([seconds for seconds, _ in waits]))
    row(
        "cancel, until the thread has ended",
        f"median {1e3 * typical:.0f} ms, worst {1e3 * worst[0]:.0f} ms ({worst[1]})",
        "100 ms",
    )
    runner.close()

    # the panels together
    session = Session(Document(project, root=root))
    view, develop, runner = CameraView(session), DevelopPanel(session), JobRunner()
    panel = RenderPanel(session, runner)
    for widget, size in ((view, (900, 700)), (develop, (330, 460)), (panel, (340, 700))):
        widget.resize(*size)
        widget.show()
    run_until(lambda: not live(session).is_loading)
    session.set(("render", "ambient_samples"), 4)
    panel.start()
    row("event loop, a render with all its panels", ticker.watch(lambda: runner.job() is None), "55")
    run_until(lambda: not develop.busy)
    shown = session.shown
    assert shown is not None

    # development
    how, seconds = development(shown.project, project), []
    busy = time.process_time()
    for _ in range(12):
        start = time.perf_counter()
        images = develop_again(shown.frame, how)
        seconds.append(time.perf_counter() - start)
    busy = (time.process_time() - busy) / len(seconds)
    row(
        "development of the frame",
        f"least {1e3 * min(seconds):.0f} ms, of all processors {1e3 * busy:.0f} ms",
        "150 ms",
    )
    start = time.perf_counter()
    view_of = views(project.scene, shown.frame)[0]
    made = picture(view_of, project.scene, shown.frame, images, True)
    assert made is not None
    pyramid(made)
    row("picture of it for the screen", f"{1e3 * (time.perf_counter() - start):.0f} ms")
    methods = develop.chosen()
    start = time.perf_counter()
    measure_again(shown.frame, shown.world, how, images, methods, cancelled=lambda: False)
    row(f"line, points and errors by {len(methods)} methods", f"{1e3 * (time.perf_counter() - start):.0f} ms")

    # exposure dragged: newest wins
    told: list[float] = []
    session.developed.connect(lambda: told.append(time.perf_counter()))
    values = itertools.cycle(np.geomspace(1e-3, 8e-3, 50))
    drag = QTimer()
    drag.timeout.connect(lambda: session.set(("sensor", "exposure_time"), float(next(values)), "drag", "drag"))
    drag.start(20)
    row("event loop, exposure dragged", ticker.watch(after(options.seconds)), "55")
    drag.stop()
    row("  new images while dragging", f"{len(told) / options.seconds:.1f} a second")
    run_until(lambda: not develop.busy)

    # a number dragged in the inspector
    session.show(None)
    inspector = Inspector(session)
    inspector.show()
    session.select(("scene", "rig", "lasers", 0))
    app.processEvents()
    editor = inspector.form.rows[("scene", "rig", "lasers", 0, "T_rig_laser")][0].editor.fields[0]  # type: ignore[attr-defined]
    steps = []
    for i in range(50):
        start = time.perf_counter()
        editor.dragged.emit(0.2 + 0.001 * i)
        steps.append(time.perf_counter() - start)
    row("a number dragged in the inspector", f"median {1e3 * np.median(steps):.1f} ms a step", "33 ms")

    # the live picture
    pose = project.scene.lasers[0].T_rig_laser
    steps = []
    session.begin_drag()
    for i in range(40):
        x, y, z = pose.translation
        moved = pose.model_copy(update={"translation": (x + 1e-4 * i, y, z)})
        start = time.perf_counter()
        session.set(("scene", "rig", "lasers", 0, "T_rig_laser"), moved, "move", "move")
        live(session).refresh()
        steps.append(time.perf_counter() - start)
        app.processEvents()
    session.end_drag()
    row(
        "a dragged laser: look, curve and live picture",
        f"median {1e3 * np.median(steps):.0f} ms, worst {1e3 * max(steps):.0f} ms",
        "33 ms",
    )
    for widget in (view, develop, panel, inspector):
        widget.close()
    live(session).close()
    runner.close()


if __name__ == "__main__":
    with display():
        main()
