"""On four templates the effects and their interaction make the error that a scan has."""

from __future__ import annotations

from pathlib import Path

import pytest

from studio.study.answers import answers
from studio.study.runner import run_study
from studio.study.store import Store
from studio.study.study import Study

pytestmark = pytest.mark.validation


@pytest.mark.parametrize("template", ["plane", "step_block", "v_groove", "sphere"])
def test_terms_add_up_to_the_total(tmp_path: Path, template: str) -> None:
    sweep = {"name": "budget", "sampling": "effects"}
    study = Study.model_validate({"base": template, "image_scale": 0.25, "repeats": 8, "sweeps": [sweep]})
    bases = study.bases(tmp_path)
    with Store(tmp_path, study.digest(bases)) as store:
        run_study(study, bases, store)
        (found,) = answers(study, bases, store.rows())[0].budgets
    assert found.bias.adds_up and found.variance.adds_up
