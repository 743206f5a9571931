"""Points of photographs and their report: shapes fitted without truth, strays, and the page."""

from __future__ import annotations

import json
import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from click.testing import CliRunner

import main
from render.scene.motion import LinearStage
from studio.photographs.fitted_shapes import fit_flat, fit_round
from studio.project.project import Project
from studio.project.templates import template_folder
from tests.analysis.line.line_images import expected, exposed


def test_a_plane_is_found_among_strays_and_its_noise_measured() -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform(-0.1, 0.1, (2000, 3))
    points[:, 2] = 0.3 * points[:, 0] - 0.2 * points[:, 1] + rng.normal(scale=2e-5, size=2000)
    points[:150, 2] += rng.uniform(0.001, 0.05, 150)
    fit = fit_flat(points)
    assert fit is not None and fit.strays == pytest.approx(0.075, abs=0.003)
    normal = np.array([0.3, -0.2, -1.0]) / np.sqrt(1.13)
    told = np.tile([0.0, 0.0, 2e-5], (2000, 1))
    # 1850 points: the RMS is known to 1.6 %, the median of the ratio to 2.6 %
    assert fit.rms == pytest.approx(2e-5 * abs(normal[2]), rel=0.05)
    assert fit.normalised(told) == pytest.approx(1.0, abs=0.09)
    assert abs(fit.direction[0] @ normal) == pytest.approx(1.0, abs=1e-6)


def test_a_sphere_is_found_by_a_part_of_it() -> None:
    rng = np.random.default_rng(1)
    away = rng.normal(size=(1500, 3)) * [0.5, 0.5, 0.2] + [0.0, 0.0, 1.0]
    away /= np.linalg.norm(away, axis=1)[:, None]
    points = 0.05 * away * (1.0 + rng.normal(scale=2e-4, size=(1500, 1))) + [0.3, 0.1, 0.9]
    points[:60] += rng.normal(scale=0.01, size=(60, 3))
    fit = fit_round(points)
    assert fit is not None and fit.radius == pytest.approx(0.05, rel=5e-4)
    assert fit.rms == pytest.approx(1e-5, rel=0.06) and fit.strays == pytest.approx(0.04, abs=0.005)


def test_points_on_one_line_are_no_plane() -> None:
    along = np.linspace(0, 1, 50)[:, None] * [0.1, 0.2, 0.3]
    assert fit_flat(along + 1e-6 * np.random.default_rng(2).normal(size=(50, 3))) is None


def test_photographs_of_a_plane_get_a_report_with_residuals_as_large_as_sigma_says(tmp_path: Path) -> None:
    project = Project.load(template_folder("plane") / "project.json")
    scene = project.scene.scaled(0.25)
    motion = LinearStage(moves="rig", step=(0.002, 0.0, 0.0), steps=3)
    project = project.model_copy(update={"scene": scene.model_copy(update={"motion": motion})})
    project.save(tmp_path / "rig.json")
    camera = scene.camera
    # a straight line in the image of a lens without distortion is one in the laser's plane
    centre = 0.5 * camera.width + 0.02 * np.arange(camera.height)
    names = []
    for k in range(3):
        electrons = exposed(expected(camera.width, centre, 3000, 1.5, 15.0), 3, np.random.default_rng(k))
        names.append(str(tmp_path / f"photo{k}.png"))
        cv2.imwrite(names[-1], np.round(electrons * 10).clip(0, 65535).astype(np.uint16))
    arguments = ["reconstruct", *names, "--project", str(tmp_path / "rig.json"), "--out", str(tmp_path / "out")]
    done = CliRunner().invoke(main.cli, [*arguments, "--json", "--quiet"])
    assert done.exit_code == 0, done.output
    answer = json.loads(done.stdout)
    assert answer["points"] > 0.98 * 3 * camera.height and answer["chosen"]["axis"] == "rows"
    lines, plane = answer["fits"][:3], answer["fits"][3]
    assert [fit["shape"] for fit in lines] == ["straight line"] * 3 and plane["shape"] == "plane"
    for fit in answer["fits"]:
        # the median of so many ratios scatters by 1.17 / sqrt(n)
        assert fit["over_sigma"] == pytest.approx(1.0, abs=0.08 + 4.0 * 1.17 / np.sqrt(camera.height))
        assert fit["strays"] < 0.01
    page = re.sub(r'"data:image/png;base64,[^"]*"', '""', (tmp_path / "out" / "photo0_report.html").read_text())
    assert "Nothing unusual." in page  # the surface is the shape, and sigma is true
    assert "http" not in page and "photo2.png" in page and "nan" not in page.lower()
    assert (tmp_path / "out" / "photo0_report.pdf").read_bytes().startswith(b"%PDF")
    again = CliRunner().invoke(main.cli, [*arguments, "--json", "--quiet", "--shape", "sphere", "--axis", "auto"])
    assert again.exit_code == 0, again.output  # its own files are replaced
    page = (tmp_path / "out" / "photo0_report.html").read_text()
    assert "lie beside its" not in page


def test_a_surface_of_another_shape_is_told_as_worth_noticing(tmp_path: Path) -> None:
    """A tenth of the line is on a ledge, and the third photograph is nowhere near where the project moves it to."""
    project = Project.load(template_folder("plane") / "project.json")
    scene = project.scene.scaled(0.25)
    motion = LinearStage(moves="rig", step=(0.002, 0.0, 0.0), steps=3)
    project.model_copy(update={"scene": scene.model_copy(update={"motion": motion})}).save(tmp_path / "rig.json")
    camera, names = scene.camera, []
    ledge = np.where(np.arange(camera.height) % camera.height < 0.1 * camera.height, 6.0, 0.0)
    for k in range(3):
        centre = 0.5 * camera.width + 0.02 * np.arange(camera.height) + ledge + (20.0 if k == 1 else 0.0)
        electrons = exposed(expected(camera.width, centre, 3000, 1.5, 15.0), 3, np.random.default_rng(k))
        names.append(str(tmp_path / f"photo{k}.png"))
        cv2.imwrite(names[-1], np.round(electrons * 10).clip(0, 65535).astype(np.uint16))
    arguments = ["reconstruct", *names, "--project", str(tmp_path / "rig.json"), "--out", str(tmp_path / "out")]
    done = CliRunner().invoke(main.cli, [*arguments, "--quiet"])
    assert done.exit_code == 0, done.output
    page = (tmp_path / "out" / "photo0_report.html").read_text()
    assert "Nothing unusual." not in page and "lie beside its straight line" in page
    assert "times farther from one plane" in page
