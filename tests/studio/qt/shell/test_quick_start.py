"""What makes the start quick leaves everything usable afterwards."""

from __future__ import annotations

import subprocess
import sys

CHILD = """
import sys, threading
from studio.qt.shell.quick_start import pyplot_when_asked_for

pyplot_when_asked_for()
import matplotlib.pyplot as held
assert "matplotlib.figure" not in sys.modules
start, seen = threading.Barrier(4), []

def ask():
    start.wait()
    seen.append(held.figure)

threads = [threading.Thread(target=ask) for _ in range(4)]
for one in threads: one.start()
for one in threads: one.join()
from matplotlib import pyplot
assert pyplot is sys.modules["matplotlib.pyplot"] and pyplot is not held
assert all(one is pyplot.figure for one in seen) and held.rcParams is pyplot.rcParams
print("whole")
"""


def test_pyplot_is_whole_when_threads_ask_for_it_at_once() -> None:
    done = subprocess.run([sys.executable, "-c", CHILD], capture_output=True, text=True, timeout=300.0)
    assert done.stdout.strip() == "whole", done.stderr
