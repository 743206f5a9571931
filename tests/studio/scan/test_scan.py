"""A scan from end to end: what it leaves behind, that it repeats, and that stopping it leaves nothing half-done."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from analysis.cloud import read_ply
from render.base.errors import Cancelled, InputError
from render.base.pose import Pose
from render.material.material import Lambertian
from render.output.frame_files import read_frame
from render.scene.scene import SceneObject
from render.scene.shape import MeshFile
from studio.photographs.image_files import load_photograph
from studio.photographs.reconstruct_images import reconstruct_images
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.scan import scan_folder
from studio.scan.options import Listener, ScanOptions
from studio.scan.reconstruct import reconstruct_folder
from studio.scan.scan import run_scan
from studio.scan.stages import Clock, scaled

SCALE = 0.125


def template(name: str) -> Project:
    return Project.load(template_folder(name) / "project.json")


def still(name: str) -> Project:
    """A template at a small size without its costly truth images, ambient light and goal."""
    project = template(name)
    render = project.render.model_copy(update={"truth_images": False, "goal": None})
    dark = project.scene.environment.model_copy(update={"radiance": (0.0, 0.0, 0.0)})
    scene = project.scene.model_copy(update={"lights": (), "environment": dark})
    return project.model_copy(update={"render": render, "scene": scene})


def quiet() -> Clock:
    return Clock(lambda stage, done: None, lambda: False)


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The first two frames of the moving template, scanned with its report."""
    out = tmp_path_factory.mktemp("scan") / "out"
    run_scan(template("scan"), template_folder("scan"), out=out, options=ScanOptions(steps=2, image_scale=SCALE))
    return out


class TestWhatIsLeftBehind:
    def test_the_files_that_the_readme_promises(self, finished: Path) -> None:
        names = {path.name for path in finished.iterdir()}
        frames = {f"frame_{step:04d}.{kind}" for step in range(2) for kind in ("exr", "png", "json")}
        assert names == frames | {
            "points.ply", "points.csv", "report.html", "report.pdf", "scan.json", "scan_project.json"
        }  # fmt: skip

    def test_the_manifest_tells_the_result_and_the_time_of_every_stage(self, finished: Path) -> None:
        manifest = json.loads((finished / "scan.json").read_text())
        assert {row["method"] for row in manifest["results"]} == {"likelihood", "gaussian", "centre_of_mass"}
        assert manifest["results"][0]["method"] == "likelihood"
        assert manifest["frames"] == ["frame_0000.json", "frame_0001.json"]
        stages = sum(seconds for name, seconds in manifest["seconds"].items() if name != "all")
        assert 0.8 * manifest["seconds"]["all"] < stages <= manifest["seconds"]["all"]

    def test_points_carry_their_frame_and_lie_where_the_rig_was(self, finished: Path) -> None:
        """The rig moves 5 mm a frame along x, and with it the line on the table."""
        points = read_ply(finished / "points.ply")
        on_table = np.abs(points["z"]) < 2e-3
        x = [np.median(points["x"][on_table & (points["step"] == step)]) for step in range(2)]
        assert x[1] - x[0] == pytest.approx(5e-3, abs=2e-4)

    def test_the_project_as_it_was_run_is_beside_it(self, finished: Path) -> None:
        run = Project.load(finished / "scan_project.json")
        assert run.scene.camera == template("scan").scene.scaled(SCALE).camera


class TestRepeating:
    def test_the_same_seed_gives_the_same_points_on_any_number_of_threads(self, tmp_path: Path) -> None:
        project, root = still("plane"), template_folder("plane")
        for name, threads in (("one", 1), ("two", 2)):
            run_scan(
                project,
                root,
                out=tmp_path / name,
                options=ScanOptions(image_scale=SCALE, threads=threads, report=False),
            )
        for file in ("points.ply", "frame_0000.png", "frame_0000.exr"):
            assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "two" / file).read_bytes(), file

    def test_another_seed_gives_other_noise(self, tmp_path: Path) -> None:
        project, root = still("plane"), template_folder("plane")
        for seed in (1, 2):
            run_scan(
                project,
                root,
                out=tmp_path / str(seed),
                options=ScanOptions(image_scale=SCALE, seed=seed, measure=False),
            )
        images = [load_photograph(tmp_path / str(seed) / "frame_0000.png") for seed in (1, 2)]
        assert np.mean(images[0] != images[1]) > 0.1

    def test_frames_measured_again_give_the_same_points(self, finished: Path, tmp_path: Path) -> None:
        found = scan_folder.open_folder(finished)
        reconstruct_folder(found, found.project, found.root, tmp_path, quiet(), report=False)
        assert (tmp_path / "points.ply").read_bytes() == (finished / "points.ply").read_bytes()

    def test_a_shorter_exposure_is_developed_from_the_same_frames(self, finished: Path, tmp_path: Path) -> None:
        """Half the light makes the points noisier, by a factor between 1 and 2 with shot and read noise.

        By three points: of a line so narrow the likelihood's sigma is that of its place in the pixel, in any light.
        """
        found = scan_folder.open_folder(finished)
        bright = found.project.replaced({"extraction.method": "gauss_3"})
        dim = bright.replaced({"sensor.exposure_time": bright.sensor.exposure_time / 2})
        sigma = []
        for name, project in (("bright", bright), ("dim", dim)):
            reconstruct_folder(found, project, found.root, tmp_path / name, quiet(), report=False)
            sigma.append(np.nanmedian(read_ply(tmp_path / name / "points.ply")["sigma_random"]))
        assert 1.1 < sigma[1] / sigma[0] < 2.0

    def test_a_photograph_of_the_scene_gives_the_same_surface(self, tmp_path: Path) -> None:
        """Its noise is estimated, so points agree within their sigma, not to the bit."""
        project, root = still("plane"), template_folder("plane")
        run_scan(project, root, out=tmp_path, options=ScanOptions(image_scale=SCALE, report=False))
        small = scaled(project, SCALE)
        made = reconstruct_images([tmp_path / "frame_0000.png"], small, 0, tmp_path / "photo", quiet())
        assert made["points"] > 0.95 * small.scene.camera.height
        photo, scan = read_ply(tmp_path / "photo" / "frame_0000.ply"), read_ply(tmp_path / "points.ply")
        rows = np.intersect1d(photo["row"], scan["row"])
        a, b = (points["z"][np.searchsorted(points["row"], rows)] for points in (photo, scan))
        assert np.median(np.abs(a - b)) < np.median(scan["sigma_random"])


class TestAccuracy:
    def test_a_tilted_plane_is_measured_without_bias(self, tmp_path: Path) -> None:
        """Mean depth error within 4 standard errors of zero, and the predicted sigma within a factor of 1.5.

        Five rows at either end are left out: there the plane's own edge cuts the line.
        """
        project = still("plane")
        done = run_scan(
            project, template_folder("plane"), out=tmp_path, options=ScanOptions(image_scale=0.5, report=False)
        )
        result = done.manifest["results"][0]
        points = read_ply(tmp_path / "points.ply")
        error, sigma = points["error_depth"][5:-5], points["sigma_random"][5:-5]
        assert result["completeness"] > 0.99 and result["false_scan_lines"] <= 2
        assert abs(np.mean(error)) < 4 * np.std(error) / np.sqrt(len(error))
        assert 1 / 1.5 < np.std(error) / np.median(sigma) < 1.5

    def test_a_quick_look_is_about_as_bright(self, tmp_path: Path) -> None:
        project = still("plane")
        peaks = []
        for scale in (0.25, 0.5):
            out = tmp_path / str(scale)
            run_scan(project, template_folder("plane"), out=out, options=ScanOptions(image_scale=scale, measure=False))
            peaks.append(np.median(load_photograph(out / "frame_0000.png").max(axis=1)))
        assert 0.4 < peaks[0] / peaks[1] < 1.5


class TestSeveralLasers:
    def test_each_laser_has_its_own_image_and_points(self, tmp_path: Path) -> None:
        project = still("plane")
        left = project.scene.lasers[0].model_copy(
            update={"name": "left", "T_rig_laser": Pose(translation=(-0.2, 0.0, 0.0), rotation=(0.0, 0.226893, 0.0))}
        )
        rig = project.scene.rig.model_copy(update={"lasers": (project.scene.lasers[0], left)})
        project = project.model_copy(update={"scene": project.scene.model_copy(update={"rig": rig})})
        done = run_scan(
            project, template_folder("plane"), out=tmp_path, options=ScanOptions(image_scale=SCALE, report=False)
        )
        rows = done.manifest["results"]
        assert [row["laser"] for row in rows] == ["laser"] * 3 + ["left"] * 3
        assert all(
            row["completeness"] > 0.95 and row["false_scan_lines"] <= 2 for row in rows if row["method"] == "likelihood"
        )


class TestStopping:
    def test_a_cancelled_scan_keeps_whole_frames_and_says_it_is_unfinished(self, tmp_path: Path) -> None:
        project = template("scan")
        done: list[str] = []

        def progress(stage: str, fraction: float) -> None:
            if stage == "writing frames" and fraction == 1.0:
                done.append(stage)

        with pytest.raises(Cancelled):
            run_scan(
                still("scan").model_copy(update={"scene": project.scene}),
                template_folder("scan"),
                out=tmp_path,
                options=ScanOptions(image_scale=SCALE),
                listener=Listener(progress=progress, cancelled=lambda: len(done) >= 2),
            )
        assert not (tmp_path / "scan.json").exists()
        assert [path for path in tmp_path.iterdir() if path.name.startswith(".")] == []
        assert [read_frame(tmp_path / f"frame_{step:04d}.json").step for step in range(2)] == [0, 1]
        with pytest.raises(InputError, match="did not finish"):
            scan_folder.open_folder(tmp_path)

    def test_a_scan_that_fails_at_once_writes_nothing(self, tmp_path: Path) -> None:
        project = still("plane")
        missing = SceneObject(name="part", shape=MeshFile(path="part.stl"), material=Lambertian())
        bad = project.model_copy(update={"scene": project.scene.model_copy(update={"objects": (missing,)})})
        with pytest.raises(InputError, match=r"part\.stl"):
            run_scan(bad, tmp_path, out=tmp_path / "out", options=ScanOptions(image_scale=SCALE))
        assert list(tmp_path.iterdir()) == []

    def test_a_rig_without_a_laser_is_refused(self, tmp_path: Path) -> None:
        project = still("plane")
        rig = project.scene.rig.model_copy(update={"lasers": ()})
        bad = project.model_copy(update={"scene": project.scene.model_copy(update={"rig": rig})})
        with pytest.raises(InputError, match="no laser"):
            run_scan(bad, tmp_path, out=tmp_path / "out", options=ScanOptions(image_scale=SCALE))
        assert list(tmp_path.iterdir()) == []


class TestDamagedFolders:
    @pytest.mark.parametrize(
        "text", ["", "{", "[]", "{}", '{"format": "blazer-scan", "format_version": 3}',
                 '{"format": "blazer-scan", "format_version": 2, "frames": [1], "project_folder": "."}']
    )  # fmt: skip
    def test_a_damaged_manifest_is_refused(self, text: str, tmp_path: Path) -> None:
        (tmp_path / "scan.json").write_text(text)
        with pytest.raises(InputError, match=r"scan\.json"):
            scan_folder.open_folder(tmp_path)

    def test_a_frame_outside_the_folder_is_not_read(self, finished: Path, tmp_path: Path) -> None:
        manifest = json.loads((finished / "scan.json").read_text())
        manifest["frames"] = ["../frame_0000.json"]
        (tmp_path / "scan.json").write_text(json.dumps(manifest))
        (tmp_path / "scan_project.json").write_bytes((finished / "scan_project.json").read_bytes())
        with pytest.raises(InputError, match="leaves the project folder"):
            scan_folder.open_folder(tmp_path)

    def test_a_photograph_of_another_size_is_refused(self, finished: Path, tmp_path: Path) -> None:
        with pytest.raises(InputError, match=r"306 x 256 px.*153 x 128|153 x 128 px"):
            reconstruct_images([finished / "frame_0000.png"], template("scan"), 0, tmp_path, quiet())
        assert list(tmp_path.iterdir()) == []

    def test_what_is_no_image_is_refused(self, tmp_path: Path) -> None:
        (tmp_path / "a.png").write_bytes(b"not an image")
        with pytest.raises(InputError, match="not an image"):
            load_photograph(tmp_path / "a.png")
