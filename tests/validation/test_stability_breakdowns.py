"""The ready-made study of stability, run as it ships, breaks where numerical experiments and closed forms say.

EXPERIMENT is of seeded experiments on drawn lines, apart from this program (pixel-integrated Gaussian lines, 8000 rows
a cell): the RMS error of 3000 electrons a row with 5 e- of read noise, by width. Saturation, detection and edges are of
the same source; the rest is of closed forms, as said at each.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import curve_fit

from analysis.study.intervals import mean_interval
from render.base.arrays import Float
from studio.project.project import Project
from studio.runtime.workers import Engine
from studio.study.answers import Answer, answers
from studio.study.begin import begin
from studio.study.runner import run_study
from studio.study.store import Row
from studio.study.study import Study
from studio.study.tables import grouped, values_of

pytestmark = pytest.mark.validation

FULL_WELL, READ_NOISE = 10_500.0, 2.5
DIGIT = FULL_WELL / 2**12
NOISE = math.sqrt(READ_NOISE**2 + DIGIT**2 / 12.0)
"""e- of a dark pixel."""
PRINCIPAL, F_NUMBER, PIXEL = 0.012, 5.6, 6.9e-6
FOCAL_PX, DEPTH, WAVELENGTH = PRINCIPAL / PIXEL, 0.8663, 450e-9
TILT, LASER_ANGLE = 0.523598776, 0.226893
WINDOWED = ("phase", "centre_of_mass", "blais_rioux_8")
EXPERIMENT = {  # RMS error, px, by width, px
    "likelihood": {3.0: 0.067, 5.0: 0.116},
    "gaussian": {3.0: 0.074, 5.0: 0.127},
    "phase": {0.2: 0.120, 0.3: 0.057, 0.4: 0.018, 3.0: 0.067, 5.0: 0.117},
    "centre_of_mass": {0.2: 0.104, 0.3: 0.039, 0.4: 0.015, 3.0: 0.076, 5.0: 0.139},
    "blais_rioux_8": {0.2: 0.10, 0.3: 0.04, 0.4: 0.012, 3.0: 0.092, 5.0: 0.277},
    "gauss_3": {0.2: 0.076, 0.3: 0.031, 0.4: 0.014, 1.5: 0.090, 2.0: 0.181},
}


class Found:
    """What the study says, by the name of a sweep."""

    def __init__(self, study: Study, bases: Mapping[str, Project], rows: Mapping[str, Row]) -> None:
        self.answers: dict[str, Answer] = {one.sweep.name: one for one in answers(study, bases, rows)}
        self._groups = {sweep.name: grouped(study, bases, rows, n) for n, sweep in enumerate(study.sweeps)}

    def place(self, sweep: str, method: str) -> float:
        """Where a method breaks; NaN: it holds as far as it was asked."""
        (one,) = (one for one in self.answers[sweep].broken if one.method == method)
        assert one.breakdown.ending != "fails", f"{sweep} by {method} fails from the start"
        return one.breakdown.value if one.breakdown.ending == "found" else math.nan

    def cause(self, sweep: str, method: str) -> str:
        (one,) = (one for one in self.answers[sweep].broken if one.method == method)
        return one.cause

    def curve(self, sweep: str, method: str, measure: str, second: object = None) -> tuple[list[float], Float]:
        """The first parameter's values in order, and means over the repeats there; second: the second one's value."""
        groups = self._groups[sweep].items()
        mine = {point[0]: rows for (point, of), rows in groups if of == method and second in (None, *point[1:])}
        values = sorted(mine, key=str) if any(isinstance(one, str) for one in mine) else sorted(mine)
        return values, np.array([mean_interval(values_of(mine[one], measure)).mean for one in values])

    def at(self, sweep: str, method: str, measure: str, value: object) -> float:
        values, means = self.curve(sweep, method, measure)
        return float(means[values.index(value)])  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Found:
    folder: Path = tmp_path_factory.mktemp("stability")
    study, root = Study.load("stability")
    bases, engine = study.bases(root), Engine(2, None)
    with begin(folder, study, bases, engine) as store:
        run_study(study, bases, store, engine=engine)
        return Found(study, bases, store.rows())


def width_px(found: Found, full_angle: float) -> float:
    """Sigma of the line on the dark plate: as the likelihood measures a wide one, in proportion."""
    angle = max(found.curve("Wide lines", "likelihood", "line_width")[0], key=lambda one: -abs(one - 0.005))
    return found.at("Wide lines", "likelihood", "line_width", angle) * full_angle / angle


def reaches(method: str, limit: float, widths: tuple[float, float]) -> float:
    """The width at which the experiment's error is at a limit, in logarithms between two widths."""
    a, b = widths
    share = math.log(limit / EXPERIMENT[method][a]) / math.log(EXPERIMENT[method][b] / EXPERIMENT[method][a])
    return float(a * (b / a) ** share)


def peak_rate(found: Found) -> float:
    """e- of the line's peak for each second, on the dark plate."""
    exposures, peaks = found.curve("Too much light", "likelihood", "signal")
    return float(peaks[0]) / exposures[0]


def test_a_faint_line_is_lost_about_four_times_the_noise(found: Found) -> None:
    """A peak of 3.75 times the noise is the row's maximum in 72 % of the rows, one of 5 times in 95 %."""
    sweep = "Too little light"
    for method in ("likelihood", "steger_2d", *WINDOWED):
        ratio = found.place(sweep, method) * peak_rate(found) / NOISE
        print(f"{method}: 95 % of the rows at a peak of {ratio:.2f} times the noise")
        assert 4.5 < ratio < 5.5 and found.cause(sweep, method) == "starved"
        exposures, complete = found.curve(sweep, method, "completeness")
        at = np.array(exposures) * peak_rate(found) / NOISE
        assert 0.5 < np.interp(3.75, at, complete) < 0.8 and np.interp(2.0, at, complete) < 0.2


def test_a_line_drowns_in_other_light_as_in_the_noise_of_the_sensor(found: Found) -> None:
    """Its shot noise counts as read noise does: the same peak over noise is lost."""
    sweep = "Too much other light"
    for method in ("likelihood", *WINDOWED):
        lamps, light = found.curve(sweep, method, "background")
        place = found.place(sweep, method)
        noise = math.sqrt(NOISE**2 + np.interp(place, lamps, light))
        ratio = found.curve(sweep, "likelihood", "signal")[1][0] / noise
        print(f"{method}: lost beside {place:.0f} W/sr, at a peak of {ratio:.2f} times the noise")
        assert 4.0 < ratio < 6.0 and found.cause(sweep, method) == "too much other light"


def test_three_points_fail_at_the_full_well_and_what_leaves_saturated_pixels_out_never(found: Found) -> None:
    """Three points at 1 to 2 times the full well, censored fits never; Blais-Rioux at 30 to 100, here at 20."""
    sweep, full = "Too much light", FULL_WELL / peak_rate(found)
    times = {method: found.place(sweep, method) / full for method in EXPERIMENT}
    print({method: round(value, 2) for method, value in times.items()})
    assert 0.9 < times["gauss_3"] < 1.2
    assert 10.0 < times["blais_rioux_8"] < 100.0
    for method in ("likelihood", "gaussian", "phase", "centre_of_mass"):
        assert math.isnan(times[method])
    assert found.cause(sweep, "gauss_3") == found.cause(sweep, "blais_rioux_8") == "saturated"
    error = found.curve(sweep, "likelihood", "position_rmse")[1]
    assert error[-1] == pytest.approx(0.0062, abs=0.0006), "of 100 times the full well, in the experiment"


def test_wide_lines_reach_a_tenth_of_a_pixel_where_the_experiment_does(found: Found) -> None:
    for method in EXPERIMENT:
        widths = (1.5, 2.0) if method == "gauss_3" else (3.0, 5.0)
        ours, expected = width_px(found, found.place("Wide lines", method)), reaches(method, 0.1, widths)
        print(f"{method}: {ours:.2f} px, in the experiment {expected:.2f}")
        assert ours == pytest.approx(expected, rel=0.06)
        assert found.cause("Wide lines", method) == "out of focus or too wide"


def test_thin_lines_lock_to_the_pixels_below_a_third_of_one(found: Found) -> None:
    for method in (*WINDOWED, "gauss_3"):
        ours, expected = width_px(found, found.place("Thin lines", method)), reaches(method, 0.03, (0.3, 0.4))
        print(f"{method}: {ours:.3f} px, in the experiment {expected:.3f}")
        assert ours == pytest.approx(expected, rel=0.12)
        assert found.cause("Thin lines", method) == "too thin for the pixels"
    for method in ("likelihood", "gaussian"):
        assert width_px(found, found.place("Thin lines", method)) < 0.27, "integrates over the pixels"


def test_a_tilted_plate_fails_beyond_60_degrees_towards_grazing_light(found: Found) -> None:
    for method in ("likelihood", "gaussian", *WINDOWED):  # three pixels of a line so wide are too noisy before that
        degrees = math.degrees(abs(found.place("Tilt", method)))
        print(f"{method}: {degrees:.1f} degrees, {found.cause('Tilt', method)}")
        assert 60.0 < degrees < 75.0 and found.cause("Tilt", method) == "grazing"


def test_an_edge_of_albedo_pulls_the_line_as_in_the_experiment(found: Found) -> None:
    """A line of 1.5 px: 0.36 to 0.65 px at 2 to 1, 1.2 to 2.1 px at 10 to 1."""
    sweep = "An edge of albedo"
    for method in EXPERIMENT:
        albedos, error = found.curve(sweep, method, "position_p95")
        print(f"{method}: 0.5 px at {0.5 / found.place(sweep, method):.2f} to 1")
        assert 1.5 < 0.5 / found.place(sweep, method) < 3.0
        assert 0.3 < np.interp(0.25, albedos, error) < 0.7


def test_polish_below_a_tenth_saturates_here_and_starves_there(found: Found) -> None:
    for method in ("likelihood", "centre_of_mass", "gauss_3"):
        print(f"{method}: roughness {found.place('Polish', method):.3f}")
        assert 0.05 < found.place("Polish", method) < 0.11


def test_continuity_recovers_what_the_brightest_peak_loses_in_a_groove(found: Found) -> None:
    for method in ("row_maximum", "likelihood"):
        angles, strongest = found.curve("Angle of a bare groove", method, "wrong_rows", "strongest")
        _, continuous = found.curve("Angle of a bare groove", method, "wrong_rows", "continuous")
        print(method, np.round(angles, 2), np.round(strongest, 4), np.round(continuous, 4))
        assert strongest[0] > 0.0 and strongest[-1] == 0.0
        assert np.all(continuous <= strongest)


def test_eight_bits_cost_a_quarter_at_a_thousand_electrons(found: Found) -> None:
    """0.0326 px in place of 0.0264, by the Cramer-Rao bound."""
    bits, error = found.curve("Bits", "likelihood", "position_rmse")
    print(dict(zip(bits, np.round(error, 4), strict=True)))
    assert error[0] / error[-1] == pytest.approx(0.0326 / 0.0264, rel=0.05)


def test_read_noise_breaks_depth_where_the_cramer_rao_bound_does(found: Found) -> None:
    sweep = "Read noise"
    least = found.curve(sweep, "likelihood", "depth_robust_sigma")[0][0]
    peak, width, scale = (
        found.at(sweep, "likelihood", one, least) for one in ("signal", "line_width", "depth_per_pixel")
    )
    for method, efficiency in {"likelihood": 0.97, "gaussian": 0.95}.items():
        place = found.place(sweep, method)
        bound = scale * cramer_rao(peak, width, place**2 + DIGIT**2 / 12.0)
        print(f"{method}: {place:.0f} e-, where the bound is {bound * 1e6:.0f} um")
        assert bound**2 / efficiency == pytest.approx(0.0002**2, rel=0.15)


def cramer_rao(peak: float, width: float, variance: float) -> float:
    """px. sigma^2 = st^2 / (N I(tau)), tau = variance sqrt(2 pi) st / N, N = A s sqrt(2 pi), st^2 = s^2 + 1/12."""
    electrons, spread = peak * width * math.sqrt(2.0 * math.pi), math.sqrt(width**2 + 1.0 / 12.0)
    tau = variance * math.sqrt(2.0 * math.pi) * spread / electrons
    z = np.linspace(-8.0, 8.0, 4001)
    density = np.exp(-0.5 * z**2) / math.sqrt(2.0 * math.pi)
    information = np.sum(z**2 * density / (1.0 + tau * np.exp(np.minimum(0.5 * z**2, 700.0)))) * (z[1] - z[0])
    return float(spread / math.sqrt(electrons * information))


def test_depth_grows_coarse_as_the_baseline_shrinks(found: Found) -> None:
    """dz/du = z^2 / (B f); the sheet meets the tilted plate at z."""
    baselines, depth = found.curve("Angle between camera and laser", "likelihood", "depth_rmse")
    _, line = found.curve("Angle between camera and laser", "likelihood", "position_rmse")
    b = np.array(baselines)
    z = (DEPTH - b * math.tan(TILT)) / (1.0 - math.tan(TILT) * math.tan(LASER_ANGLE))
    print(np.round(depth / line / (z**2 / (b * FOCAL_PX)), 3))
    np.testing.assert_allclose(depth / line, z**2 / (b * FOCAL_PX), rtol=0.05)


def test_speckle_is_that_of_the_line_form(found: Found) -> None:
    """sigma = sqrt(A_c s / (4 sqrt(pi) p^2)), A_c = 4 lambda^2 N_w^2 / pi; 0.96 of it by an FFT at 1.5 px."""
    sigma = {
        kind: found.at("Speckle", "likelihood", "position_robust_sigma", kind)
        for kind in ("off", "depolarised", "polarised")
    }
    working = F_NUMBER * (1.0 + PRINCIPAL / (DEPTH - PRINCIPAL))
    grain = 4.0 * WAVELENGTH**2 * working**2 / math.pi
    width = found.at("Speckle", "likelihood", "line_width", "off")
    expected = 0.96 * math.sqrt(grain * width / (4.0 * math.sqrt(math.pi) * PIXEL**2))
    whole, half = (math.sqrt(sigma[kind] ** 2 - sigma["off"] ** 2) for kind in ("polarised", "depolarised"))
    print(f"speckle {whole:.3f} px, expected {expected:.3f}; depolarised {half:.3f}")
    assert whole == pytest.approx(expected, rel=0.15) and half == pytest.approx(whole / math.sqrt(2.0), rel=0.15)


def test_a_line_out_of_focus_is_as_wide_as_its_disc_says(found: Found) -> None:
    """c = (f / N) v |1 / z_f - 1 / z|, v the principal distance, 1 / f = 1 / v + 1 / z_f: its line by least squares."""
    focus, width = found.curve("Out of focus", "gaussian", "line_width")
    sharp = found.at("Speckle", "gaussian", "line_width", "off")
    near = np.array(focus)
    focal = PRINCIPAL * near / (PRINCIPAL + near)
    discs = focal / F_NUMBER * PRINCIPAL * np.abs(1.0 / near - 1.0 / DEPTH) / PIXEL
    expected = np.array([fitted_width(sharp, disc) for disc in discs])
    print(np.round(near, 3), np.round(width, 2), np.round(expected, 2))
    np.testing.assert_allclose(width, expected, rtol=0.03)


def fitted_width(sharp: float, disc: float) -> float:
    """px: sigma of the Gaussian that is nearest to one of sigma `sharp` under an even disc of that diameter."""
    x = np.arange(-60.0, 60.0, 0.05)
    chord = np.sqrt(np.maximum(1.0 - (2.0 * x / max(disc, 0.1)) ** 2, 0.0))
    line = np.convolve(np.exp(-0.5 * (x / sharp) ** 2), chord / chord.sum(), "same")
    (_, width), _ = curve_fit(lambda at, a, s: a * np.exp(-0.5 * (at / s) ** 2), x, line, p0=(line.max(), sharp))
    return float(width)


def test_boards_that_hardly_tilt_tell_too_little_and_more_of_them_more(found: Found) -> None:
    """38 boards: 0.046 mm at tilts of 5 to 35 degrees, 0.2 mm below 12, so that 0.1 mm lies between for 20 of them."""
    degrees = math.degrees(found.place("Tilt of the boards", "likelihood"))
    print(f"tilts up to {degrees:.1f} degrees, {found.cause('Tilt of the boards', 'likelihood')}")
    assert 12.0 < degrees < 35.0 and found.cause("Tilt of the boards", "likelihood") == "degenerate"
    for boards, expected in {5: 107e-6, 10: 63e-6, 40: 39e-6}.items():  # of 38, by joint adjustment
        error = found.at("Few boards", "likelihood", "calibration_rmse", boards)
        print(f"{boards} boards: {error * 1e6:.0f} um, in the experiment {expected * 1e6:.0f}")
        assert 0.5 < error / expected < 2.0


def test_light_below_the_surface_shifts_the_line_by_less_than_a_tail_on_one_side(found: Found) -> None:
    """A tail of 30 % on one side makes 0.2 to 0.5 px; light below a slab spreads to both sides of where it enters."""
    for method in ("likelihood", "gaussian", "centre_of_mass"):
        paths, bias = found.curve("Below the surface", method, "depth_bias_right")
        shift = bias / found.curve("Below the surface", method, "depth_per_pixel")[1]
        print(method, np.round(paths, 5), np.round(shift, 3), "px")
        assert shift[0] < 0.03 and 2.0 * abs(shift[0]) < shift[-1] < 0.5
