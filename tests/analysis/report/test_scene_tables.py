"""What a report says of the scanner's own figures."""

from __future__ import annotations

import dataclasses

from analysis.report.tables import scene_tables
from render.camera.camera import Camera
from tests.analysis.report.test_report import make_report


def test_the_lens_is_told_by_its_own_focal_length():
    report = make_report()
    camera = Camera.from_physical(64, 48, 3.45e-6, 0.025, focus_distance=0.403)
    rig = report.scene.rig.model_copy(update={"camera": camera})
    told = scene_tables(dataclasses.replace(report, scene=report.scene.model_copy(update={"rig": rig})))["Camera"]
    assert told["Lens"].startswith("25.00\u00a0mm, f/1.4, ") and "focused 403.0\u00a0mm" in told["Lens"]
    assert told["Image distance"] == "26.65\u00a0mm"
