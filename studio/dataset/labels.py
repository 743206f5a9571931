"""What is known of every image: the exact line of each laser, what hides it elsewhere, and maps of every pixel."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float
from render.base.pose import invert, transform_points
from render.frame import Frame, LaserCurve
from studio.dataset.recipe import Recipe
from studio.dataset.scenes import Scene
from studio.preview import estimates
from studio.preview.preview import Look
from studio.project.project import Project

ABSENT, VISIBLE, OCCLUDED = 0, 1, 2
"""Of a scan line: no line crosses it; one is seen; one is lit or would be, and something stands before it."""


def labels(scene: Scene, image: int, frame: Frame) -> dict[str, Any]:
    """The JSON labels of one image of a scene; lengths m, positions px, pixel centres at whole numbers."""
    project = scene.projects[image]
    camera = project.scene.camera
    rows = project.extraction.axis == "rows"
    T_world_camera = project.scene.T_world_camera(frame.step)
    return {
        "scene": scene.number,
        "split": scene.split,
        "seed": project.seed,
        "width": camera.width,
        "height": camera.height,
        "scan_lines": "rows" if rows else "columns",
        "lasers": [_laser(project, scene.look, frame, i) for i in range(len(project.scene.lasers))],
        "camera": camera.model_dump(mode="json"),
        "T_world_camera": T_world_camera.tolist(),
        "sensor": project.sensor.model_dump(mode="json"),
        "objects": [
            {
                "id": k,
                "name": item.name,
                "material": item.material.model_dump(mode="json"),
                "T_world_object": project.scene.T_world_object(item, frame.step).tolist(),
            }
            for k, item in enumerate(project.scene.visible_objects)
        ],
        "drawn": dict(scene.drawn[image]),
        "rejected": list(scene.rejected),
    }


def _laser(project: Project, look: Look, frame: Frame, i: int) -> dict[str, Any]:
    curve = frame.curves[i]
    floor = sigma_floor(project, look, i, curve).tolist()
    return {
        "name": project.scene.lasers[i].name,
        "wavelength_nm": project.scene.lasers[i].wavelength_nm,
        "plane": project.scene.laser_plane(i).tolist(),
        "states": "".join(map(str, line_states(curve, look, i).tolist())),
        "index": curve.index.tolist(),
        "position": np.round(curve.position, 6).tolist(),
        "sigma_floor": [round(one, 6) if math.isfinite(one) else None for one in floor],
        "depth_z": np.round(curve.depth_z, 9).tolist(),
        "object": curve.object_id.tolist(),
    }


def line_states(curve: LaserCurve, look: Look, laser: int) -> NDArray[np.int8]:
    """(h,) of each scan line: ABSENT, VISIBLE or OCCLUDED.

    A line is there where the sheet cuts a facet that faces laser and camera, within the fan and the image.
    """
    scene, camera = look.scene, look.scene.camera
    rows = curve.axis == "rows"
    count, across = (camera.height, camera.width) if rows else (camera.width, camera.height)
    states = np.zeros(count, np.int8)
    segments = curve.segments
    if len(segments):
        T_camera_world = invert(scene.T_world_camera(look.step))
        points = transform_points(T_camera_world, segments.reshape(-1, 3))
        pixels, valid = camera.project(points)
        pixels, ends = pixels.reshape(-1, 2, 2), np.all(valid.reshape(-1, 2), axis=1)
        along, position = (pixels[..., 1], pixels[..., 0]) if rows else (pixels[..., 0], pixels[..., 1])
        within = ends & np.all((position > -0.5) & (position < across - 0.5), axis=1)
        first = np.clip(np.ceil(along[within].min(axis=1)), 0, count).astype(int)
        last = np.clip(np.floor(along[within].max(axis=1)), -1, count - 1).astype(int)
        crossed = np.zeros(count + 1, int)
        some = last >= first
        np.add.at(crossed, first[some], 1)
        np.add.at(crossed, last[some] + 1, -1)
        states[np.cumsum(crossed[:-1]) > 0] = OCCLUDED
    states[curve.index] = VISIBLE
    return states


def sigma_floor(project: Project, look: Look, laser: int, curve: LaserCurve) -> Float:
    """(n,) Cramer-Rao bound of each crossing's position, px: shot, read and quantisation noise, background, no speckle.

    NaN where the sensor does not see the laser.
    """
    lit = look.lit(laser)
    if not len(curve.index) or len(lit.curve.index) != len(curve.index):
        return np.full(len(curve.index), np.nan)
    scene, sensor = project.scene, project.sensor
    pixels = estimates.line_pixels(lit)
    T_camera_laser = scene.T_camera_laser(laser)
    rows = curve.axis == "rows"
    width = estimates.line_width_px(
        scene.camera, scene.lasers[laser], T_camera_laser, lit.normal, lit.curve.point, pixels, rows
    )
    background = estimates.ambient_electrons(look, lit, pixels) + sensor.dark_current * sensor.exposure_time
    amplitude = estimates.line_electrons(scene.camera, scene.lasers[laser], sensor, lit, pixels)
    return estimates.centre_bound_px(amplitude, width, background, estimates.read_variance(sensor))


def maps(recipe: Recipe, frame: Frame) -> Mapping[str, NDArray[Any]]:
    """Layers of every pixel by name, those that the recipe keeps, but for the objects' ids: (h, w) float32."""
    found: dict[str, NDArray[Any]] = {}
    if frame.truth is not None and "depth" in recipe.maps:
        found["depth.Z"] = frame.truth.depth_z
    if frame.truth is not None and "normals" in recipe.maps:
        found |= {f"normal.{name}": frame.truth.normal[..., k] for k, name in enumerate("XYZ")}
    if "laser" in recipe.maps:
        for i in range(len(frame.laser_direct)):
            found[f"direct{i}.Y"] = frame.laser_direct[i]
            if frame.laser_indirect:
                found[f"reflected{i}.Y"] = frame.laser_indirect[i]
    return found


def object_ids(frame: Frame) -> NDArray[np.uint8] | NDArray[np.uint16]:
    """(h, w) ids of the objects, from 1; 0 where nothing is hit."""
    assert frame.truth is not None
    ids = frame.truth.object_id + 1
    return ids.astype(np.uint8) if int(ids.max(initial=0)) < 256 else ids.astype(np.uint16)
