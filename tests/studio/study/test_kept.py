"""Charts that show the thing itself keep it of the first repeat; figures of others stand beside what is measured."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from render.base.errors import InputError
from studio.study.answers import answers
from studio.study.charts import chart, places
from studio.study.kept import picture_pixels
from studio.study.page import sentences, write_page
from studio.study.runner import run_study
from studio.study.store import Store
from studio.study.study import Study
from tests.studio.study.test_run import HERE

SEGMENTS = [16, 32]
DATA: dict[str, Any] = {
    "base": "sphere",
    "image_scale": 0.05,
    "repeats": 2,
    "set": {"render.goal": None, "render.transport": "direct", "render.ambient_samples": 1},
    "sweeps": [
        {
            "name": "facets",
            "vary": [
                {"field": "scene.objects[1].shape.segments", "values": SEGMENTS},
                {"field": "scene.objects[1].crease_angle", "values": [0.0, 3.1]},
            ],
            "measure": "facet_error",
            "references": [
                {"label": "A paper", "measure": "facet_error", "value": 0.002, "point": [16, 0.0]},
                {"label": "Another", "measure": "completeness", "value": 1.0, "point": [32, 3.1]},
            ],
        },
        {"name": "line", "vary": [{"field": "sensor.read_noise", "values": [1.0, 9.0]}], "chart": "profile"},
        {"name": "image", "vary": [{"field": "sensor.read_noise", "values": [1.0, 9.0]}], "chart": "pictures"},
    ],
}


@pytest.fixture(scope="module")
def run_of(tmp_path_factory: pytest.TempPathFactory) -> tuple[Study, Any, Any]:
    study = Study.model_validate(DATA)
    folder = tmp_path_factory.mktemp("kept")
    bases = study.bases(folder)
    with Store(folder, study.digest(bases)) as store:
        run_study(study, bases, store, engine=HERE)
        return study, bases, store.rows()


def test_depth_follows_the_facets_however_they_are_shaded(run_of: tuple[Study, Any, Any]) -> None:
    """A meridian of n segments is off by up to R (1 - cos(pi / n)), and so, across it, is a parallel."""
    spots = {spot.point: spot.measure.mean for spot in answers(*run_of)[0].spots}
    for segments in SEGMENTS:
        flat, smooth = (spots[segments, angle] for angle in (0.0, 3.1))
        most = 0.05 * (1.0 - math.cos(math.pi / segments) ** 2)
        assert flat == smooth and 0.3 * most < flat < most
    assert spots[16, 0.0] / spots[32, 0.0] == pytest.approx(4.0, rel=0.25)


def test_profiles_and_images_are_of_the_first_repeat_and_are_drawn(run_of: tuple[Study, Any, Any]) -> None:
    study, bases, rows = run_of
    _, line, image = answers(study, bases, rows)
    assert [one.point for one in line.kept] == [one.point for one in image.kept] == [(1.0,), (9.0,)]
    assert sum("kept" in row for row in rows.values()) == 4
    found = line.kept[0].content
    assert len(found["line"]) == len(found["depth"]) == len(found["error"]) > 50
    errors = np.array([one for one in found["error"] if one is not None])
    assert math.sqrt(np.mean(errors**2)) == pytest.approx(_first(line, rows, study, bases), rel=1e-3)
    assert picture_pixels(image.kept[0].content).shape == (102, 122)
    for answer in (line, image):
        assert len(chart(answer, {}).axes) == (3 if answer is line else 2) and np.isnan(places(answer)).all()


def _first(answer: Any, rows: Any, study: Study, bases: Any) -> float:
    from studio.study.cells import cells_at

    cells = cells_at(study, 1, bases, [answer.kept[0].point])
    return float(rows[next(cell.key for cell in cells if cell.repeat == 0)]["depth_rmse"])


def test_figures_of_others_are_a_table_marks_and_sentences(run_of: tuple[Study, Any, Any], tmp_path: Path) -> None:
    page, found = write_page(tmp_path, *run_of)
    assert "Beside the figures of others" in page.read_text() and "A paper" in page.read_text()
    assert [one.split(":")[0] for one in sentences(found[0], {})] == ["A paper", "Another"]
    assert "2e+03 µm; here" in sentences(found[0], {})[0]
    header, first, _ = (tmp_path / "references.csv").read_text().splitlines()
    assert header.startswith("sweep,label,measure,theirs,ours") and first.startswith("facets,A paper,facet_error,0.002")


def test_a_reference_of_no_point_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "study.json"
    sweep = {**DATA["sweeps"][0], "references": [{"label": "x", "measure": "completeness", "value": 1, "point": [1]}]}
    file.write_text(json.dumps({**DATA, "sweeps": [sweep]}))
    with pytest.raises(InputError, match="a value for each field that is varied"):
        Study.load(file)
