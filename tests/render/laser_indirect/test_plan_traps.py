"""Scenes where a look at the materials would choose the wrong rung, and how honest the pilot's uncertainty is.

What is left out is held against a full render of that very kind of light.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import binom
from scipy.stats import t as student

from render.laser_direct.integrator import direct_image
from render.laser_indirect.guiding import find_specular_pixels
from render.laser_indirect.integrator import indirect_image
from render.laser_indirect.path_vertex import CAUSTIC, INTERREFLECTION, SPECULAR_CHAIN, SUBSURFACE_LIGHT
from render.laser_indirect.pilot import indirect_pilot
from render.laser_indirect.transport_plan import pilot_shares, plan_of
from render.material.material import Conductor, Glass, Lambertian, Subsurface
from render.mesh.primitives import primitive_mesh
from render.run import Memory, Run
from render.scene.settings import RenderSettings
from render.scene.shape import Box, Cylinder, Sphere
from render.world.placed import PlacedScene
from tests.render.laser_indirect.test_integrator import setting, turned_groove
from tests.render.scenes import moved, paper_camera, plane_mesh

CAMERA = paper_camera(0.04)
GREY, GLASS, MIRROR = Lambertian(albedo=0.5), Glass(index=1.5), Conductor(roughness=0.0)
WAX = Subsurface(index=1.45, roughness=0.3, mean_free_path=0.0005, scattering_albedo=0.95)
WALL = plane_mesh((0, 0, 1), 0.9)
WITHOUT = {
    "interreflection": (INTERREFLECTION, None),
    "caustic": (CAUSTIC, INTERREFLECTION),
    "specular_chain": (CAUSTIC | SPECULAR_CHAIN, CAUSTIC),
    "subsurface": (SUBSURFACE_LIGHT, INTERREFLECTION),
}
"""Of each kind: the kinds of two renders whose difference it is."""


def ball(x, y, z, radius=0.02):
    return moved(primitive_mesh(Sphere(radius=radius)), (x, y, z))


def box(size, at, turn=(0.0, 0.0, 0.0)):
    return moved(primitive_mesh(Box(size_x=size[0], size_y=size[1], size_z=size[2])), at, turn)


PANE_BEFORE_THE_LASER = box((0.06, 0.1, 0.004), (0.142, 0.05, 0.25))
PANE_BEFORE_THE_CAMERA = box((0.1, 0.1, 0.004), (0.0, 0.06, 0.3))
BALL_IN_THE_BEAM = ball(0.142, 0.02, 0.25)
BALL_AT_THE_FANS_END = ball(0.142, 0.11, 0.25, 0.01)
MIRROR_OF_THE_DARK = box((0.1, 0.1, 0.004), (-0.12, 0.0, 0.6))
WAX_BESIDE_THE_SHEET = box((0.1, 0.1, 0.05), (-0.15, 0.0, 0.85))
GROOVE_BESIDE_THE_SHEET = moved(turned_groove(), (-0.2, 0.0, 0.0))

CHOICES = {
    "a pane that the laser passes, out of the camera's view": (PANE_BEFORE_THE_LASER, GLASS, "caustic", True),
    "a pane that only shows the line": (PANE_BEFORE_THE_CAMERA, GLASS, "caustic", True),
    "a pane that shows no caustic": (PANE_BEFORE_THE_CAMERA, GLASS, "specular_chain", False),
    "a ball that throws its caustic out of view": (BALL_AT_THE_FANS_END, GLASS, "caustic", False),
    "a mirror that shows no laser light": (MIRROR_OF_THE_DARK, MIRROR, "caustic", False),
    "wax beside the sheet": (WAX_BESIDE_THE_SHEET, WAX, "subsurface", False),
    "a groove beside the sheet": (GROOVE_BESIDE_THE_SHEET, Lambertian(albedo=0.9), "interreflection", False),
}


@pytest.mark.parametrize("case", CHOICES)
def test_a_wrong_choice_would_look_right(case):
    mesh, material, kind, wanted = CHOICES[case]
    scene, parts = setting([WALL, mesh], [GREY, material], camera=CAMERA)
    direct = direct_image(*parts, target=3e-3).radiance
    shares = pilot_shares(PlacedScene(parts[0], scene), (direct,))
    plan = plan_of(shares, RenderSettings())
    share, error = shares[kind]
    bits = WITHOUT[kind][0]
    assert (plan.kinds is not None and plan.kinds & bits == bits) == wanted
    full = share_of(kind, parts, direct)
    assert (full > RenderSettings().negligible) == wanted
    assert abs(share - full) <= student.ppf(0.9995, 3) * error + 0.02 * full


def share_of(kind, parts, direct):
    """Of the direct light, by full renders."""
    fluxes = [
        0.0
        if kinds is None
        else indirect_image(*parts, target=0.02, most_paths=1 << 18, kinds=kinds, run=Run(seed=5)).radiance.sum(
            dtype=np.float64
        )
        for kinds in WITHOUT[kind]
    ]
    return (fluxes[0] - fluxes[1]) / direct.sum(dtype=np.float64)


SEEDS = 24
KINDS_OF = {
    "groove": ([turned_groove()], [Conductor(roughness=0.2)], "interreflection"),
    "caustic": ([WALL, BALL_IN_THE_BEAM], [GREY, GLASS], "caustic"),
    "line through a pane": ([WALL, PANE_BEFORE_THE_CAMERA], [GREY, GLASS], "caustic"),
    "caustic through a pane": (
        [WALL, BALL_IN_THE_BEAM, PANE_BEFORE_THE_CAMERA],
        [GREY, GLASS, GLASS],
        "specular_chain",
    ),
    "wax": ([box((0.3, 0.3, 0.1), (0.0, 0.0, 0.95))], [WAX], "subsurface"),
    "wax beside": ([WALL, WAX_BESIDE_THE_SHEET], [GREY, WAX], "subsurface"),
    "mirror of the dark": ([WALL, MIRROR_OF_THE_DARK], [GREY, MIRROR], "caustic"),
}

QUICK = ("groove", "caustic", "wax beside")


@pytest.mark.parametrize(
    "case", [pytest.param(case, marks=[] if case in QUICK else pytest.mark.validation) for case in KINDS_OF]
)
def test_the_pilots_uncertainty_holds_as_often_as_it_says(case):
    meshes, materials, kind = KINDS_OF[case]
    _, parts = setting(meshes, materials, camera=CAMERA)
    # no seed changes which chains there are
    memory = Memory()
    found = np.array(
        [getattr(indirect_pilot(*parts, run=Run(seed=seed, memory=memory)), kind) for seed in range(SEEDS)]
    )
    mean = found[:, 0].mean()
    assert mean > 0.0
    # of four passes; the mean of all seeds is known to a fifth of one's error
    covered = np.abs(found[:, 0] - mean) <= student.ppf(0.975, 3) * found[:, 1] * math.sqrt(1.0 + 1.0 / SEEDS)
    assert covered.sum() >= binom.ppf(1e-3, SEEDS, 0.95)


THIN = [box((0.1, 0.006, 0.005), (0.0, 0.01 + 0.0018 * k, 0.5)) for k in range(8)]


def test_light_behind_glass_thinner_than_the_rays_that_look_for_it_is_found():
    _, parts = setting([WALL], [GREY], camera=CAMERA)
    line = direct_image(*parts, target=3e-3).radiance.sum(axis=1, dtype=np.float64)
    # two faces; what is lost at and won by the upper and lower edge is a few per cent
    expected = (1.0 - 0.04) / (1.0 + 0.04) * np.median(line[line > 0.0]) * 0.006 / 0.5 * parts[1].fy
    for bar in THIN:
        _, parts = setting([WALL, bar], [GREY, GLASS], camera=CAMERA)
        share, error = indirect_pilot(*parts).caustic
        assert abs(share - expected) < student.ppf(0.9995, 3) * error + 0.1 * expected


@pytest.mark.parametrize(
    "thin",
    [
        *THIN[:2],
        moved(primitive_mesh(Cylinder(radius=0.001, length=0.6)), (0.0, 0.0, 0.6), (0.9, 0.7, 0.3)),
        ball(0.05, 0.07, 0.7, 0.004),
    ],
)
def test_every_pixel_that_shows_glass_is_known(thin):
    _, (world, camera, laser, pose, _) = setting([WALL, thin], [GREY, GLASS], camera=CAMERA)
    specular = find_specular_pixels(world, world.surface_at((laser.wavelength_nm,) * 3), camera, pose)
    steps = (np.arange(4) + 0.5) / 4 - 0.5
    seen = np.zeros((camera.height, camera.width), bool)
    v, u = np.mgrid[0 : camera.height, 0 : camera.width].astype(float)
    for du in steps:
        for dv in steps:
            rays, _ = camera.rays(np.stack([u + du, v + dv], axis=-1).reshape(-1, 2))
            hit = world.rays.from_point(np.zeros(3), rays.astype(np.float32))
            seen |= ((hit >= 0) & (world.object_id[hit] == 1)).reshape(seen.shape)
    assert seen.any() and not np.any(seen & ~specular.reshape(seen.shape))
    # and not much else
    assert specular.sum() < seen.sum() + 13 * (seen.sum() + 13)
