"""Opens, edits, renders, measures and exports in a loop: memory and threads after the first cycle and at the end.

    python tests/benchmarks/bench_soak.py [minutes]      default: 2

Bar: memory within 5 % of its level after the first cycle, no thread more, no warning of Qt or VTK. Without a display a
virtual one is used.
"""

from __future__ import annotations

import os
import resource
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from virtual_display import display

ROOT = Path(__file__).resolve().parents[2]
BAR = 0.05
TEMPLATES = ("step_block", "weld_seam", "sphere")
LASER = ("scene", "rig", "lasers", 0)
ROUNDS = 3
"""Of every template in a cycle: after so many all bounded caches are full."""
SCALE = 0.125


def main() -> int:
    minutes = float(sys.argv[1]) if len(sys.argv) > 1 else 2.0
    with display(), tempfile.TemporaryDirectory() as home:
        os.environ.update(XDG_CONFIG_HOME=f"{home}/config", XDG_STATE_HOME=f"{home}/state")
        good = soak(60.0 * minutes, Path(home))
    return 0 if good else 1


def soak(seconds: float, folder: Path) -> bool:
    from PySide6.QtCore import QCoreApplication, QEvent, qInstallMessageHandler

    from studio.qt.shell import app as desktop
    from studio.qt.shell.file_actions import template as new

    app = desktop.application()
    desktop.FIRST_LOOK_MS = 10**8
    window = desktop.start(None)
    if window.tour is not None:
        window.tour.end()
    warnings: list[str] = []
    qInstallMessageHandler(lambda kind, context, text: warnings.append(text))

    def wait(done: Callable[[], bool], limit: float = 300.0) -> None:
        until = time.monotonic() + limit
        finished = False
        while not finished:
            app.processEvents()
            # what is deleted later waits for a running event loop, and here is none
            QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
            time.sleep(0.002)
            finished = done()
            if time.monotonic() > until:
                raise TimeoutError("the desktop did not get there")

    # the first cycle fills every cache; it is the level to come back to
    began, cycles = time.monotonic(), 0
    first_memory = first_threads = 0
    while cycles < 2 or time.monotonic() - began < seconds:
        for template in ROUNDS * TEMPLATES:
            cycle(window, template, folder, wait)
        settled = time.monotonic() + 1.5
        window.files.replace(new(TEMPLATES[0], window.files.autosave))
        wait(lambda settled=settled: time.monotonic() > settled)
        cycles += 1
        now, threads = memory_mb(), threading.active_count()
        if cycles == 1:
            first_memory, first_threads = now, threads
        print(f"cycle {cycles}: {now} MB, {threads} threads, {time.monotonic() - began:.0f} s", flush=True)
    change = now / first_memory - 1.0
    good = change <= BAR and threads <= first_threads and not warnings
    window.files.count_as_saved(window.session.project)
    window.close()
    app.processEvents()
    print(f"memory {first_memory} -> {now} MB ({change:+.1%}, bar {BAR:.0%}) over {cycles} cycles")
    print(f"threads {first_threads} -> {threads}; warnings: {warnings[:5] or 'none'}; peak {peak_mb()} MB")
    print("met" if good else "missed")
    return good


def cycle(window: object, template: str, folder: Path, wait: Callable[..., None]) -> None:
    """What a person does in some minutes, on one project."""
    from studio.qt.core.live_preview import live
    from studio.qt.shell.file_actions import template as new
    from studio.qt.shell.window import MainWindow

    assert isinstance(window, MainWindow)
    session = window.session
    window.files.replace(new(template, window.files.autosave))
    wait(lambda: not live(session).is_loading)
    window.switch_to("setup")
    session.select(LASER)
    session.begin_drag()
    for i in range(30):
        session.set((*LASER, "fan_angle"), 0.5 + 0.01 * i, "drag", "drag")
        wait(lambda: True)
    session.end_drag()
    for _ in range(5):
        session.document.undo()
        session.document.redo()
    window.switch_to("render")
    window.panels["render"].start(SCALE)  # type: ignore[attr-defined]
    wait(lambda: session.shown is not None and session.shown.final and not window.runner.busy)
    wait(lambda: bool(session.shown and session.shown.measurements))
    session.set(("sensor", "exposure_time"), session.project.sensor.exposure_time * 0.8)
    window.switch_to("measure")
    for row in range(0, 200, 5):
        session.hover(row)
        wait(lambda: True)
    for key, name in (("export_csv", "points.csv"), ("export_png", "image.png"), ("export_exr", "frame.exr")):
        window.exports.write(key, folder / name)
        wait(lambda: not window.runner.busy)
    window.files.keep()
    for theme in ("dark", "light"):
        window.choose_theme(theme)
        wait(lambda: True)


def memory_mb() -> int:
    """Resident, as the system counts it."""
    statm = Path("/proc/self/statm")
    if statm.exists():
        return round(int(statm.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20)
    return peak_mb()


def peak_mb() -> int:
    return round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (2**10 if sys.platform != "darwin" else 2**20))


if __name__ == "__main__":
    sys.exit(main())
