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
from studio.photographs import twin_noise, twin_profile
from studio.photographs.line_profile import Profile, Stretch, Transfer
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


def photon_transfer(values: np.ndarray, mean: np.ndarray) -> Transfer:
    """The exact noise of a sensor, (3,) as `twin_noise.Noise` has it, at some means, DN."""
    exact = Transfer(mean, mean - 40.0, mean, 0.02 * mean, np.arange(len(mean) + 1.0), 0.0, 0.01)
    variance = twin_noise.expected(values, exact, 32.0)
    return replace(exact, variance=variance, sigma=0.02 * variance)


def test_a_rehearsal_on_darker_ground_takes_nothing_off_the_noise() -> None:
    """Compared at the photographs' light, ground that was 8 DN darker made the read noise a fifth too large."""
    true = np.array([0.27, 7.3, 0.0])
    found = photon_transfer(true, np.linspace(85.0, 3000.0, 12))
    darker = photon_transfer(true, found.mean - 8.0)
    usual = twin_noise.expected(true, darker, 32.0)
    left = twin_noise.less(found, darker.variance, np.ones(12), usual)
    np.testing.assert_allclose(left.variance, found.variance)


def test_noise_is_as_sure_as_what_a_rehearsal_leaves_out_lets_it_be() -> None:
    """Against fits of noise that is off by as much by chance: 2000 tell a standard deviation to 1.6 %."""
    true, random = np.array([0.27, 7.3, 0.0]), np.random.default_rng(4)
    found = photon_transfer(true, np.linspace(85.0, 3000.0, 12))
    left_out = 0.06 * found.variance
    told = twin_noise.fit_noise(found, 32.0, 0.0, True, left_out).left_out
    off = [replace(found, variance=found.variance + left_out * random.standard_normal(12)) for _ in range(2000)]
    scatter = np.std([twin_noise.fit_noise(one, 32.0, 0.0, True, 0.0 * left_out).values for one in off], axis=0)
    np.testing.assert_allclose(told[:2], scatter[:2], rtol=3.5 * 0.016)


@pytest.mark.parametrize(("sheet", "most"), [(0.18, None), (3.0, 0.03)])
def test_what_a_thin_lines_width_is_hangs_on_how_sheet_and_blur_share_it(sheet: float, most: float | None) -> None:
    """At one phase of the pixels: all sheet, all blur and a mixture look alike, and are of unlike width."""
    random, count, half, blur = np.random.default_rng(6), 512, 40, 0.36
    distance = np.arange(-half, half + 1) - np.full((count, 1), 0.2)
    electrons = 100.0 + 12_000.0 * blurred_line(distance, sheet, blur)
    zeros, rows = np.zeros(count), np.arange(count)
    # positions that are known to 0.02 px spread one phase over a bin
    about = distance + random.normal(0.0, 0.02, (count, 1))
    stretch = Stretch(random.poisson(electrons).astype(float), about, zeros, rows, zeros.astype(np.intp))
    piece = Piece(stretch, np.full(count, sheet), zeros, np.ones(count), zeros)
    parts = twin_profile.parts_of(Seen([piece], max(sheet, 0.6), None, facing=False))
    shape = twin_profile.fit_shape(parts, np.array([1.0, 0.13, 0.0, 6.0]), halo=False)
    off = shape.best[0] * sheet**2 + shape.best[1] - sheet**2 - blur
    assert not shape.apart
    assert abs(off) < 3.0 * np.hypot(shape.line, shape.unlike / np.sqrt(3.0))
    relative = shape.unlike / (sheet**2 + blur)
    assert relative > 0.3 if most is None else relative < most


def test_what_a_rehearsal_shows_nothing_of_is_left_out() -> None:
    """A rehearsal may lose all scan lines of a short stretch: that stopped the fit with an internal error."""
    profile = Profile(np.linspace(-3.0, 3.0, 30), np.ones(30), np.ones(30))
    parts = [twin_profile.Part(profile, 1.0, 0.0, 1.0, place) for place in (0, 1, 2)]
    departed = twin_profile.departures(np.array([1.0, 0.5, 0.0, 5.0]), [parts[0], parts[2]])
    assert [one.place for one in twin_profile.less(parts, departed)] == [0, 2]
