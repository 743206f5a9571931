"""The benchmark's scenes in plain arrays, for every engine the same: half of the founding paper's camera, its laser.

    s1          a Lambertian plane tilted by 20 deg: the direct line alone
    s2          a single-bevel tee weld, ground metal (GGX, alpha 0.15) between painted plates: line and reflections
    s2-shiny    the same with alpha 0.03
    s3          a glass ball before a wall: line and caustic
    s4          s3 seen through a plate of glass: light that goes laser - glass - wall - glass - camera
    channel     a channel of ground copper, crossed by the line: bright concave edges
    rocker      the trough of a rocker, polished chromium: bright and concave all over

World coordinates are the camera's: x right, y down, z forward, metres. The camera is centred, so that the principal
point needs no convention. The geometry of s2 is `tee_weld.npz`, float32 vertices; its bead is a grid of 1001 x 51.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

WIDTH, HEIGHT, FOCAL = 1224, 1024, 3478.3 / 2

POWER, FAN, DIVERGENCE = 0.02, math.radians(45), 1.149425160806683e-3
"""W; rad; rad, the full 1/e^2 angle across the sheet. Radiant intensity is constant over the fan."""
SIGMA = math.tan(DIVERGENCE / 2) / 2
"""Of the sheet, on the plane one metre before the laser."""
TURN = -math.radians(13)
T_WORLD_LASER = np.array(
    [
        [math.cos(TURN), 0.0, math.sin(TURN), 0.2],
        [0.0, 1.0, 0.0, 0.0],
        [-math.sin(TURN), 0.0, math.cos(TURN), 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ]
)

BALL_CENTRE, BALL_RADIUS, GLASS_IOR = (-0.02352, 0.0, 0.8437), 0.04, 1.5
PLATE_NEAR, PLATE_FAR, PLATE_HALF = 0.30, 0.31, (0.12, 0.10)
"""m; the laser passes beside it."""


@dataclass(frozen=True)
class Material:
    """diffuse: albedo; metal: GGX alpha and the complex index n + ik; glass: smooth, n."""

    kind: str
    albedo: float = 0.0
    alpha: float = 0.0
    n: float = 1.0
    k: float = 0.0


@dataclass(frozen=True)
class Part:
    name: str
    vertices: np.ndarray
    """(v, 3) float32."""
    triangles: np.ndarray
    """(t, 3) int32."""
    material: Material
    smooth: np.ndarray | None = None
    """(v, 3) normals for shading, or none: facets."""


@dataclass(frozen=True)
class Setting:
    name: str
    title: str
    parts: tuple[Part, ...]
    backdrop: tuple[str, ...] = ()
    """Parts that send light to no other: an aimed laser may pass them by."""


WALL = Material("diffuse", albedo=0.5)
PAINT = Material("diffuse", albedo=0.3)
GLASS = Material("glass", n=GLASS_IOR)


def _quad(*corners: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray]:
    return np.array(corners, np.float32), np.array([[0, 1, 2], [0, 2, 3]], np.int32)


def _plane() -> Part:
    """Through (0, 0, 0.9), turned by 20 deg about the diagonal of the image."""
    lower, upper = (0.84572333, -0.84572333, 0.46467942), (-0.84572333, 0.84572333, 1.33532059)
    return Part("plane", *_quad((-0.9, -0.9, 0.9), upper, (0.9, 0.9, 0.9), lower), WALL)


def _grid(rows: int, columns: int) -> np.ndarray:
    """Two triangles for each cell of a grid of rows x columns vertices."""
    i, j = np.meshgrid(np.arange(rows - 1), np.arange(columns - 1), indexing="ij")
    a = (i * columns + j).ravel()
    lower = np.stack([a + columns + 1, a + columns, a], axis=1)
    upper = np.stack([a + 1, a + columns + 1, a], axis=1)
    return np.concatenate([lower, upper]).astype(np.int32)


def _tee(alpha: float) -> tuple[Part, ...]:
    metal = Material("metal", alpha=alpha, n=2.87, k=3.25)
    stored = np.load(Path(__file__).with_name("tee_weld.npz"))
    parts = [
        Part(name, stored[f"{name}_vertices"], stored[f"{name}_triangles"], material)
        for name, material in (("base", PAINT), ("vert", PAINT), ("ground", metal))
    ]
    return (*parts, Part("bead", stored["bead_vertices"], _grid(1001, 51), metal))


def _ball(segments: int) -> Part:
    """A ball of segments x segments / 2 quads, with the exact normals for those who shade with them."""
    rings = segments // 2
    polar, azimuth = np.arange(rings + 1) * math.pi / rings, np.arange(segments) * 2 * math.pi / segments
    p, a = np.meshgrid(polar, azimuth, indexing="ij")
    normals = np.stack([np.sin(p) * np.cos(a), np.sin(p) * np.sin(a), np.cos(p)], axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(rings), np.arange(segments), indexing="ij")
    here, beside = (i * segments + j).ravel(), (i * segments + (j + 1) % segments).ravel()
    triangles = np.concatenate(
        [np.stack([here, here + segments, beside + segments], 1), np.stack([here, beside + segments, beside], 1)]
    )
    # the caps' second triangles have no area
    points = np.asarray(BALL_CENTRE) + BALL_RADIUS * normals
    a0, b0, c0 = (points[triangles[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b0 - a0, c0 - a0), axis=1)
    keep = triangles[area > 1e-3 * np.median(area)].astype(np.int32)
    return Part("ball", points.astype(np.float32), keep, GLASS, normals.astype(np.float32))


def _wall() -> Part:
    return Part("wall", *_quad((-0.7, -0.7, 0.95), (-0.7, 0.7, 0.95), (0.7, 0.7, 0.95), (0.7, -0.7, 0.95)), WALL)


def _plate() -> Part:
    x, y = PLATE_HALF
    corners = [(sx * x, sy * y, z) for z in (PLATE_NEAR, PLATE_FAR) for sy in (-1, 1) for sx in (-1, 1)]
    # outward, counter-clockwise
    quads = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
    triangles = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return Part("plate", np.array(corners, np.float32), np.array(triangles, np.int32), GLASS)


def _channel() -> Part:
    """40 mm wide, 30 mm deep, along x, its floor's middle at z = 0.9, tilted by 25 deg so that one wall faces us."""
    half, depth, reach, tilt = 0.02, 0.03, 0.12, math.radians(25)
    profile = [(-half, -depth), (-half, 0.0), (half, 0.0), (half, -depth)]
    turned = [
        (y * math.cos(tilt) - z * math.sin(tilt), 0.9 + y * math.sin(tilt) + z * math.cos(tilt)) for y, z in profile
    ]
    corners = np.array([(x, y, z) for y, z in turned for x in (-reach, reach)], np.float32)
    triangles = [t for i in (0, 2, 4) for t in ((i, i + 1, i + 3), (i, i + 3, i + 2))]
    return Part("channel", corners, np.array(triangles, np.int32), Material("metal", alpha=0.2, n=0.24, k=3.6))


def _rocker() -> Part:
    """A trough along x, an arc of 150 deg about a radius of 24 mm, whose floor sinks as a circle of 120 mm does."""
    along, across = 301, 201
    x = np.linspace(-0.06, 0.06, along)
    angle = np.radians(np.linspace(-75.0, 75.0, across))
    floor = 0.9 + np.sqrt(0.12**2 - x**2) - 0.12
    y = np.broadcast_to(0.024 * np.sin(angle), (along, across))
    z = floor[:, None] - 0.024 * (1.0 - np.cos(angle))
    points = np.stack([np.broadcast_to(x[:, None], y.shape), y, z], axis=-1).reshape(-1, 3)
    metal = Material("metal", alpha=0.08, n=3.1, k=3.33)
    return Part("rocker", points.astype(np.float32), _grid(along, across), metal)


def setting(name: str, ball_segments: int = 256) -> Setting:
    """One of NAMES. ball_segments: how finely the ball of s3 and s4 is cut."""
    if name == "s1":
        return Setting(name, "tilted Lambertian plane", (_plane(),))
    if name == "s2":
        return Setting(name, "tee weld, metal of alpha 0.15", _tee(0.15))
    if name == "s2-shiny":
        return Setting(name, "tee weld, metal of alpha 0.03", _tee(0.03))
    if name == "s3":
        return Setting(name, "glass ball before a wall", (_wall(), _ball(ball_segments)), ("wall",))
    if name == "s4":
        return Setting(name, "ball and wall behind a glass plate", (_wall(), _ball(ball_segments), _plate()))
    if name == "channel":
        return Setting(name, "channel of ground copper", (_channel(),))
    if name == "rocker":
        return Setting(name, "trough of polished chromium", (_rocker(),))
    raise ValueError(f"scene {name!r}; known: {', '.join(NAMES)}")


NAMES = ("s1", "s2", "s2-shiny", "s3", "s4", "channel", "rocker")


def aim(of: Setting) -> tuple[float, float]:
    """Tangents along the fan, in the laser's frame, between which the sheet meets what reflections come by way of."""
    world_to_laser = np.linalg.inv(T_WORLD_LASER)
    low, high, edge = math.inf, -math.inf, math.tan(FAN / 2)
    for part in (part for part in of.parts if part.name not in of.backdrop):
        points = part.vertices.astype(np.float64) @ world_to_laser[:3, :3].T + world_to_laser[:3, 3]
        a, b = (points[part.triangles[:, k]] for k in ([0, 1, 2], [1, 2, 0]))
        # where an edge of a triangle goes through the sheet's plane
        through = a[..., 0] * b[..., 0] <= 0.0
        a, b = a[through], b[through]
        share = a[:, 0] / np.where(a[:, 0] == b[:, 0], 1.0, a[:, 0] - b[:, 0])
        met = a + share[:, None] * (b - a)
        tangents = met[:, 1] / met[:, 2]
        low, high = min([low, *tangents]), max([high, *tangents])
    return max(float(low), -edge), min(float(high), edge)


def sheet_profile(texels: int, reach: float) -> np.ndarray:
    """(texels,) unit-area Gaussian g(X), X out to `reach` sigmas either side, at the texels' centres."""
    x = ((np.arange(texels) + 0.5) / texels * 2 - 1) * reach * SIGMA
    return np.asarray(np.exp(-0.5 * (x / SIGMA) ** 2) / (SIGMA * math.sqrt(2 * math.pi)))
