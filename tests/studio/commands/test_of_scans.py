"""`main.py deviation`, `section` and `film` of a finished scan: what is written, and bad input."""

from __future__ import annotations

import csv
import json
import shutil
import struct
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import trimesh
from click.testing import CliRunner, Result

import main
from analysis.cloud import read_ply
from analysis.report.units import counted, micrometres
from render.world.world import build_world
from studio.commands.deviation import details, sentence
from studio.scan.deviation import Question, compare_cloud, read_cloud
from studio.scan.scan_folder import open_folder
from tests.studio.scan_of_steps import small_scan


def call(*arguments: object) -> Result:
    return CliRunner().invoke(main.cli, [str(argument) for argument in arguments])


def told(*arguments: object) -> dict[str, Any]:
    done = call(*arguments, "--json")
    assert done.exit_code == 0, done.output
    found: dict[str, Any] = json.loads(done.stdout)
    return found


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    _, folder = small_scan(tmp_path_factory.mktemp("steps"))
    return folder


@pytest.fixture
def scan(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "scan"))


def column(path: Path, name: str) -> np.ndarray:
    with open(path, newline="", encoding="utf-8") as file:
        return np.array([float(row[name] or "nan") for row in csv.DictReader(file)])


def test_against_the_part_as_scanned_deviations_are_the_scan_s_own_distances(scan: Path) -> None:
    record = told("deviation", scan, "--lower=-700", "--upper", 700)
    own = -read_ply(scan / "points.ply")["error_surface"]
    assert np.allclose(column(scan / "deviation.csv", "deviation_m"), own, rtol=0.0, atol=1e-9)
    assert record["rms"] == pytest.approx(float(np.sqrt(np.mean(own**2))), rel=1e-9)
    assert sum(record["verdicts"].values()) == len(own) and record["verdict"] == "fail"
    assert record == {"ok": True, "files": record["files"], **json.loads((scan / "deviation.json").read_text())}
    assert cv2.imread(str(scan / "deviation.png")) is not None
    assert record["meaning"].startswith("positive is outside the nominal part")
    value, sigma = (column(scan / "deviation.csv", name) for name in ("deviation_m", "sigma_m"))
    beyond = (np.abs(value) - 2.0 * sigma > 700e-6).sum()
    proved = record["verdicts"]["above"] + record["verdicts"]["below"]
    assert record["undecided_but_beyond"] == beyond - proved and sum(record["verdicts"].values()) == record["points"]
    said = call("deviation", scan, "--lower=-700", "--upper", 700).stdout  # replaces its own files
    assert "Sign of a deviation: positive is outside the nominal part" in said
    assert f"{record['verdicts']['above']} outside (above the upper limit)" in said


def test_a_point_that_is_out_alone_is_said_to_be_undecided_and_by_what_rule(scan: Path) -> None:
    """One whole interval was above the limit, and "0 outside" stood beside it under the name of two sigma."""
    record = told("deviation", scan, "--lower=-700", "--upper", 700) | {"undecided_but_beyond": 1, "points": 8185}
    said = " ".join(details(record | {"coverage_beyond": 4.6}))
    assert "beyond by 4.6 sigma (as rare by chance among 8185 points as two sigma of one)" in said
    assert "; 1 of the undecided is beyond by two sigma, but not by this" in said
    assert "but not by this" not in " ".join(details(record | {"undecided_but_beyond": 0}))


def test_where_points_far_off_decide_the_verdict_of_the_others_is_told_beside_it(scan: Path) -> None:
    """Four stray points of 824 left a part undecided, 820 of which were proved within."""
    record = told("deviation", scan, "--lower=-700", "--upper", 700)
    record |= {"points": 824, "share_false": 4 / 824, "verdict": "undecided", "verdict_without_far": "pass"}
    assert "UNDECIDED by ISO 14253-1 (PASS without the 4 points far off), within" in " ".join(details(record))
    assert "without the" not in " ".join(details(record | {"verdict": "pass"})).split("ISO 14253-1")[1]


@pytest.mark.parametrize(("rms", "said"), [(2.9e-5, False), (3.1e-5, True)])
def test_points_rule_the_rms_by_the_rule_of_the_report(scan: Path, rms: float, said: bool) -> None:
    """Mean -1733 um and rms 36.5 mm stood there of 20195 points of which 105 made them."""
    record = {**told("deviation", scan), "points": 1000, "share_false": 0.001, "rms": rms}
    first = sentence({**record, "median": 0.0, "robust_sigma": 1e-5})
    assert first.startswith("median 0")
    assert first.endswith(f"ruled by 1 point farther than {micrometres(6e-5)} from the median") == said


def test_points_far_off_are_not_called_false(scan: Path) -> None:
    """False is a scan line that carries a point although no line crosses it."""
    record = {**told("deviation", scan), "share_false": 0.1, "rms_without_false": 1e-5}
    said = " ".join(details(record))
    assert "of the points are far off: beyond 6 robust sigma of all" in said and "false" not in said


def test_a_nominal_that_is_lower_shifts_every_deviation_until_it_is_fitted(scan: Path, tmp_path: Path) -> None:
    """The scanned mesh, 0.5 mm lower, as a file: the deviation grows by it, and the best fit takes it back."""
    found = open_folder(scan)
    world = build_world(found.project.scene, found.root)
    part = found.project.scene.visible_objects[0]
    index = world.triangles[world.object_id == 0]
    local = (world.vertices - part.T_world_object.matrix[:3, 3]) @ part.T_world_object.matrix[:3, :3] / part.scale
    lower = local - [0.0, 0.0, 5e-4]
    trimesh.Trimesh(1e3 * lower, index, process=False).export(tmp_path / "nominal.stl")
    arguments = ("--part", part.name, "--cad", tmp_path / "nominal.stl", "--unit", "mm")
    as_scanned = told("deviation", scan, "--part", part.name, "--out", tmp_path / "a.csv")
    measured = told("deviation", scan, *arguments, "--out", tmp_path / "b.csv")
    assert measured["points"] == as_scanned["points"] > 20
    tops = np.abs(column(tmp_path / "a.csv", "deviation_m")) < 2e-3
    shift = (column(tmp_path / "b.csv", "deviation_m") - column(tmp_path / "a.csv", "deviation_m"))[tops]
    assert np.median(shift) == pytest.approx(5e-4, abs=2e-6)
    one = told("deviation", scan, "--part", part.name, "--align", "best-fit", "--out", tmp_path / "c.csv")
    two = told("deviation", scan, *arguments, "--align", "best-fit", "--out", tmp_path / "d.csv")
    assert two["shift"][2] - one["shift"][2] == pytest.approx(-5e-4, abs=5e-5)
    assert measured["nominal_unit"] == "mm" and measured["nominal_over_part"] == pytest.approx(1.0, abs=1e-5)
    inches = ("--part", part.name, "--cad", tmp_path / "nominal.stl", "--unit", "in", "--out", tmp_path / "e.csv")
    assert told("deviation", scan, *inches)["nominal_over_part"] == pytest.approx(25.4, rel=1e-5)
    warned = "The nominal is 25.4 times as large as the part; it was read in in, and may be in another"
    assert warned in call("deviation", scan, *inches).output


def polylines(path: Path) -> list[np.ndarray]:
    """(n, 2) vertices of each LWPOLYLINE, read by group codes (AutoCAD's DXF reference)."""
    lines = path.read_text().split("\n")
    pairs = list(zip((int(code) for code in lines[:-1:2]), lines[1::2], strict=False))
    found: list[list[list[float]]] = []
    is_inside = False
    for code, value in pairs:
        if code == 0:
            is_inside = value == "LWPOLYLINE"
            if is_inside:
                found.append([])
        elif is_inside and code == 10:
            found[-1].append([float(value)])
        elif is_inside and code == 20:
            found[-1][-1].append(float(value))
    return [np.array(one) for one in found]


def test_a_section_is_a_drawing_in_mm_of_truth_and_cloud(scan: Path) -> None:
    import ezdxf

    record = told("section", scan, "--through", "0,2,0", "--normal", "1,0,0", "--thickness", 6)
    path = scan / "section.dxf"
    drawing = ezdxf.readfile(path)  # type: ignore[attr-defined]
    assert drawing.header["$INSUNITS"] == 4 and len(drawing.audit().errors) == 0
    points = np.array([one.dxf.location for one in drawing.modelspace().query("POINT[layer=='MEASURED']")])
    cloud = read_ply(scan / "points.ply")
    here = np.abs(cloud["x"]) <= 3e-3
    assert record["points"] == len(points) == np.count_nonzero(here) > 10
    # across and up of a plane whose normal is x are y and z, wherever it is taken through
    assert np.allclose(points[:, :2], 1e3 * np.column_stack([cloud["y"], cloud["z"]])[here], atol=1e-6)
    found = open_folder(scan)
    world = build_world(found.project.scene, found.root)
    lines = polylines(path)
    assert len(lines) == record["lines"]
    exact = trimesh.intersections.mesh_plane(
        trimesh.Trimesh(world.vertices, world.triangles, process=False), (1.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    )
    length = np.linalg.norm(exact[:, 1] - exact[:, 0], axis=1).sum()
    assert record["length"] == pytest.approx(float(length), rel=1e-9)


def test_the_table_of_a_section_holds_the_same(scan: Path) -> None:
    record = told("section", scan, "--through", "0,0,0", "--normal", "1,0,0", "--thickness", 6, "--out", scan / "s.csv")
    with open(scan / "s.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    measured = [row for row in rows if row["of"] == "measured"]
    assert len(measured) == record["points"] and {row["of"] for row in rows} == {"true", "measured"}
    assert all(abs(float(row["x_m"])) <= 3e-3 + 1e-12 for row in measured)
    assert all(abs(float(row["x_m"])) < 1e-9 for row in rows if row["of"] == "true")
    cells = [cell for row in rows for name, cell in row.items() if name.endswith("_m") and cell]
    assert all(cell == f"{float(cell):.9g}" for cell in cells), "0.002493000000000023 was written for 0.002493"


def samples(path: Path) -> tuple[int, float]:
    """Number of pictures and seconds of an MP4, from its boxes (ISO 14496-12)."""
    data = path.read_bytes()
    assert data[4:8] == b"ftyp"
    sizes, times = data.index(b"stsz"), data.index(b"mdhd")
    scale, length = struct.unpack(">II", data[times + 16 : times + 24])
    return struct.unpack(">I", data[sizes + 12 : sizes + 16])[0], length / scale


def test_a_film_has_every_step_and_lasts_as_long_as_was_asked(scan: Path) -> None:
    record = told("film", scan, "--rate", 2)
    assert record["frames"] == 3
    count, seconds = samples(scan / "scan.mp4")
    assert count == 3 and seconds == pytest.approx(1.5, abs=0.01)
    film = cv2.VideoCapture(str(scan / "scan.mp4"))
    coloured = []
    for _ in range(3):
        done, picture = film.read()
        assert done
        right = picture[:720, -720:].astype(int)
        coloured.append(int((right.max(axis=2) > 120).sum()))
    # points of every step stay: the cloud grows
    assert 0 < coloured[0] < coloured[1] < coloured[2]
    assert [file.name for file in scan.glob("*.mp4*")] == ["scan.mp4"]


@pytest.mark.parametrize(
    ("arguments", "told_of"),
    [
        (("deviation", "--part", "nobody"), "nobody"),
        (("deviation", "--align", "3-2-1"), "six spots"),
        (("deviation", "--lower", "5", "--upper", "-5"), "tolerance is empty"),
        (("deviation", "--part", "step block", "--cad", "missing.stl"), "missing.stl"),
        (("deviation", "--cad", "missing.stl"), "which part"),
        (("deviation", "--out", "table.txt"), "table.txt"),
        (("section", "--through", "0,0,0", "--normal", "0,0,0"), "no direction"),
        (("section", "--through", "0,0,90000", "--normal", "0,0,1"), "neither the part nor a point"),
        (("section", "--through", "0,0", "--normal", "0,0,1"), "0,0"),
        (("section", "--through", "0,0,nan", "--normal", "0,0,1"), "nan"),
        (("section", "--through", "0,0,0", "--normal", "1,0,0", "--out", "x.dwg"), "x.dwg"),
        (("film", "--out", "x.avi"), "x.avi"),
        (("film", "--rate", "0"), "rate"),
        (("points", "--out", "points.dat"), ".dat"),
    ],
)
def test_bad_input_is_one_message(made: Path, arguments: tuple[str, ...], told_of: str) -> None:
    """Of what was bad, and of nothing else."""
    before = sorted(made.iterdir())
    done = call(arguments[0], made, *arguments[1:], "--json")
    said = json.loads(done.stdout)
    assert done.exit_code == 2 and said["ok"] is False
    assert told_of in json.dumps(said["error"], ensure_ascii=False), said["error"]
    assert sorted(made.iterdir()) == before


@pytest.mark.parametrize("suffix", [".ply", ".csv", ".pcd", ".las", ".e57"])
def test_points_go_into_other_formats_and_replace_their_own(scan: Path, suffix: str) -> None:
    out = scan / f"other{suffix}"
    for _ in range(2):
        record = told("points", scan, "--out", out)
    assert record["points"] == len(read_ply(scan / "points.ply")["x"]) and out.stat().st_size > 100
    out.write_text("mine")
    assert call("points", scan, "--out", out).exit_code == 2


def test_files_of_others_are_not_replaced(scan: Path) -> None:
    for name, command in (
        ("section.dxf", ("section", scan, "--through", "0,0,0", "--normal", "1,0,0")),
        ("deviation.csv", ("deviation", scan)),
        ("scan.mp4", ("film", scan)),
    ):
        (scan / name).write_text("mine")
        done = call(*command, "--json")
        assert done.exit_code == 2 and "did not write" in json.loads(done.stdout)["error"]["message"], name
        assert (scan / name).read_text() == "mine"


def test_far_off_draw_the_rms_but_not_the_robust_figures(made: Path) -> None:
    found = open_folder(made)
    cloud = read_cloud(made / "points.ply")
    whole = compare_cloud(found.project.scene, found.root, cloud, Question(lower=-1e-3, upper=1e-3)).record
    spoilt = {name: column.copy() for name, column in cloud.items()}
    spoilt["z"][::100] += 0.3
    record = compare_cloud(found.project.scene, found.root, spoilt, Question(lower=-1e-3, upper=1e-3)).record
    share = len(spoilt["z"][::100]) / len(spoilt["z"])
    # 1 % of them 300 mm away
    assert record["rms"] == pytest.approx(0.3 * np.sqrt(share), rel=0.02)
    assert record["share_false"] == pytest.approx(whole["share_false"] + share, abs=0.003)
    for name in ("robust_sigma", "rms_without_false"):
        assert record[name] == pytest.approx(whole[name], rel=0.05)
    far = round(record["share_false"] * record["points"])
    beyond = micrometres(6.0 * record["robust_sigma"])
    ruling = f"; rms {micrometres(record['rms'])}, ruled by {counted(far, 'point')} farther than {beyond} from"
    assert ruling in sentence(record)
    assert record["share_beyond"] == pytest.approx(whole["share_beyond"] + share, abs=0.003)
    nobody = compare_cloud(found.project.scene, found.root, spoilt, Question()).record
    assert nobody["share_beyond"] is None
