"""Pictures of the desktop's main states, for people to look at, and a few for the README.

    python tests/screenshots.py FOLDER [--readme]

Drives the real program on the sample; --readme writes the README's pictures into assets/screenshots as well. Without a
display a virtual one is used.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from virtual_display import display

ROOT = Path(__file__).resolve().parents[1]
if TYPE_CHECKING:
    from studio.qt.shell.window import MainWindow
    from studio.qt.study.study_work import StudyWork

SIZE = (1440, 900)
README = {
    "setup_dark": "setup.png",
    "render_dark": "render.png",
    "measure_light": "measure.png",
    "study_light": "study_window.png",
    "calibrate_light": "calibrate_window.png",
    "dataset_light": "dataset_window.png",
}
README_WIDTH = 1120
LASER, OBJECT = ("scene", "rig", "lasers", 0), ("scene", "objects", 0)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--readme", action="store_true")
    parser.add_argument("--only", choices=["study", "calibrate", "dataset"], help="of one workspace alone")
    parser.add_argument("--scale", type=float, default=0.5, help="image scale of the render")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    with display(), tempfile.TemporaryDirectory() as home:
        os.environ.update(XDG_CONFIG_HOME=f"{home}/config", XDG_STATE_HOME=f"{home}/state")
        folder = options.folder.resolve()
        os.chdir(home)  # the picture shows no more of the study's folder than its name
        take(folder, options.scale, options.readme, Path("read noise"), only=options.only)
    return 0


def take(folder: Path, scale: float, readme: bool, results: Path, *, only: str | None) -> None:
    """results: a folder for those of a study."""
    from studio.qt.shell import app as desktop
    from studio.qt.shell.app import application, start
    from studio.qt.shell.shortcuts import CheatSheet

    app = application()
    desktop.FIRST_LOOK_MS = 10**8  # the render below takes its place
    window = start(None)
    window.resize(*SIZE)

    def wait(done: Callable[[], bool], seconds: float = 600.0) -> None:
        until = time.monotonic() + seconds
        while not done():
            app.processEvents()
            time.sleep(0.005)
            if time.monotonic() > until:
                raise TimeoutError("a picture's state never came")

    def settle(seconds: float = 0.6) -> None:
        end = time.monotonic() + seconds
        wait(lambda: time.monotonic() > end)

    def shoot(name: str) -> None:
        settle()
        picture = window.grab()
        picture.save(str(folder / f"{name}.png"))
        print(folder / f"{name}.png", flush=True)
        if readme and name in README:
            write_small(folder / f"{name}.png", ROOT / "assets" / "screenshots" / README[name])

    window.choose_theme("dark")
    settle(2.0)
    shoot("tour")
    if window.tour is not None:
        window.tour.end()
    session = window.session
    if only != "study":
        if only != "dataset":
            shoot_calibration(window, wait, shoot)
        if only != "calibrate":
            shoot_dataset(window, wait, shoot)
    if only in ("calibrate", "dataset"):
        window.files.count_as_saved(session.project)
        window.close()
        app.processEvents()
        return
    window.switch_to("study")
    shoot("study_empty")
    study = ask_a_question(window, results)
    settle(1.0)  # until what it takes is worked out
    shoot("study_asked")
    study.start()
    wait(lambda: not study.running and study.found is not None)
    window.panels["charts"].table.setCurrentCell(0, 0)  # type: ignore[attr-defined]
    for theme in ("dark", "light"):
        window.choose_theme(theme)
        shoot(f"study_{theme}")
    if only == "study":
        window.files.count_as_saved(window.session.project)
        window.close()
        app.processEvents()
        return
    window.switch_to("setup")
    session.select(LASER)
    settle()
    for theme in ("dark", "light"):
        window.choose_theme(theme)
        shoot(f"setup_{theme}_before_render")
    window.panels["render"].start(scale)  # type: ignore[attr-defined]
    window.switch_to("render")
    wait(lambda: session.shown is not None)
    shoot("rendering")
    wait(lambda: not window.runner.busy and session.shown is not None and len(session.shown.measurements) == 3)
    settle(2.0)
    session.hover(worst_row(window))
    for theme in ("dark", "light"):
        window.choose_theme(theme)
        for key in ("setup", "render", "measure"):
            window.switch_to(key)
            if key == "measure":
                settle(0.2)
                window.cloud.frame()
            shoot(f"{key}_{theme}")
    window.panels["results"].tabs.setCurrentIndex(1)  # type: ignore[attr-defined]
    shoot("measure_histogram")
    window.switch_to("setup")
    session.select(OBJECT)
    window.panels["viewport"].frame(OBJECT)  # type: ignore[attr-defined]
    shoot("setup_object")
    window.show_panel("log")
    window.show_panel("motion")
    shoot("setup_all_panels")
    window.rearrange()
    for name, dialog in (("help", window.help), ("shortcuts", CheatSheet(window))):
        window.help.open_page("results") if name == "help" else dialog.show()
        settle()
        dialog.grab().save(str(folder / f"{name}.png"))
        dialog.close()
    window.files.count_as_saved(window.session.project)
    window.close()
    app.processEvents()


def shoot_dataset(window: MainWindow, wait: Callable[[Callable[[], bool]], None], shoot: Callable[[str], None]) -> None:
    """A ready-made recipe with its first scenes."""
    from studio.qt.core.session import one_of
    from studio.qt.dataset.dataset_work import DatasetWork

    work = one_of(DatasetWork, window.session)
    work.load("stairs")
    window.switch_to("dataset")
    wait(lambda: len(work.pictures) == work.shown)
    for theme in ("dark", "light"):
        window.choose_theme(theme)
        shoot(f"dataset_{theme}")


def shoot_calibration(
    window: MainWindow, wait: Callable[[Callable[[], bool]], None], shoot: Callable[[str], None]
) -> None:
    """Virtual boards, and each way to look at them."""
    from studio.qt.calibrate.calibration_work import CalibrationWork
    from studio.qt.core.session import one_of

    window.switch_to("calibrate")
    shoot("calibrate_empty")
    work = one_of(CalibrationWork, window.session)
    work.simulate()
    wait(lambda: not work.running)
    for number, what in enumerate(("", "_next", "_coverage", "_depth")):
        window.panels["boards"].tabs.setCurrentIndex(number)  # type: ignore[attr-defined]
        for theme in ("dark", "light"):
            window.choose_theme(theme)
            shoot(f"calibrate{what}_{theme}")


def ask_a_question(window: MainWindow, results: Path) -> StudyWork:
    """How much read noise each of four methods bears; one render serves all cells."""
    from studio.qt.core.session import one_of
    from studio.qt.study.study_work import StudyWork

    study = one_of(StudyWork, window.session)
    noise = {"field": "sensor.read_noise", "values": [2.0, 5.0, 10.0, 20.0, 50.0, 100.0]}
    methods = ["likelihood", "gaussian", "centre_of_mass", "parabola"]
    study.change(lambda draft: draft.update(name="Read noise", repeats=4, set={"render.goal": None}))
    study.change_sweep(name="Read noise", vary=[noise], methods=methods, measure="depth_rmse")
    results.mkdir()
    study.choose_folder(results)
    return study


def worst_row(window: MainWindow) -> int | None:
    window.measuring.worst()
    return window.session.hovered


def write_small(source: Path, target: Path) -> None:
    """As the README shows it: smaller, with a palette, so that the repository stays small."""
    from PIL import Image

    from render.base.files import atomic_write

    with Image.open(source) as image:
        height = round(image.height * README_WIDTH / image.width)
        small = image.convert("RGB").resize((README_WIDTH, height), Image.Resampling.LANCZOS)
        with atomic_write(target) as temporary:
            # an octree keeps what is rare: with a median cut, axes and lines of other colours looked alike
            few = small.quantize(256, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
            few.save(temporary, optimize=True)


if __name__ == "__main__":
    sys.exit(main())
