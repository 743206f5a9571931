"""What the 3D pictures show and from where: geometry gathered into one file that a separate process can draw."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.report.colour import wavelength_colour
from analysis.report.frame_result import FrameResult
from analysis.report.model import ReportInput
from render.base.arrays import Float
from render.base.pose import invert, transform_points
from render.frame import LaserCurve

FAN_RAYS = 160
MOST_POINTS = 200_000


@dataclass(frozen=True)
class View:
    """A viewpoint of a 3D picture, world frame, m."""

    eye: Float
    target: Float
    up: Float
    low: Float
    """(3,) corner of the box that must be in the picture."""
    high: Float


@dataclass(frozen=True)
class SceneView:
    """The scene at the step that the report shows; world frame, m."""

    view: View
    frustum: Float
    """(5, 3) the camera's centre and the corners of what it sees, at the depth of the line."""
    emitters: Float
    """(l, 3) positions of the lasers."""
    sheets: list[tuple[Float, NDArray[np.int32]]]
    """For each laser the lit part of its sheet, as triangles."""
    edges: list[Float]
    """For each laser (3, 3) the full fan: one edge, the laser, the other edge."""
    curves: list[Float]
    """For each laser (m, 2, 3) pieces of the exact line where it is lit and seen."""
    colours: list[tuple[float, float, float]]


def placed_vertices(report: ReportInput, step: int) -> Float:
    """(v, 3) vertices with the objects placed for a step."""
    motion = report.scene.motion
    if motion.kind == "none" or motion.moves != "objects":
        return report.vertices
    return transform_points(motion.displacement(step) @ invert(motion.displacement(0)), report.vertices)


def scene_view(report: ReportInput, frame: FrameResult) -> SceneView:
    """Gather the scene at the frame's step."""
    scene, step = report.scene, frame.step
    T_world_camera = scene.T_world_camera(step)
    poses = [scene.T_world_laser(i, step) for i in range(len(scene.lasers))]
    on_line = [transform_points(T_world_camera, laser.curve.point) for laser in frame.lasers]
    every = np.concatenate([np.zeros((0, 3)), *on_line])
    if len(every) == 0:
        every = report.vertices if len(report.vertices) else transform_points(T_world_camera, np.array([[0, 0, 1.0]]))
    centre, eye = np.median(every, axis=0), T_world_camera[:3, 3]
    depth = float(transform_points(invert(T_world_camera), centre[None])[0, 2])
    frustum = _frustum(report, max(depth, 1e-3), T_world_camera)
    sheets, edges = [], []
    for laser, pose, points in zip(scene.lasers, poses, on_line, strict=True):
        reach = float(np.median(np.linalg.norm(points - pose[:3, 3], axis=1))) if len(points) else abs(depth)
        tan = min(laser.tan_half_fan, 3.0)
        ends = transform_points(pose, np.array([[0, -tan, 1.0], [0, 0, 0], [0, tan, 1.0]]) * 1.05 * reach)
        edges.append(ends)
        sheets.append(_lit_sheet(points, pose))
    emitters = np.array([pose[:3, 3] for pose in poses]).reshape(-1, 3)
    in_picture = np.concatenate([frustum, emitters, every])
    return SceneView(
        view=_viewpoint(in_picture, centre, eye, T_world_camera, emitters, every),
        frustum=frustum,
        emitters=emitters,
        sheets=sheets,
        edges=edges,
        curves=[_pieces(laser.curve, points) for laser, points in zip(frame.lasers, on_line, strict=True)],
        colours=[wavelength_colour(laser.wavelength_nm) for laser in scene.lasers],
    )


def cloud_view(report: ReportInput) -> tuple[View, Float, Float]:
    """The sample's points, where the objects are at step 0, with their surface error: view, (m, 3) m, (m,) m."""
    rows = report.record.chosen().rows
    rows = rows[rows["valid"]]
    cloud, error = rows["world"], rows["off_surface"]
    if len(cloud) > MOST_POINTS:
        kept = np.linspace(0, len(cloud) - 1, MOST_POINTS).astype(np.intp)
        cloud, error = cloud[kept], error[kept]
    pose = report.scene.T_world_camera(report.record.steps[0].step)
    spread = np.nanmedian(np.abs(error)) if np.any(np.isfinite(error)) else 0.0
    on_part = np.abs(error) <= max(1e-3, 20.0 * spread)
    shown = cloud[on_part] if np.any(on_part) else cloud if len(cloud) else report.vertices
    if len(shown) == 0:
        shown = np.zeros((1, 3))
    centre = (shown.min(axis=0) + shown.max(axis=0)) / 2
    return _viewpoint(shown, centre, pose[:3, 3], pose, np.zeros((0, 3)), shown), cloud, error


def _pieces(curve: LaserCurve, points: Float) -> Float:
    """(n, 3) points of the line -> (m, 2, 3), between neighbours on neighbouring scan lines."""
    near = np.abs(np.diff(curve.index)) == 1
    if np.any(near):
        gap = np.linalg.norm(np.diff(points, axis=0), axis=1)
        near &= gap < 20.0 * np.median(gap[near])
    at = np.flatnonzero(near)
    return np.stack([points[at], points[at + 1]], axis=1)


def _frustum(report: ReportInput, depth: float, T_world_camera: Float) -> Float:
    camera = report.scene.camera
    w, h = camera.width, camera.height
    corners = np.array([[-0.5, -0.5], [w - 0.5, -0.5], [w - 0.5, h - 0.5], [-0.5, h - 0.5]])
    # without the distortion: its inverse may end before the corners
    x = (corners - [camera.cx, camera.cy]) / [camera.fx, camera.fy]
    ends = np.concatenate([x, np.ones((4, 1))], axis=1) * depth
    return transform_points(T_world_camera, np.concatenate([np.zeros((1, 3)), ends]))


def _lit_sheet(points: Float, pose: Float) -> tuple[Float, NDArray[np.int32]]:
    """Triangles from the laser to neighbouring lit points, in the order of the fan."""
    if len(points) < 2:
        return np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int32)
    local = transform_points(invert(pose), points)
    order = np.argsort(np.arctan2(local[:, 1], local[:, 2]))
    order = order[np.linspace(0, len(order) - 1, min(FAN_RAYS, len(order))).astype(np.intp)]
    angle = np.arctan2(local[order, 1], local[order, 2])
    near = np.flatnonzero(np.diff(angle) <= 4.0 * np.median(np.diff(angle)) + 1e-9)
    triangles = np.stack([np.zeros_like(near), near + 1, near + 2], axis=1).astype(np.int32)
    return np.concatenate([pose[None, :3, 3], points[order]]), triangles


def _viewpoint(box: Float, centre: Float, eye: Float, T_world_camera: Float, emitters: Float, line: Float) -> View:
    """From the camera's side, turned off the sheet's plane and along the line: neither is then seen edge-on."""
    back = eye - centre
    back /= max(float(np.linalg.norm(back)), 1e-12)
    side = T_world_camera[:3, 0] if len(emitters) == 0 else emitters.mean(axis=0) - eye
    if np.linalg.norm(side) < 1e-9:
        side = T_world_camera[:3, 0]
    side = side / np.linalg.norm(side)
    spread = line - line.mean(axis=0)
    along = np.linalg.svd(spread, full_matrices=False)[2][0] if len(line) > 1 else T_world_camera[:3, 1]
    vertical = np.array([0.0, 0.0, 1.0])
    along = along if along @ vertical >= 0 else -along
    direction = 0.75 * back - 0.62 * side + 0.30 * along + 0.12 * vertical
    direction /= np.linalg.norm(direction)
    up = vertical if abs(direction @ vertical) < 0.95 else -T_world_camera[:3, 1]
    low, high = box.min(axis=0), box.max(axis=0)
    target = (low + high) / 2
    return View(target + direction, target, up, low, high)
