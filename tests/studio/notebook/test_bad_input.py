"""What a notebook hands in wrongly is one InputError that says where, what was found and what is allowed."""

from __future__ import annotations

from pathlib import Path

import pytest

import studio as blazer
from studio.project.document import replaced


class TestBadInputIsNamed:
    @pytest.mark.parametrize(
        ("options", "where"),
        [
            ({"image_scale": 0.0}, "render: image_scale"),
            ({"image_scale": float("nan")}, "render: image_scale"),
            ({"image_scale": "0.1"}, "render: image_scale"),
            ({"error": 2.0}, "render: error"),
            ({"error": True}, "render: error"),
            ({"step": 1}, "render: step"),
            ({"step": 0.5}, "render: step"),
            ({"seed": -1}, "render: seed"),
            ({"threads": 0}, "threads"),
        ],
    )
    def test_options_of_render(self, options: dict, where: str) -> None:
        with pytest.raises(blazer.InputError) as caught:
            blazer.render(blazer.Project.load("plane"), **options)
        assert caught.value.where == where
        assert caught.value.found is not None and caught.value.allowed

    def test_a_scene_rendered_from_a_word(self) -> None:
        with pytest.raises(blazer.InputError, match="found str; allowed: Project; load one"):
            blazer.render("weld_seam")  # type: ignore[arg-type]

    @pytest.mark.parametrize(
        ("options", "where"),
        [
            ({"laser": 1}, "laser"),
            ({"laser": "laser"}, "laser"),
            ({"power": -1.0}, "develop: power"),
            ({"seed": 1.5}, "develop: seed"),
            ({"sensor": 12}, "develop: sensor"),
            ({"threads": -2}, "threads"),
        ],
    )
    def test_options_of_develop(self, frame: blazer.RenderedFrame, options: dict, where: str) -> None:
        with pytest.raises(blazer.InputError) as caught:
            blazer.develop(frame, **options)
        assert caught.value.where == where

    @pytest.mark.parametrize(
        ("options", "where"),
        [
            ({"method": "magic"}, "extraction.method"),
            ({"peaks": 0}, "extraction.peaks"),
            ({"axis": "rowss"}, "extraction.axis"),
            ({"settings": "gaussian"}, "extract: settings"),
        ],
    )
    def test_options_of_extract(self, image: blazer.DevelopedImage, options: dict, where: str) -> None:
        for one in (image, image.pixels):
            with pytest.raises(blazer.InputError) as caught:
                blazer.extract(one, **options)
            assert caught.value.where == where

    def test_each_step_says_what_it_needs(
        self, frame: blazer.RenderedFrame, image: blazer.DevelopedImage, line: blazer.ExtractedLine
    ) -> None:
        wrong = (
            (lambda: blazer.develop(image), "found DevelopedImage; allowed: RenderedFrame; render one"),
            (lambda: blazer.extract(frame), "found RenderedFrame; allowed: ndarray; develop one"),
            (lambda: blazer.triangulate(image), "found DevelopedImage; allowed: ExtractedLine; extract one"),
            (lambda: blazer.compare(line, frame), "found ExtractedLine; allowed: TriangulatedPoints"),
        )
        for call, text in wrong:
            with pytest.raises(blazer.InputError, match=text):
                call()

    def test_a_project_loaded_by_a_number(self) -> None:
        with pytest.raises(blazer.InputError, match="found int; allowed: a template's name or a path"):
            blazer.Project.load(3)  # type: ignore[arg-type]

    def test_one_image_is_not_measured_along_time_unsaid(self, image: blazer.DevelopedImage) -> None:
        settings = blazer.ExtractionSettings(spacetime=True)
        assert "not along time" in blazer.extract(image, settings=settings).note

    def test_a_line_without_a_camera_and_a_camera_of_another_size(self, image: blazer.DevelopedImage) -> None:
        found = blazer.extract(image.pixels)
        with pytest.raises(blazer.InputError, match=r"does not tell the camera.*project=project"):
            blazer.triangulate(found)
        with pytest.raises(blazer.InputError, match="found 205 rows; allowed: 2048"):
            blazer.triangulate(found, project=blazer.Project.load("plane"))

    def test_points_against_a_frame_of_another_size(self, points: blazer.TriangulatedPoints) -> None:
        other = blazer.render(blazer.Project.load("plane"), image_scale=0.05)
        with pytest.raises(blazer.InputError, match="another size"):
            blazer.compare(points, other)

    def test_a_line_across_the_axis_of_the_truth(
        self, image: blazer.DevelopedImage, frame: blazer.RenderedFrame
    ) -> None:
        points = blazer.triangulate(blazer.extract(image, axis="columns"))
        with pytest.raises(blazer.InputError, match=r"extraction\.axis"):
            blazer.compare(points, frame)

    def test_a_rig_without_a_laser(self) -> None:
        project = blazer.Project.load("plane")
        bare = replaced(project, ("scene", "rig", "lasers"), ()).in_folder(project.folder)
        with pytest.raises(blazer.InputError, match="no laser"):
            blazer.develop(blazer.render(bare, image_scale=0.05))

    def test_a_report_of_another_kind_or_over_the_projects_own_file(
        self,
        tmp_path: Path,
        frame: blazer.RenderedFrame,
        image: blazer.DevelopedImage,
        line: blazer.ExtractedLine,
        points: blazer.TriangulatedPoints,
        errors: blazer.PointErrors,
    ) -> None:
        with pytest.raises(blazer.InputError, match=r"found \.txt; allowed: \.html, \.pdf"):
            blazer.write_report(tmp_path / "a.txt", frame, image, line, points, errors)
        other = blazer.extract(image)
        with pytest.raises(blazer.InputError, match=r"write_report: points.*the points triangulated from this line"):
            blazer.write_report(tmp_path / "a.html", frame, image, other, points, errors)
        assert list(tmp_path.iterdir()) == []
