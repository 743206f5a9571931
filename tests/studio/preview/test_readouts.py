"""The design read-outs agree with closed forms, with what a render shows, and with the published limits."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analysis.line.detection.noise import NoiseModel
from analysis.line.extract import extract
from analysis.line.result import Flag
from analysis.line.settings import ExtractionSettings
from analysis.report.total import NARROW_PX
from render.base.pose import Pose
from render.camera.camera import Camera
from studio.editing import units
from studio.preview.estimates import blur_px, centre_bound_px, depth_of_field, detection_response, read_variance
from studio.preview.inspection import inspect
from studio.preview.preview import Preview
from studio.preview.readout_rows import NOTHING, Row, rows
from studio.preview.readouts import Range, Readouts, readouts
from studio.project.document import replaced
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.study.small_images import small_image_doubts
from studio.study.study import Study
from tests.analysis.line.line_images import expected

PROJECTS = Path(__file__).parents[3] / "assets/projects"
CAMERA, LASER = ("scene", "rig", "camera"), ("scene", "rig", "lasers", 0)


def sample(name: str) -> Project:
    return Project.load(PROJECTS / name / "project.json")


def read(project: Project, name: str) -> Readouts:
    return readouts(Preview(1).look(project, PROJECTS / name), 0)


def row(project: Project, name: str, key: str) -> Row:
    return next(found for found in rows(read(project, name)) if found.key == key)


@pytest.mark.parametrize("name", ["plane", pytest.param("weld_seam", marks=pytest.mark.validation)])
def test_they_agree_with_the_rendered_inspection(name: str) -> None:
    project = sample(name)
    dark = replaced(project, ("scene", "lights"), ())
    dark = replaced(dark, ("scene", "environment", "radiance"), (0.0, 0.0, 0.0))
    quick, slow = read(dark, name), inspect(dark, PROJECTS / name).lasers[0]
    assert quick.baseline == slow.baseline
    assert quick.triangulation_angle is not None and quick.depth_per_px is not None
    assert quick.triangulation_angle.middle == pytest.approx(slow.triangulation_angle, rel=1e-9)
    assert quick.depth_per_px.middle == pytest.approx(slow.depth_per_px, rel=1e-6)
    assert quick.scan_lines_hit == slow.scan_lines_hit
    assert (quick.working_nearest, quick.working_farthest) == (slow.working_nearest, slow.working_farthest)
    # the inspection renders the light; median over rows of the brightest pixel
    assert quick.peak_electrons is not None
    assert quick.peak_electrons.middle == pytest.approx(slow.peak_electrons, rel=0.05)


def test_the_lines_width_is_that_of_the_rendered_rows() -> None:
    # rendered: total over peak of a row, which holds the pixel's own box; median over sub-pixel phases
    project = replaced(sample("plane"), (*LASER, "sheet", "full_angle"), 4e-3)
    quick, slow = read(project, "plane"), inspect(project, PROJECTS / "plane").lasers[0]
    assert quick.width_px is not None and slow.width_px is not None and quick.width_px.middle > 3.0
    assert quick.width_px.middle == pytest.approx(slow.width_px, rel=0.01)


def test_depth_per_pixel_is_z_squared_over_baseline_and_focal_length() -> None:
    # parallel axes: z = B f / (u - cx) in the sheet x = B + z tan(a)
    project = sample("plane")
    r = read(project, "plane")
    assert r.distance is not None and r.depth_per_px is not None
    camera = project.scene.camera
    expected = r.distance.middle**2 / (0.2 * camera.fx)
    assert r.depth_per_px.middle == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize(
    ("read_noise", "amplitude", "sigma", "bound"),
    [(2, 1000, 1.5, 0.0263), (5, 1000, 1.5, 0.0276), (10, 300, 1.5, 0.0691), (5, 10000, 1.0, 0.0066),
     (2, 100, 3, 0.1406), (10, 100, 0.8, 0.1312), (2, 10000, 0.6, 0.0055)],
)  # fmt: skip
def test_the_centre_bound_is_the_joint_cramer_rao_bound(
    read_noise: float, amplitude: float, sigma: float, bound: float
) -> None:
    """Against the inverse Fisher matrix over A, c, s, b of the pixel-integrated model, background 10 e-."""
    quick = centre_bound_px(np.array([amplitude]), np.array([sigma]), np.array([10.0]), read_noise**2)[0]
    exact = joint_bound(amplitude, sigma, 10.0, read_noise**2)
    assert exact == pytest.approx(bound, rel=0.02)
    assert 0.975 < quick / exact < 1.005


def joint_bound(amplitude: float, sigma: float, background: float, variance: float) -> float:
    from scipy.special import ndtr

    x = np.arange(-40, 41)
    bounds = []
    for phase in np.linspace(-0.5, 0.5, 16, endpoint=False):

        def mean(p: np.ndarray) -> np.ndarray:
            a, c, s, b = p
            area = ndtr((x + 0.5 - c) / s) - ndtr((x - 0.5 - c) / s)
            return a * s * math.sqrt(2 * math.pi) * area + b

        p = np.array([amplitude, phase, sigma, background])
        step = 1e-6 * np.array([amplitude, 1.0, 1.0, 1.0])
        J = np.stack([(mean(p + e) - mean(p - e)) / (2 * e.sum()) for e in np.diag(step)], axis=1)
        fisher = J.T @ (J / (mean(p) + variance)[:, None])
        bounds.append(np.linalg.inv(fisher)[1, 1])
    return math.sqrt(float(np.mean(bounds)))


def test_quantisation_counts_as_read_noise() -> None:
    sensor = sample("plane").sensor
    coarse = sensor.model_copy(update={"bits": 8, "gain": None})
    step = 1.0 / coarse.dn_per_electron
    assert read_variance(coarse) == pytest.approx(sensor.read_noise**2 + sensor.dsnu**2 + step**2 / 12)


def test_blur_is_nought_in_focus_and_the_limits_of_sharpness_have_one_pixel() -> None:
    camera = Camera.from_physical(2448, 2048, 3.45e-6, 0.012, f_number=5.6, focus_distance=0.8)
    near, far = depth_of_field(camera)
    points = np.array([[0.1, -0.05, depth] for depth in (near, 0.8, far)])
    np.testing.assert_allclose(blur_px(camera, points), (1.0, 0.0, 1.0), atol=1e-9)
    assert near < 0.8 < far
    # the textbook's hyperfocal distance f^2 / (N c), beyond which focusing keeps infinity sharp
    hyperfocal = 0.012**2 / (5.6 * 3.45e-6) + 0.012
    beyond = Camera.from_physical(2448, 2048, 3.45e-6, 0.012, f_number=5.6, focus_distance=1.001 * hyperfocal)
    before = Camera.from_physical(2448, 2048, 3.45e-6, 0.012, f_number=5.6, focus_distance=0.999 * hyperfocal)
    assert math.isinf(depth_of_field(beyond)[1]) and math.isfinite(depth_of_field(before)[1])


def test_a_blur_that_images_have_not_is_told_to_be_off_in_them() -> None:
    for defocus in (False, True):
        project = replaced(sample("plane"), ("sensor", "defocus"), defocus)
        found = next(row for row in rows(read(project, "plane")) if row.key == "blur")
        assert (found.note == "off in images") != defocus


def test_four_times_the_exposure_halves_the_photon_noise_and_saturates() -> None:
    project = sample("plane")
    time = project.sensor.exposure_time
    short = read(replaced(project, ("sensor", "exposure_time"), time), "plane")
    long = read(replaced(project, ("sensor", "exposure_time"), 4 * time), "plane")
    assert short.photon_sigma is not None and long.photon_sigma is not None
    assert long.photon_sigma == pytest.approx(short.photon_sigma / 2, rel=0.02)
    assert short.saturated == 0.0 and long.saturated == 1.0
    # light and its speckle grow alike; of read noise, which weighs the flanks, little is left in either
    assert short.speckle_sigma == pytest.approx(long.speckle_sigma, rel=0.01)


def test_depth_noise_is_that_of_the_sensor_as_it_is_set() -> None:
    smooth = replaced(sample("plane"), ("sensor", "speckle"), "off")
    off, on = (read(replaced(smooth, ("sensor", "speckle"), how), "plane") for how in ("off", "polarised"))
    told_off, told_on = (next(row for row in rows(r) if row.key == "sigma") for r in (off, on))
    assert off.depth_sigma == off.photon_sigma == on.photon_sigma
    assert on.depth_sigma == pytest.approx(math.hypot(on.photon_sigma, on.speckle_sigma))
    assert told_off.note == f"with speckle {told_on.value.removesuffix(' µm')}"
    # a share that saturates by speckle is beside a peak that none is in
    full_off, full_on = (next(row for row in rows(r) if row.key == "saturated").note for r in (off, on))
    assert full_on == f"{full_off} without speckle" and full_off.endswith("% of full well")
    assert "switch it on" in told_off.help.lower() and "switch it on" not in told_on.help.lower()


def test_depth_noise_says_where_it_takes_the_line_to_be_sharp_and_unsaturated() -> None:
    blurred = replaced(sample("plane"), (*CAMERA, "lens", "focus_distance"), 0.3)
    exposed = replaced(sample("plane"), ("sensor", "exposure_time"), 4 * sample("plane").sensor.exposure_time)
    for project, told in ((sample("plane"), ""), (blurred, "as if in focus, "), (exposed, "saturated")):
        found = next(row for row in rows(read(project, "plane")) if row.key == "sigma")
        assert (found.note.startswith(told) and found.level == "warning") if told else "as if" not in found.note
        assert (found.value == NOTHING) == (project is exposed), "more light would make it look better"
        full = next(row for row in rows(read(project, "plane")) if row.key == "saturated").note
        assert full.endswith(", as if in focus") == (project is blurred), "a lens that blurs fills no pixel like this"
    some = replace(read(sample("plane"), "plane"), saturated=0.3)
    assert next(row for row in rows(some) if row.key == "sigma").note.startswith("as if unsaturated, with speckle ")


@pytest.mark.parametrize(("times", "least", "most"), [(0.6, 0.0, 0.1), (1.0, 0.3, 0.7), (1.5, 0.95, 1.0)])
@pytest.mark.parametrize(("sigma", "background"), [(0.6, 0.0), (1.0, 250.0), (3.0, 250.0)])
def test_the_least_response_is_found_on_half_of_the_scan_lines(
    times: float, least: float, most: float, sigma: float, background: float
) -> None:
    lines, read, threshold = 2000, 5.0, ExtractionSettings().threshold
    random = np.random.default_rng(2)
    one = detection_response(np.ones(1), np.full(1, sigma), np.full(1, background), read**2)[0]
    light = expected(320, 160 + random.uniform(-0.5, 0.5, lines), times * threshold / one, sigma, 0.0)
    image = random.poisson(light + background) + read * random.standard_normal(light.shape)
    line = extract(image.astype(np.float32), noise=NoiseModel(read_noise=read, step=0.0))
    assert least <= np.mean(line.flag[:, 0] != Flag.NO_PEAK) <= most


@pytest.mark.parametrize(("milliwatts", "level"), [(0.1, "error"), (0.3, "warning"), (0.7, "")])
def test_a_line_that_is_lost_in_the_light_beneath_it_is_warned_of(milliwatts: float, level: str) -> None:
    """A peak of 285 e-, of which 250 were ambient light, was uncoloured, and 0.8 % of the scan lines were measured."""
    root = template_folder("v_groove")
    project = replaced(Project.load(root / "project.json"), (*LASER, "power"), 1e-3 * milliwatts)
    r = readouts(Preview(1).look(project, root), 0)
    (peak,) = [row for row in rows(r) if row.key == "peak"]
    assert peak.level == level and r.laser_electrons is not None and r.ambient_electrons is not None
    assert peak.note == f"laser {r.laser_electrons:,.0f} over {r.ambient_electrons:,.0f}"
    assert r.peak_electrons is not None
    assert r.laser_electrons + r.ambient_electrons == pytest.approx(r.peak_electrons.middle, rel=0.01)


def test_the_working_range_tells_what_of_it_the_lens_leaves_sharp() -> None:
    sharp = replaced(sample("plane"), ("sensor", "defocus"), False)
    blurred = replaced(sharp, ("sensor", "defocus"), True)
    near = replaced(blurred, (*CAMERA, "lens", "focus_distance"), 0.1)
    assert row(sharp, "plane", "working").note == ""
    r = read(blurred, "plane")
    assert r.working_nearest is not None and r.working_nearest < r.sharp_nearest < r.sharp_farthest
    assert row(blurred, "plane", "working").note == row(blurred, "plane", "blur").note
    assert row(near, "plane", "working").note == "sharp nowhere"


def test_nothing_lit_leaves_what_the_rig_alone_decides() -> None:
    project = replaced(sample("plane"), ("scene", "objects"), ())
    r = read(project, "plane")
    assert r.depth_per_px is None and r.depth_sigma is None and r.scan_lines_hit == 0 and r.occluded is None
    assert r.working_nearest is not None and r.working_depth_per_px is not None
    assert r.working_depth_per_px[1] == pytest.approx(100 * r.working_depth_per_px[0], rel=1e-3)
    assert {found.value for found in rows(r) if found.key in ("angle", "depth", "peak", "sigma")} == {NOTHING}


def test_of_no_line_no_share_is_occluded() -> None:
    """0 % was told of a fan that falls between two scan lines, and a dash where there is no object."""
    project = sample("step_block")
    for wrong in ((("scene", "objects"), ()), (("scene", "rig", "lasers", 0, "fan_angle"), math.radians(0.001))):
        none = replaced(project, *wrong)
        assert read(none, "step_block").scan_lines_hit == 0
        assert row(none, "step_block", "occluded").value == NOTHING
    behind = Pose(translation=(0.0, 0.0, 1.5), rotation=(math.pi, 0.0, 0.0))
    hidden = replaced(project, ("scene", "rig", "lasers", 0, "T_rig_laser"), behind)
    assert row(hidden, "step_block", "occluded").value == "100%", "all of it is behind the block"


def test_rows_warn_where_a_value_leaves_its_sensible_range() -> None:
    project = replaced(sample("plane"), (*CAMERA, "lens", "focus_distance"), 0.8663)
    assert {found.key: found.level for found in rows(read(project, "plane")) if found.level} == {}
    bright = replaced(project, (*LASER, "power"), 1.0)
    assert row(bright, "plane", "saturated").level == "error"
    wide = replaced(project, (*LASER, "sheet", "full_angle"), 1e-2)
    assert row(wide, "plane", "width").level == "warning"
    far = replaced(project, (*CAMERA, "lens", "focus_distance"), None)
    assert row(far, "plane", "blur").level == "error"
    away = replaced(project, (*LASER, "T_rig_laser"), Pose(translation=(0.2, 0, 0), rotation=(0, 0.9, 0)))
    assert row(away, "plane", "working").level == "error"


def test_a_design_a_study_and_a_report_tell_one_limit_of_a_thin_line() -> None:
    """The design wanted 0.5 px, and a study and a report warned from 0.4 px on."""
    found = read(sample("plane"), "plane")

    def of(width: float) -> Row:
        seen = replace(found, width_px=Range(width, width, width))
        return next(row for row in rows(seen) if row.key == "width")

    assert of(1.01 * NARROW_PX).level == "" and of(0.99 * NARROW_PX).level == "warning"
    assert f"{NARROW_PX:g} to 6 px measure well" in of(1.0).help
    small = Study.model_validate(
        {"base": "plane", "image_scale": 0.05, "sweeps": [{"name": "s", "vary": [{"field": "seed", "values": [1]}]}]}
    )
    assert f"which want {NARROW_PX:g} px" in " ".join(small_image_doubts(small, small.bases(Path())))
    page = (Path(__file__).parents[3] / "assets/help/readout.md").read_text()
    assert f"{NARROW_PX:g} to 6 px measure well" in page


def test_distances_are_in_the_unit_that_fields_show(monkeypatch: pytest.MonkeyPatch) -> None:
    made = read(sample("plane"), "plane")
    told = {row.key: row for row in rows(made)}
    monkeypatch.setitem(units.SHOWN, "m", "in")
    inches = {row.key: row for row in rows(made)}
    for key in ("baseline", "standoff"):
        (value, unit), (other, inch) = told[key].value.split(), inches[key].value.split()
        assert (unit, inch) == ("mm", "in")
        assert float(value) == pytest.approx(25.4 * float(other), rel=0.01)
    assert inches["working"].value.endswith(" in")
    assert inches["depth"] == told["depth"]


@pytest.mark.parametrize(("name", "told"), [("weld_seam", "as if plain, with speckle"), ("plane", "with speckle")])
def test_noise_that_texture_adds_is_said_to_be_left_out(name: str, told: str) -> None:
    """Of the seam's 20.8 um Design tells 11.9."""
    project = Project.load(name)
    found = rows(readouts(Preview().look(project, project.folder), 0))
    (row,) = [one for one in found if one.key == "sigma"]
    assert row.note.startswith(told) and row.level == ""
    assert ("Texture" in row.help) == (name == "weld_seam")
