"""The cheaper project of each template: what it changes in depth on fresh seeds, and the share of seconds it takes.

python -m tests.validation.advice_table --scale 0.1 plane sphere   # no names: every template
python -m tests.validation.advice_table --full --scale 1 --rows 256

As they come, the templates have a goal in depth and leave out what a pilot does not find: advised already. With --full
they are as one models who does not know yet what the scene needs: every step of transport, no goal, and every light
to its error of the image (0.3 % of the laser's, 1 % of ambient light as far as samples end it, 10 % of the reflected).

The bar: bias and sigma of the rows measured on the line, and wrong rows as a share of all, within 3 % on 8 seeds that
had no say in the choice, shown by intervals that lie within it, and at most a third of the seconds on at least five. A
small scale has few rows, so that intervals may be too wide to decide; what a frame costs at any quality counts for
more; and below half the size the line is so narrow that a few rows make most of sigma. A ninth beside the eight
templates: a slab of wax in place of the plane.
"""

from __future__ import annotations

import argparse
from typing import Any

from analysis.study.intervals import Interval
from studio.project.project import Project
from studio.project.templates import DESCRIPTIONS
from studio.runtime.workers import Engine
from studio.study.advice import Advice, Question, advise

THIRD = 1.0 / 3.0
WAX = {
    "scene.objects[0].shape": {"kind": "box", "size_x": 0.5, "size_y": 0.5, "size_z": 0.02},
    "scene.objects[0].material": {"kind": "subsurface", "scattering_albedo": 0.99, "mean_free_path": 5e-4},
}
NINE = (*DESCRIPTIONS, "wax")
FULL = {"render.goal": None, "render.transport": "subsurface", "render.ambient_samples": 4096}
"""Fields of the render by which nothing is left out, and errors of the image decide."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("templates", nargs="*", metavar="template", help=", ".join(NINE))
    parser.add_argument("--scale", type=float, default=0.2)
    parser.add_argument("--rows", type=int, help="of the image, about its middle, at scale 1")
    parser.add_argument("--full", action="store_true", help="all light, to errors of the image")
    parser.add_argument("--workers", type=int, default=1)
    given = parser.parse_args()
    question = Question(image_scale=given.scale, engine=Engine(given.workers))
    print(
        "template          bias, %            sigma, %           wrong rows, %   seconds         alike  a third  taken"
    )
    shown = third = 0
    for name in given.templates or NINE:
        project = Project.load("plane" if name == "wax" else name)
        if name == "wax":
            project = project.replaced(WAX).in_folder(project.folder)
        found = advise(changed(project, full=given.full, rows=given.rows), question)
        print(f"{name:16s}  {row(found, question.within)}", flush=True)
        proof = found.proved
        shown += proof is not None
        third += proof is not None and proof.found.seconds <= THIRD * proof.found.seconds_before
    print(f"{shown} proved, {third} of them at a third of the seconds or less; image scale {given.scale:g}")


def changed(project: Project, *, full: bool, rows: int | None) -> Project:
    """The project that is asked about."""
    values: dict[str, Any] = dict(FULL) if full else {}
    if rows is not None:
        camera = project.scene.camera
        middle = camera.cy - 0.5 * (camera.height - rows)
        values |= {"scene.rig.camera.height": rows, "scene.rig.camera.cy": middle}
    return project.replaced(values).in_folder(project.folder)


def row(found: Advice, within: float) -> str:
    """Of the proof that holds, or else of the last one."""
    proof = found.proved or (found.proofs[-1] if found.proofs else None)
    if proof is None:
        return "no part leaves depth as it is and saves seconds"
    one = proof.found
    alike = "yes" if proof.alike else "cannot tell" if one.undecided(within) else "no"
    third = "yes" if one.seconds <= THIRD * one.seconds_before else "no"
    taken = ", ".join(f"{part.name} {part.change}" for part in proof.parts)
    seconds = f"{one.seconds:.2f} of {one.seconds_before:.2f}"
    wrong = f"{100.0 * one.wrong_before:.2f} to {100.0 * one.wrong_after:.2f}"
    figures = f"{percent(one.bias):17s}  {percent(one.sigma):17s}  {wrong:14s}  {seconds:14s}"
    return f"{figures}  {alike:5s}  {third:7s}  {taken}"


def percent(one: Interval) -> str:
    return f"{100.0 * one.low:+.2f} to {100.0 * one.high:+.2f}"


if __name__ == "__main__":
    main()
