"""On four templates the effects and their interaction make the error that a scan has.

A quarter of the rows at a third of the pixels a side, where the line is still half a pixel wide: no effect on a
narrower one is small.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from studio.study.answers import answers
from studio.study.budget_table import LARGEST, simulation_share
from studio.study.effects import WHOLE_IMAGE
from studio.study.runner import run_study
from studio.study.store import Store
from studio.study.study import Study

pytestmark = pytest.mark.validation

PART = {"scene.rig.camera.height": 512, "scene.rig.camera.cy": 255.5}
"""Of the image, about its middle."""


@pytest.mark.parametrize("template", ["plane", "step_block", "v_groove", "sphere"])
def test_terms_add_up_to_the_total(tmp_path: Path, template: str) -> None:
    sweep = {"name": "budget", "sampling": "effects"}
    study = Study.model_validate(
        {"base": template, "image_scale": 0.35, "repeats": 8, "set": {**PART, **WHOLE_IMAGE}, "sweeps": [sweep]}
    )
    bases = study.bases(tmp_path)
    with Store(tmp_path, study.digest(bases)) as store:
        run_study(study, bases, store)
        (found,) = answers(study, bases, store.rows())[0].budgets
    for what in (found.bias, found.variance):
        rest = f"{what.rest.mean:.2g} ({what.rest.low:.2g} to {what.rest.high:.2g})"
        print(f"{template}: total {what.total.mean:.3g}, three or more effects {rest}")
    own = simulation_share(found)
    print(f"{template}: the simulation makes {own.mean:.1%} ({own.low:.1%} to {own.high:.1%}) of the variance")
    assert found.bias.adds_up and found.variance.adds_up
    assert own.mean < LARGEST
