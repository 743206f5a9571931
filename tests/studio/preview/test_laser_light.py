"""The light of a laser alone, as it is looked at."""

from __future__ import annotations

import numpy as np
import pytest

from studio.preview.inspection import inspect
from studio.preview.laser_light import laser_electrons
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.scan.stages import scaled


def test_the_light_of_a_laser_is_what_is_told_of_it_and_grows_with_its_power() -> None:
    root = template_folder("plane")
    project = scaled(Project.load(root / "project.json"), 0.1)
    electrons = laser_electrons(project, root, 0)
    told = inspect(project, root).lasers[0].light_electrons
    lit = electrons.max(axis=1)
    assert float(np.median(lit[lit > 0.0])) == pytest.approx(told, rel=0.05)
    laser = project.scene.lasers[0]
    rig = project.scene.rig.model_copy(update={"lasers": (laser.model_copy(update={"power": 2.0 * laser.power}),)})
    brighter = project.model_copy(update={"scene": project.scene.model_copy(update={"rig": rig})})
    np.testing.assert_allclose(laser_electrons(brighter, root, 0), 2.0 * electrons, rtol=1e-3, atol=1e-3)
