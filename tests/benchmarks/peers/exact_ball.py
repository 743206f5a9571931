"""s3 and s4 with the exact ball, by particles in float64: nothing of the renderer, and no fault that it could share.

Particles leave the laser stratified, split at the ball by Fresnel's equations, the sphere itself for a surface, and
are seen where they land on the wall: straight, or through the plate, where Snell's law leaves one unknown. Pixels in
which the ball is seen, and light that meets the wall twice, are left out; `ball_pixels` tells the former. On s3 it
agrees with `references/s3.npz`, made apart from it: 1e-4 in the line's light, 1e-3 in the caustic's.

    python -m peers.exact_ball s4 PASSES    writes references/s4.npz
"""

from __future__ import annotations

import math
import sys

import numba
import numpy as np
from peers import scenes
from peers.references import FOLDER

WALL_Z = 0.95
ORDERS = 4
"""A ray is followed through this many meetings with the inside of the ball; 1e-5 of its power is left."""
REACH = 5.0
ALONG, ACROSS = 1 << 15, 32
"""Particles of a pass, stratified."""
CX, CY = (scenes.WIDTH - 1) / 2, (scenes.HEIGHT - 1) / 2


@numba.njit(cache=False, error_model="numpy")
def fresnel(cosine, eta):
    """Reflectance of unpolarised light, eta = n beyond / n before; and the refracted cosine (0: total)."""
    sine2 = (1 - cosine * cosine) / (eta * eta)
    if sine2 >= 1:
        return 1.0, 0.0
    beyond = math.sqrt(1 - sine2)
    s = (cosine - eta * beyond) / (cosine + eta * beyond)
    p = (eta * cosine - beyond) / (eta * cosine + beyond)
    return 0.5 * (s * s + p * p), beyond


@numba.njit(cache=False, error_model="numpy")
def meets_ball(o, d, c, radius):
    """Distance to the ball from outside, or -1."""
    b = d[0] * (o[0] - c[0]) + d[1] * (o[1] - c[1]) + d[2] * (o[2] - c[2])
    q = (o[0] - c[0]) ** 2 + (o[1] - c[1]) ** 2 + (o[2] - c[2]) ** 2 - radius * radius
    root = b * b - q
    if root <= 0:
        return -1.0
    return -b - math.sqrt(root)


@numba.njit(cache=False, error_model="numpy")
def through_plate(radius, depth, thickness, passes, n):
    """Tangent of the camera ray that meets a point `radius` off the axis at `depth`, and d radius / d tangent.

    It goes through the plate's thickness `passes` times: once, or to and fro and out.
    """
    t = radius / depth
    slope = depth
    for _ in range(20):
        s = t / math.sqrt(1 + t * t) / n
        inside = s / math.sqrt(1 - s * s)
        f = (depth - thickness) * t + passes * thickness * inside - radius
        # d inside / d t by Snell's law
        slope = (depth - thickness) + passes * thickness * (1 + inside * inside) ** 1.5 / (n * (1 + t * t) ** 1.5)
        t -= f / slope
    return t, slope


@numba.njit(cache=False, error_model="numpy")
def see(x, y, power, albedo, f, cx, cy, c, radius, thickness, n, image):
    """Add what the camera sees of light of this power that lands at (x, y) on the wall."""
    r = math.hypot(x, y)
    # through a plate: straight, and after going to and fro in it once (2e-3 of the light)
    for order in range(2 if thickness > 0.0 else 1):
        t, slope = through_plate(r, WALL_Z, thickness, 2 * order + 1, n)
        passed = 1.0
        if thickness > 0.0:
            reflected, _ = fresnel(1 / math.sqrt(1 + t * t), n)
            passed = (1 - reflected) ** 2 * reflected ** (2 * order)
        ux, uy = (x / r * t, y / r * t) if r > 0 else (0.0, 0.0)
        # the ray's last leg, as if it began on the plane z = 0
        d = np.array([ux, uy, 1.0]) / math.sqrt(1 + t * t)
        start = np.array([x - ux * WALL_Z, y - uy * WALL_Z, 0.0])
        if meets_ball(start, d, c, radius) > 0.0:
            continue
        # radiance = albedo / pi irradiance; area on the wall for an area of the image: along the radius and across it
        area = (r / t if t > 0 else slope) * slope / (f * f)
        i, j = int(math.floor(f * ux + cx + 0.5)), int(math.floor(f * uy + cy + 0.5))
        if 0 <= i < image.shape[1] and 0 <= j < image.shape[0]:
            image[j, i] += passed * albedo / math.pi * power / area


@numba.njit(cache=False, error_model="numpy")
def particles(seed, pose, sigma, fan, power, albedo, f, cx, cy, centre, radius, n, thickness, direct, caustic):
    """One pass over all strata, jittered."""
    np.random.seed(seed)
    edge = math.sin(fan / 2)
    each = power / (ALONG * ACROSS)
    o = pose[:3, 3].copy()
    d, normal = np.empty(3), np.empty(3)
    for i in range(ALONG):
        for j in range(ACROSS):
            # constant radiant intensity: even in the sine of the angle along the fan
            sine = (2 * (i + np.random.random()) / ALONG - 1) * edge
            y = sine / math.sqrt(1 - sine * sine)
            x = -REACH * sigma + 2 * REACH * sigma * (j + np.random.random()) / ACROSS
            weight = 2 * REACH * math.exp(-0.5 * (x / sigma) ** 2) / math.sqrt(2 * math.pi)
            length = math.sqrt(x * x + y * y + 1)
            for k in range(3):
                d[k] = (pose[k, 0] * x + pose[k, 1] * y + pose[k, 2]) / length
            s = meets_ball(o, d, centre, radius)
            if s < 0.0:
                if d[2] > 0:
                    s = (WALL_Z - o[2]) / d[2]
                    see(
                        o[0] + s * d[0],
                        o[1] + s * d[1],
                        each * weight,
                        albedo,
                        f,
                        cx,
                        cy,
                        centre,
                        radius,
                        thickness,
                        n,
                        direct,
                    )
                continue
            p = o + s * d
            for k in range(3):
                normal[k] = (p[k] - centre[k]) / radius
            cosine = -(d[0] * normal[0] + d[1] * normal[1] + d[2] * normal[2])
            reflected, beyond = fresnel(cosine, n)
            mirror = d + 2 * cosine * normal
            land(p, mirror, each * weight * reflected, albedo, f, cx, cy, centre, radius, thickness, n, caustic)
            inner = d / n + (cosine / n - beyond) * normal
            rest = each * weight * (1 - reflected)
            for _ in range(ORDERS):
                # a chord of a sphere meets it at the same angle each time
                chord = -2 * (inner[0] * normal[0] + inner[1] * normal[1] + inner[2] * normal[2]) * radius
                p = p + chord * inner
                for k in range(3):
                    normal[k] = (p[k] - centre[k]) / radius
                inside = inner[0] * normal[0] + inner[1] * normal[1] + inner[2] * normal[2]
                back, leaves = fresnel(inside, 1 / n)
                out = n * inner - (n * inside - leaves) * normal
                land(p, out, rest * (1 - back), albedo, f, cx, cy, centre, radius, thickness, n, caustic)
                rest *= back
                inner = inner - 2 * inside * normal


@numba.njit(cache=False, error_model="numpy")
def land(p, d, power, albedo, f, cx, cy, c, radius, thickness, n, image):
    """Follow light that left the ball to the wall; what flies back towards camera and plate is lost."""
    if d[2] > 1e-9:
        s = (WALL_Z - p[2]) / d[2]
        see(p[0] + s * d[0], p[1] + s * d[1], power, albedo, f, cx, cy, c, radius, thickness, n, image)


def ball_pixels(plate: bool, margin: float = 2.0) -> np.ndarray:
    """(h, w) bool: pixels in which the ball is seen, and a margin around them."""
    u, v = np.meshgrid(np.arange(scenes.WIDTH), np.arange(scenes.HEIGHT))
    x, y = (u - CX) / scenes.FOCAL, (v - CY) / scenes.FOCAL
    t = np.hypot(x, y)
    # the plate moves a ray aside by thickness (tan - tan inside)
    sine = t / np.sqrt(1 + t * t) / scenes.GLASS_IOR
    aside = (scenes.PLATE_FAR - scenes.PLATE_NEAR) * (t - sine / np.sqrt(1 - sine**2)) if plate else 0.0 * t
    start = np.stack([-x / np.maximum(t, 1e-12) * aside, -y / np.maximum(t, 1e-12) * aside, 0 * t], -1)
    d = np.stack([x, y, np.ones_like(x)], -1) / np.sqrt(1 + t * t)[..., None]
    to = np.asarray(scenes.BALL_CENTRE) - start
    along = np.sum(to * d, -1)
    off = np.linalg.norm(to - along[..., None] * d, axis=-1)
    return np.asarray(off < scenes.BALL_RADIUS + margin * along / scenes.FOCAL)


def main() -> None:
    name, passes = sys.argv[1], int(sys.argv[2])
    thickness = scenes.PLATE_FAR - scenes.PLATE_NEAR if name == "s4" else 0.0
    direct, caustic = np.zeros((scenes.HEIGHT, scenes.WIDTH)), np.zeros((scenes.HEIGHT, scenes.WIDTH))
    ball = np.asarray(scenes.BALL_CENTRE), scenes.BALL_RADIUS, scenes.GLASS_IOR
    view = scenes.WALL.albedo, scenes.FOCAL, CX, CY
    for seed in range(passes):
        laser = scenes.T_WORLD_LASER, scenes.SIGMA, scenes.FAN, scenes.POWER
        particles(seed, *laser, *view, *ball, thickness, direct, caustic)
    direct, caustic = (image / passes for image in (direct, caustic))
    hidden = ball_pixels(name == "s4")
    total = direct + caustic
    total[hidden] = 0.0
    direct[hidden] = 0.0
    print(f"{name}: {total.sum():.3f}, of it caustic {(total - direct).sum():.3f}")
    np.savez_compressed(FOLDER / f"{name}.npz", img=total.astype(np.float32), direct=direct.astype(np.float32))


if __name__ == "__main__":
    main()
