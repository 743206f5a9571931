"""The report: whole in itself, true to the numbers, safe against hostile names, and there when nothing was measured."""

from __future__ import annotations

import contextlib
import dataclasses
import math
import re
import zlib
from html.parser import HTMLParser
from typing import Any, get_args

import numpy as np
import pytest

from analysis.error import compare
from analysis.line.result import Flag, Line
from analysis.line.settings import Method
from analysis.report import picture
from analysis.report.colour import method_colour, wavelength_colour
from analysis.report.error_figures import nice_limit
from analysis.report.frame_result import Extraction, FrameResult, LaserResult
from analysis.report.line_figures import block_maximum, places
from analysis.report.model import ReportInput
from analysis.report.record import record_of
from analysis.report.summary import headline, remarks
from analysis.report.tables import scene_tables
from analysis.report.total import total
from analysis.report.units import counted, digits, micrometres
from analysis.report.write import PLAIN_NOTE, render_page, write_report
from analysis.triangulate import triangulate
from render.base.counts import RAYS
from render.base.pose import Pose
from render.camera.camera import Camera
from render.frame import LaserCurve
from render.laser.laser import LineLaser
from render.material.material import (
    Blend,
    BumpMap,
    Coated,
    Conductor,
    Emitter,
    Glass,
    GreyTexture,
    Lambertian,
    Subsurface,
    Texture,
)
from render.plan import Plan, TransportStep
from render.scene.motion import LinearStage
from render.scene.scene import Rig, Scene, SceneObject
from render.scene.shape import Plane

WIDTH, HEIGHT, DEPTH, THETA, BASELINE = 160, 120, 0.8, math.radians(13), 0.2
HOSTILE = "<script>alert('ü')</script> $\\frac{1}{0}$ {{ 7*7 }} \x07"
WALL = np.array([[-0.3, -0.3, DEPTH], [0.3, -0.3, DEPTH], [0.3, 0.3, DEPTH], [-0.3, 0.3, DEPTH]])
WALL_TRIANGLES = np.array([[0, 2, 1], [0, 3, 2]], dtype=np.int32)


def make_scene(lasers: int = 1, steps: int = 1, name: str = "laser") -> Scene:
    """A camera at the origin that looks along z at a wall, and lasers beside it."""
    camera = Camera(width=WIDTH, height=HEIGHT, fx=400, fy=400, cx=(WIDTH - 1) / 2, cy=(HEIGHT - 1) / 2)
    mounted = tuple(
        LineLaser(
            name=name + "abc"[i],
            wavelength_nm=(450.0, 532.0, 660.0)[i],
            fan_angle=0.3,
            T_rig_laser=Pose(translation=(BASELINE, 0.0, 0.0), rotation=(0.0, -THETA, 0.0)),
        )
        for i in range(lasers)
    )
    wall = SceneObject(name=name, shape=Plane(width=0.6, height=0.6))
    motion = {"motion": LinearStage(steps=steps)} if steps > 1 else {}
    return Scene(rig=Rig(camera=camera, lasers=mounted), objects=(wall,), **motion)


def wall_curve(scene: Scene, visible: bool = True) -> LaserCurve:
    """The exact line on the wall: one column, rows 10 to 109."""
    camera, rows = scene.camera, np.arange(10, 110) if visible else np.arange(0)
    n, x = len(rows), BASELINE - DEPTH * math.tan(THETA)
    point = np.stack([np.full(n, x), (rows - camera.cy) / camera.fy * DEPTH, np.full(n, DEPTH)], axis=1)
    zero = np.zeros(n)
    return LaserCurve(
        "rows", rows.astype(np.int32), np.full(n, camera.fx * x / DEPTH + camera.cx), point, point[:, 2].copy(),
        np.linalg.norm(point, axis=1), np.zeros(n, np.int32), zero, zero, zero + 30.0, np.zeros((0, 2, 3)), zero,
    )  # fmt: skip


def extraction(scene: Scene, curve: LaserCurve, step: int, method: str, noise: np.ndarray | None) -> Extraction:
    """A line that is off the true one by `noise`, px; None: nothing was found."""
    u = np.full((HEIGHT, 1), np.nan)
    if noise is not None:
        u[curve.index, 0] = curve.position + noise
    full = np.ones_like(u)
    flag = np.where(np.isfinite(u), Flag.OK, Flag.NO_PEAK).astype(np.uint8)
    line = Line("rows", method, u, 0.1 * full, 1.2 * full, 500 * full, full, full, flag)
    pose = scene.T_world_camera(step)
    points = triangulate(line, scene.camera, scene.laser_plane(0), T_rig_camera=np.eye(4), T_world_camera=pose)
    vertices = WALL + (pose[:3, 3] if step else 0.0)
    return Extraction(line, points, compare(points, line, curve, vertices, WALL_TRIANGLES, pose))


def make_frames(
    lasers: int = 1, steps: int = 1, methods: tuple[str, ...] = ("likelihood",), name: str = "laser",
    found: bool = True, visible: bool = True,
) -> tuple[Scene, list[FrameResult]]:  # fmt: skip
    """A scan of the wall with 0.1 px of noise."""
    random = np.random.default_rng(5)
    scene, frames = make_scene(lasers, steps, name), []
    curve = wall_curve(scene, visible)
    for step in range(steps):
        results = []
        for _ in range(lasers):
            noise = 0.1 * random.standard_normal(len(curve.index)) if found else None
            image = random.integers(0, 40, (HEIGHT, WIDTH)).astype(np.uint16)
            image[curve.index, np.round(curve.position).astype(int)] = 3000
            made = tuple(extraction(scene, curve, step, method, noise) for method in methods)
            results.append(LaserResult(curve, made, image))
        steps = (
            TransportStep("direct", "direct", True, "always"),
            TransportStep("indirect", "indirect", False, "switched off"),
        )
        plan = Plan(steps, text=("told by an older program <b>",))
        frames.append(FrameResult(step, tuple(results), plan, {"laser light": 0.5}, {RAYS: 12345.0}))
    return scene, frames


def make_report(name: str = "laser", **options: Any) -> ReportInput:
    """As `make_frames`."""
    return report_of(*make_frames(name=name, **options), name=name)


def report_of(scene: Scene, frames: list[FrameResult], name: str = "laser") -> ReportInput:
    return ReportInput(
        title=name, scene=scene, record=record_of(scene, frames), vertices=WALL, triangles=WALL_TRIANGLES,
        object_id=np.zeros(2, np.int32), display_max=4095.0, settings={"Extraction": {name: name}},
        seed=41, versions={"numpy": "9.9.9"}, notes=(f"a note of {name}",), created="2030-01-02",
    )  # fmt: skip


class Outward(HTMLParser):
    """Collects everything in a page that refers to something, and every tag."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.references: list[str] = []
        self.tags: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.references += [
            v or "" for k, v in attributes if k in ("src", "href", "srcset", "data", "action", "poster")
        ]


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """A scan of three steps with two lasers and two methods, as files."""
    scene, frames = make_frames(lasers=2, steps=3, methods=("likelihood", "centre_of_mass"))
    report = report_of(scene, frames)
    html, pdf = write_report(tmp_path_factory.mktemp("report") / "new" / "folder", report)
    return report, html.read_text(encoding="utf-8"), pdf.read_bytes()


def test_the_page_refers_to_nothing_outside_itself(written):
    _, page, _ = written
    parsed = Outward(page)
    assert parsed.references
    assert all(reference.startswith("data:image/png;base64,") for reference in parsed.references)
    assert not {"script", "link", "iframe", "object", "embed", "base"} & set(parsed.tags)
    assert "@import" not in page
    assert not re.search(r"url\(|https?://", page)
    assert len(page) < 6e6


def test_the_page_tells_the_numbers(written):
    report, page, _ = written
    found = total(report.record.chosen())
    assert micrometres(found.depth_z.rmse) in page
    assert micrometres(found.surface.p95) in page
    for m in (found.u, found.depth_z, found.surface):
        assert m.count == 600
    for k, laser in enumerate(("laser" + "a", "laser" + "b")):
        assert f"{laser}: maximum likelihood" in page
        assert digits(1e6 * total(report.record.chosen(k)).depth_z.sigma) in page
    for text in (
        "41",
        "9.9.9",
        "2030-01-02",
        "532 nm",
        "20\u00a0mW",
        "exact across the sheet",
        "its share was not measured",
        "older program &lt;b&gt;",
        "37\u202f035",
    ):
        assert text in page


def test_every_figure_has_a_caption_and_a_number(written):
    _, page, _ = written
    tags = Outward(page).tags
    assert tags.count("img") == tags.count("figcaption") == tags.count("figure")
    # scene, steps, map, and for each of two lasers camera, places, three panels, methods, profile
    numbers = [int(number) for number in re.findall(r"<b>Figure (\d+)\.", page)]
    assert numbers == list(range(1, 14))


def test_the_pdf_has_pages(written):
    _, _, pdf = written
    assert pdf.startswith(b"%PDF")
    text = pdf
    for stream in re.findall(rb"stream\r?\n(.*?)endstream", pdf, re.DOTALL):
        with contextlib.suppress(zlib.error):
            text += zlib.decompress(stream)
    assert len(re.findall(rb"/Type\s*/Page\b", text)) > 3


def test_totals_are_those_of_all_points_together(written):
    report, _, _ = written
    found = total(report.record.chosen())
    _, frames = make_frames(lasers=2, steps=3, methods=("likelihood", "centre_of_mass"))
    every = np.concatenate([laser.extractions[0].errors.depth for frame in frames for laser in frame.lasers])
    assert found.depth_z.bias == pytest.approx(np.mean(every))
    assert found.depth_z.rmse == pytest.approx(np.sqrt(np.mean(every**2)))
    assert (found.truth_rows, found.measured_rows, found.false_rows) == (600, 600, 0)


def test_hostile_names_are_text_and_nothing_else(tmp_path, quick_reports):
    html, pdf = write_report(
        tmp_path, dataclasses.replace(make_report(name=HOSTILE, lasers=2), notes=("\ud800 alone",))
    )
    page = html.read_text(encoding="utf-8")
    assert "script" not in Outward(page).tags
    assert "<b>" not in re.sub(r"<b>(Figure|[^<]*</b>)", "", page)
    assert "&lt;script&gt;alert" in page
    assert "{{ 7*7 }}" in page
    assert pdf.read_bytes().startswith(b"%PDF")


@pytest.mark.parametrize("visible", [True, False], ids=["line missed", "line not visible"])
def test_a_scan_that_measured_nothing_says_so(visible, quick_reports):
    report = make_report(found=False, visible=visible)
    page = render_page(report)
    assert "Nothing was measured" in headline(report)
    assert "Nothing was measured" in page
    assert "nan" not in re.sub(r"base64,[^\"]*|[a-z]*nan[a-z]+", "", page.lower())
    assert "nothing was measured" in remarks(total(report.record.chosen()))[0].lower() or visible
    assert "Nothing of the line was found" in remarks(total(report.record.chosen()))[0] or not visible


def test_a_machine_that_cannot_draw_3d_gets_a_plain_picture(monkeypatch):
    monkeypatch.setattr(picture.sys, "executable", "/bin/false")
    page = render_page(make_report())
    assert PLAIN_NOTE in page
    assert '"scene' not in page
    assert Outward(page).tags.count("img") == 6


def test_a_drawing_that_nobody_needs_ends_and_one_begun_before_draws_the_same(tmp_path, monkeypatch):
    monkeypatch.setattr("analysis.report.write.write_pdf", lambda page, path: path.touch())
    with picture.Drawing() as drawing:
        pass
    assert drawing._process.poll() is not None
    report, begun = make_report(), picture.Drawing()
    page = write_report(tmp_path, report, begun)[0].read_text(encoding="utf-8")
    assert begun._process.poll() is not None and page == render_page(report)


def test_remarks_name_what_is_wrong():
    scene, (frame,) = make_frames()

    def told(shown: FrameResult) -> list[str]:
        return remarks(total(report_of(scene, [shown]).record.chosen()))

    assert told(frame) == []
    first = frame.lasers[0].extractions[0]
    noise = 0.1 * np.random.default_rng(1).standard_normal(100)

    def said(changed: Extraction) -> str:
        laser = dataclasses.replace(frame.lasers[0], extractions=(changed,))
        return " ".join(told(dataclasses.replace(frame, lasers=(laser,))))

    curve = frame.lasers[0].curve
    assert "bias" in said(extraction(scene, curve, 0, "likelihood", noise + 0.2))
    alike = extraction(scene, curve, 0, "likelihood", 0.15 * np.sin(np.arange(100) / 8))
    assert "predicted sigma" in said(extraction(scene, curve, 0, "likelihood", 2.5 * noise))
    some = extraction(scene, curve, 0, "likelihood", np.where(np.arange(100) < 10, np.nan, noise))
    assert "10 scan lines" in said(some).replace("\u202f", "")
    assert "outliers" in said(extraction(scene, curve, 0, "likelihood", np.where(np.arange(100) < 3, 9.0, noise)))
    for width, causes in ((2.0, ("err alike", "surface's texture")), (0.3, ("narrower", "so thin a line"))):
        line = dataclasses.replace(first.line, width=width * np.ones_like(first.line.width))
        assert all(cause in said(dataclasses.replace(alike, line=line)) for cause in causes)
    bent = dataclasses.replace(first.errors, sheet_bias=np.where(np.arange(100) < 50, 0.04, np.nan))
    assert "own width moves the line by 0.04" in said(dataclasses.replace(first, errors=bent))
    lost = extraction(scene, curve, 0, "likelihood", np.where(np.arange(100) < 60, np.nan, noise))
    assert said(lost).startswith("Only 40.0% of the line was found")


def test_a_report_at_another_image_scale_says_at_its_head_that_it_is_not_the_scanners(quick_reports):
    report = dataclasses.replace(make_report(), image_scale=0.25)
    page = render_page(report)
    head = page[: page.index("<figure")]
    assert "image scale 0.25: not the scanner" in head and "4 times as large" in head
    assert "image scale" not in render_page(make_report())


def test_the_frame_shown_is_the_one_of_median_error_among_those_with_images():
    scene, made_frames = make_frames(steps=3)
    curve = wall_curve(scene)
    noises = (0.3, 0.1, 0.2)
    frames = []
    for frame, noise in zip(made_frames, noises, strict=True):
        made = extraction(scene, curve, frame.step, "likelihood", np.full(100, noise))
        frames.append(dataclasses.replace(frame, lasers=(dataclasses.replace(frame.lasers[0], extractions=(made,)),)))
    assert record_of(scene, frames).shown_frame().step == 2
    blind = dataclasses.replace(frames[2], lasers=(dataclasses.replace(frames[2].lasers[0], image=None),))
    assert record_of(scene, [frames[0], blind]).shown_frame().step == 0


def test_enlarged_places_hold_the_worst_row_and_differ():
    _, (frame,) = make_frames()
    first = frame.lasers[0].extractions[0]
    found = places(first)
    assert found[0].point == int(np.argmax(np.abs(first.errors.position)))
    assert len({place.point for place in found}) == len(found)


@pytest.mark.parametrize(
    ("wavelength", "order"), [(405, "brg"), (450, "brg"), (488, "bgr"), (532, "grb"), (590, "rgb"), (660, "rgb")]
)
def test_wavelengths_look_like_their_colour(wavelength, order):
    colour = dict(zip("rgb", wavelength_colour(wavelength), strict=True))
    assert max(colour.values()) == pytest.approx(1.0)
    assert min(colour.values()) >= 0.0
    assert colour[order[0]] >= colour[order[1]] >= colour[order[2]]
    assert max(wavelength_colour(905.0)) < 0.6  # cannot be seen: dark


def test_methods_keep_apart_by_colour():
    assert len({method_colour(m) for m in get_args(Method)}) == len(get_args(Method))
    assert method_colour("new method") == method_colour("new method")


def test_numbers_are_written_for_people():
    assert [digits(x) for x in (0.0, 1.0, -12.345, 1234.5, 0.00123, 3e-9, math.nan)] == [
        "0", "1.00", "-12.3", "1234", "0.00123", "3.00e-09", "–",  # noqa: RUF001
    ]  # fmt: skip
    assert [counted(n, "line") for n in (0, 1, 1820)] == ["0 lines", "1 line", "1\u202f820 lines"]
    assert micrometres(2.17e-5) == "21.7\u00a0µm"
    assert micrometres(0.0123) == "12.3\u00a0mm"


def test_a_thin_line_survives_downsampling():
    image = np.zeros((40, 40))
    image[:, 13] = 1.0
    assert block_maximum(image, 8).max(axis=1).min() == 1.0
    assert block_maximum(np.zeros((41, 47, 3)), 4).shape == (10, 11, 3)


def test_colour_limits_are_round_and_hold_nearly_all_errors():
    error = np.random.default_rng(0).standard_normal(10_000) * 2.2e-5
    limit = nice_limit(error)
    assert limit == pytest.approx(1e-4)
    assert nice_limit(np.array([np.nan])) == 1e-6
    assert nice_limit(np.array([1.9e-5])) == pytest.approx(2e-5)


@pytest.mark.parametrize(
    ("material", "told"),
    [
        (Lambertian(albedo=(0.1, 0.2, 0.3)), "diffuse, albedo 0.1, 0.2, 0.3"),
        (
            Conductor(metal="stainless_steel", roughness_across=0.4),
            "stainless steel, roughness 0.15 along u, 0.4 along v",
        ),
        (Coated(index=1.4), "albedo 0.5 under a coat of index 1.4, roughness 0.1"),
        (Conductor(roughness=GreyTexture(path="worn.png")), "steel, roughness of worn.png"),
        (Lambertian(relief=BumpMap(path="grain.png")), "diffuse, albedo 0.5, relief of grain.png"),
        (Glass(roughness=0.1), "transparent, BK7, roughness 0.1, tint 1"),
        (Glass(index=1.6, tint=(1, 0.9, 0.9)), "transparent, index 1.6, roughness 0, tint 1, 0.9, 0.9"),
        (Glass(priority=2), "transparent, BK7, roughness 0, tint 1, priority 2"),
        (
            Subsurface(mean_free_path=(1e-3, 2e-3, 3e-3)),
            "translucent, index 1.5, roughness 0.3, mean free path 1, 2, 3 mm, scattering albedo 0.99, anisotropy 0",
        ),
        (Emitter(radiance=(3, 2, 1)), "shines with 3, 2, 1 W/(m^2 sr), albedo 0.5"),
        (
            Blend(base=Lambertian(albedo=Texture(path="rust.png")), mask=Texture(path="ground.png")),
            "diffuse, albedo of rust.png; where ground.png is white, steel, roughness 0.15",
        ),
    ],
)
def test_materials_are_told_with_what_decides_how_they_shine(material, told):
    report = make_report()
    (wall,) = report.scene.objects
    shown = report.scene.model_copy(update={"objects": (wall.model_copy(update={"material": material}),)})
    (line,) = scene_tables(dataclasses.replace(report, scene=shown))["Objects"].values()
    assert line == f"plane, 2 triangles, {told}"
