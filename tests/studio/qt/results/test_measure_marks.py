"""Values of measures in the 3D view are read side by side, wherever they are looked at from."""

from __future__ import annotations

import numpy as np
from pytestqt.qtbot import QtBot
from vtkmodules.vtkRenderingCore import vtkTextRenderer

from studio.preview.view_camera import Eye
from studio.qt.results.results_panel import ResultsPanel
from studio.qt.shell.window import MainWindow
from studio.qt.viewport.measure_marks import MeasureMarks
from studio.scan.measures_in_3d import MeasureIn3D
from tests.studio.qt.results.test_results import render, results

__all__ = ["render", "results"]


def boxes(marks: MeasureMarks) -> list[np.ndarray]:
    """Left, bottom, right and top of each text, px."""
    view, found = marks.view, []
    for label in marks.labels:
        box = [0, 0, 0, 0]
        vtkTextRenderer.GetInstance().GetBoundingBox(
            label.GetTextProperty(), label.GetInput(), box, view.ren_win.GetDPI()
        )
        at = view.devicePixelRatioF() * view.eye.project(np.array(label.GetPosition()), view.pixels)[0] * [1.0, -1.0]
        low = at + label.GetDisplayOffset()
        found.append(np.concatenate([low, low + np.array([box[1] - box[0], box[3] - box[2]])]))
    return found


def overlap(one: np.ndarray, other: np.ndarray) -> bool:
    return bool(np.all(one[:2] < other[2:]) and np.all(other[:2] < one[2:]))


def test_no_text_lies_over_another_from_wherever_the_part_is_seen(
    window: MainWindow, results: ResultsPanel, qtbot: QtBot
) -> None:
    """Texts stood in lines by how near their places are on the part; one behind the other, or a line apart, they did
    not, and lay over each other."""
    session, view = window.session, window.cloud.view
    marks = next(child for child in view.children() if isinstance(child, MeasureMarks))
    eye = view.eye
    away, up = eye.centre - eye.position, eye.rotation[:, 1]
    a_line = 22.0 * 2.0 * eye.half_height / view.pixels[1]
    behind = [eye.centre + share * away for share in (0.0, 0.3)]
    places = [*behind, *(eye.centre - a_line * k * up for k in (1.0, 2.0, 3.0))]
    line = np.stack([eye.centre, eye.centre + a_line * up])
    five = tuple(MeasureIn3D(f"Step height {k}: 12.000 mm", "pass", (line,), at) for k, at in enumerate(places))
    for seen in (eye, *(Eye.standing(eye.centre, eye.half_height, turned, 25.0) for turned in (-60.0, 20.0, 110.0))):
        session.show_measures_in_3d(five)  # again, as figures of the scan that come late take their place
        assert len(marks.labels) == 5
        paints = view.paints
        view.look_from(seen)
        qtbot.waitUntil(lambda paints=paints: view.paints > paints)
        found = boxes(marks)
        covered = [(i, k) for i in range(5) for k in range(i) if overlap(found[i], found[k])]
        assert not covered
