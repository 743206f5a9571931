import cv2
import numpy as np
import pytest
from pydantic import ValidationError

from render.camera.camera import Camera
from render.camera.distortion import FOLD_ANGLES, MAX_RADIUS, distort, fold_radii, tilt_matrix
from tests.render.scenes import paper_camera

COEFFICIENTS = (0.1, -0.2, 1e-3, 2e-3, 0.03, 0.1, 0.01, 2e-3, 1e-3, -2e-3, 3e-3, 1e-3, 0.02, -0.03)


def pixel_grid(camera, step=37):
    u, v = np.meshgrid(np.arange(0, camera.width, step), np.arange(0, camera.height, step))
    return np.stack([u, v], axis=-1).reshape(-1, 2).astype(float)


@pytest.mark.parametrize("length", [0, 4, 5, 8, 12, 14])
def test_projection_equals_opencv(length):
    camera = paper_camera(distortion=COEFFICIENTS[:length])
    points = np.random.default_rng(length).uniform((-0.4, -0.3, 0.7), (0.4, 0.3, 1.2), (2000, 3))
    pixels, valid = camera.project(points)
    expected = cv2.projectPoints(points, np.zeros(3), np.zeros(3), camera.matrix, camera.coefficients)[0][:, 0]
    assert np.count_nonzero(valid) > 1900
    assert np.abs(pixels - expected)[valid].max() < 1e-9


def test_pixel_centres_are_integers():
    camera = paper_camera()
    assert (camera.cx, camera.cy) == ((camera.width - 1) / 2, (camera.height - 1) / 2)
    border, _ = camera.normalise(np.array([[-0.5, -0.5], [2447.5, 2047.5]]))
    assert border[0] == pytest.approx(-border[1], abs=1e-15)


@pytest.mark.parametrize("k1", [-0.4, -0.1, 0.1, 0.4])
def test_strong_distortion_is_inverted_to_a_ten_billionth_of_a_pixel_or_said_to_have_no_ray(k1):
    camera = Camera(width=1200, height=1000, fx=600, fy=610, cx=599.5, cy=499.5, distortion=(k1, 0, 0, 0))
    pixels = pixel_grid(camera, 11)
    directions, valid = camera.rays(pixels)
    again, seen = camera.project(directions[valid])
    assert seen.all()
    assert np.abs(again - pixels[valid]).max() < 1e-10
    # k1 < 0 reaches out to r' = 2/3 r at r^2 = -1 / (3 k1), and no further
    radius = np.hypot(*((pixels - (camera.cx, camera.cy)) / (camera.fx, camera.fy)).T)
    edge = np.inf if k1 > 0 else 2.0 / 3.0 * np.sqrt(-1.0 / (3.0 * k1))
    assert valid[radius < edge - 1e-3].all()
    assert not valid[radius > edge + 1e-3].any()
    assert np.isnan(directions[~valid]).all()


def test_all_fourteen_coefficients_are_inverted():
    camera = paper_camera(distortion=COEFFICIENTS)
    pixels = pixel_grid(camera)
    directions, valid = camera.rays(pixels)
    assert valid.all()
    assert np.abs(camera.project(directions)[0] - pixels).max() < 1e-10


def test_points_beyond_the_fold_have_no_image():
    camera = Camera(width=1200, height=1000, fx=600, fy=600, cx=599.5, cy=499.5, distortion=(-0.4, 0, 0, 0))
    # without the check this point would show up in the middle of the image, on the wrong side
    _, valid = camera.project(np.array([[1.58, 0.0, 1.0], [0.5, 0.0, 1.0], [0.0, 0.0, -1.0]]))
    assert valid.tolist() == [False, True, False]


@pytest.mark.parametrize("terms", [1, 12, 14])
def test_the_fold_is_the_first_radius_where_the_map_turns_back(terms):
    k = np.zeros(14)
    k[:terms] = (3.0 * np.array(COEFFICIENTS) - 0.4 * (np.arange(14) == 0))[:terms]
    folds, tilt = fold_radii(k), tilt_matrix(k[12], k[13])
    assert np.all(folds > 0.1) and np.any(folds < MAX_RADIUS)

    def keeps_on(radius, angle):
        c, s = np.cos(angle), np.sin(angle)
        _, _, xx, xy, yx, yy = distort(radius * c, radius * s, k, tilt)
        return xx * yy - xy * yx > 0.0 and xx * c * c + (xy + yx) * c * s + yy * s * s > 0.0

    for i in range(0, FOLD_ANGLES, 31):
        angle = 2.0 * np.pi * i / FOLD_ANGLES
        assert all(keeps_on(share * folds[i], angle) for share in np.linspace(0.0, 1.0 - 1e-9, 60))
        assert folds[i] == MAX_RADIUS or not keeps_on((1.0 + 1e-9) * folds[i], angle)


def test_a_scaled_camera_sees_the_same_field():
    camera = paper_camera()
    for scale in (0.5, 0.1, 2.0):
        scaled = camera.scaled(scale)
        corner = np.array([[-0.5, -0.5]])
        assert scaled.normalise(corner)[0] == pytest.approx(camera.normalise(corner)[0], abs=1e-12)
        assert scaled.pixel_pitch * scaled.width == pytest.approx(camera.pixel_pitch * camera.width)


def test_focus_lengthens_the_image_distance():
    camera = Camera.from_physical(2448, 2048, 3.45e-6, 0.012, focus_distance=1.0)
    assert camera.fx == pytest.approx(3520.5, abs=0.05)
    assert camera.working_f_number == pytest.approx(1.4 / (1 - 0.012))
    assert Camera.from_physical(2448, 2048, 3.45e-6, 0.012).fx == pytest.approx(3478.26, abs=0.01)


@pytest.mark.parametrize(
    "change",
    [{"width": 0}, {"fx": -1.0}, {"distortion": (0.1, 0.2, 0.3)}, {"cy": float("nan")}, {"height": 10**9}, {"zoom": 2}],
)
def test_impossible_cameras_are_refused(change):
    with pytest.raises(ValidationError):
        Camera.model_validate({**paper_camera().model_dump(), **change})
