"""What a stage, a turntable or a robot was told at each photograph, as a table; and what was found of it, as data."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import scipy  # whose parts are loaded as they are named: the window starts without them

from analysis.calibration.calibrate import Calibrated
from analysis.calibration.estimate import Estimate
from analysis.calibration.motion import Held, Kind, Told
from render.base.arrays import Float
from render.base.errors import InputError
from render.base.files import read_bytes

LARGEST = 10_000_000
MOST = 1e6
COLUMNS: dict[Kind, tuple[str, ...]] = {
    "stage": ("position_mm",),
    "turntable": ("angle_deg",),
    "hand_eye": ("x_mm", "y_mm", "z_mm", "qx", "qy", "qz", "qw"),
}
EXACT = "exact"
"""In place of a sigma."""
FORMS = "; ".join(", ".join(("view", *columns)) for columns in COLUMNS.values())


def read_motion(file: Path, hand: Held) -> Told:
    """A table with the columns of `FORMS`, and "placement" where the board was put elsewhere in between.

    hand: what it carries; a robot's quaternions are of any length but zero. InputError: not such a table.
    """
    try:
        text = read_bytes(file, LARGEST, "table of the motion").decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError("the table is not text", where=str(file), allowed="CSV in UTF-8") from None
    try:
        lines = [line for line in csv.reader(text.splitlines(), strict=True) if any(cell.strip() for cell in line)]
    except csv.Error as error:
        raise InputError("the table is no CSV", where=str(file), found=str(error)) from None
    header = [cell.strip() for cell in lines[0]] if lines else []
    kinds = [kind for kind, columns in COLUMNS.items() if set(header) in ({"view", *columns}, _placed(columns))]
    if not kinds or len(set(header)) != len(header):
        found = ", ".join(header[:12])
        raise InputError("not the columns of a motion", where=str(file), found=found, allowed=f"{FORMS}; placement")
    by_name: dict[str, tuple[str, Float]] = {}
    for number, line in enumerate(lines[1:], start=2):
        where = f"{file}, line {number}"
        if len(line) != len(header):
            raise InputError("a line of another length", where=where, found=len(line), allowed=str(len(header)))
        cells = dict(zip(header, (cell.strip() for cell in line), strict=True))
        if cells["view"] in by_name:
            raise InputError("a view that was told of already", where=where, found=cells["view"])
        values = [_number(cells[column], f"{where}, {column}") for column in COLUMNS[kinds[0]]]
        by_name[cells["view"]] = (cells.get("placement", ""), _given(kinds[0], values, hand, where))
    return Told(kinds[0], by_name, hand)


def told_of(file: Path, hand: Held, names: Sequence[str]) -> Told:
    """What the table tells of photographs of these names. InputError: no such table, or it names another."""
    told = read_motion(file, hand)
    check_names(told, names, str(file))
    return told


def check_names(told: Told, names: Sequence[str], where: str) -> None:
    """InputError: a name of the table is that of no pose."""
    unknown = [name for name in told.by_name if name not in names]
    if unknown:
        raise InputError(
            "there is no photograph of that name",
            where=where,
            found=", ".join(unknown[:5]),
            allowed=", ".join(list(names)[:5]) + (", ..." if len(names) > 5 else ""),
        )


def motion_data(result: Calibrated) -> dict[str, Any] | None:
    """What was found with its covariance, m and rad, in the camera's frame; None without a motion."""
    motion, values = result.estimate.motion, motion_values(result.estimate)
    if motion is None or values is None:
        return None
    own = result.estimate.motion_slice
    spread = result.adjusted.solution.covariance[own, own]
    if motion.kind == "turntable":
        by_parameters = motion.axis_and_point_derivative()
        spread = by_parameters @ spread @ by_parameters.T
    return {**values, "covariance": (0.5 * (spread + spread.T)).tolist()}


def motion_values(estimate: Estimate) -> dict[str, Any] | None:
    """Of a stage the board's way for each metre told; of a turntable its axis and the point of it next to the camera;
    of a hand the camera's pose in it, or in the base where it carries the board."""
    motion = estimate.motion
    if motion is None:
        return None
    if motion.kind == "stage":
        return {"kind": "stage", "step": motion.parameters.tolist()}
    if motion.kind == "turntable":
        normal, point = motion.axis()
        return {"kind": "turntable", "axis": normal.tolist(), "point": (point - normal * (normal @ point)).tolist()}
    turn, shift = motion.parameters[:3].tolist(), motion.parameters[3:].tolist()
    return {"kind": "hand_eye", "holds": motion.holds, "rotation": turn, "translation": shift}


def motion_rows(result: Calibrated) -> list[tuple[str, str, str]]:
    """Name, value and sigma, as a person reads them."""
    data = motion_data(result)
    return [] if data is None else rows_of_motion(data)


def rows_of_motion(data: dict[str, Any]) -> list[tuple[str, str, str]]:
    """The same of what `motion_data` gives, or a project holds; without a covariance it is exact."""
    if not len(data["covariance"]):
        nothing = np.zeros((3, 3) if data["kind"] == "stage" else (6, 6))
        return [(name, value, EXACT) for name, value, _ in rows_of_motion({**data, "covariance": nothing})]
    spread = np.array(data["covariance"])
    sigma = np.sqrt(np.maximum(np.diag(spread), 0.0))
    if data["kind"] == "stage":
        step = np.array(data["step"])
        length = float(np.linalg.norm(step))
        unit = step / length
        across = np.eye(3) - np.outer(unit, unit)
        turn = 1e3 * math.sqrt(np.linalg.eigvalsh(across @ spread @ across)[-1]) / length
        along = math.sqrt(unit @ spread @ unit)
        return [
            ("stage: direction", _triple(unit, 6), f"{turn:.2g} mrad"),
            ("stage: way for each mm told", f"{length:.6f}", f"{along:.2g}"),
        ]
    if data["kind"] == "turntable":
        turn = 1e3 * math.sqrt(np.linalg.eigvalsh(spread[:3, :3])[-1])
        at = 1e3 * math.sqrt(np.linalg.eigvalsh(spread[3:, 3:])[-1])
        return [
            ("turntable: axis", _triple(data["axis"], 6), f"{turn:.2g} mrad"),
            ("turntable: nearest point mm", _triple(1e3 * np.array(data["point"]), 4), f"{at:.2g}"),
        ]
    return [
        ("hand-eye: turn deg", _triple(np.degrees(data["rotation"]), 4), _triple(np.degrees(sigma[:3]), -2)),
        ("hand-eye: place mm", _triple(1e3 * np.array(data["translation"]), 4), _triple(1e3 * sigma[3:], -2)),
    ]


def _triple(values: Any, digits: int) -> str:
    return " ".join(f"{value:.{digits}f}" if digits > 0 else f"{value:.{-digits}g}" for value in values)


def _placed(columns: tuple[str, ...]) -> set[str]:
    return {"view", "placement", *columns}


def _number(text: str, where: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not abs(value) <= MOST:
        raise InputError("not a number", where=where, found=text[:40], allowed=f"-{MOST:g} to {MOST:g}")
    return value


def _given(kind: Kind, values: list[float], hand: Held, where: str) -> Float:
    if kind == "stage":
        return np.array(1e-3 * values[0])
    if kind == "turntable":
        return np.array(math.radians(values[0]))
    if not np.linalg.norm(values[3:]) > 1e-6:
        raise InputError("a quaternion of no length", where=where, allowed="qx, qy, qz, qw of length 1")
    pose = np.eye(4)
    pose[:3, :3] = scipy.spatial.transform.Rotation.from_quat(values[3:]).as_matrix()
    pose[:3, 3] = 1e-3 * np.array(values[:3])
    return pose if hand == "camera" else np.asarray(np.linalg.inv(pose))
