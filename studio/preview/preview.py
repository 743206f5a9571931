"""The live preview: the exact lit curve, the fan and a quick camera picture while things are dragged.

Every mesh keeps its triangles, boxes and embree scene in its own frame, made once. A moved object, camera or laser
changes poses only: the plane and the rays are taken into each object's frame, and the nearest hit is kept.
"""

from __future__ import annotations

import contextlib
import dataclasses
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float
from render.base.errors import InputError
from render.base.pose import Pose, invert, transform_points
from render.camera.camera import Camera
from render.frame import Axis, LaserCurve
from render.material.material import Lambertian
from render.mesh.load import load_mesh
from render.scene.scene import Rig, Scene, SceneObject
from render.truth.laser_curve import curve_of_cut, cut_triangles
from render.truth.visibility import visible
from render.world.embree import RayScene
from render.world.plane_culling import block_boxes, crossing_in_blocks
from render.world.triangles import Surface
from render.world.world import place_meshes
from studio.preview.preview_image import PreviewImage, Speed, preview_image
from studio.preview.reflected_light import reflected_light
from studio.preview.unshadowed_light import unshadowed_light
from studio.project.project import Project

Mask = NDArray[np.bool_]

FAN_RAYS = 512
DRAG_SECONDS = 0.01
"""Of work for one camera picture while something is dragged."""
ALONE = Rig(camera=Camera(width=1, height=1, fx=1.0, fy=1.0, cx=0.0, cy=0.0))


@dataclass(frozen=True)
class Body:
    """One mesh in its own frame."""

    surface: Surface
    surface_at: Callable[[tuple[float, float, float]], Surface]
    """The same with its materials at three wavelengths, nm."""
    rays: RayScene
    boxes: Float
    """(b, 6) `render.world.plane_culling`."""
    bounds: Float
    """(2, 3) m."""


@dataclass(frozen=True)
class Placed:
    """A body in the world."""

    index: int
    """In `scene.visible_objects`."""
    body: Body
    T_world_object: Float
    T_object_world: Float


@dataclass(frozen=True)
class Fan:
    """Rays of a laser, evenly spaced across its fan, up to what they hit first. World frame."""

    origin: Float
    """(3,) m."""
    direction: Float
    """(n, 3) unit."""
    distance: Float
    """(n,) m, inf where nothing is hit."""
    in_image: Mask
    """(n,) the hit point projects into the image."""
    seen: Mask
    """(n,) and the camera sees it."""

    @property
    def occluded(self) -> float | None:
        """Share of the line within the image that the camera cannot see; None: no line there."""
        count = int(self.in_image.sum())
        return None if count == 0 else 1.0 - float(self.seen.sum()) / count


@dataclass(frozen=True)
class Lit:
    """The lit curve with what the surface is like at each of its (n,) points."""

    curve: LaserCurve
    normal: Float
    """(n, 3) unit facet normal towards the camera, camera frame."""
    unshadowed: Float
    """(n, 3) RGB radiance of environment and lamps towards the camera as if nothing threw shadows, W/(m^2 sr)."""
    reflected: Float
    """(n,) of the laser's light towards the camera: the reflectance of a diffuse surface that would be as bright."""


class Preview:
    """Bodies that outlive edits. `load` may run in a thread; the rest belongs to one thread."""

    def __init__(self, threads: int | None = None) -> None:
        self.threads = threads
        self.speed = Speed()
        self.errors: dict[str, InputError] = {}
        """By object name: why it is not shown, or not as what it is made of."""
        self._rays: dict[object, tuple[RayScene, Float]] = {}
        self._bodies: dict[object, Body] = {}
        self._failed: dict[object, InputError] = {}
        self._lock = threading.Lock()

    def missing(self, project: Project, root: Path) -> list[SceneObject]:
        """Visible objects that are not loaded yet, and have not failed to."""
        wanted = {_key(item, root): item for item in project.scene.visible_objects}
        return [item for key, item in wanted.items() if key not in self._bodies and key not in self._failed]

    def load(self, item: SceneObject, root: Path) -> None:
        """Make an object's body. A bad one is remembered, and told in `errors` of the next look.

        Where only the material is impossible, the object stands there in plain grey.
        """
        key = _key(item, root)
        try:
            self._bodies[key] = self._body(item, root)
        except InputError as error:
            self._failed[key] = error
            with contextlib.suppress(InputError):
                self._bodies[key] = self._body(item.model_copy(update={"material": Lambertian()}), root)

    def _body(self, item: SceneObject, root: Path) -> Body:
        shape_key = _shape_key(item, root)
        mesh = load_mesh(item, root)
        # the world of this object alone, standing at its own origin
        alone = item.model_copy(update={"T_world_object": Pose()})
        world = place_meshes(Scene(rig=ALONE, objects=(alone,)), [mesh], root=root)
        surface = world.surface
        with self._lock:
            if shape_key not in self._rays:
                self._rays[shape_key] = (
                    RayScene(world.vertices, world.triangles),
                    block_boxes(world.vertices, world.triangles),
                )
            rays, boxes = self._rays[shape_key]
        bounds = np.stack([world.vertices.min(axis=0), world.vertices.max(axis=0)])
        return Body(surface, world.surface_at, rays, boxes, bounds)

    def look(self, project: Project, root: Path, step: int = 0, *, wait: bool = True) -> Look:
        """The project as it is. wait: load what is missing now; otherwise leave it out."""
        if wait:
            for item in self.missing(project, root):
                self.load(item, root)
        scene, placed, errors = project.scene, [], {}
        for i, item in enumerate(scene.visible_objects):
            key = _key(item, root)
            if key in self._bodies:
                T = scene.T_world_object(item, step)
                placed.append(Placed(i, self._bodies[key], T, invert(T)))
            if key in self._failed:
                errors[item.name] = self._failed[key]
        self.errors = errors
        return Look(project, step, tuple(placed), self)

    def drop_unused(self, project: Project, root: Path) -> None:
        """Free the bodies that the project does not show any more."""
        keys = {_key(item, root) for item in project.scene.objects}
        shapes = {_shape_key(item, root) for item in project.scene.objects}
        self._bodies = {key: body for key, body in self._bodies.items() if key in keys}
        self._rays = {key: rays for key, rays in self._rays.items() if key in shapes}
        self._failed = {key: error for key, error in self._failed.items() if key in keys}


class Look:
    """One state of the project; curves, fans and pictures are made when asked for, once."""

    def __init__(self, project: Project, step: int, placed: tuple[Placed, ...], preview: Preview) -> None:
        self.project, self.scene, self.step, self.placed = project, project.scene, step, placed
        self._preview = preview
        self._lit: dict[int, Lit] = {}
        self._fans: dict[int, Fan] = {}
        self._images: dict[float, PreviewImage] = {}

    def lit_curve(self, laser: int) -> LaserCurve:
        """The exact line of a laser, as `render.truth.laser_curve.laser_curve` of the whole world gives it."""
        return self.lit(laser).curve

    def lit(self, laser: int) -> Lit:
        """The lit curve with normals and how bright it is."""
        if laser not in self._lit:
            self._lit[laser] = self._cut(laser)
        return self._lit[laser]

    def fan(self, laser: int) -> Fan:
        """What each part of the sheet meets first, and whether the camera sees it there."""
        if laser not in self._fans:
            self._fans[laser] = self._trace_fan(laser)
        return self._fans[laser]

    def image(self, scale: float | None = None, *, seconds: float = DRAG_SECONDS) -> PreviewImage:
        """What the camera sees, with `scale` times its pixels a side; None: as many as fit into `seconds` of work."""
        if scale is None:
            scale = self._preview.speed.scale(self.scene, seconds)
        if scale not in self._images:
            self._images[scale] = preview_image(
                self.scene, self.step, self.placed, self.clear, scale, self._preview.speed, self._preview.threads
            )
        return self._images[scale]

    def clear(self, points: Float, facing: Float, towards: Float) -> Mask:
        """(n, 3) world points on surfaces, unit normals and vectors to a target on their side -> (n,) not occluded."""
        result = np.ones(len(points), dtype=np.bool_)
        for item in self.placed:
            todo = np.flatnonzero(result)
            R = item.T_object_world[:3, :3]
            result[todo] = visible(
                item.body.rays,
                transform_points(item.T_object_world, points[todo]),
                facing[todo] @ R.T,
                towards[todo] @ R.T,
                self._preview.threads,
            )
        return result

    def _cut(self, i: int) -> Lit:
        if not self.placed:
            return Lit(_no_curve(self.project.extraction.axis), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0))
        scene, laser = self.scene, self.scene.lasers[i]
        T_world_camera, T_world_laser = scene.T_world_camera(self.step), scene.T_world_laser(i, self.step)
        parts = [_cut_body(item, T_world_camera, T_world_laser) for item in self.placed]
        segments = np.concatenate([part[0] for part in parts])
        normals = np.concatenate([part[1] for part in parts])
        triangle = np.concatenate([part[2] for part in parts])
        place = np.repeat(np.arange(len(parts), dtype=np.int32), [len(part[2]) for part in parts])
        # the segment's own number stands in for the object, so that the triangle of each point is known as well
        curve = curve_of_cut(
            segments,
            normals,
            np.arange(len(triangle), dtype=np.int32),
            scene.camera,
            laser,
            T_world_camera,
            T_world_laser,
            self.project.extraction.axis,
            self.clear,
        )
        owner = curve.object_id
        points = transform_points(T_world_camera, curve.point)
        unshadowed, reflected = np.empty((len(owner), 3)), np.empty(len(owner))
        for k, item in enumerate(self.placed):
            mine = place[owner] == k
            local = transform_points(item.T_object_world, points[mine])
            ends = transform_points(item.T_object_world, np.stack([T_world_camera[:3, 3], T_world_laser[:3, 3]]))
            material = scene.visible_objects[item.index].material
            facets = triangle[owner[mine]]
            unshadowed[mine] = unshadowed_light(
                scene, item.body.surface, material, facets, local, item.T_object_world, ends[0]
            )
            reflected[mine] = reflected_light(item.body.surface_at, material, laser.wavelength_nm, facets, local, *ends)
        normal = normals[owner] @ T_world_camera[:3, :3]
        normal /= -np.sign(np.einsum("ij,ij->i", normal, curve.point))[:, None] * np.linalg.norm(
            normal, axis=1, keepdims=True
        )
        index = np.array([item.index for item in self.placed], dtype=np.int32)
        objects = index[place[owner]] if len(owner) else np.zeros(0, np.int32)
        return Lit(dataclasses.replace(curve, object_id=objects), normal, unshadowed, reflected)

    def _trace_fan(self, i: int) -> Fan:
        scene, laser, T = self.scene, self.scene.lasers[i], self.scene.T_world_laser(i, self.step)
        angle = np.linspace(-laser.fan_angle / 2, laser.fan_angle / 2, FAN_RAYS)
        local = np.stack([np.zeros_like(angle), np.sin(angle), np.cos(angle)], axis=1)
        direction, origin = local @ T[:3, :3].T, T[:3, 3].copy()
        distance = np.full(FAN_RAYS, np.inf)
        normal = np.zeros((FAN_RAYS, 3))
        for item in self.placed:
            towards = np.ascontiguousarray(direction @ item.T_object_world[:3, :3].T)
            start = transform_points(item.T_object_world, origin)
            hit = item.body.rays.from_point(start, towards.astype(np.float32))
            some = np.flatnonzero(hit >= 0)
            corners = item.body.surface.vertices[item.body.surface.triangles[hit[some]]]
            facet = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            facing = np.einsum("ij,ij->i", facet, towards[some])
            with np.errstate(divide="ignore", invalid="ignore"):
                far = np.einsum("ij,ij->i", facet, corners[:, 0] - start) / facing
            nearer = (far > 0.0) & (far < distance[some])
            chosen = some[nearer]
            distance[chosen] = far[nearer]
            facet = facet[nearer] * -np.sign(facing[nearer])[:, None]
            normal[chosen] = facet / np.linalg.norm(facet, axis=1, keepdims=True) @ item.T_world_object[:3, :3].T
        hits = np.flatnonzero(np.isfinite(distance))
        in_image, seen = np.zeros(FAN_RAYS, np.bool_), np.zeros(FAN_RAYS, np.bool_)
        if len(hits) == 0:
            return Fan(origin, direction, distance, in_image, seen)
        points = origin + distance[hits, None] * direction[hits]
        T_world_camera, camera = scene.T_world_camera(self.step), scene.camera
        pixels, valid = camera.project(transform_points(invert(T_world_camera), points))
        with np.errstate(invalid="ignore"):
            valid &= np.all((pixels > -0.5) & (pixels < (camera.width - 0.5, camera.height - 0.5)), axis=1)
        to_camera = T_world_camera[:3, 3] - points
        facing = np.einsum("ij,ij->i", normal[hits], to_camera) > 0.0
        look = np.flatnonzero(valid & facing)
        in_image[hits] = valid
        seen[hits[look]] = self.clear(points[look], normal[hits[look]], to_camera[look])
        return Fan(origin, direction, distance, in_image, seen)


def _cut_body(item: Placed, T_world_camera: Float, T_world_laser: Float) -> tuple[Float, Float, NDArray[np.int32]]:
    """Segments (m, 2, 3) and facet normals (m, 3), world, and triangles (m,) of one object."""
    vertices, triangles = _arrays(item.body.surface)
    T_laser_object = invert(T_world_laser) @ item.T_world_object
    side = np.empty(len(vertices))
    crossing = crossing_in_blocks(vertices, triangles, item.body.boxes, T_laser_object, side)
    camera = transform_points(item.T_object_world, T_world_camera[:3, 3])
    laser = transform_points(item.T_object_world, T_world_laser[:3, 3])
    segments, owner = cut_triangles(vertices, triangles, side, crossing, camera, laser)
    corners = vertices[triangles[owner]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return transform_points(item.T_world_object, segments), normals @ item.T_world_object[:3, :3].T, owner


def _no_curve(axis: Axis) -> LaserCurve:
    none, integers, points = np.zeros(0), np.zeros(0, np.int32), np.zeros((0, 3))
    return LaserCurve(axis, integers, none, points, none, none, integers, none, none, none, np.zeros((0, 2, 3)), none)


def _arrays(surface: Surface) -> tuple[Float, NDArray[np.int32]]:
    return surface.vertices, surface.triangles


def _shape_key(item: SceneObject, root: Path) -> object:
    return root, item.shape, item.scale


def _key(item: SceneObject, root: Path) -> object:
    return root, item.shape, item.scale, item.material
