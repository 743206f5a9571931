"""How soon the desktop answers, kernels warm: the first true figure after the window, and the line on a new STEP part.

    python tests/benchmarks/bench_answers.py [runs]

Bars: 10 s from the window to a depth error with its uncertainty at full scale; 5 s from the file of a part of 1,000
faces to its lit line. The first run, which may compile, does not count. Without a display a virtual one is used.
"""

from __future__ import annotations

import math
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from virtual_display import display

from tests.studio.project.step_text import pin

ROOT = Path(__file__).resolve().parents[2]
FIGURE_BAR, STEP_BAR = 10.0, 5.0
TEETH = 499
"""Each a round and a flat face; with top and bottom 1,000."""
CHILD = """
import sys, time
from pathlib import Path
from studio.qt.shell.app import application, start
app = application()
window = start(None)
if window.tour is not None:
    window.tour.end()
app.processEvents()
began, session = time.time(), window.session

def wait(done):
    while not done():
        app.processEvents()
        time.sleep(0.002)

results = window.panels["results"]
wait(lambda: session.shown is not None and session.shown.scanner_scale == 1.0 and bool(session.shown.measurements))
window.switch_to("measure")
wait(lambda: results.table.item(0, 0) is not None)
figure = time.time() - began
table = results.table
rows = {table.verticalHeaderItem(i).text(): table.item(i, 0).text() for i in range(table.rowCount())}
wait(lambda: not window.runner.busy)

from studio.qt.core.live_preview import live
from studio.qt.scene.mesh_importer import import_meshes
began, before = time.time(), len(session.project.scene.objects)
import_meshes(session, [Path(sys.argv[1])], window)
wait(lambda: len(session.project.scene.objects) > before)
at = len(session.project.scene.objects) - 1
wait(lambda: live(session).look.project is session.project and any(p.index == at for p in live(session).look.placed))
curve = live(session).look.lit_curve(0)
app.processEvents()
print(figure, time.time() - began, len(curve.index), rows, flush=True)
# else the next start finds unsaved work and asks about it
window.files.count_as_saved(session.project)
window.close()
import os
os._exit(0)
"""


def main() -> int:
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 3
    figures, steps, told = [], [], ""
    with display(), tempfile.TemporaryDirectory() as home:
        part = Path(home) / "wheel.step"
        part.write_text(toothed_wheel(TEETH, 20.0, 30.0), encoding="utf-8")
        environment = {**os.environ, "XDG_CONFIG_HOME": f"{home}/config", "XDG_STATE_HOME": f"{home}/state"}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        for run in range(runs + 1):
            command = [sys.executable, "-c", CHILD, str(part)]
            done = subprocess.run(command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, text=True, check=True)
            figure, step, _, told = done.stdout.strip().splitlines()[-1].split(" ", 3)
            if run:
                figures.append(float(figure))
                steps.append(float(step))
    print(told)
    for name, seconds, bar in (("first true figure", figures, FIGURE_BAR), ("1,000 faces to a line", steps, STEP_BAR)):
        middle = statistics.median(seconds)
        said = "met" if middle <= bar else "missed"
        print(f"{name}: median {middle:.2f} s, best {min(seconds):.2f} s; bar {bar:g} s: {said}")
    print(f"a plain loop of ten million additions: {plain_loop():.2f} s; load {os.getloadavg()[0]:.1f}")
    return 0


def plain_loop() -> float:
    """s; says how fast the machine is."""
    began, total = time.perf_counter(), 0
    for i in range(10_000_000):
        total += i
    return time.perf_counter() - began


def toothed_wheel(teeth: int, radius: float, height: float) -> str:
    """A STEP file (mm) of a wheel with half-round teeth: 2 teeth + 2 faces, the header that of the pin."""
    lines, number = [], 1000

    def add(text: str) -> int:
        nonlocal number
        number += 1
        lines.append(f"#{number}={text};")
        return number

    def triple(values: np.ndarray) -> str:
        return "(" + ",".join(f"{value:.9f}" for value in values) + ")"

    def point(at: np.ndarray) -> int:
        return add(f"CARTESIAN_POINT('',{triple(at)})")

    def direction(along: np.ndarray) -> int:
        return add(f"DIRECTION('',{triple(along)})")

    def frame(at: np.ndarray, z: np.ndarray, x: np.ndarray) -> int:
        return add(f"AXIS2_PLACEMENT_3D('',#{point(at)},#{direction(z)},#{direction(x)})")

    def face(edges: list[tuple[int, bool]], surface: int) -> int:
        turned = [add(f"ORIENTED_EDGE('',*,*,#{edge},.{'FT'[ahead]}.)") for edge, ahead in edges]
        loop = add(f"EDGE_LOOP('',({','.join(f'#{one}' for one in turned)}))")
        bound = add(f"FACE_OUTER_BOUND('',#{loop},.T.)")
        return add(f"ADVANCED_FACE('',(#{bound}),#{surface},.T.)")

    up, lift, count = np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, height]), 2 * teeth
    angle = 2.0 * math.pi * np.arange(count) / count
    places = radius * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(count)])
    vertex = [[add(f"VERTEX_POINT('',#{point(at + z)})") for at in places] for z in (0.0 * lift, lift)]

    def line(a: int, b: int, start: np.ndarray, along: np.ndarray) -> int:
        vector = add(f"VECTOR('',#{direction(along / np.linalg.norm(along))},1.)")
        curve = add(f"LINE('',#{point(start)},#{vector})")
        return add(f"EDGE_CURVE('',#{a},#{b},#{curve},.T.)")

    rims: list[list[int]] = [[], []]
    for k in range(count):
        start, along = places[k], places[(k + 1) % count] - places[k]
        for level, z in enumerate((0.0 * lift, lift)):
            a, b = vertex[level][k], vertex[level][(k + 1) % count]
            if k % 2:
                rims[level].append(line(a, b, start + z, along))
            else:
                placement = frame(start + 0.5 * along + z, up, -along / np.linalg.norm(along))
                circle = add(f"CIRCLE('',#{placement},{0.5 * np.linalg.norm(along):.9f})")
                rims[level].append(add(f"EDGE_CURVE('',#{a},#{b},#{circle},.T.)"))
    posts = [line(vertex[0][k], vertex[1][k], places[k], up) for k in range(count)]
    faces = []
    for k in range(count):
        along = places[(k + 1) % count] - places[k]
        unit = along / np.linalg.norm(along)
        if k % 2:
            surface = add(f"PLANE('',#{frame(places[k], np.cross(unit, up), unit)})")
        else:
            placement = frame(places[k] + 0.5 * along, up, unit)
            surface = add(f"CYLINDRICAL_SURFACE('',#{placement},{0.5 * np.linalg.norm(along):.9f})")
        ring = [(rims[0][k], True), (posts[(k + 1) % count], True), (rims[1][k], False), (posts[k], False)]
        faces.append(face(ring, surface))
    right = np.array([1.0, 0.0, 0.0])
    faces.append(face([(edge, True) for edge in rims[1]], add(f"PLANE('',#{frame(lift, up, right)})")))
    faces.append(face([(edge, False) for edge in rims[0][::-1]], add(f"PLANE('',#{frame(0.0 * lift, -up, right)})")))
    header, rest = pin(1.0, 1.0).split("#22=")
    # the pin's own shell gives way to the wheel's
    shell = f"#22=CLOSED_SHELL('',({','.join(f'#{one}' for one in faces)}));\n"
    colours = rest[rest.index("#80=") :]
    return header + shell + "\n".join(lines) + "\n" + colours


if __name__ == "__main__":
    sys.exit(main())
