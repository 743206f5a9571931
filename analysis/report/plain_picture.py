"""The 3D pictures drawn by matplotlib: coarser than VTK's, for machines on which VTK cannot draw off-screen."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.report.colour import ACCENT, DIVERGING, INK, SLATE, STEEL
from analysis.report.style import figure
from analysis.report.view import SceneView, View
from render.base.arrays import Float

MOST_TRIANGLES = 6000
CELLS = 90
MOST_POINTS = 8000


def draw(
    folder: Path, vertices: Float, triangles: NDArray[np.int32], scene: SceneView, cloud: Float, error: Float,
    view: View, limit: float,
) -> tuple[Path, Path]:  # fmt: skip
    """Draw both pictures, as `picture.start` does; their paths."""
    with figure(5.0, 8.0) as made:
        axes = _axes(made, scene.view)
        _add_mesh(axes, vertices, triangles, STEEL, 0.8)
        centre, corners = scene.frustum[0], scene.frustum[1:]
        for corner in corners:
            _add_path(axes, np.stack([centre, corner]), ACCENT, 0.7)
        _add_path(axes, np.concatenate([corners, corners[:1]]), ACCENT, 0.7)
        axes.text(*centre, " camera", color=INK, fontsize=10)
        for i, colour in enumerate(scene.colours):
            corners_of_sheet, faces = scene.sheets[i]
            if len(faces):
                _add_mesh(axes, corners_of_sheet, faces, colour, 0.22)
            _add_path(axes, scene.edges[i], colour, 0.7)
            for piece in scene.curves[i][:: max(1, len(scene.curves[i]) // 400)]:
                _add_path(axes, piece, colour, 2.5)
            axes.text(
                *scene.emitters[i], " laser" if len(scene.colours) == 1 else f" laser {i + 1}", color=INK, fontsize=10
            )
        made.savefig(folder / "scene.png", dpi=200)
    with figure(5.0, 8.0) as made:
        axes = _axes(made, view)
        _add_mesh(axes, vertices, triangles, SLATE, 0.9)
        kept = slice(None, None, max(1, len(cloud) // MOST_POINTS))
        x, y, z = cloud[kept].T
        axes.scatter(x, y, z, c=error[kept], cmap=DIVERGING, vmin=-limit, vmax=limit, s=4, lw=0, depthshade=False)
        made.savefig(folder / "cloud.png", dpi=200)
    return folder / "scene.png", folder / "cloud.png"


def _axes(made: Any, view: View) -> Any:
    axes = made.add_subplot(projection="3d", computed_zorder=False)
    towards = view.eye - view.target
    axes.view_init(
        elev=float(np.degrees(np.arctan2(towards[2], np.hypot(towards[0], towards[1])))),
        azim=float(np.degrees(np.arctan2(towards[1], towards[0]))),
    )
    centre = (view.low + view.high) / 2
    half = max(0.5 * float(np.max(view.high - view.low)), 1e-6)
    axes.set(xlim=centre[0] + [-half, half], ylim=centre[1] + [-half, half], zlim=centre[2] + [-half, half])
    axes.set_box_aspect((1, 1, 1), zoom=1.5)
    axes.set_axis_off()
    return axes


def _add_mesh(axes: Any, vertices: Float, triangles: NDArray[np.int32], colour: Any, alpha: float) -> None:
    """Thousands of triangles at most: matplotlib would take minutes over a whole mesh."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    if len(triangles) > MOST_TRIANGLES:
        vertices, triangles = _simplified(vertices, triangles)
    if len(triangles):
        axes.add_collection3d(
            Poly3DCollection(
                vertices[triangles], facecolors=colour, edgecolors=colour, lw=0, alpha=alpha, zorder=1, shade=True
            )
        )


def _simplified(vertices: Float, triangles: NDArray[np.int32]) -> tuple[Float, NDArray[np.int32]]:
    """Vertices gathered in cells of a grid."""
    import open3d as o3d

    mesh = o3d.geometry.TriangleMesh(o3d.utility.Vector3dVector(vertices), o3d.utility.Vector3iVector(triangles))
    simple = mesh.simplify_vertex_clustering(float(np.max(np.ptp(vertices, axis=0))) / CELLS)
    return np.asarray(simple.vertices), np.asarray(simple.triangles)


def _add_path(axes: Any, points: Float, colour: Any, width: float) -> None:
    axes.plot(*points.T, color=colour, lw=width, zorder=2)
