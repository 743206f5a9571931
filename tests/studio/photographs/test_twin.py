"""Twins of scanners that the program itself photographed: sheet, blur, halo and noise as they were."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from click.testing import CliRunner

import main
from render.laser.laser import Divergence, Waist
from render.run import Run
from render.sensor.develop import develop, expected_electrons
from render.world.world import build_world
from studio.photographs.line_profile import Stretch
from studio.photographs.twin import fitted
from studio.photographs.twin_light import numbers_of
from studio.photographs.twin_profile import blurred_line
from studio.photographs.twin_project import wider
from studio.photographs.twin_seen import Piece, Seen
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.scan.stages import Clock, render_step, scaled

SCALE, SHOTS, PEAK = 0.2, 4, 0.7
ANGLE, READ_NOISE, FULL_WELL, HALO, BLUR_PX, HALO_PX = 5e-3, 8.0, 8000.0, 0.1, 0.8, 6.0


def changed(project: Project, angle: float, **sensor: Any) -> Project:
    scene = project.scene
    laser = scene.lasers[0].model_copy(update={"sheet": Divergence(full_angle=angle)})
    scene = scene.model_copy(update={"rig": scene.rig.model_copy(update={"lasers": (laser,)})})
    render = project.render.model_copy(update={"truth_images": False, "transport": "direct"})
    given = {"scene": scene, "render": render, "sensor": project.sensor.model_copy(update=sensor)}
    return project.model_copy(update=given)


@pytest.fixture(scope="module")
def shots(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[Path], Project]:
    """A project that is wrong about its scanner, photographs of the scanner, and the scanner."""
    folder = tmp_path_factory.mktemp("twin")
    template = template_folder("plane")
    project = scaled(Project.load(template / "project.json"), SCALE)
    pitch = project.scene.camera.pixel_pitch
    true = changed(
        project, ANGLE, blur_sigma=BLUR_PX * pitch, read_noise=READ_NOISE, full_well=FULL_WELL, halo=HALO,
        halo_sigma=HALO_PX * pitch,
    )  # fmt: skip
    frame = render_step(true, build_world(true.scene, template, 0), 0, Clock(lambda _, __: None, lambda: False), Run())
    peaks = expected_electrons(frame, true.scene, true.sensor).max(axis=1)
    level = PEAK * FULL_WELL / float(np.quantile(peaks, 0.9))
    frame = replace(frame, laser_direct=((level * frame.laser(0)).astype(np.float32),), laser_indirect=())
    paths = []
    for seed in range(SHOTS):
        paths.append(folder / f"shot{seed}.png")
        cv2.imwrite(str(paths[-1]), develop(frame, true.scene, true.sensor, seed=seed).pixels)
    changed(project, 0.7 * ANGLE, blur_sigma=BLUR_PX * pitch).save(folder / "project.json")
    bright = [true.scene.lasers[0].model_copy(update={"power": level * true.scene.lasers[0].power})]
    scene = true.scene.model_copy(update={"rig": true.scene.rig.model_copy(update={"lasers": tuple(bright)})})
    return folder / "project.json", paths, true.model_copy(update={"scene": scene})


def twin(*arguments: object) -> tuple[int, Any]:
    done = CliRunner().invoke(main.cli, ["twin", *map(str, arguments), "--json", "--quiet"])
    return done.exit_code, json.loads(done.stdout)


def test_the_twin_has_the_scanners_sheet_halo_and_noise(shots: tuple[Path, list[Path], Project]) -> None:
    project, paths, true = shots
    out = project.with_name("made.json")
    code, answer = twin(project, *paths, "--out", out)
    assert code == 0 and answer["written"] == str(out)
    made, pitch = Project.load(out), true.scene.camera.pixel_pitch
    assert made.scene.lasers[0].sheet.full_angle == pytest.approx(ANGLE, rel=0.05)
    assert made.sensor.halo == pytest.approx(HALO, rel=0.1)
    assert made.sensor.halo_sigma / pitch == pytest.approx(HALO_PX, rel=0.1)
    assert made.sensor.dn_per_electron == pytest.approx(true.sensor.dn_per_electron, rel=0.1)
    assert made.sensor.full_well == pytest.approx(FULL_WELL, rel=0.1)
    for light in (300.0, 0.5 * FULL_WELL):  # of a pixel beside the line, and on it
        noise, known = (np.sqrt(one.sensor.read_noise**2 + light) for one in (made, true))
        assert noise == pytest.approx(known, rel=0.1)
    assert made.scene.lasers[0].power == pytest.approx(true.scene.lasers[0].power, rel=0.05)
    # a sheet that is as wide everywhere says nothing of the blur, which stays
    assert answer["blur_px"]["kept"] and made.sensor.blur_sigma == pytest.approx(BLUR_PX * pitch)
    for name, value in (("gain", true.sensor.dn_per_electron), ("halo", HALO), ("read_noise", READ_NOISE)):
        assert abs(answer[name]["value"] - value) < 4.0 * answer[name]["sigma"]


def test_a_sheet_that_widens_along_the_line_tells_it_from_the_blur() -> None:
    project = Project.load(template_folder("plane") / "project.json")
    rng, count, half = np.random.default_rng(5), 1200, 40
    sheet, blur, scale = np.linspace(0.8, 2.4, count), 1.1, 1.25
    distance = np.arange(-half, half + 1) - rng.uniform(-0.5, 0.5, (count, 1))
    electrons = 100.0 + 12_000.0 * blurred_line(distance, scale * sheet[:, None], blur**2)
    gain = project.sensor.dn_per_electron
    values = np.rint(gain * rng.poisson(electrons) + project.sensor.black_level)
    zeros, rows = np.zeros(count), np.arange(count)
    stretch = Stretch(values, distance, zeros, rows, zeros.astype(np.intp))
    piece = Piece(stretch, sheet, zeros, np.ones(count), -distance[:, half])
    found = fitted(project, Seen([piece], 2.0, None, facing=False), numbers_of(project, 0)).twin
    assert not found.blur_px.why and found.blur_px.value == pytest.approx(blur, rel=0.1)
    assert found.scale.value == pytest.approx(scale, rel=0.05)
    assert found.gain.value == pytest.approx(gain, rel=0.1)
    for told, true in ((found.blur_px, blur), (found.scale, scale), (found.gain, gain)):
        assert abs(told.value - true) < 4.0 * told.sigma


def test_the_twin_is_refused_in_words(shots: tuple[Path, list[Path], Project], tmp_path: Path) -> None:
    project, paths, _ = shots
    image = cv2.imread(str(paths[0]), cv2.IMREAD_UNCHANGED)
    cases = {
        "small": image[:100], "bits": (image // 16).astype(np.uint8), "colour": np.stack([image, image // 2, image], 2),
    }  # fmt: skip
    cases["noise"] = (100 + 5 * np.random.default_rng(1).standard_normal(image.shape)).astype(np.uint16)
    for name, pixels in cases.items():
        cv2.imwrite(str(tmp_path / f"{name}.png"), pixels)
    out = tmp_path / "out.json"
    for given in (*(tmp_path / f"{name}.png" for name in cases), tmp_path / "absent.png"):
        code, answer = twin(project, given, "--out", out)
        assert code == 2 and given.name in answer["error"]["message"] and not out.exists()
    assert twin(project, paths[0], "--out", project)[0] == 2
    assert twin(project, paths[0], "--laser", 7, "--out", out)[0] == 2


def test_a_focused_sheet_is_wider_by_the_same_at_every_distance() -> None:
    laser = Project.load(template_folder("plane") / "project.json").scene.lasers[0]
    focused = laser.model_copy(update={"sheet": Waist()})
    z = np.linspace(0.5, 1.2, 8)
    assert wider(focused, 1.3).sigma(z) == pytest.approx(1.3 * focused.sigma(z))
    assert wider(laser, 1.3).sigma(z) == pytest.approx(1.3 * laser.sigma(z), rel=1e-6)
