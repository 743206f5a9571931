"""Starts the window again and again with the panels of another screen, and switches workspaces while it renders.

    python tests/benchmarks/bench_switches.py [switches] [starts]      default: 250 5; a release: 2000 40

Every start is a process of its own, on one of three screen sizes, with the arrangements that the start before left on
another one; between switches panels are floated, put upon each other, shown, hidden and resized, and frames rendered.
Two busy processes are the load. Bar: no start ends by a signal, with a fault or not at all.
"""

from __future__ import annotations

import faulthandler
import multiprocessing
import os
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from virtual_display import display

SCREENS = (((1280, 800), "1"), ((1920, 1200), "1.5"), ((2560, 1440), "2"), ((1920, 1200), "1"), ((2560, 1440), "1.5"))
"""Size, px, and QT_SCALE_FACTOR, in turn: never the screen of the start before."""
BUSY = 2
LIMIT = 1800.0
"""Seconds for one start; one that takes longer hangs."""


def main() -> int:
    if sys.argv[1:2] == ["--start"]:
        return switch_about(int(sys.argv[2]), int(sys.argv[3]))
    switches = int(sys.argv[1]) if len(sys.argv) > 1 else 250
    starts = int(sys.argv[2]) if len(sys.argv) > 2 else 5
    load = [multiprocessing.Process(target=_busy, daemon=True) for _ in range(BUSY)]
    for process in load:
        process.start()
    try:
        faults = run(switches, starts)
    finally:
        for process in load:
            process.terminate()
    print(f"{switches} switches over {starts} starts: {faults} faults")
    print("met" if not faults else "missed")
    return 1 if faults else 0


def run(switches: int, starts: int) -> int:
    """How many starts ended otherwise than in order."""
    faults = 0
    with tempfile.TemporaryDirectory() as home:
        for i in range(starts):
            faults += not start(i, switches // starts + (i < switches % starts), home)
    return faults


def start(seed: int, switches: int, home: str) -> bool:
    size, scale = SCREENS[seed % len(SCREENS)]
    command = [sys.executable, str(Path(__file__).resolve()), "--start", str(seed), str(switches)]
    began = time.monotonic()
    with display(size, anew=True):
        environment = os.environ | {
            "XDG_CONFIG_HOME": f"{home}/config",
            "XDG_STATE_HOME": f"{home}/state",
            "QT_SCALE_FACTOR": scale,
        }
        try:
            done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=LIMIT)
            code, told = done.returncode, done.stdout + done.stderr
        except subprocess.TimeoutExpired as late:
            code, told = -1, f"hangs after {late.timeout:.0f} s"
    print(
        f"start {seed}: {size[0]} x {size[1]} at {scale}, {switches} switches, "
        f"{time.monotonic() - began:.0f} s, {'in order' if code == 0 else f'exit {code}'}",
        flush=True,
    )
    if code:
        print(told[-20_000:], flush=True)
    return code == 0


def switch_about(seed: int, switches: int) -> int:
    """One start, in this process."""
    faulthandler.enable()
    from studio.qt.shell import app as desktop

    app = desktop.application()
    window = desktop.start(None)
    if window.tour is not None:
        window.tour.end()
    chance = random.Random(seed)

    def idle(seconds: float) -> None:
        until = time.monotonic() + seconds
        while True:
            app.processEvents()
            if time.monotonic() >= until:
                return
            time.sleep(0.002)

    idle(chance.uniform(0.0, 6.0))
    for i in range(switches):
        key = chance.choice(("setup", "render_workspace", "measure"))
        print(f"switch {i} to {key}", flush=True)  # told of a start that does not end in order
        window.commands[key].trigger()
        idle(chance.choice((0.0, 0.0, 0.02, 0.3)))
        disarrange(window, chance)
        idle(chance.choice((0.0, 0.02)))
        if chance.random() < 0.05:
            window.panels["render"].start(0.125)
    print("closing", flush=True)
    window.files.count_as_saved(window.session.project)
    window.close()
    app.processEvents()
    print("closed", flush=True)
    return 0


def disarrange(window: object, chance: random.Random) -> None:
    """What a person does to panels, now and then."""
    from PySide6.QtCore import QPoint, Qt

    from studio.qt.shell.window import MainWindow

    assert isinstance(window, MainWindow)
    dock, other = chance.sample(list(window.docks.values()), 2)
    what = chance.randrange(16)
    if what == 0:
        dock.setFloating(not dock.isFloating())
        dock.move(QPoint(chance.randrange(3000), chance.randrange(1500)))
    elif what == 1:
        dock.setVisible(not dock.isVisible())
    elif what == 2 and not dock.isFloating() and not other.isFloating():
        window.tabifyDockWidget(dock, other)
    elif what == 3:
        window.resize(chance.randrange(800, 2000), chance.randrange(600, 1300))
    elif what == 4:
        window.resizeDocks([dock], [chance.randrange(50, 1500)], Qt.Orientation.Horizontal)
    elif what == 5:
        window.showMaximized() if not window.isMaximized() else window.showNormal()
    elif what == 6:
        window.rearrange()


def _busy() -> None:
    os.nice(1)
    while True:
        sum(range(10**6))


if __name__ == "__main__":
    sys.exit(main())
