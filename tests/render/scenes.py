"""Small scenes that the tests of the renderer share."""

from __future__ import annotations

import math

import numpy as np

from render.base.pose import Pose, invert
from render.camera.camera import Camera
from render.laser.laser import Divergence, LineLaser
from render.mesh.mesh import Mesh
from render.scene.scene import Rig, Scene, SceneObject
from render.scene.shape import Plane
from render.world.world import World, place_meshes

BASELINE = Pose(translation=(0.2, 0.0, 0.0), rotation=(0.0, -math.radians(13), 0.0))


def paper_camera(scale: float = 1.0, distortion: tuple[float, ...] = ()) -> Camera:
    """The founding paper's camera, centred."""
    camera = Camera(width=2448, height=2048, fx=3478.26, fy=3478.26, cx=1223.5, cy=1023.5, distortion=distortion)
    return camera.scaled(scale)


def paper_laser(half_width: float = 1.15e-3, **changes: object) -> LineLaser:
    """The founding paper's laser, 0.2 m beside the camera and turned in by 13 degrees."""
    return LineLaser(sheet=Divergence(full_angle=half_width), T_rig_laser=BASELINE).model_copy(update=changes)


def scene_of(camera: Camera, *lasers: LineLaser, objects: int = 1, **parts: object) -> Scene:
    """A scene whose objects are placeholders for meshes given to `world_of`."""
    items = tuple(SceneObject(name=f"object {i}", shape=Plane()) for i in range(objects))
    return Scene(rig=Rig(camera=camera, lasers=lasers), objects=items, **parts)


def world_of(scene: Scene, *meshes: Mesh) -> World:
    return place_meshes(scene, list(meshes))


def plane_mesh(normal: tuple[float, float, float], distance: float, size: float = 1.5) -> Mesh:
    """Two triangles on normal . p = distance, camera frame."""
    n = np.asarray(normal) / np.linalg.norm(normal)
    a = np.cross(n, (0.0, 1.0, 0.0))
    a /= np.linalg.norm(a)
    b = np.cross(n, a)
    centre = np.array([0.0, 0.0, distance / n[2]])
    corners = [centre + size * (x * a + y * b) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return Mesh(np.array(corners), np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32))


def moved(
    mesh: Mesh, translation: tuple[float, float, float], rotation: tuple[float, float, float] = (0, 0, 0)
) -> Mesh:
    """The mesh in another pose."""
    matrix = Pose(translation=translation, rotation=rotation).matrix
    return Mesh(mesh.vertices @ matrix[:3, :3].T + matrix[:3, 3], mesh.triangles, mesh.uv, mesh.texture)


def centroids(image: np.ndarray) -> np.ndarray:
    """(h,) centre of mass of each row of a noiseless image, NaN where it is dark."""
    image = image.astype(np.float64)
    total = image.sum(axis=1)
    with np.errstate(invalid="ignore"):
        return np.asarray((image @ np.arange(image.shape[1])) / np.where(total > 0, total, np.nan))


def in_laser_frame(points: np.ndarray, laser: LineLaser) -> np.ndarray:
    """Camera-frame points, camera at the rig's origin, in the laser's frame."""
    matrix = invert(laser.T_rig_laser.matrix)
    return np.asarray(points @ matrix[:3, :3].T + matrix[:3, 3])
