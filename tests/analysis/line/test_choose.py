"""Which peak is the line, and which method it needs: continuity, geometry, selection, and `auto`."""

import numpy as np
import pytest

from analysis.line.extract import extract
from analysis.line.result import Flag
from analysis.line.selection.geometry import WorkingVolume, consistent
from analysis.line.settings import ExtractionSettings
from render.base.errors import InputError
from render.base.pose import Pose
from render.camera.camera import Camera
from render.laser.laser import LineLaser, laser_plane
from tests.analysis.line.line_images import electrons, expected, exposed

ROWS, WIDTH = 600, 640


def groove(seed=0, brighter=3.0, mirror_rows=slice(200, 400)):
    """A V-shaped line and its mirror image, brighter on a third of the rows and fainter on the rest."""
    v = np.arange(ROWS)
    line = 300 - 0.25 * np.abs(v - ROWS / 2)
    mirror = 420 + 0.35 * np.abs(v - ROWS / 2)
    gain = np.full(ROWS, 0.4)
    gain[mirror_rows] = brighter
    mean = expected(WIDTH, line, 800, 1.5, 10.0) + gain[:, None] * expected(WIDTH, mirror, 800, 1.8, 0.0)
    return line, mirror, exposed(mean, 3, np.random.default_rng(seed)).astype(np.float32)


def wrong(line, centre):
    """Share of scan lines with a position more than 1 px off."""
    found = line.valid[:, 0]
    return np.mean(found & (np.abs(line.u[:, 0] - centre) > 1))


def rig():
    camera = Camera.from_physical(WIDTH, ROWS, 10e-6, 0.012)
    T_camera_laser = Pose(translation=(0.2, 0.0, 0.0), rotation=(0.0, -0.22, 0.0))
    return camera, LineLaser(), T_camera_laser.matrix


def test_row_maximum_takes_the_reflection_and_continuity_does_not():
    centre, _, image = groove()
    assert wrong(extract(image, method="row_maximum", noise=electrons(3)), centre) == pytest.approx(1 / 3, abs=0.01)
    settings = ExtractionSettings(select="continuous")
    line = extract(image, settings=settings, noise=electrons(3))
    assert wrong(line, centre) <= 0.02
    assert line.valid.mean() > 0.98
    assert line.candidates is not None and line.candidates.u.shape == (ROWS, 5)


def test_geometry_takes_out_reflections_that_no_chain_can():
    """The reflection is brighter everywhere: only where it would be in space tells it from the line."""
    centre, _, image = groove(brighter=2.5, mirror_rows=slice(0, ROWS))
    camera, laser, pose = rig()
    settings = ExtractionSettings(select="continuous")
    assert wrong(extract(image, settings=settings, noise=electrons(3)), centre) > 0.9
    plane = laser_plane(pose)

    def depth(u):
        ray = np.array([(u - camera.cx) / camera.fx, 0.0, 1.0])
        return -plane[3] / (ray @ plane[:3])

    near, far = sorted((depth(220), depth(360)))
    volume = WorkingVolume(camera, laser, pose, nearest=near, farthest=far)
    line = extract(image, settings=settings, noise=electrons(3), volume=volume)
    assert wrong(line, centre) == 0.0
    assert line.valid.mean() > 0.98


def test_a_peak_outside_the_fan_or_behind_is_not_the_line():
    camera, laser, pose = rig()
    _, _, image = groove()
    line = extract(image, peaks=2, noise=electrons(3))
    assert consistent(line, WorkingVolume(camera, laser, pose)).any()
    narrow = laser.model_copy(update={"fan_angle": 0.05})
    lit = consistent(line, WorkingVolume(camera, narrow, pose))
    rows = np.nonzero(lit.any(axis=1))[0]
    assert 0 < len(rows) < 0.5 * ROWS and abs(rows.mean() - ROWS / 2) < 30
    with pytest.raises(InputError, match="range is empty"):
        WorkingVolume(camera, laser, pose, nearest=2.0, farthest=1.0)


def test_a_glow_wider_than_the_sheet_can_be_is_not_the_line():
    camera, laser, pose = rig()
    plane = laser_plane(pose)
    centre = np.full(40, 300.0)
    image = exposed(expected(WIDTH, centre, 800, 9.0, 10.0), 3, np.random.default_rng(4)).astype(np.float32)
    glow = extract(image, noise=electrons(3))
    assert glow.valid.all() and np.median(glow.width) == pytest.approx(9.0, abs=0.3)
    assert not consistent(glow, WorkingVolume(camera, laser, pose)).any()
    depth = -plane[3] / (np.array([(300.0 - camera.cx) / camera.fx, 0.0, 1.0]) @ plane[:3])
    sheet = float(laser.sigma(depth)) * camera.fx / depth  # px, across the beam
    slanted = exposed(expected(WIDTH, centre, 800, 3.0 * sheet, 10.0), 3, np.random.default_rng(5)).astype(np.float32)
    assert consistent(extract(slanted, noise=electrons(3)), WorkingVolume(camera, laser, pose)).mean() > 0.9


def test_continuity_bridges_gaps_and_leaves_empty_rows_empty():
    centre, _, image = groove(brighter=0.0)
    rng = np.random.default_rng(3)
    gap, end = slice(100, 105), slice(450, ROWS)
    for rows in (gap, end):
        image[rows] = exposed(np.full(image[rows].shape, 10.0), 3, rng)
    image[np.arange(460, 600, 20), 50] += 3000.0  # single hot pixels are no line
    image[np.arange(460, 600, 20), 51] += 3000.0
    line = extract(image, settings=ExtractionSettings(select="continuous"), noise=electrons(3))
    assert not line.valid[gap].any() and not line.valid[end].any()
    assert (line.flag[460:600:20] == Flag.REJECTED).all()
    inside = np.r_[0:100, 105:450]
    assert line.valid[inside].all() and wrong(line, centre) == 0


def test_a_step_in_depth_is_followed():
    centre = np.where(np.arange(ROWS) < 250, 200.3, 330.7)
    image = exposed(expected(WIDTH, centre, 800, 1.5, 10.0), 3, np.random.default_rng(1)).astype(np.float32)
    line = extract(image, settings=ExtractionSettings(select="continuous"), noise=electrons(3))
    assert line.valid.all() and wrong(line, centre) == 0


@pytest.mark.parametrize(("how", "which"), [("first", 0), ("last", 1), ("strongest", 1)])
def test_the_selection_is_the_one_asked_for(how, which):
    line, mirror, image = groove(mirror_rows=slice(0, ROWS))
    found = extract(image, settings=ExtractionSettings(select=how), noise=electrons(3))
    assert wrong(found, (line, mirror)[which]) == 0


def auto(amplitude, sigma, read_noise, *, slope=0.0, saturation=None):
    rng = np.random.default_rng(2)
    centre = 100 + rng.uniform(-0.5, 0.5, 400)
    mean = expected(200, centre, amplitude, sigma, 10.0) + slope * np.arange(200)
    image = exposed(mean, read_noise, rng)
    if saturation:
        image = np.minimum(image, saturation)
    line = extract(image.astype(np.float32), method="auto", noise=electrons(read_noise, saturation=saturation))
    return line.method, line.note


def test_auto_takes_no_more_method_than_the_image_needs():
    assert auto(3000, 1.5, 3)[0] == "phase"
    for case, word in (
        ({"amplitude": 3000, "sigma": 0.45, "read_noise": 3}, "narrow"),
        ({"amplitude": 60, "sigma": 1.5, "read_noise": 3}, "faint"),
        ({"amplitude": 30000, "sigma": 1.5, "read_noise": 3, "saturation": 1e4}, "saturated"),
        ({"amplitude": 3000, "sigma": 1.5, "read_noise": 3, "slope": 6.0}, "the phase"),  # noisier, and dragged along
    ):
        method, note = auto(**case)
        assert method == "likelihood"
        assert word in note
