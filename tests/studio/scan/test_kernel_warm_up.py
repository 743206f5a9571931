"""After the warm-up nothing is compiled: what renders, measures and draws is there, whatever the scene is made of."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from render.base.errors import Cancelled
from render.laser_indirect.camera_tree import cell_rays, divide
from render.laser_indirect.laser_walks import add_walks, mark_near, walk_to_laser
from studio.project.project import Project
from studio.project.templates import DESCRIPTIONS, template_folder
from studio.scan import kernel_warm_up

ROOT = Path(__file__).resolve().parents[3]
CHILD = """
import importlib, json, pkgutil, sys
from pathlib import Path
from numba.core.dispatcher import Dispatcher
import analysis, render
from studio.project.project import Project
from studio.scan.stages import scaled
from studio.scan.kernel_warm_up import beside, needed, warm_up

def quietly(stage, done): pass

def never(): return False

def kernels():
    # every kernel of both rooms, by name: signatures that are there
    found = {}
    for room in (render, analysis):
        for module in pkgutil.walk_packages(room.__path__, room.__name__ + "."):
            for name, value in vars(importlib.import_module(module.name)).items():
                if isinstance(value, Dispatcher):
                    found[f"{value.py_func.__module__}.{value.py_func.__qualname__}"] = value
    return found

def read():
    return {name: set(map(str, kernel.signatures)) for name, kernel in kernels().items()}

from render.material.material import Subsurface
from studio.scan.options import ScanOptions
from studio.scan.scan import run_scan
late = {}
for folder in map(Path, sys.argv[2:]):
    project = scaled(Project.load(folder / "project.json"), 0.03)
    if folder.name == "sphere":
        # what no template has: wax, and a lens that blurs
        scene, camera = project.scene, project.scene.camera
        camera = camera.model_copy(update={"lens": camera.lens.model_copy(update={"model": "thin-lens"})})
        objects = tuple(
            item.model_copy(update={"material": Subsurface()}) if item.shape.kind == "sphere" else item
            for item in scene.objects
        )
        scene = scene.model_copy(update={"rig": scene.rig.model_copy(update={"camera": camera}), "objects": objects})
        project = project.model_copy(update={"scene": scene})
    warm_up(sum(needed(project), ()), quietly, never)
    before = read()
    options = ScanOptions(steps=1, report=False, seconds=0.5)
    run_scan(project, folder, out=Path(sys.argv[1], folder.name), options=options)
    late[folder.name] = sorted(name for name, there in read().items() if there - before.get(name, set()))
before = read()
beside()
late["beside"] = sorted(name for name, there in read().items() if there - before.get(name, set()))
print(json.dumps({"late": late, "kernels": len(read())}))
"""


@pytest.mark.parametrize(
    "names",
    [
        ("scan", "sphere"),
        pytest.param(("scan", "weld_seam", "shiny_weld_seam", "glass_ball", "sphere"), marks=pytest.mark.validation),
    ],
    ids=["a moving rig and a lens that blurs", "all kinds"],
)
def test_nothing_is_compiled_or_loaded_after_the_warm_up(tmp_path, names):
    """No kernel of render and analysis, whatever its name, meets types in a scan that the warm-up has not shown it.

    Nor does the process beside the first one compile any that this has no use for.
    """
    done = subprocess.run(
        [sys.executable, "-c", CHILD, str(tmp_path), *(str(template_folder(name)) for name in names)],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=True,
    )
    told = json.loads(done.stdout.splitlines()[-1])
    assert told["kernels"] > 150
    assert told["late"] == {name: [] for name in (*names, "beside")}


def test_light_through_windows_is_prepared_though_small_images_leave_it_to_random_paths():
    kernel_warm_up.light(lambda: False)
    for kernel in (walk_to_laser, add_walks, mark_near, cell_rays, divide):
        assert len(kernel.signatures) == 1


def test_a_lens_that_blurs_is_prepared_where_there_is_one():
    for name in DESCRIPTIONS:
        assert kernel_warm_up.needed(Project.load(template_folder(name) / "project.json"))[0] == ("draw",)
    project = Project.load(template_folder("plane") / "project.json")
    camera = project.scene.camera
    camera = camera.model_copy(update={"lens": camera.lens.model_copy(update={"model": "thin-lens"})})
    scene = project.scene.model_copy(update={"rig": project.scene.rig.model_copy(update={"camera": camera})})
    for_line, for_all = kernel_warm_up.needed(project.model_copy(update={"scene": scene}))
    assert for_line == ("draw", "lens") and {*for_line, *for_all, "look", "learned"} == set(kernel_warm_up.STEPS)
    assert "learned" in kernel_warm_up.needed(project.replaced({"extraction.select": "learned"}))[1]


@pytest.fixture
def slow_step(monkeypatch):
    """A step that takes until it is let go, and how often it has run."""
    go, runs = threading.Event(), []

    def step(cancelled):
        runs.append(1)
        go.wait(180.0)

    monkeypatch.setitem(kernel_warm_up.STEPS, "slow", step)
    yield go, runs
    go.set()
    kernel_warm_up._ends.pop("slow", None)


def test_who_waits_is_told_and_cancelled_at_once_and_a_step_runs_once(slow_step):
    go, runs = slow_step
    told, asked = [], []

    def cancelled():
        asked.append(1)
        return len(asked) > 3

    with pytest.raises(Cancelled):
        kernel_warm_up.warm_up(("slow",), lambda stage, done: told.append(stage), cancelled)
    assert len(asked) == 4 and not kernel_warm_up._ends["slow"].done()
    assert set(told) == {kernel_warm_up.PREPARING} and "compiled" in kernel_warm_up.PREPARING
    go.set()
    kernel_warm_up.warm_up(("slow",), lambda stage, done: None, lambda: False)
    kernel_warm_up.warm_up(("slow",), lambda stage, done: pytest.fail("it is done"), lambda: False)
    assert len(runs) == 1


def test_what_is_broken_is_told_to_all_who_wait(monkeypatch):
    def broken(cancelled):
        raise RuntimeError("the installation is damaged")

    monkeypatch.setitem(kernel_warm_up.STEPS, "broken", broken)
    for _ in range(2):
        with pytest.raises(RuntimeError, match="damaged"):
            kernel_warm_up.warm_up(("broken",), lambda stage, done: None, lambda: False)
    kernel_warm_up._ends.pop("broken", None)


@pytest.fixture
def empty_cache(monkeypatch, tmp_path):
    """A program that has compiled nothing yet, and does so in no time; what it did, in order."""
    done = []
    monkeypatch.setattr(kernel_warm_up, "kept_in", lambda: str(tmp_path / "kernels"))
    monkeypatch.setattr(kernel_warm_up, "thread_count", lambda threads: 2)
    monkeypatch.setattr(kernel_warm_up, "_ends", {})
    monkeypatch.setattr(kernel_warm_up, "_helper", None)
    for name in ("draw", "scan"):
        monkeypatch.setitem(kernel_warm_up.STEPS, name, lambda cancelled, name=name: done.append(name))
    return done


def warm(*names: str) -> None:
    kernel_warm_up.warm_up(names, lambda stage, done: None, lambda: False)


@pytest.mark.parametrize("code", ["", "raise SystemExit(1)"])
def test_where_nothing_is_compiled_another_process_begins_at_the_other_end(empty_cache, monkeypatch, code) -> None:
    """The last step waits for it, and does itself what it left undone; the next start needs it no more."""
    started, start = [], subprocess.Popen

    def helper(command, **options):
        started.append(command)
        return start([sys.executable, "-c", f"import time; time.sleep(0.3); {code}"], **options)

    monkeypatch.setattr(subprocess, "Popen", helper)
    for _ in range(2):
        warm("draw", "scan")
        assert kernel_warm_up._helper is None or kernel_warm_up._helper.poll() is not None
        kernel_warm_up._ends.clear()
    assert len(started) == 1 and started[0][1:] == ["-m", "studio.scan.kernel_warm_up"]
    assert empty_cache == ["draw", "scan"] * 2


def test_no_process_is_started_that_could_not_hand_anything_over(empty_cache, monkeypatch, tmp_path) -> None:
    (tmp_path / "kernels").write_text("a file where the folder would be")
    monkeypatch.setattr(subprocess, "Popen", lambda *_, **__: pytest.fail("it cannot write there"))
    warm("draw", "scan")
    assert empty_cache == ["draw", "scan"]


def test_on_one_processor_everything_is_compiled_here(empty_cache, monkeypatch) -> None:
    monkeypatch.setattr(kernel_warm_up, "thread_count", lambda threads: 1)
    monkeypatch.setattr(subprocess, "Popen", lambda *_, **__: pytest.fail("there is no processor for it"))
    warm("draw", "scan")
    assert empty_cache == ["draw", "scan"]
