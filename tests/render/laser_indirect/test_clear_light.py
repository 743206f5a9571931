"""Light through windows, integrated pixel by pixel, against random paths, Snell and Fresnel."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from render.laser.laser import Divergence, Waist
from render.laser_direct.integrator import direct_image
from render.laser_indirect import specular_chains
from render.laser_indirect.accumulator import Accumulator
from render.laser_indirect.bdpt_pass import BdptPass
from render.laser_indirect.clear_light import NO_LIGHT, Integral, clear_light
from render.laser_indirect.integrator import empty_buffer, indirect_image
from render.laser_indirect.path_vertex import ALL_KINDS, CAUSTIC, INTERREFLECTION, SPECULAR_CHAIN
from render.material.material import Conductor
from render.mesh.primitives import primitive_mesh
from render.run import Memory, Run
from render.scene.shape import Box, Sphere
from render.world.placed import PlacedLaser
from tests.render.laser_indirect.test_integrator import setting
from tests.render.laser_indirect.test_manifold_walk import (
    CAMERAS,
    GLASS,
    GREY,
    SCENES,
    THICKNESS,
    WALL,
    fresnel,
    pass_of,
)
from tests.render.scenes import moved, paper_camera, paper_laser

# wide enough for pixels of small images
BROAD = paper_laser(sheet=Divergence(full_angle=0.012))
# before the laser alone: the camera looks past it
SIDE_WINDOW = moved(primitive_mesh(Box(size_x=0.08, size_y=0.3, size_z=THICKNESS)), (0.17, 0.0, 0.12))
MIRROR_STRIP = moved(primitive_mesh(Box(size_x=0.05, size_y=0.1, size_z=0.01)), (0.05, 0.02, 0.7), (0.0, 0.6, 0.0))

FACETED_BALL = moved(primitive_mesh(Sphere(radius=0.03, segments=96)), (0.01, 0.0, 0.8))
"""Its facets are narrower than what lies between the rays that first look for chains."""

LIT = {
    **SCENES,
    "a window before the laser": ([WALL, SIDE_WINDOW], [GREY, GLASS]),
    "a mirror in the sheet": ([WALL, MIRROR_STRIP], [GREY, Conductor(roughness=0.0)]),
    "a ball of facets": ([WALL, FACETED_BALL], [GREY, GLASS]),
}
QUICK = ("a window before the laser", "a mirror in the sheet", "a mirror behind a window", "a ball of facets")
"""Those that random paths bring within seconds."""


def of_kinds(task, sampling, camera, passes):
    """Sums over the image of light through glass or off mirrors, (passes, 2): seen itself, and over such again."""
    sums = []
    for number in range(passes):
        buffer = empty_buffer(camera.width * camera.height)
        task.run(100 + number, sampling, buffer)
        sums.append(buffer.sums[[CAUSTIC, SPECULAR_CHAIN]])
    return np.array(sums)


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name in QUICK else pytest.mark.validation) for name in LIT]
)
def test_it_is_the_light_that_random_paths_bring(name):
    _, parts = setting(*LIT[name], camera=CAMERAS.get(name, paper_camera(0.05)), laser=BROAD)
    task, sampling, camera = pass_of(parts)
    light = clear_light(task, Run())
    known = replace(task, clear=light.mask(camera.width * camera.height))
    alone = of_kinds(task, sampling, camera, 48)
    rest = of_kinds(known, sampling, camera, 48)
    together = rest.mean(axis=0) + light.radiance.sum(axis=0)
    error = np.sqrt((alone.var(axis=0, ddof=1) + rest.var(axis=0, ddof=1)) / 48 + np.square(light.error).sum())
    assert np.all(np.abs(together - alone.mean(axis=0)) <= 4.0 * error)
    if "plate" in name or "laser" in name:
        assert light.radiance.sum() > 0.9 * alone.mean(axis=0).sum()


def test_a_line_through_the_lasers_own_window_lies_and_shines_as_snell_and_fresnel_say():
    camera = paper_camera(0.2)
    _, bare_parts = setting([WALL], [GREY], camera=camera, laser=BROAD)
    _, parts = setting([WALL, SIDE_WINDOW], [GREY, GLASS], camera=camera, laser=BROAD)
    T_world_laser = parts[4]
    task = BdptPass.of(PlacedLaser(*parts), 0.9, 1)
    image = clear_light(task, Run()).added_to(np.zeros((camera.height, camera.width), np.float32), ALL_KINDS)
    row = slice(camera.height // 2 - 4, camera.height // 2 + 4)
    start, d = T_world_laser[:3, 3], T_world_laser[:3, 2]
    angle = math.acos(abs(d[2]))
    inside = math.asin(math.sin(angle) / 1.5)
    lit = start[0] + d[0] / d[2] * (0.9 - THICKNESS - start[2]) + math.copysign(THICKNESS * math.tan(inside), d[0])
    profile = image[row].sum(axis=0, dtype=np.float64)
    # what is reflected twice within the window lies farther off than this
    columns = np.arange(camera.width)
    near = np.abs(columns - (camera.cx + camera.fx * lit / 0.9)) < 12
    middle = (profile * columns)[near].sum() / profile[near].sum()
    assert middle == pytest.approx(camera.cx + camera.fx * lit / 0.9, abs=0.01)
    bare = direct_image(*bare_parts, target=1e-4).radiance.astype(np.float64)[row].sum()
    reach = (0.9 - start[2]) / math.cos(angle)
    along_fan = reach / (reach - THICKNESS / math.cos(angle) + THICKNESS / (1.5 * math.cos(inside)))
    share = (1 - fresnel(angle, inside)) ** 2
    assert profile[near].sum() / bare == pytest.approx(share * along_fan, rel=2e-3)


def test_most_of_the_light_through_facets_narrower_than_the_first_grid_is_listed(monkeypatch):
    """By light paths through them, which know whether their chain is listed."""
    _, parts = setting(*LIT["a ball of facets"], camera=paper_camera(0.05), laser=BROAD)
    task, sampling, camera = pass_of(parts)
    monkeypatch.setattr(specular_chains, "NARROW", 0)
    coarse, _, _ = pass_of(parts)
    listed, power = [], []
    for part in (task, coarse):
        buffer = empty_buffer(camera.width * camera.height)
        found = part.trace_light_paths(5, 0, sampling.light_paths, sampling, buffer, True)
        paths = np.concatenate([paths for _, _, paths in found])
        over = paths[paths["all_specular"] & paths["after_specular"]]
        listed.append(float(over["throughput"][over["walked"]].sum()))
        power.append(float(over["throughput"].sum()))
    assert power[0] == power[1] > 0.0
    assert listed[1] < 0.5 * listed[0] and listed[0] > 0.9 * power[0]


def test_its_error_is_told():
    """Beside eight times as many rays a side, anywhere in the pixels."""
    _, parts = setting(*LIT["a plate on both ways"], camera=paper_camera(0.05), laser=BROAD)
    task, _, _ = pass_of(parts)
    light = clear_light(task, Run())
    exact = Integral(task, Run(), []).sampled(light.pixels, 16, jitter=True).sum(axis=1)
    off = math.sqrt(np.square(light.of_kinds(ALL_KINDS) - exact).sum() / np.square(exact).sum())
    told = math.sqrt(np.square(light.error).sum() / np.square(exact).sum())
    assert off < 0.01
    assert off < 3.0 * told


def test_only_wanted_kinds_are_added_and_the_error_is_that_of_all_light():
    _, parts = setting(*LIT["a plate on both ways"], camera=paper_camera(0.05), laser=BROAD)
    task, _, camera = pass_of(parts)
    light = clear_light(task, Run())
    for kinds, whole in (
        (INTERREFLECTION, 0.0),
        (CAUSTIC, light.radiance[:, 0].sum()),
        (ALL_KINDS, light.radiance.sum()),
    ):
        buffer = empty_buffer(camera.width * camera.height)
        light.add_to(buffer, kinds)
        assert buffer.image.sum() == pytest.approx(whole, rel=1e-5)
        assert buffer.sums.sum() == pytest.approx(whole)
    other = Accumulator(*[None] * 11, squares=5.0, variance_sum=1.0, weight=2.0, passes=8, error=0.5)
    squares = np.square(light.of_kinds(ALL_KINDS)).sum()
    variance = 0.25 + np.square(light.error).sum()
    assert light.error_with(other, ALL_KINDS) == pytest.approx(math.sqrt(variance / (1.0 + squares)))
    assert NO_LIGHT.error_with(other, ALL_KINDS) == 0.5


def test_it_is_the_same_on_any_number_of_threads_and_for_any_seed():
    _, parts = setting(*LIT["a smooth ball, seen through a window"], camera=paper_camera(0.05), laser=BROAD)
    task, _, _ = pass_of(parts)
    one, two = (clear_light(task, Run(seed=seed, threads=seed)) for seed in (1, 2))
    assert np.array_equal(one.radiance, two.radiance)
    assert np.array_equal(one.error, two.error)


def test_a_frame_integrates_it_once():
    _, parts = setting(*LIT["a plate on both ways"], camera=paper_camera(0.05), laser=BROAD)
    task, _, _ = pass_of(parts)
    run = Run(memory=Memory())
    assert clear_light(task, run) is clear_light(replace(task, seed=9), run)
    assert clear_light(replace(task, laser=task.laser.model_copy(update={"power": 1.0})), run) is not clear_light(
        task, run
    )


@pytest.mark.parametrize("sheet", [Waist(focus_distance=0.8), Divergence(full_angle=0.0005)])
def test_a_sheet_with_a_waist_or_far_thinner_than_a_pixel_is_left_to_random_paths(sheet):
    _, parts = setting(*LIT["a plate on both ways"], camera=paper_camera(0.05), laser=paper_laser(sheet=sheet))
    assert clear_light(pass_of(parts)[0], Run()) is NO_LIGHT
    assert indirect_image(*parts, target=0.3).radiance.sum() > 0.0
