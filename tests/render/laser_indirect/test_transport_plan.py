"""The ladder of light transport: on a scene built for each rung, and where the materials alone would mislead.

Whatever the pilot says of a rung is held against a full render of everything.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import t as student

from analysis.report.light_text import plan_lines
from render.laser_direct.integrator import direct_image
from render.laser_indirect.integrator import ALL_KINDS, indirect_image
from render.laser_indirect.path_vertex import CAUSTIC, INTERREFLECTION, SPECULAR_CHAIN, SUBSURFACE_LIGHT
from render.laser_indirect.transport_plan import pilot_shares, plan_of
from render.material.material import Conductor, Glass, Lambertian, Subsurface
from render.mesh.primitives import primitive_mesh
from render.plan import Plan
from render.run import Run
from render.scene.settings import RenderSettings
from render.scene.shape import Box, Sphere
from render.world.placed import PlacedScene
from tests.render.laser_indirect.test_integrator import setting, turned_groove
from tests.render.scenes import moved, paper_camera, plane_mesh

CAMERA = paper_camera(0.04)
GREY, GLASS, MIRROR = Lambertian(albedo=0.5), Glass(index=1.5), Conductor(roughness=0.0)


def wall():
    return plane_mesh((0, 0, 1), 0.9)


def ball(x=0.142, y=0.02, z=0.25):
    """In the beam near the laser, where the camera does not see it."""
    return moved(primitive_mesh(Sphere(radius=0.02)), (x, y, z))


def window(y=0.0):
    """Before the camera, not before the laser."""
    return moved(primitive_mesh(Box(size_x=0.16, size_y=0.2, size_z=0.005)), (-0.01, y, 0.2))


class Choice:
    """What the plan chose on a scene, and what a full render of it finds."""

    def __init__(self, meshes, materials, **settings):
        self.scene, parts = setting(meshes, materials, camera=CAMERA)
        self.direct = direct_image(*parts, target=3e-3).radiance
        known = self.direct.sum(dtype=np.float64)
        self.shares = pilot_shares(PlacedScene(parts[0], self.scene), (self.direct,))
        self.plan = plan_of(self.shares, RenderSettings(**settings))
        everything = indirect_image(*parts, target=0.05, most_paths=1 << 20, kinds=ALL_KINDS, run=Run(seed=77))
        self.flux = everything.radiance.sum(dtype=np.float64)
        self.full = self.flux / known if known > 0.0 else math.inf

    def steps(self):
        """Names of the rungs that are computed."""
        return [step.name for step in self.plan.steps if step.computed]

    def left_out(self):
        """Names of the rungs that are there, and are not."""
        return [step.name for step in self.plan.steps if not step.computed and step.reason != "absent"]

    def pilot_agrees(self):
        """The rungs together bring what the full render finds, within the spread of the pilot's four passes."""
        total = sum(share for share, _ in self.shares.values())
        error = math.sqrt(sum(error**2 for _, error in self.shares.values()))
        assert abs(total - self.full) <= student.ppf(0.995, 3) * error + 0.01 * self.full


def test_a_lone_plane_needs_nothing_but_direct_light():
    found = Choice([wall()], [Conductor(roughness=0.1)])
    assert found.plan.kinds is None and found.full == 0.0
    assert found.shares["interreflection"] == (0.0, 0.0)
    found.pilot_agrees()


def test_a_groove_of_metal_needs_interreflection():
    found = Choice([turned_groove()], [Conductor(roughness=0.2)])
    assert found.steps() == ["interreflection"] and found.plan.kinds == INTERREFLECTION
    assert found.full > 0.05
    found.pilot_agrees()


def test_a_dark_groove_looks_the_same_and_needs_nothing():
    found = Choice([turned_groove()], [Lambertian(albedo=0.01)])
    assert found.steps() == [] and found.left_out() == ["interreflection"] and found.plan.kinds is None
    assert 0.0 < found.full < 0.02
    found.pilot_agrees()


def test_a_glass_ball_in_the_beam_needs_caustics():
    found = Choice([wall(), ball()], [GREY, GLASS])
    assert found.steps() == ["interreflection", "caustic"] or found.steps() == ["caustic"]
    assert found.plan.kinds & CAUSTIC and not found.plan.kinds & (SPECULAR_CHAIN | SUBSURFACE_LIGHT)
    assert found.shares["caustic"][0] > 0.02
    found.pilot_agrees()


def test_the_same_seen_through_a_window_needs_merging():
    found = Choice([wall(), ball(), window(0.1)], [GREY, GLASS, GLASS])
    assert "specular-chain" in found.steps() and found.plan.kinds & SPECULAR_CHAIN
    # what is computed with it is not said to be left out
    assert found.left_out() == []
    assert found.shares["specular_chain"][0] > 0.02
    found.pilot_agrees()


@pytest.mark.validation
def test_a_block_of_wax_needs_the_walk_below_its_surface():
    block = moved(primitive_mesh(Box(size_x=0.3, size_y=0.3, size_z=0.1)), (0.0, 0.0, 0.95))
    wax = Subsurface(index=1.45, roughness=0.3, mean_free_path=0.0005, scattering_albedo=0.95)
    found = Choice([block], [wax])
    assert "subsurface" in found.steps() and found.plan.kinds & SUBSURFACE_LIGHT
    found.pilot_agrees()


def test_glass_that_the_beam_does_not_meet_is_left_out():
    # some of what the wall scatters still finds its way through the ball, and is measured
    found = Choice([wall(), ball(-0.3, 0.0, 0.7)], [GREY, GLASS])
    assert found.plan.kinds is None and "caustic" not in found.steps()
    assert found.full < 0.02
    found.pilot_agrees()


def test_a_mirror_that_throws_the_beam_out_of_view_is_left_out():
    # near the laser, across half of the fan, facing away from the wall's lit part
    mirror = moved(primitive_mesh(Box(size_x=0.04, size_y=0.05, size_z=0.001)), (0.142, 0.03, 0.25), (0.0, 0.7, 0.0))
    found = Choice([wall(), mirror], [GREY, MIRROR])
    _, parts = setting([wall()], [GREY], camera=CAMERA)
    assert found.direct.sum() < 0.8 * direct_image(*parts, target=3e-3).radiance.sum()
    assert found.plan.kinds is None and found.full < 0.02
    found.pilot_agrees()


def test_behind_a_window_before_the_camera_the_left_out_light_would_be_the_whole_line():
    found = Choice([wall(), window()], [GREY, GLASS])
    _, parts = setting([wall()], [GREY], camera=CAMERA)
    plain = direct_image(*parts, target=3e-3).radiance.sum(dtype=np.float64)
    assert found.direct.sum() < 1e-6 * plain
    assert "caustic" in found.steps() and found.plan.kinds & CAUSTIC
    assert [step.share for step in found.plan.steps if step.name == "caustic"] == [math.inf]
    assert "no direct light in the image" in light_text(found) and "inf" not in light_text(found)
    # dimmed by two faces and what goes to and fro between them, near normal incidence
    reflected = dielectric_reflectance(1.0, 1.5)
    assert found.flux / plain == pytest.approx((1.0 - reflected) / (1.0 + reflected), rel=0.03)
    asked = Choice([wall(), window()], [GREY, GLASS], transport="interreflection")
    assert "caustic" in asked.left_out() and not asked.plan.kinds & CAUSTIC


def light_text(found):
    return "\n".join(plan_lines(Plan(found.plan.steps)))


def dielectric_reflectance(cosine, index):
    """Of unpolarised light at one face (Born and Wolf 1999, 1.5.2)."""
    inside = math.sqrt(1.0 - (1.0 - cosine**2) / index**2)
    s = (cosine - index * inside) / (cosine + index * inside)
    p = (index * cosine - inside) / (index * cosine + inside)
    return 0.5 * (s * s + p * p)
