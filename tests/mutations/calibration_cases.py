"""Broken calibration files, cameras in the formats of others, and command lines of calibrations and boards."""

from __future__ import annotations

import json
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from studio.calibration.exchange import WRITERS
from studio.project.calibration import CalibratedCamera
from tests.mutations import values
from tests.mutations.damage import damaged
from tests.mutations.option_cases import NUMBERS, OUTS, PATHS, WORDS
from tests.mutations.project_cases import json_or_not
from tests.mutations.sources import Sources

BOARDS = (
    "checkerboard:5x4:30mm", "charuco:6x5:30mm:20mm", "charuco:6x5:30mm:20mm:DICT_4X4_50:legacy", "checkerboard",
    "checkerboard:5x4:30", "checkerboard:0x4:30mm", "checkerboard:9999x9999:1m", "checkerboard:5x4:nanmm",
    "checkerboard:5x4:30mm:30mm", "charuco:6x5:30mm:30mm", "charuco:6x5:30mm:20mm:", "charuco:6x5:30mm:20mm:legacy",
    "charuco:6x5:30mm:20mm:DICT_NONE", "charuco:200x200:30mm:20mm", "charuco:6x5:30mm:29.999mm", ":::", "checkerboard:",
    "circles:6x5:30mm:12mm", "circles:6x5:30mm", "circles:6x5:30mm:30mm",
    "charuco:6x5:30mm:1um:DICT_ARUCO_ORIGINAL", "checkerboard:2x2:10m", "checkerboard:200x200:10um",
)  # fmt: skip
NAMES = ("--nearest", "--farthest", "--most-tilt", "--target-um", "--corner-sigma", "--line-sigma", "--seed")


def calibration(sources: Sources, place: Path, rng: Random, harm: bool) -> list[str]:
    project = json.loads(json.dumps(sources.projects["plane"]))
    data = calibration_data(project)
    content = json.dumps(data).encode()
    if harm:
        change = rng.choice((values.extreme, values.mutated))
        content = change(data, rng, sources.limits)
    (place / "calibration.json").write_bytes(content)
    project["calibration"] = "calibration.json"
    if harm and rng.random() < 0.1:
        project["calibration"] = rng.choice(PATHS).encode("utf-8", "replace").decode()
    (place / "project.json").write_text(json.dumps(project), encoding="utf-8")
    way = rng.random() if harm else 0.0
    if way < 0.45:
        return ["inspect", "project.json", *json_or_not(rng)]
    if way < 0.55:
        return ["calibrate", *json_or_not(rng), "laser", "absent", "--camera", "calibration.json"]
    if way < 0.8:
        write = rng.choice([*WRITERS.values()])
        camera = CalibratedCamera.model_validate(data["camera"] | {"distortion": (-0.1, 0.1, 1e-3, 1e-3)})
        (place / "camera.txt").write_bytes(damaged(write(camera).encode(), rng))
        return ["camera", "camera.txt"]
    return _command(place, sources, rng)


def calibration_data(project: dict[str, Any]) -> dict[str, Any]:
    """A whole calibration file of the project's camera and its one laser."""
    camera = {name: project["scene"]["rig"]["camera"][name] for name in ("width", "height", "fx", "fy", "cx", "cy")}
    return {
        "kind": "blazer-calibration", "version": 1, "board": BOARDS[0], "views": 20,
        "camera": camera | {"distortion": [-0.1, 0.1, 0.0, 0.0]}, "camera_covariance": np.diag([0.1] * 8).tolist(),
        "planes": [[0.974, 0.0, 0.2265480082, -0.195]], "covariances": [np.diag([0.1] * 4 + [1e-6] * 8).tolist()],
    }  # fmt: skip


def _command(place: Path, sources: Sources, rng: Random) -> list[str]:
    if rng.random() < 0.5:
        argv = ["board", *json_or_not(rng), rng.choice(BOARDS)]
        argv += ["--contrast", rng.choice(NUMBERS)] if rng.random() < 0.3 else []
        out = rng.choice((*OUTS, "fifo.pdf", "folder.pdf", "zero.pdf"))
        return [*argv, "--out", out if rng.random() < 0.5 else "out.pdf"]
    (place / "project.json").write_text(json.dumps(sources.projects["plane"]), encoding="utf-8")
    what = rng.choice((["project.json"], ["project.json"], ["camera", "textures"], ["laser", "."], ["", "."]))
    argv = ["calibrate", *json_or_not(rng), *what, "--views", rng.choice(("3", "6", "nan")), "--lens", "0"]
    argv += ["--board", rng.choice(BOARDS[:3] if rng.random() < 0.7 else (*BOARDS, *WORDS))]
    if rng.random() < 0.2:
        (place / "motion.csv").write_bytes(damaged(b"view,position_mm,placement\na,1.5,\nb,2.5,\n", rng))
        argv += ["--motion", rng.choice(("motion.csv", *PATHS)), "--hand", rng.choice(("camera", "board"))]
    for name in rng.sample(NAMES, rng.choice((0, 1, 2))):
        argv += [name, rng.choice(NUMBERS)]
    return [*argv, "--out", rng.choice((*OUTS, "out.json", "out.json"))]
