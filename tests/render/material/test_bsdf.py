"""Every scattering model: reciprocal, never gaining energy, and sampled as its density says."""

import numba
import numpy as np
import pytest
from scipy import stats

from render.base.vectors import store, vector
from render.material import bsdf
from render.material.fresnel import diffuse_reflectance, fresnel_conductor, fresnel_dielectric
from render.material.microfacet import ggx, visible_normal_pdf
from render.material.scattering import Microsurface


def material(kind, alpha=(0.0, 0.0), index=1.5, n=2.87, k=3.25):
    row = np.zeros(bsdf.ROW)
    row[:4] = kind, *alpha, index
    row[4:7], row[7:10] = n, k
    row[10] = diffuse_reflectance(1.0 / index)
    return row


ROUGH = {
    "lambertian": material(bsdf.LAMBERTIAN),
    "rough steel": material(bsdf.CONDUCTOR, (0.3, 0.3)),
    "polished steel": material(bsdf.CONDUCTOR, (0.08, 0.08)),
    "brushed steel": material(bsdf.CONDUCTOR, (0.1, 0.4)),
    "frosted glass": material(bsdf.DIELECTRIC, (0.3, 0.3)),
    "brushed glass": material(bsdf.DIELECTRIC, (0.2, 0.5), 1.33),
    "paint": material(bsdf.COATED, (0.1, 0.1)),
    "matt plastic": material(bsdf.COATED, (0.4, 0.3), 1.4),
    "skin of wax": material(bsdf.SUBSURFACE, (0.5, 0.5), 1.44),
}
GREY, WHITE = np.array([0.7, 0.5, 0.3]), np.ones(3)
DIRECTIONS = [(0.1, 0.2, 0.9), (0.8, -0.3, 0.4), (-0.5, 0.5, -0.7), (0.1, 0.9, -0.15)]


def unit(v):
    return np.asarray(v) / np.linalg.norm(v)


@numba.njit
def draw(row, rgb, o, numbers):
    out, weights, chance = np.empty((len(numbers), 3)), np.empty((len(numbers), 3)), np.empty(len(numbers))
    for j in range(len(numbers)):
        wi, chance[j] = bsdf.sample(row, vector(rgb), vector(o), vector(numbers[j]), weights[j])
        store(out[j], wi)
    return out, weights, chance


@numba.njit
def densities(row, rgb, o, i):
    out = np.empty(len(i))
    for j in range(len(i)):
        out[j] = bsdf.pdf(row, vector(rgb), vector(o), vector(i[j]))
    return out


@numba.njit
def values(row, rgb, o, i):
    out = np.empty((len(i), 3))
    for j in range(len(i)):
        store(out[j], bsdf.evaluate(row, vector(rgb), vector(o), vector(i[j])))
    return out


def sphere_grid(n_theta, n_phi, fine):
    """Midpoints (cells, fine^2, 3) of a grid in the two angles, and the solid angle (cells, fine^2) each stands for."""
    theta = (np.arange(n_theta * fine) + 0.5) / (n_theta * fine) * np.pi
    phi = (np.arange(n_phi * fine) + 0.5) / (n_phi * fine) * 2 * np.pi
    tt, pp = np.meshgrid(theta, phi, indexing="ij")
    grid = np.stack([np.sin(tt) * np.cos(pp), np.sin(tt) * np.sin(pp), np.cos(tt), np.sin(tt)], axis=-1)
    grid = grid.reshape(n_theta, fine, n_phi, fine, 4).transpose(0, 2, 1, 3, 4).reshape(n_theta * n_phi, fine * fine, 4)
    share = grid[..., 3] * (np.pi / (n_theta * fine)) * (2 * np.pi / (n_phi * fine))
    return np.ascontiguousarray(grid[..., :3]), share


@pytest.mark.parametrize("o", DIRECTIONS)
@pytest.mark.parametrize("name", ROUGH)
def test_samples_follow_their_density(name, o):
    # chi-square over 1800 cells of the sphere, Sidak-corrected for the whole table
    row, o, count, n_theta, n_phi = ROUGH[name], unit(o), 100_000, 30, 60
    directions, _, chance = draw(row, GREY, o, np.random.default_rng(7).random((count, 3)))
    # refraction has a hard edge at the critical angle, which asks for a finer quadrature of the expected counts
    grid, share = sphere_grid(n_theta, n_phi, 40 if bsdf.is_boundary(row) else 16)
    density_at = densities(row, GREY, o, grid.reshape(-1, 3)).reshape(share.shape)
    expected = np.sum(density_at * share, axis=1) * count
    kept = directions[chance > 0]
    column = (np.arctan2(kept[:, 1], kept[:, 0]) / (2 * np.pi) % 1.0 * n_phi).astype(int) % n_phi
    line = np.minimum((np.arccos(np.clip(kept[:, 2], -1, 1)) / np.pi * n_theta).astype(int), n_theta - 1)
    found = np.bincount(line * n_phi + column, minlength=n_theta * n_phi).astype(float)
    # what goes below the surface is a cell of its own; cells of few counts are pooled
    found, expected = np.append(found, count - len(kept)), np.append(expected, max(count - expected.sum(), 0.0))
    many = expected >= 10
    found = np.append(found[many], found[~many].sum())
    expected = np.append(expected[many], expected[~many].sum())
    use = expected > 5
    statistic = np.sum((found - expected)[use] ** 2 / expected[use])
    level = 1 - (1 - 0.01) ** (1 / (len(ROUGH) * len(DIRECTIONS)))
    assert stats.chi2.sf(statistic, np.count_nonzero(use) - 1) > level


@pytest.mark.parametrize("o", DIRECTIONS)
@pytest.mark.parametrize("name", ROUGH)
def test_weights_are_value_times_cosine_over_density(name, o):
    row, o = ROUGH[name], unit(o)
    directions, weights, chance = draw(row, GREY, o, np.random.default_rng(1).random((2000, 3)))
    kept = chance > 0
    i = np.ascontiguousarray(directions[kept])
    assert densities(row, GREY, o, i) == pytest.approx(chance[kept], rel=1e-9)
    expected = values(row, GREY, o, i) * np.abs(i[:, 2:]) / chance[kept][:, None]
    assert weights[kept] == pytest.approx(expected, rel=1e-6, abs=1e-12)
    assert np.linalg.norm(i, axis=1) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("name", ROUGH)
def test_scattering_is_reciprocal(name):
    row = ROUGH[name]
    rng = np.random.default_rng(3)
    a, b = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in rng.normal(size=(2, 300, 3)))
    for o, i in zip(a, b, strict=True):
        forward, backward = values(row, GREY, o, i[None])[0], values(row, GREY, i, o[None])[0]
        if bsdf.is_boundary(row) and o[2] * i[2] < 0:
            # radiance over index squared is what is conserved: f(o, i) / eta_i^2 = f(i, o) / eta_o^2
            inside = row[3] ** 2
            forward, backward = (forward, backward * inside) if i[2] < 0 else (forward * inside, backward)
        assert forward == pytest.approx(backward, rel=1e-9, abs=1e-14)


@pytest.mark.parametrize("o", DIRECTIONS)
@pytest.mark.parametrize("name", ROUGH)
def test_no_material_scatters_more_than_it_receives(name, o):
    # white furnace: what comes back from a constant sky is the mean weight
    _, weights, _ = draw(ROUGH[name], WHITE, unit(o), np.random.default_rng(5).random((100_000, 3)))
    error = weights.std(axis=0) / np.sqrt(len(weights))
    assert (weights.mean(axis=0) <= 1 + 4 * error + 1e-12).all()
    if name == "lambertian":
        assert weights == pytest.approx(1.0)


def test_smooth_glass_and_metal_keep_what_fresnel_says():
    o = unit((0.6, 0.0, 0.8))
    numbers = np.random.default_rng(2).random((50_000, 3))
    directions, weights, chance = draw(material(bsdf.DIELECTRIC), WHITE, o, numbers)
    assert (chance == -1).all() and weights == pytest.approx(1.0)
    reflected, _ = fresnel_dielectric(0.8, 1.5)
    up = directions[:, 2] > 0
    assert abs(up.mean() - reflected) < 4 * np.sqrt(reflected * (1 - reflected) / len(up))
    assert directions[up] == pytest.approx(np.broadcast_to([-0.6, 0, 0.8], (up.sum(), 3)))
    # Snell
    assert directions[~up][:, 0] == pytest.approx(-0.6 / 1.5)
    _, weights, _ = draw(material(bsdf.CONDUCTOR), WHITE, o, numbers[:1])
    assert weights[0] == pytest.approx(fresnel_conductor(0.8, 2.87, 3.25))


def test_fresnel_at_normal_incidence_at_brewster_and_beyond_the_critical_angle():
    assert fresnel_dielectric(1.0, 1.5)[0] == pytest.approx(0.04)
    brewster = np.cos(np.arctan(1.5))
    beyond = 1.5 * np.sqrt(1 - (1 - brewster**2) / 2.25)
    assert fresnel_dielectric(brewster, 1.5)[0] == pytest.approx(((brewster - beyond) / (brewster + beyond)) ** 2 / 2)
    assert fresnel_dielectric(0.5, 1 / 1.5) == (1.0, 0.0)
    n, k = 2.87, 3.25
    assert fresnel_conductor(1.0, n, k) == pytest.approx(((n - 1) ** 2 + k**2) / ((n + 1) ** 2 + k**2))
    assert fresnel_conductor(0.3, 1.5, 0.0) == pytest.approx(fresnel_dielectric(0.3, 1.5)[0])
    # average over the hemisphere from inside glass (Walter et al. 1.0 / 1.5: 0.596)
    assert diffuse_reflectance(1 / 1.5) == pytest.approx(0.5963, abs=5e-4)


@numba.njit
def facet_sums(view, ax, ay, grid, share):
    projected, seen, m = 0.0, 0.0, Microsurface(ax, ay, 1.0)
    for j in range(len(grid)):
        x, y, z = grid[j]
        projected += ggx(m, (x, y, z)) * max(z, 0.0) * share[j]
        seen += visible_normal_pdf(m, (view[0], view[1], view[2]), (x, y, z)) * share[j]
    return projected, seen


@pytest.mark.parametrize("alpha", [(0.05, 0.05), (0.2, 0.6)])
def test_facets_project_to_the_surface_and_those_seen_to_the_view(alpha):
    grid, share = sphere_grid(64, 64, 16)
    projected, seen = facet_sums(unit((0.5, 0.3, 0.6)), *alpha, grid.reshape(-1, 3), share.ravel())
    assert projected == pytest.approx(1.0, rel=1e-3)
    assert seen == pytest.approx(1.0, rel=1e-3)
