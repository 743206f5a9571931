"""What the result views draw: true where the truth is known, in the units that are written beside it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from render.base.pose import transform_points
from studio.preview.diverging_colours import diverging
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.scan.result_series import (
    ERROR_VIEWS,
    UNCERTAINTY,
    error_values,
    histogram,
    measured_series,
    symmetric_limit,
    table,
    true_series,
)
from studio.scan.stages import Clock, Measurement, develop_step, measure_step, render_step, scaled

DEPTH, SURFACE, POSITION = ERROR_VIEWS


@pytest.fixture(scope="module")
def measured() -> tuple[Project, Measurement, object]:
    from render.world.world import build_world

    folder = template_folder("plane")
    project = scaled(Project.load(folder / "project.json"), 0.1)
    clock = Clock(lambda *_: None, lambda: False)
    world = build_world(project.scene, folder, 0)
    frame = render_step(project, world, 0, clock)
    images = develop_step(project, frame, clock, None)
    return project, measure_step(project, frame, world, images, clock, None)[0], frame.curves[0]


def test_the_true_line_lies_in_the_lasers_plane(measured) -> None:
    project, _, curve = measured
    series = true_series(curve, project.scene, 0)
    here = np.isfinite(series.depth)
    points = np.stack([np.zeros(here.sum()), series.across[here], series.distance[here]], axis=1) / 1e3
    back = transform_points(project.scene.T_camera_laser(0), points)
    np.testing.assert_allclose(back, curve.point, atol=1e-9)
    np.testing.assert_allclose(series.depth[here], 1e3 * curve.depth_z)


def test_measured_points_lie_on_the_true_profile_within_their_error(measured) -> None:
    project, one, curve = measured
    series, truth = measured_series(one, project.scene), true_series(curve, project.scene, 0)
    error = error_values(one.errors, DEPTH)
    matched = one.errors.truth >= 0
    true_depth = 1e3 * curve.depth_z[one.errors.truth[matched]]
    np.testing.assert_allclose(series.depth[matched] - true_depth, error[matched] / 1e3, atol=1e-9)
    assert (
        np.nanmin(truth.across) - 1 < np.nanmin(series.across) < np.nanmax(series.across) < np.nanmax(truth.across) + 1
    )


def test_a_curve_is_broken_where_the_line_is(measured) -> None:
    project, _, curve = measured
    keep = np.r_[0:40, 60 : len(curve.index)]
    cut = replace(curve, **{name: getattr(curve, name)[keep] for name in ("index", "position", "point", "depth_z")})
    series = true_series(cut, project.scene, 0)
    assert np.flatnonzero(np.isnan(series.depth)).tolist() == [40]


@pytest.mark.parametrize(
    "errors,limit", [([0.3, -0.9, 1.1], 1.5), ([210.0, -190.0], 300.0), ([], 1.0), ([np.nan], 1.0), ([0.0], 1.0)]
)
def test_limits_are_round_and_hold_the_errors(errors: list[float], limit: float) -> None:
    assert symmetric_limit(np.array(errors, dtype=float)) == pytest.approx(limit)


def test_one_outlier_in_a_hundred_does_not_spoil_the_colours() -> None:
    errors = np.append(np.random.default_rng(1).normal(0.0, 10.0, 999), 5000.0)
    assert symmetric_limit(errors) == pytest.approx(30.0)


def test_a_histogram_counts_everything_and_zero_has_a_bin() -> None:
    errors = np.append(np.random.default_rng(2).normal(0.0, 10.0, 500), [np.nan, 999.0])
    edges, counts = histogram(errors, 30.0)
    assert counts.sum() == 501
    middle = len(counts) // 2
    assert edges[middle] < 0.0 < edges[middle + 1]
    assert edges[middle] == pytest.approx(-edges[middle + 1])


def test_no_error_is_white_and_signs_have_their_colours() -> None:
    far, near, none, absent = diverging(np.array([5.0, -5.0, 0.0, np.nan]), 5.0).astype(int)
    assert far[0] > far[2] and near[2] > near[0]
    assert none.min() > 240
    assert np.ptp(absent) == 0 and absent[0] < 200
    up, down = diverging(np.array([2.0, -2.0]), 5.0).astype(float)
    assert abs(up.mean() - down.mean()) < 25, "as strong on either side of zero"


def test_the_table_tells_how_well_the_bias_is_known(measured) -> None:
    """Twice what the spread over the root of the number says, where neighbours err apart; more where they err alike."""
    _, found, _ = measured
    for view in ERROR_VIEWS:
        rows = {name: values[0] for name, _, values in table([found], view)}
        error = error_values(found.errors, view)
        count = np.count_nonzero(np.isfinite(error))
        apart = 2.0 * np.nanstd(error) / np.sqrt(count)
        assert apart <= rows[UNCERTAINTY] < 4.0 * apart
        assert abs(rows["Bias"]) == pytest.approx(abs(np.nanmean(error)))


def test_outliers_are_named_by_the_error_that_they_are_of(measured) -> None:
    """A calibration that is off made "Outliers 100 %" beside a completeness of 95 %, which counts by the image."""
    _, found, _ = measured
    off = replace(found, errors=replace(found.errors, depth_z=replace(found.errors.depth_z, outlier_rate=1.0)))
    named = [{name: values[0] for name, _, values in table([off], view) if "utlier" in name} for view in ERROR_VIEWS]
    assert [list(one) for one in named] == [
        ["Outliers of depth"],
        ["Outliers of the surface"],
        ["Outliers in the image"],
    ]
    assert named[0]["Outliers of depth"] == 100.0
    assert named[2]["Outliers in the image"] == 100.0 * found.errors.u.outlier_rate < 100.0
