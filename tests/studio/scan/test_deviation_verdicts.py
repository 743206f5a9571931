"""One sigma of a point's deviation: the report for a customer and the deviation in the window judge alike."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analysis.cloud import cloud
from analysis.deviation import ABOVE, BELOW, UNDECIDED, WITHIN
from analysis.error import compare
from analysis.report.delivery import Delivery
from analysis.report.deviation_figure import DeviationMap, draw
from analysis.report.front import front
from analysis.report.units import percent
from render.base.pose import Pose
from render.scene.scene import Scene
from studio.scan.deviation import Question, compare_cloud, map_of
from tests.analysis.report.test_report import DEPTH, WALL, WALL_TRIANGLES, make_frames, report_of


@pytest.mark.parametrize("limits", [(-2e-3, 2e-3), (-4e-3, 4e-3), (None, 5e-4), (3e-3, None)])
def test_report_and_window_give_the_same_points_the_same_verdicts(
    limits: tuple[float | None, float | None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, frames = make_frames()
    (laser,) = frames[0].lasers
    (made,) = laser.extractions
    # of a calibration that errs across the normal as much as along it, and of a sheet with a bias
    random = np.random.default_rng(7)
    common = 4e-4 * random.standard_normal((len(made.points.flag), 3, 4))
    curve = replace(laser.curve, sheet_bias=np.linspace(-0.1, 0.1, len(laser.curve.index)))
    points = replace(made.points, calibration=common)
    errors = compare(points, made.line, curve, WALL, WALL_TRIANGLES, scene.T_world_camera(0))
    frame = replace(frames[0], lasers=(replace(laser, extractions=(replace(made, points=points, errors=errors),)),))
    lower, upper = limits
    report = replace(report_of(scene, [frame]), delivery=Delivery(customer="Ada", lower=lower, upper=upper))
    maps: list[DeviationMap] = []
    monkeypatch.setattr("analysis.report.front.draw", lambda what: (maps.append(what), draw(what))[1])
    told = front(report)
    assert told is not None
    rows = dict(told["surface"]["rows"])

    found = compare_cloud(_standing(scene), tmp_path, cloud(points, errors, 0, 0), Question(lower=lower, upper=upper))
    assert found.verdicts is not None
    judged = {key: percent(float(np.mean(found.verdicts == key)), 2) for key in (WITHIN, UNDECIDED, ABOVE, BELOW)}
    named = {
        WITHIN: "Proved within",
        UNDECIDED: "Not decided",
        ABOVE: "Proved outside (above)",
        BELOW: "Proved inside (below)",
    }
    assert {key: rows[name] for key, name in named.items()} == judged
    assert found.record["verdict"] == told["surface"]["verdict"]
    assert not found.sigma_is_bound
    # and their maps number the same points
    np.testing.assert_array_equal(maps[0].no_place, map_of(found).no_place)
    size = dict(told["how"])["Uncertainty of a point, two sigma"]
    assert size.endswith("along the normal, median of 100 points (laser)")
    assert float(size.split()[0]) == pytest.approx(2e6 * found.record["median_sigma"], rel=1e-2)


def test_points_of_former_files_have_their_whole_sigma_which_is_said_to_be_a_bound(tmp_path: Path) -> None:
    scene, frames = make_frames()
    (made,) = frames[0].lasers[0].extractions
    whole = cloud(made.points, made.errors, 0, 0)
    former = {name: column for name, column in whole.items() if not name.startswith("sigma_surface")}
    along, bound = (compare_cloud(_standing(scene), tmp_path, one, Question()) for one in (whole, former))
    assert bound.sigma_is_bound and not along.sigma_is_bound
    # noise moves a point along the sheet, which leans to the wall's normal
    assert np.all(bound.sigma > along.sigma)
    unknown = compare_cloud(_standing(scene), tmp_path, cloud(made.points, None, 0, 0), Question())
    np.testing.assert_array_equal(unknown.sigma, bound.sigma)
    assert unknown.sigma_is_bound


def _standing(scene: Scene) -> Scene:
    """With the wall where the report's mesh is."""
    (wall,) = scene.objects
    there = wall.model_copy(update={"T_world_object": Pose(translation=(0.0, 0.0, DEPTH))})
    return scene.model_copy(update={"objects": (there,)})
