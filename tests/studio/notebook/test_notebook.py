"""The package in a notebook: seven lines, the same numbers as a scan, what each result knows and shows."""

from __future__ import annotations

import doctest
import pickle
import re
import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

import studio as blazer
from render.output.frame_files import read_frame
from render.scene.motion import LinearStage
from studio.notebook import frame as notebook_frame
from studio.notebook import measuring as notebook_measuring
from studio.notebook import report as notebook_report
from studio.project import project as project_module
from studio.project.document import replaced
from studio.scan.options import Listener, ScanOptions
from studio.scan.scan import run_scan

ROOT = Path(__file__).resolve().parents[3]
SCALE = 0.1


def python_block(text: str) -> str:
    (found,) = (block for block in re.findall(r"```python\n(.*?)```", text, re.DOTALL) if "as blazer" in block)
    return found


class TestTheSevenLines:
    def test_they_run_as_the_readme_has_them(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, quick_reports: None
    ) -> None:
        """At a small image scale, but for that letter by letter."""
        monkeypatch.chdir(tmp_path)
        lines = python_block((ROOT / "README.md").read_text(encoding="utf-8"))
        assert lines.count("error=0.01") == 1
        told: dict = {}
        exec(lines.replace("error=0.01", f"error=0.01, image_scale={SCALE}"), told)
        assert 0.0 < told["errors"].depth_z.rmse < 5e-3
        assert told["errors"].completeness > 0.9
        direct = told["frame"].quality[0]
        assert direct.image_error <= 0.01 and direct.of == "line" and direct.error <= direct.target
        assert told["line"].u.shape == told["line"].sigma_u.shape == told["line"].flags.shape
        assert "Weld seam" in (tmp_path / "report.html").read_text(encoding="utf-8")

    def test_the_readme_and_the_packages_own_text_have_the_same_calls(self) -> None:
        calls = re.compile(r"blazer\.[\w.]+\([^)]*\)")
        readme = calls.findall(python_block((ROOT / "README.md").read_text(encoding="utf-8")))
        assert len(readme) == 7
        assert calls.findall(blazer.__doc__ or "") == readme

    @pytest.mark.parametrize("template", ["plane", "shiny_weld_seam"])
    def test_the_numbers_are_those_of_a_scan_to_the_bit(self, template: str, tmp_path: Path) -> None:
        project = blazer.Project.load(template)
        scanned: list = []
        out = tmp_path / "out"
        run_scan(
            project,
            project.folder,
            out=out,
            options=ScanOptions(image_scale=0.05, seed=7, report=False),
            listener=Listener(measured=scanned.append),
        )
        frame = blazer.render(project, image_scale=0.05, seed=7)
        image = blazer.develop(frame)
        line = blazer.extract(image)
        points = blazer.triangulate(line)
        errors = blazer.compare(points, frame)

        stored = read_frame(out / "frame_0000.json")
        assert np.array_equal(stored.laser_direct, frame.laser_direct)
        assert np.array_equal(stored.laser_indirect, frame.laser_indirect)
        assert np.array_equal(stored.ambient, frame.ambient)
        (laser,) = scanned[0].lasers
        own = laser.extractions[0]
        assert np.array_equal(laser.image, image.pixels)
        for name in ("u", "sigma_u", "width", "flag"):
            assert np.array_equal(getattr(own.line, name), getattr(line, name), equal_nan=True), name
        assert np.array_equal(own.points.world, points.world, equal_nan=True)
        assert np.array_equal(own.errors.depth, errors.depth, equal_nan=True)
        assert (own.errors.depth_z.rmse, own.errors.surface.rmse, own.errors.completeness) == (
            errors.depth_z.rmse, errors.surface.rmse, errors.completeness,
        )  # fmt: skip

    def test_the_example_runs(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], quick_reports: None
    ) -> None:
        text = (ROOT / "assets" / "examples" / "first_scan.py").read_text(encoding="utf-8")
        assert text.count("SCALE = 0.2\n") == 1
        (tmp_path / "first_scan.py").write_text(text.replace("SCALE = 0.2\n", "SCALE = 0.05\n"), encoding="utf-8")
        monkeypatch.chdir(tmp_path)
        runpy.run_path("first_scan.py", run_name="__main__")
        assert "PointErrors: depth RMSE" in capsys.readouterr().out
        assert (tmp_path / "ball.html").stat().st_size > 10_000

    @pytest.mark.parametrize("module", [notebook_frame, notebook_measuring, notebook_report, project_module])
    def test_the_examples_in_the_docstrings(
        self, module: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, quick_reports: None
    ) -> None:
        monkeypatch.chdir(tmp_path)
        failed, tried = doctest.testmod(module, optionflags=doctest.NORMALIZE_WHITESPACE)  # type: ignore[arg-type]
        assert tried > 0 and failed == 0


class TestWhatAFrameKnows:
    def test_the_quality_of_every_light_group_is_data(self, frame: blazer.RenderedFrame) -> None:
        direct, ambient = frame.quality
        assert (direct.group, direct.laser, direct.of) == ("direct", "laser", "line")
        assert direct.image_error is not None and direct.image_error <= frame.project.render.laser_error
        assert direct.reached == (direct.error <= direct.target) and direct.work > 0
        assert (ambient.group, ambient.laser, ambient.unit) == ("ambient", None, "samples a pixel")

    def test_it_goes_to_another_process_and_back(
        self, errors: blazer.PointErrors, frame: blazer.RenderedFrame, points: blazer.TriangulatedPoints
    ) -> None:
        copied = pickle.loads(pickle.dumps(frame))
        assert copied.project == frame.project and copied.project.folder == frame.project.folder
        again = blazer.compare(points, copied)
        assert again.depth_z == errors.depth_z and again.completeness == errors.completeness

    def test_progress_is_told(self) -> None:
        told: list[tuple[str, float]] = []
        project = blazer.Project.load("plane")
        blazer.render(project, image_scale=0.05, progress=lambda stage, done: told.append((stage, done)))
        assert told[0] == ("loading meshes", 0.0) and all(0.0 <= done <= 1.0 for _, done in told)
        assert {"laser light", "ambient light"} <= {stage for stage, _ in told}

    def test_it_can_be_cancelled(self) -> None:
        with pytest.raises(blazer.Cancelled):
            blazer.render(blazer.Project.load("plane"), image_scale=0.05, cancelled=lambda: True)

    def test_a_step_of_a_motion(self) -> None:
        project = replaced(blazer.Project.load("plane"), ("scene", "motion"), LinearStage(step=(0, 0.002, 0), steps=3))
        frame = blazer.render(project, step=2, image_scale=0.05)
        points = blazer.triangulate(blazer.extract(blazer.develop(frame)))
        found = np.linalg.inv(project.scene.T_world_camera(2)) @ np.c_[points.world, np.ones(len(points.world))].T
        assert frame.step == 2
        assert np.allclose(found[:3].T, points.camera, equal_nan=True)

    def test_representations_are_one_line(
        self,
        frame: blazer.RenderedFrame,
        image: blazer.DevelopedImage,
        line: blazer.ExtractedLine,
        points: blazer.TriangulatedPoints,
        errors: blazer.PointErrors,
    ) -> None:
        for one in (frame, image, line, points, errors):
            assert type(one).__name__ in repr(one) and len(repr(one)) < 200 and "\n" not in repr(one)


class TestFigures:
    def test_they_are_matplotlibs_and_a_notebook_shows_them_without_pyplot(
        self,
        frame: blazer.RenderedFrame,
        image: blazer.DevelopedImage,
        line: blazer.ExtractedLine,
        errors: blazer.PointErrors,
    ) -> None:
        for made in (frame.show(), frame.show("depth"), image.show(), image.show(line), errors.plot()):
            assert isinstance(made, Figure)
            assert made._repr_png_().startswith(b"\x89PNG")  # type: ignore[attr-defined]

    def test_the_error_figure_holds_the_errors(self, errors: blazer.PointErrors) -> None:
        along = errors.plot().axes[0]
        drawn = np.concatenate([one.get_ydata() for one in along.lines if len(one.get_ydata()) > 2])
        kept = 1e6 * errors.depth[~(errors.outlier & np.isfinite(errors.depth))]
        assert np.array_equal(drawn, kept, equal_nan=True)

    def test_titles_say_what_is_drawn(self, frame: blazer.RenderedFrame, errors: blazer.PointErrors) -> None:
        assert re.search(r"Depth, [\d.]+\smm \(dark\) to [\d.]+\smm", frame.show("depth").axes[0].get_title(loc="left"))
        assert "RMSE" in errors.plot().axes[0].get_title(loc="left")
        wrong = replace(errors, outlier=np.isfinite(errors.depth) & (np.cumsum(np.isfinite(errors.depth)) <= 3))
        assert "3 outliers are not shown" in wrong.plot().axes[0].get_xlabel()

    def test_a_view_that_the_frame_does_not_have(self, frame: blazer.RenderedFrame) -> None:
        with pytest.raises(blazer.InputError, match=r"show: kind.*found reflected; allowed: laser, ambient"):
            frame.show("reflected")


class TestChangesAtEachStep:
    def test_half_the_power_is_half_the_light(self, frame: blazer.RenderedFrame) -> None:
        full, half = (blazer.develop(frame, power=power, noise=False).electrons for power in (0.02, 0.01))
        dark = blazer.develop(frame, power=0.0, noise=False).electrons
        lit = (full - dark > 500) & (full < 0.9 * full.max())
        assert lit.any()
        assert np.allclose((half - dark)[lit] / (full - dark)[lit], 0.5, atol=0.02)

    def test_a_sensor_is_told_as_at_full_scale(self, frame: blazer.RenderedFrame) -> None:
        own = blazer.Project.load("plane").sensor
        assert np.array_equal(blazer.develop(frame, sensor=own).pixels, blazer.develop(frame).pixels)

    def test_a_plain_array_is_measured_with_its_own_settings(self) -> None:
        u = np.arange(100.0)
        drawn = np.tile(20 + 150 * np.exp(-0.5 * ((u - 40.3) / 1.8) ** 2), (20, 1)).astype(np.uint8)
        settings = blazer.ExtractionSettings(method="centre_of_mass", axis="columns")
        found = blazer.extract(np.ascontiguousarray(drawn.T), settings=settings)
        assert found.axis == "columns" and found.image is None and found.method == "centre_of_mass"
        assert np.allclose(found.u[:, 0], 40.3, atol=0.1)

    def test_a_plain_arrays_line_is_triangulated_with_a_project(
        self, image: blazer.DevelopedImage, points: blazer.TriangulatedPoints
    ) -> None:
        found = replace(points.line, image=None)
        again = blazer.triangulate(found, project=image.frame.project, laser=0)
        assert np.array_equal(again.world, points.world)

    def test_a_scene_made_in_python_is_the_one_read_from_a_file(self, tmp_path: Path) -> None:
        scene = blazer.Scene(
            rig=blazer.Rig(
                camera=blazer.Camera(width=200, height=160, fx=350.0, fy=350.0, cx=99.5, cy=79.5, pixel_pitch=20e-6),
                lasers=(blazer.LineLaser(T_rig_laser=blazer.Pose(translation=(0.2, 0, 0), rotation=(0, -0.245, 0))),),
            ),
            objects=(
                blazer.SceneObject(
                    name="ball",
                    shape=blazer.Sphere(radius=0.1),
                    material=blazer.Lambertian(albedo=0.6),
                    T_world_object=blazer.Pose(translation=(0, 0, 0.8)),
                ),
            ),
        )
        project = blazer.Project(scene=scene)
        project.save(tmp_path / "ball.json")
        read = blazer.Project.load(tmp_path / "ball.json")
        assert read == project
        assert np.array_equal(blazer.render(read).laser(0), blazer.render(project).laser(0))
        assert blazer.render(project).laser(0).max() > 0.0

    def test_two_lasers_make_one_report_of_lists(self, tmp_path: Path, quick_reports: None) -> None:
        project = blazer.Project.load("plane")
        (first,) = project.scene.lasers
        pose = blazer.Pose(translation=(-0.2, 0.0, 0.0), rotation=(0.0, 0.226893, 0.0))
        second = first.model_copy(update={"name": "second", "T_rig_laser": pose})
        project = replaced(project, ("scene", "rig", "lasers"), (first, second)).in_folder(project.folder)
        frame = blazer.render(project, image_scale=0.05)
        images = [blazer.develop(frame, laser=i) for i in range(2)]
        lines = [blazer.extract(one) for one in images]
        points = [blazer.triangulate(one) for one in lines]
        errors = [blazer.compare(one, frame) for one in points]
        page = blazer.write_report(tmp_path / "two.html", frame, images, lines, points, errors)
        assert "second" in page.read_text(encoding="utf-8")
        with pytest.raises(blazer.InputError, match=r"write_report: image.*found 1; allowed: 2"):
            blazer.write_report(tmp_path / "one.html", frame, images[0], lines[0], points[0], errors[0])
        with pytest.raises(blazer.InputError, match="write_report: line"):
            blazer.write_report(tmp_path / "one.html", frame, images, lines[::-1], points, errors)
        assert not (tmp_path / "one.html").exists()
