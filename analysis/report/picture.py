"""Draws the 3D pictures with VTK in a process of its own: where a graphics library is missing, VTK ends the process.

python -m analysis.report.picture      told a FOLDER, a line on its standard input, it reads FOLDER/job.npz and writes
                                       FOLDER/scene.png and FOLDER/cloud.png
"""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from analysis.report.colour import ACCENT, DIVERGING, INK, SLATE, STEEL

if TYPE_CHECKING:  # the process that draws needs none of what these stand on
    from analysis.report.view import SceneView, View
    from render.base.arrays import Float

SIZE = (1800, 1125)
"""px: a little finer than the pages show it; without a graphics card the time goes with their number."""
MARGIN = 18
"""px left around a cropped picture."""
TIME_LIMIT = 60.0
"""s; drawing takes 3. Without a graphics card a mesh of millions takes longer, but not this long."""


class Drawing:
    """The process that draws, which takes a second to begin: whoever is to have a report may begin it before."""

    def __init__(self) -> None:
        root = Path(__file__).resolve().parents[2]
        environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(root), os.environ.get("PYTHONPATH", "")])}
        self._process = subprocess.Popen(
            [sys.executable, "-m", "analysis.report.picture"],
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )

    def __enter__(self) -> Drawing:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()

    def start(self, folder: Path, vertices: Float, triangles: NDArray[np.int32], scene: SceneView, cloud: Float,
              error: Float, view: View, limit: float) -> None:  # fmt: skip
        """Draw both pictures into a folder, once; `limit` is the error at the colours' ends, m."""
        arrays: dict[str, Any] = {
            "vertices": vertices, "triangles": triangles, "frustum": scene.frustum, "emitters": scene.emitters,
            "colours": np.array(scene.colours).reshape(-1, 3), "cloud": cloud, "error": error,
            "limit": np.array(limit), "scene_view": _pack(scene.view), "cloud_view": _pack(view),
        }  # fmt: skip
        for i, (corners, faces) in enumerate(scene.sheets):
            arrays |= {f"sheet{i}": corners, f"faces{i}": faces}
            arrays |= {f"edges{i}": scene.edges[i], f"curve{i}": scene.curves[i]}
        np.savez(folder / "job.npz", **arrays)
        assert self._process.stdin is not None
        with suppress(OSError):  # it may have ended, which `finish` tells
            self._process.stdin.write(os.fsencode(folder) + b"\n")
            self._process.stdin.close()

    def finish(self, folder: Path) -> tuple[Path, Path] | None:
        """The two pictures, or None when they could not be drawn here."""
        try:
            code = self._process.wait(TIME_LIMIT)
        except subprocess.TimeoutExpired:
            code = 1
        finally:
            self.stop()
        made = folder / "scene.png", folder / "cloud.png"
        return made if code == 0 and all(path.is_file() for path in made) else None

    def stop(self) -> None:
        """End the drawing, if it has not ended."""
        if self._process.poll() is None:
            self._process.kill()
            self._process.wait()
        if self._process.stdin is not None:
            with suppress(OSError):
                self._process.stdin.close()


def _pack(view: View) -> Float:
    return np.stack([view.eye, view.target, view.up, view.low, view.high])


def _plotter(job: Any, name: str, colour: str, mesh_alpha: float) -> Any:
    import pyvista as pv

    plotter = pv.Plotter(off_screen=True, window_size=[SIZE[0], SIZE[1]], lighting="three lights")
    plotter.set_background("white")
    if len(job["triangles"]):
        mesh = pv.PolyData.from_regular_faces(job["vertices"], job["triangles"])
        plotter.add_mesh(mesh, color=colour, ambient=0.25, diffuse=0.75, specular=0.1, opacity=mesh_alpha)
    eye, target, up, low, high = job[name]
    plotter.camera_position = [eye, target, up]
    plotter.reset_camera(bounds=np.stack([low, high], axis=1).ravel().tolist(), render=False)
    plotter.camera.zoom(0.9)  # leaves room for labels
    plotter.enable_anti_aliasing("msaa", multi_samples=8)
    return plotter


def _write(plotter: Any, path: Path) -> None:
    from PIL import Image

    pixels = plotter.screenshot(None, return_img=True)
    plotter.close()
    # it is read once and thrown away: quickly rather than small
    Image.fromarray(np.ascontiguousarray(without_margins(pixels))).save(path, compress_level=1)


def without_margins(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """(h, w, 3) picture without its white margins but MARGIN; as it is where nothing is drawn."""
    drawn = np.any(pixels < 250, axis=2)
    if not np.any(drawn):
        return pixels
    rows, columns = np.flatnonzero(drawn.any(axis=1)), np.flatnonzero(drawn.any(axis=0))
    top, left = max(0, rows[0] - MARGIN), max(0, columns[0] - MARGIN)
    return pixels[top : rows[-1] + MARGIN, left : columns[-1] + MARGIN]


def draw_scene(job: Any, path: Path) -> None:
    """Objects, camera with what it sees, laser sheets and the exact line."""
    import pyvista as pv

    plotter = _plotter(job, "scene_view", STEEL, 1.0)
    centre, corners = job["frustum"][0], job["frustum"][1:]
    size = 0.16 * float(np.linalg.norm(corners[0] - centre))
    for corner in corners:
        plotter.add_mesh(pv.Line(centre, corner), color=ACCENT, line_width=2.25, opacity=0.5)
    body = centre + 0.16 * (corners - centre)
    pyramid = pv.PolyData.from_regular_faces(
        np.concatenate([centre[None], body]), np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]])
    )
    plotter.add_mesh(pyramid, color=ACCENT, opacity=0.85, ambient=0.5)
    around = np.concatenate([corners, corners[:1]])
    plotter.add_mesh(pv.MultipleLines(around), color=ACCENT, line_width=2.25, opacity=0.5)
    # beside the apex, away from what it looks at
    labels, places = ["camera"], [centre - 0.04 * (corners.mean(axis=0) - centre)]
    for i, colour in enumerate(job["colours"]):
        emitter = job["emitters"][i]
        plotter.add_mesh(pv.Sphere(radius=0.11 * size, center=emitter), color=colour, ambient=0.6)
        plotter.add_mesh(pv.MultipleLines(job[f"edges{i}"]), color=colour, line_width=2.25, opacity=0.6)
        if len(job[f"faces{i}"]):
            sheet = pv.PolyData.from_regular_faces(job[f"sheet{i}"], job[f"faces{i}"])
            plotter.add_mesh(sheet, color=colour, opacity=0.22, lighting=False)
        if len(job[f"curve{i}"]):
            segments = job[f"curve{i}"].reshape(-1, 3)
            plotter.add_mesh(pv.line_segments_from_points(segments), color=colour, line_width=7.5, lighting=False)
        labels.append("laser" if len(job["colours"]) == 1 else f"laser {i + 1}")
        places.append(emitter - 0.04 * (job[f"edges{i}"][[0, 2]].mean(axis=0) - emitter))
    plotter.add_point_labels(
        np.array(places), labels, font_size=28, text_color=INK, shape=None, show_points=False, always_visible=True
    )
    plotter.renderer.ResetCameraClippingRange()
    _write(plotter, path)


def draw_cloud(job: Any, path: Path) -> None:
    """Measured points coloured by their error normal to the surface, over the objects."""
    import pyvista as pv

    plotter = _plotter(job, "cloud_view", SLATE, 1.0)
    if len(job["cloud"]):
        # a little towards the eye, so that the points lie over the surface whose error they show
        eye = job["cloud_view"][0]
        towards = eye - job["cloud_view"][1]
        reach = float(np.linalg.norm(job["cloud_view"][4] - job["cloud_view"][3]))
        points = pv.PolyData(job["cloud"] + 0.004 * reach * towards / np.linalg.norm(towards))
        points["error"] = job["error"]
        limit = float(job["limit"])
        dense = len(job["cloud"]) > 20_000
        plotter.add_mesh(
            points, scalars="error", cmap=DIVERGING, clim=(-limit, limit), nan_color="#f0c000", show_scalar_bar=False,
            point_size=4 if dense else 8, render_points_as_spheres=True, lighting=False,
        )  # fmt: skip
    plotter.renderer.ResetCameraClippingRange()
    _write(plotter, path)


def main() -> None:
    """Draw both pictures of a job, once there is one."""
    import pyvista.plotting  # noqa: F401 - before there is anything to draw

    name = sys.stdin.buffer.readline().removesuffix(b"\n")
    if not name:
        return  # nobody wants pictures any more
    folder = Path(os.fsdecode(name))
    with np.load(folder / "job.npz", allow_pickle=False) as job:
        draw_scene(job, folder / "scene.png")
        draw_cloud(job, folder / "cloud.png")


if __name__ == "__main__":
    main()
